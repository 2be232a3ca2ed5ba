use nalgebra::Point3;

use plumb_cameras::camera_file;
use plumb_emulator::plant::Geometry;
use plumb_protocol::{MOTORS, PerMotor};

use super::*;

const P0: Point3<f64> = Point3::new(0.540, 0.220, 0.459);
const NO_NOISE: SensorOptions = SensorOptions {
    colour_noise: 0.0,
    depth_noise: 0.0,
    depth_step: 0.002_85,
    speckle: 0.0,
    nearest: 0.4,
    farthest: 8.0,
    holes: false,
};

/// Returns a grey frame whose depth is `z` metres everywhere.
fn plain(z: f64) -> Background {
    let lens = camera_file::paper().unwrap().intrinsics;
    let depth = Image::filled(640, 480, (z * lens.depth_scale).round() as u16);
    let frame = RgbdFrame::new(0.0, Image::filled(640, 480, [128; 3]), depth, lens);
    Background::Frame(frame.unwrap())
}

fn camera(background: Background, sensor: SensorOptions, seed: u64) -> SyntheticCamera {
    SyntheticCamera::new(
        camera_file::paper().unwrap(),
        background,
        RenderOptions { sensor, ..RenderOptions::default() },
        seed,
    )
    .unwrap()
}

fn bytes(frame: &RgbdFrame) -> (Vec<u8>, Vec<u16>) {
    (frame.colour().channels().to_vec(), frame.depth().pixels().to_vec())
}

fn pixel(frame: &RgbdFrame, u: f64, v: f64) -> [f64; 3] {
    frame.colour().get(u.round() as usize, v.round() as usize).unwrap().map(f64::from)
}

fn seen(p: &Point3<f64>) -> (f64, f64) {
    let camera = camera_file::paper().unwrap();
    camera.intrinsics.project(&(camera.pose.inverse() * p)).unwrap()
}

/// Mean and standard deviation of the known depth, metres.
fn depth_of(frame: &RgbdFrame) -> (f64, f64) {
    let known: Vec<f64> = frame
        .depth()
        .pixels()
        .iter()
        .filter(|d| **d > 0)
        .map(|d| f64::from(*d) / frame.intrinsics().depth_scale)
        .collect();
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    (mean, (known.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / known.len() as f64).sqrt())
}

#[test]
fn the_same_seed_gives_the_same_pictures_and_another_one_others() {
    let shots = |seed| {
        let mut camera = camera(plain(2.0), SensorOptions::default(), seed);
        let scene = Scene { light: 0.8, blur: 1.0, ..Scene::rig(P0, paper_motors()) };
        [0.0, 0.1].map(|time| bytes(&camera.render(time, &scene).unwrap()))
    };
    let (a, b, c) = (shots(1), shots(1), shots(2));
    assert!(a == b);
    assert!(a[0] != a[1] && a[0] != c[0]);
}

#[test]
fn the_ball_is_red_where_it_projects_to_and_as_far_as_it_is() {
    let mut camera = camera(plain(2.0), NO_NOISE, 1);
    let frame = camera.render(0.0, &Scene { blur: 0.0, ..Scene::rig(P0, paper_motors()) }).unwrap();
    let (u, v) = seen(&P0);
    let radius = 525.0 * 0.04 / (1.737 - 0.54);
    let red = |u, v| {
        let [b, g, r] = pixel(&frame, u, v);
        r > 1.5 * g.max(b)
    };
    for (du, dv) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)] {
        assert!(red(u + du * (radius - 2.0), v + dv * (radius - 2.0)), "{du} {dv}");
        assert!(
            !red(u + du * (radius + 2.5), v + dv * (radius + 2.5)) || du + dv == 0.0,
            "{du} {dv}"
        );
    }
    let surface = frame.depth_at(u.round() as i32, v.round() as i32).unwrap();
    // Half a step of the sensor at that distance.
    assert!(
        (surface - (1.737 - 0.54 - 0.04)).abs() < 0.002_85 / 2.0 * 1.2_f64.powi(2),
        "{surface}"
    );
}

#[test]
fn the_rendered_ball_has_the_area_of_its_disc() {
    let mut camera = camera(plain(2.0), NO_NOISE, 1);
    let centre = Point3::new(0.7, 0.286, 0.225);
    let scene = Scene {
        ball: Some(centre),
        blur: 0.0,
        ball_material: Material::red_ball().matt(),
        ..Scene::default()
    };
    let (with, without) =
        (camera.render(0.0, &scene).unwrap(), camera.render(0.0, &Scene::default()).unwrap());
    // The ball lowers the green value of every pixel that it covers, edge pixels included.
    let green = |frame: &RgbdFrame| {
        bytes(frame).0.iter().skip(1).step_by(3).filter(|g| **g != 128).count() as f64
    };
    let radius = 525.0 * 0.04 / (1.037_f64.powi(2) - 0.04_f64.powi(2)).sqrt();
    assert_eq!(green(&without), 0.0);
    let area = std::f64::consts::PI * radius * radius;
    let rim = std::f64::consts::TAU * radius;
    assert!((green(&with) - area - 0.5 * rim).abs() < 0.3 * rim, "{} {area}", green(&with));
}

