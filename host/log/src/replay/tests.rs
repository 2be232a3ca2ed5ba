//! Tests of the replay.

use nalgebra::{Isometry3, Vector3};
use plumb_cameras::png;
use plumb_cameras::tum::TumFolder;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::Image;
use plumb_frame::observation::Circle;
use plumb_vision::localise::observe;

use super::*;

/// Detector that finds a ball if the first pixel's blue is 1, and fails if it is 2.
struct Scripted;

impl BallDetector for Scripted {
    fn name(&self) -> &'static str {
        "scripted"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        match frame.colour().pixels()[0][0] {
            1 => {
                let circle = Circle::rough(15.5, 11.5, 8.0);
                Ok(Some(observe(circle, 0.75, frame, &camera())))
            }
            2 => Err(DetectError::processing("scripted")),
            _ => Ok(None),
        }
    }
}

fn camera() -> Camera {
    let intrinsics = Intrinsics {
        fx: 200.0,
        fy: 200.0,
        cx: 15.5,
        cy: 11.5,
        depth_scale: 1000.0,
        distortion: None,
    };
    let pose = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::zeros());
    Camera::new(intrinsics, pose, 0.04)
}

fn recording() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "rgb.txt",
        "# t\n0.000000 0.png\n0.033333 1.png\n0.066667 gone.png\n0.1 2.png\n0.2 1.png\n",
    );
    write("depth.txt", "0.001 d.png\n0.034 d.png\n0.066667 d.png\n0.1 d.png\nx y\n");
    for value in 0..3 {
        let path = folder.path().join(format!("{value}.png"));
        png::save(&path, &Image::filled(32, 24, [value; 3])).unwrap();
    }
    let depth = plumb_pictures::png::encode_depth(&Image::filled(32, 24, 500)).unwrap();
    std::fs::write(folder.path().join("d.png"), depth).unwrap();
    folder
}

fn replay_folder(
    folder: &Path,
    out: impl Write,
    report: impl FnMut(&Problem),
) -> Result<ReplayOutcome, ReplayError> {
    let mut source = TumFolder::open(folder, &camera()).unwrap();
    replay(&mut source, &camera(), &mut Scripted, out, None, report, |_| ())
}

#[test]
fn each_colour_frame_gives_a_row_and_each_problem_is_reported() {
    let (mut out, mut problems) = (Vec::new(), Vec::new());
    let folder = recording();
    let report = |p: &Problem| problems.push(ErrorChain(p).to_string());
    let outcome = replay_folder(folder.path(), &mut out, report).unwrap();
    let text = String::from_utf8(out).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], HEADER.join(","));
    assert_eq!(lines[1], "0.000000,,,,,,,,");
    assert!(lines[2].starts_with("0.033333,15.500,11.500,8.000,0.51"), "{}", lines[2]);
    assert!(
        lines[2].contains(",1.00000,2.00000,3.51") && lines[2].ends_with(",0.7500"),
        "{}",
        lines[2]
    );
    assert_eq!(lines[3], "0.066667,,,,,,,,");
    assert_eq!(lines[4], "0.100000,,,,,,,,");
    assert_eq!(lines[5], "0.200000,15.500,11.500,8.000,,,,,0.7500");
    assert_eq!(lines.len(), 6);
    let expected =
        ReplayOutcome { frames: 5, detected: 2, located: 1, without_depth: 1, broken: 3 };
    assert_eq!(outcome, expected);
    let named = ["depth.txt:5", "gone.png", "scripted", "0.200000 s: no depth"];
    assert_eq!(problems.len(), named.len(), "{problems:?}");
    for (problem, name) in problems.iter().zip(named) {
        assert!(problem.contains(name), "{name} in {problem}");
    }
}

#[test]
fn a_closed_pipe_ends_the_replay_with_an_error() {
    struct Closed;
    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::BrokenPipe.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let folder = recording();
    let outcome = replay_folder(folder.path(), Closed, |_| ());
    assert!(outcome.as_ref().is_err_and(ReplayError::is_closed_pipe), "{outcome:?}");
}
