use plumb_vision::detect::{DetectError, DetectorKind};
use plumb_vision::image::Image;
use plumb_vision::localise::observe;
use plumb_vision::observation::{BallObservation, Circle};

use super::stats::percentile;
use plumb_cameras::camera_file;

use super::*;

/// Finds nothing, ever.
struct Blind;

impl BallDetector for Blind {
    fn name(&self) -> &'static str {
        "blind"
    }

    fn detect(&mut self, _: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        Ok(None)
    }
}

/// The middle of what is much redder than green and blue: finds a red ball that is alone.
struct Redness(Camera);

impl BallDetector for Redness {
    fn name(&self) -> &'static str {
        "redness"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let (mut count, mut u, mut v) = (0.0, 0.0, 0.0);
        for (row, pixels) in frame.colour().rows().enumerate() {
            for (column, pixel) in pixels.iter().enumerate() {
                let [b, g, r] = pixel.map(f64::from);
                if r - g.max(b) > 40.0 {
                    (count, u, v) = (count + 1.0, u + column as f64, v + row as f64);
                }
            }
        }
        let radius = f64::sqrt(count / std::f64::consts::PI);
        let circle = Circle::rough(u / count, v / count, radius);
        Ok((count > 20.0).then(|| observe(circle, count, frame, &self.0)))
    }
}

fn small() -> (Camera, VisionOptions) {
    let mut camera = camera_file::paper().unwrap();
    let lens = &mut camera.intrinsics;
    (lens.fx, lens.fy, lens.cx, lens.cy) = (131.0, 131.0, 79.5, 59.5);
    let options = VisionOptions {
        frames: 3,
        empty: 2,
        radius: 8.0,
        width: 160,
        height: 120,
        seed: 5,
        ..Default::default()
    };
    (camera, options)
}

fn run(recorded: &[RgbdFrame]) -> VisionReport {
    let (camera, options) = small();
    let seen = suite_camera(options.suite, &camera);
    let mut detectors: Vec<Box<dyn BallDetector>> = vec![Box::new(Blind), Box::new(Redness(seen))];
    compare(&camera, recorded, &mut detectors, &options, &mut |_| {}).unwrap()
}

fn scene<'a>(report: &'a VisionReport, detector: usize, name: &str) -> &'a SceneReport {
    report.detectors[detector].scenes.iter().find(|scene| scene.scene == name).expect(name)
}

#[test]
fn hits_and_false_alarms_are_counted_where_they_are() {
    let report = run(&[]);
    assert_eq!(report.detectors[0].hit_rate, 0.0);
    assert_eq!(report.detectors[0].false_alarms, 0);
    assert_eq!(report.detectors[0].consistency, None);
    let names: Vec<_> = report.detectors.iter().map(|detector| detector.name).collect();
    assert_eq!(names, ["blind", "redness"]);
    for name in ["clean", "white wall behind", "white ball beside it"] {
        let clean = scene(&report, 1, name);
        assert_eq!(
            (clean.frames, clean.balls, clean.hits, clean.false_alarms),
            (3, 3, 3, 0),
            "{name}"
        );
        assert!(clean.error_median_px.unwrap() < 1.0, "{clean:?}");
        assert_eq!(clean.located, 3, "{clean:?}");
        // A pixel is 8 mm there.
        assert!(clean.position_p95_mm.unwrap() < 12.0, "{clean:?}");
    }
    // Only red: without a ball there is nothing on the grey wall, but the paper is red.
    assert_eq!(scene(&report, 1, "no ball").false_alarms, 0);
    let paper = scene(&report, 1, "no ball: red paper");
    assert_eq!((paper.balls, paper.hits, paper.false_alarms), (0, 0, 2));
    assert!(report.detectors[0].scenes.iter().all(|scene| !scene.scene.contains("real")));
}