#[test]
fn noise_and_steps_of_depth_grow_with_the_distance_squared() {
    let spread = |z: f64, noise| {
        let sensor = SensorOptions { depth_noise: noise, holes: true, ..SensorOptions::default() };
        depth_of(&camera(plain(z), sensor, 3).render(0.0, &Scene::default()).unwrap())
    };
    for z in [1.0, 2.0, 4.0] {
        let (mean, sd) = spread(z, 0.005);
        assert!((mean - z).abs() < 0.003 * z * z, "{mean}");
        assert!((0.9..1.15).contains(&(sd / (0.005 * z * z))), "{z}: {sd}");
    }
    let mut camera = camera(plain(2.0), SensorOptions::default(), 3);
    let mut values = bytes(&camera.render(0.0, &Scene::default()).unwrap()).1;
    values.sort_unstable();
    values.dedup();
    let scale = camera_file::paper().unwrap().intrinsics.depth_scale;
    for pair in values[1..].windows(2) {
        let (near, far) = (f64::from(pair[0]) / scale, f64::from(pair[1]) / scale);
        assert!((far - near - 0.002_85 * near * far).abs() <= 1.01 / scale, "{near} {far}");
    }
}

#[test]
fn some_depth_is_missing_by_chance_and_on_the_left_of_the_ball_by_shadow() {
    let mut camera = camera(plain(3.0), SensorOptions::default(), 4);
    let missing =
        |frame: &RgbdFrame| bytes(frame).1.iter().filter(|d| **d == 0).count() as f64 / 307_200.0;
    let empty = missing(&camera.render(0.0, &Scene::default()).unwrap());
    assert!((0.001..0.004).contains(&empty), "{empty}");
    let frame = camera.render(0.0, &Scene { ball: Some(P0), ..Scene::default() }).unwrap();
    let (u, v) = seen(&P0);
    let radius = 525.0 * 0.04 / (1.737 - 0.54);
    let known = |from: f64| {
        (3..13).filter(|k| frame.depth_at((u + from) as i32 + k, v as i32).is_some()).count()
    };
    assert_eq!(known(-radius - 14.0), 0, "the projector's shadow");
    assert!(known(radius) >= 8);
}

#[test]
fn the_cables_go_from_the_ball_to_the_motors() {
    let mut camera = camera(plain(3.0), NO_NOISE, 1);
    let frame = camera.render(0.0, &Scene::rig(P0, paper_motors())).unwrap();
    for motor in paper_motors() {
        let middle = P0 + (motor - P0) * 0.3;
        let (u, v) = seen(&middle);
        let around = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (f64::from(x), f64::from(y))));
        let darkest = around.map(|(x, y)| pixel(&frame, u + x, v + y)[1]).fold(255.0, f64::min);
        assert!(darkest < 105.0, "{motor}: {darkest}");
    }
}

#[test]
fn more_light_makes_everything_brighter() {
    let mut camera = camera(plain(3.0), NO_NOISE, 1);
    let (u, v) = seen(&P0);
    let mut at = |light| {
        let frame =
            camera.render(0.0, &Scene { ball: Some(P0), light, ..Scene::default() }).unwrap();
        (pixel(&frame, u, v)[2], pixel(&frame, 10.0, 10.0)[2])
    };
    let (dark, middle, bright) = (at(0.3), at(1.0), at(4.0));
    assert!(dark.0 < middle.0 && middle.0 < bright.0, "{dark:?} {middle:?} {bright:?}");
    assert_eq!(middle.1, 128.0);
    assert!(dark.1 < 90.0 && bright.1 > 220.0);
}