/// Returns a recorded frame of a grey wall, `depth` of the camera's units away.
fn grey(camera: &Camera, depth: u16) -> RgbdFrame {
    let (colour, depth) = (Image::filled(160, 120, [90; 3]), Image::filled(160, 120, depth));
    RgbdFrame::new(0.0, colour, depth, camera.intrinsics).unwrap()
}

#[test]
fn recorded_pictures_get_their_own_number_of_balls() {
    let (camera, _) = small();
    let frame = grey(&camera, 2000);
    let report = run(&[frame]);
    let real = scene(&report, 1, "real picture");
    assert_eq!((real.frames, real.hits), (60, 60));
    assert_eq!(scene(&report, 1, "no ball: real picture").frames, 2);
}

#[test]
fn the_hard_set_puts_balls_into_recorded_pictures_and_the_empty_one_none() {
    let (camera, options) = small();
    let frame = grey(&camera, 12_500);
    let run = |suite| {
        let options = VisionOptions { suite, ..options };
        let seen = suite_camera(suite, &camera);
        let mut detectors: Vec<Box<dyn BallDetector>> = vec![Box::new(Redness(seen))];
        compare(&camera, std::slice::from_ref(&frame), &mut detectors, &options, &mut |_| {})
            .unwrap()
    };
    let hard = run(FrameSuite::Hard);
    assert_eq!(hard.detectors[0].scenes, run(FrameSuite::Hard).detectors[0].scenes);
    let plain = scene(&hard, 0, "plain");
    assert_eq!((plain.frames, plain.balls), (3, 3));
    // Where nothing else is red, redness finds the ball near where it is said to be.
    assert!(hard.detectors[0].scenes.iter().map(|s| s.hits).sum::<usize>() > 10, "{hard}");
    assert!(plain.error_median_px.is_none_or(|error| error < 1.0), "{plain:?}");
    let empty = run(FrameSuite::Empty);
    assert!(empty.detectors[0].scenes.iter().all(|scene| scene.balls == 0 && scene.frames == 2));
    assert_eq!(empty.detectors[0].scenes.len(), 11);
    assert_eq!("hard".parse(), Ok(FrameSuite::Hard));
}

/// Runs the suite `rooms` with a detector of red pixels.
fn rooms(recorded: &[RgbdFrame], change: impl Fn(&mut VisionOptions)) -> VisionReport {
    let (camera, options) = small();
    let mut options = VisionOptions { suite: FrameSuite::Rooms, frames: 2, empty: 2, ..options };
    change(&mut options);
    let seen = suite_camera(FrameSuite::Rooms, &camera);
    let mut detectors: Vec<Box<dyn BallDetector>> = vec![Box::new(Redness(seen))];
    compare(&camera, recorded, &mut detectors, &options, &mut |_| {}).unwrap()
}

#[test]
fn rooms_are_the_same_from_a_seed_and_others_where_they_are_held_out() {
    let scenes = |report: VisionReport| report.detectors[0].scenes.clone();
    let usual = scenes(rooms(&[], |_| {}));
    assert_eq!(usual, scenes(rooms(&[], |_| {})));
    assert_ne!(usual, scenes(rooms(&[], |options| options.held_out = true)));
    // The first frames of a kind do not depend on the number of frames of other kinds.
    let fewer = scenes(rooms(&[], |options| options.frames = 1));
    let empty = |scenes: &[SceneReport]| scenes.iter().filter(|s| s.balls == 0).cloned().collect();
    let (all, few): (Vec<SceneReport>, Vec<SceneReport>) = (empty(&usual), empty(&fewer));
    assert_eq!(all, few);
}