#[test]
fn a_ball_outside_the_frame_is_drawn_as_far_as_it_is_visible() {
    let mut camera = camera(plain(3.0), NO_NOISE, 1);
    let lens = camera_file::paper().unwrap();
    let at = |u: f64, v: f64, z: f64| lens.pose * lens.intrinsics.deproject(u, v, z);
    let half = camera
        .render(0.0, &Scene { ball: Some(at(-3.0, 200.0, 1.0)), ..Scene::default() })
        .unwrap();
    assert!(pixel(&half, 0.0, 200.0)[1] < 100.0 && pixel(&half, 40.0, 200.0)[1] == 128.0);
    let empty = bytes(&camera.render(0.0, &Scene::default()).unwrap());
    let nan = Point3::new(f64::NAN, 0.0, 0.0);
    for nowhere in [at(-300.0, 9000.0, 1.0), at(300.0, 200.0, -1.0), at(320.0, 240.0, 0.01), nan] {
        let scene = Scene { ball: Some(nowhere), ..Scene::default() };
        assert!(bytes(&camera.render(0.0, &scene).unwrap()) == empty, "{nowhere}");
        let strand =
            Strand { from: nowhere, to: nowhere, diameter: 0.001, material: Material::red_ball() };
        camera
            .render(0.0, &Scene { strands: vec![strand], ..Scene::rig(P0, [nowhere; MOTORS]) })
            .unwrap();
    }
}

#[test]
fn the_room_does_not_hide_the_working_volume() {
    let camera = camera(Background::Room(Room::furnished()), NO_NOISE, 1);
    let range = camera.range.as_ref().unwrap();
    let [a, b, c] = paper_motors().map(|motor| motor.coords);
    for (wa, wb) in
        (0..=10).flat_map(|i| (0..=10 - i).map(move |j| (f64::from(i) / 10.0, f64::from(j) / 10.0)))
    {
        for z in [0.06, 0.15, 0.3, 0.45, 0.6] {
            let flat = a * wa + b * wb + c * (1.0 - wa - wb);
            let ball = Point3::new(flat.x, flat.y, z);
            let (u, v) = seen(&ball);
            let (column, row) = (u.round() as usize, v.round() as usize);
            if column < 640 && row < 480 {
                let behind = f64::from(range[row * 640 + column]);
                assert!(
                    behind > 1.737 - ball.x,
                    "{ball}: something stands {behind} m away at {u}, {v}"
                );
            }
        }
    }
}

#[test]
fn the_room_fools_a_detector_that_looks_at_the_red_channel() {
    let mut camera = camera(Background::Room(Room::furnished()), NO_NOISE, 1);
    let frame = camera.render(0.0, &Scene::rig(P0, paper_motors())).unwrap();
    let (u, v) = seen(&P0);
    let ball = pixel(&frame, u, v)[2];
    // Lamp, window, white ball, white wall: as bright in red as the ball, but not red.
    for distractor in [
        Point3::new(-0.15, 0.99, 0.42),
        Point3::new(-2.19, -0.6, 0.9),
        Point3::new(0.45, 0.80, 0.05),
        Point3::new(-1.95, 0.30, 0.9),
    ] {
        let (u, v) = seen(&distractor);
        let [blue, _, red] = pixel(&frame, u, v);
        assert!(red > 0.85 * ball && blue > 0.7 * red, "{distractor}: {red} {blue}, ball {ball}");
    }
    assert!(bytes(&frame).1.iter().filter(|d| **d > 0).count() > 250_000);
}

#[test]
fn what_cannot_be_is_refused() {
    let make = |change: fn(&mut Camera, &mut RenderOptions)| {
        let (mut camera, mut options) = (camera_file::paper().unwrap(), RenderOptions::default());
        change(&mut camera, &mut options);
        SyntheticCamera::new(camera, plain(2.0), options, 1).map(|_| ())
    };
    assert!(make(|_, _| ()).is_ok());
    assert!(matches!(
        make(|camera, _| camera.intrinsics.cx = 900.0),
        Err(SyntheticError::Intrinsics { .. })
    ));
    for wrong in [
        (|camera, _| camera.intrinsics.fx = f64::NAN) as fn(&mut Camera, &mut RenderOptions),
        |camera, _| camera.intrinsics.depth_scale = -1.0,
        |camera, _| camera.ball_diameter = -1.0,
        |_, options| options.sensor.depth_step = 0.0,
        |_, options| options.sensor.speckle = 2.0,
        |_, options| options.sensor.farthest = 0.1,
    ] {
        assert!(matches!(make(wrong), Err(SyntheticError::Value { .. })));
    }
    let mut camera = camera(plain(2.0), NO_NOISE, 1);
    for scene in
        [Scene { light: 0.0, ..Scene::default() }, Scene { blur: f64::NAN, ..Scene::default() }]
    {
        assert!(matches!(camera.render(0.0, &scene), Err(SyntheticError::Value { .. })));
    }
    assert!(matches!(camera.render(f64::NAN, &Scene::default()), Err(SyntheticError::Frame(_))));
}

fn paper_motors() -> PerMotor<Point3<f64>> {
    *Geometry::paper().motors()
}