#[test]
fn rooms_are_counted_by_group_and_have_depth_where_they_say_so() {
    let (camera, _) = small();
    let report = rooms(&[grey(&camera, 12_500)], |_| {});
    let detector = &report.detectors[0];
    let numbers = |group: &GroupReport| (group.group, group.balls, group.frames);
    assert_eq!(
        detector.groups.iter().map(numbers).collect::<Vec<_>>(),
        [
            (FrameGroup::WithDepth, 40, 40),
            (FrameGroup::WithoutDepth, 30, 30),
            (FrameGroup::CoveredWithoutDepth, 2, 2),
            (FrameGroup::Empty, 0, 28),
        ]
    );
    let located = |group: FrameGroup| {
        detector.groups.iter().find(|report| report.group == group).map(|report| report.located)
    };
    assert!(located(FrameGroup::WithDepth) > Some(0), "{report}");
    // Those without depth are frames of a camera that has none: the outline gives the position.
    assert!(located(FrameGroup::WithoutDepth) > Some(0), "{report}");
    assert_eq!(detector.times.len(), detector.scenes.len());
}

/// The figures of the whole suite are in docs/understand/detector.md. Rounding, which differs from
/// one processor to another, may change the decision about a picture or two.
#[test]
fn the_detector_ball_is_as_good_in_rooms_as_documented() {
    let camera = camera_file::paper().unwrap();
    let (frames, empty, seed) = (1, 1, 7);
    let suite = FrameSuite::Rooms;
    let options = VisionOptions { suite, frames, empty, seed, ..VisionOptions::default() };
    let mut detectors = vec![DetectorKind::Ball.build(&suite_camera(suite, &camera))];
    let report = compare(&camera, &[], &mut detectors, &options, &mut |_| {}).unwrap();
    let group = |group| report.detectors[0].groups.iter().find(|g| g.group == group).unwrap();
    assert!(group(FrameGroup::WithDepth).hits >= 18, "of 20: {report}");
    assert!(group(FrameGroup::WithoutDepth).hits >= 10, "of 15: {report}");
    assert_eq!(group(FrameGroup::Empty).false_alarms, 0, "{report}");
}

/// The detector `ball` finds none of these discs.
#[test]
fn the_detector_disc_finds_flat_discs_at_any_slant_as_documented() {
    let suite = FrameSuite::Disc;
    let camera = Camera { ball_hue: 220.0, ..camera_file::paper().unwrap() };
    let options = VisionOptions { suite, frames: 1, empty: 1, seed: 7, ..Default::default() };
    let mut detectors = vec![DetectorKind::Disc.build(&suite_camera(suite, &camera))];
    let report = compare(&camera, &[], &mut detectors, &options, &mut |_| {}).unwrap();
    let group = |group| report.detectors[0].groups.iter().find(|g| g.group == group).unwrap();
    assert!(group(FrameGroup::WithoutDepth).hits >= 11, "of 12: {report}");
    assert_eq!(group(FrameGroup::Empty).false_alarms, 0, "{report}");
    for scene in &report.detectors[0].scenes[..6] {
        assert_eq!(scene.hits, 1, "on a plain wall: {report}");
        // Perspective moves the centre of an ellipse of 60 pixels by 3.4 at most.
        assert!(scene.error_p99_px.unwrap() < 3.6, "{report}");
    }
}

#[test]
fn the_same_seed_gives_the_same_counts_and_a_table() {
    let (a, b) = (run(&[]), run(&[]));
    assert_eq!(a.detectors[1].scenes, b.detectors[1].scenes);
    let table = a.to_string();
    assert!(table.contains("dark cable across") && table.contains("redness"), "{table}");
    let json = serde_json::to_value(&a).unwrap();
    assert_eq!(json["detectors"][1]["name"], "redness");
    assert!(json["detectors"][1]["ratio"].is_number());
}

#[test]
fn percentiles_are_values_of_the_sample() {
    let mut values: Vec<f64> = (1..=20).rev().map(f64::from).collect();
    assert_eq!(percentile(&mut values, 0.5), Some(10.0));
    assert_eq!(percentile(&mut values, 0.95), Some(19.0));
    assert_eq!(percentile(&mut [], 0.5), None);
}
