//! The detector `ball` on rendered frames.

mod border;
mod certainty;
mod disc;
mod interface;
mod large;
mod real;
mod surface;

use proptest::prelude::*;

use super::BallDetector;
use super::ball::ShapeDetector;
use super::scene::{Disturbances, INTRINSICS, camera, red_ball, seen, wall};
use crate::camera::{Camera, Intrinsics};
use crate::frame::RgbdFrame;
use crate::image::{Bgr, Image};
use crate::observation::{BallObservation, Circle};
use crate::render::{Ball, Scene};

fn detect(frame: &RgbdFrame) -> Option<BallObservation> {
    ShapeDetector::new(&camera()).detect(frame).unwrap()
}

/// Returns the error of the centre, in radii; infinite if no ball was found.
fn miss(found: Option<BallObservation>, truth: &Circle) -> f64 {
    found.map_or(f64::INFINITY, |BallObservation { circle, .. }| {
        (circle.u - truth.u).hypot(circle.v - truth.v) / truth.radius
    })
}

/// Returns a ball at depth `z` that is seen at pixel (`u`, `v`).
fn ball_at(u: f64, v: f64, z: f64) -> Ball {
    red_ball(INTRINSICS.deproject(u, v, z))
}

/// Returns the ball of most tests.
fn usual_ball() -> Ball {
    ball_at(250.0, 200.0, 0.9)
}

/// Returns a ball in front of a wall, and the circle that it is seen as.
fn in_front_of_wall(ball: &Ball) -> (Scene, Circle) {
    let mut scene = wall(2.2);
    scene.add(ball);
    (scene, seen(ball, &INTRINSICS))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_ball_is_found_to_a_fraction_of_a_pixel_wherever_it_is(
        u in 60.0..580.0f64, v in 60.0..420.0f64, z in 0.45..1.9f64, light in 0.4..1.6f64,
    ) {
        let ball = Ball { light, ..ball_at(u, v, z) };
        let mut scene = wall(2.5);
        scene.add(&ball);
        let (found, truth) = (detect(&scene.frame(0.0).unwrap()), seen(&ball, &INTRINSICS));
        prop_assert!(miss(found, &truth) * truth.radius < 0.4, "{found:?} {truth:?}");
        let radius = found.unwrap().circle.radius;
        prop_assert!((radius / truth.radius - 1.0).abs() < 0.06, "{found:?} {truth:?}");
    }
}

#[test]
fn the_ball_is_found_in_disturbed_images() {
    let truth = seen(&usual_ball(), &INTRINSICS);
    let (u, v, r) = (truth.u, truth.v, truth.radius);
    type Disturb = Box<dyn Fn(&mut Scene)>;
    let cases: [(&str, f64, Disturb); 8] = [
        ("dim", 0.25, Box::new(|_| ())),
        ("overexposed", 2.5, Box::new(|_| ())),
        ("a dark cable", 1.0, Box::new(move |s| s.add_cable((u, v), 1.2, 4, 15.0))),
        ("a white cable", 1.0, Box::new(move |s| s.add_cable((u + 4.0, v), 2.0, 4, 235.0))),
        ("blurred", 1.0, Box::new(|s| s.blur(3.0))),
        ("noisy", 1.0, Box::new(|s| s.add_noise(20))),
        (
            "no depth on it",
            1.0,
            Box::new(|s| s.each_pixel(|_, _, _, d| *d = if *d < 10_000 { 0 } else { *d })),
        ),
        (
            "an object in front of a third of it",
            1.0,
            Box::new(move |s| {
                s.each_pixel(|_, at, pixel, depth| {
                    if f64::from(at.0) < u - 0.35 * r {
                        (*pixel, *depth) = ([90, 130, 170], 3500);
                    }
                });
            }),
        ),
    ];
    for (name, light, disturb) in cases {
        let (mut scene, truth) = in_front_of_wall(&Ball { light, ..usual_ball() });
        disturb(&mut scene);
        let found = detect(&scene.frame(0.0).unwrap());
        assert!(miss(found, &truth) < 0.15, "{name}: {found:?} {truth:?}");
    }
}

#[test]
fn a_narrow_post_in_front_of_half_the_ball_does_not_shift_it() {
    for (from, to) in [(0.05, 1.3), (-0.1, 1.1), (-1.2, -0.05)] {
        let (mut scene, truth) = in_front_of_wall(&usual_ball());
        scene.each_pixel(|_, at, pixel, depth| {
            let off = (f64::from(at.0) - truth.u) / truth.radius;
            if (from..to).contains(&off) {
                (*pixel, *depth) = ([105, 110, 112], 4000);
            }
        });
        let found = detect(&scene.frame(0.0).unwrap());
        assert!(miss(found, &truth) * truth.radius < 0.4, "{from} to {to}: {found:?} {truth:?}");
    }
}

#[test]
fn a_red_object_beside_the_ball_at_its_depth_does_not_hide_it() {
    let (mut scene, truth) = in_front_of_wall(&usual_ball());
    scene.each_pixel(|_, at, pixel, depth| {
        let [x, y] =
            [f64::from(at.0) - truth.u, f64::from(at.1) - truth.v].map(|way| way / truth.radius);
        if (1.15..3.0).contains(&x) && y.abs() < 0.9 {
            (*pixel, *depth) = ([30, 25, 150], 4500);
        }
    });
    let found = detect(&scene.frame(0.0).unwrap());
    assert!(miss(found, &truth) * truth.radius < 0.4, "{found:?} {truth:?}");
}

#[test]
fn a_red_print_on_the_wall_behind_does_not_hide_it() {
    let ball = usual_ball();
    let truth = seen(&ball, &INTRINSICS);
    let mut scene = wall(2.2);
    scene.each_pixel(|_, (u, v), pixel, _| {
        let [x, y] = [f64::from(u) - truth.u, f64::from(v) - truth.v].map(|way| way / truth.radius);
        if (-0.5..1.3).contains(&x) && y.abs() < 1.2 && (v % 4 != 0 || (u / 5) % 3 == 0) {
            *pixel = [45, 38, 190];
        }
    });
    scene.add(&ball);
    let found = detect(&scene.frame(0.0).unwrap());
    assert!(miss(found, &truth) * truth.radius < 1.5, "{found:?} {truth:?}");
}

#[test]
fn balls_without_depth_in_front_of_their_own_colour_are_fitted_where_they_are() {
    let mut right = 0;
    for i in 20..40 {
        let at = |step: f64, from: f64, to: f64| from + (f64::from(i) * step).fract() * (to - from);
        let ball = ball_at(at(0.7549, 60.0, 580.0), at(0.5698, 60.0, 420.0), at(0.618, 0.45, 1.2));
        let (mut scene, truth) = (wall(2.2), seen(&ball, &INTRINSICS));
        let width = at(0.3819, 25.0, 60.0);
        scene.each_pixel(|_, (u, v), pixel, _| {
            let plank = (f64::from(u) / width) as i32;
            let (shade, grain) = (plank * 37 % 5, (u * 7 + v / 9 * 13) % 11);
            let red = f64::from(95 + 22 * shade + 3 * grain);
            *pixel = [0.17, 0.12, 1.0].map(|part| (part * red) as u8);
        });
        scene.add(&ball);
        scene.add_noise(4);
        scene.each_pixel(|_, _, _, depth| *depth = 0);
        let circle = detect(&scene.frame(0.0).unwrap()).map(|ball| ball.circle);
        right += i32::from(circle.is_some_and(|circle| {
            let off = (circle.u - truth.u).hypot(circle.v - truth.v) / truth.radius;
            off < 0.1 && (circle.radius / truth.radius - 1.0).abs() < 0.06
        }));
    }
    // Without the second fit, where the network sees the ball: 8.
    assert!(right >= 11, "{right} of 20");
}

#[test]
fn a_shaded_red_oval_without_depth_is_no_ball() {
    let mut scene = wall(2.2);
    let oval = |high: f64| {
        move |_: &Intrinsics, at: (i32, i32), pixel: &mut Bgr, depth: &mut u16| {
            let (x, y) =
                ((f64::from(at.0) - 250.0) / 20.0, (f64::from(at.1) - 200.0) / 20.0 / high);
            if x * x + y * y < 1.0 {
                let red = 150.0 - 40.0 * x - 40.0 * y;
                *pixel = [(0.15 * red) as u8, (0.1 * red) as u8, red as u8];
            }
            *depth = 0;
        }
    };
    scene.each_pixel(oval(0.7));
    assert_eq!(detect(&scene.frame(0.0).unwrap()), None);
    // The same, round.
    scene.each_pixel(oval(1.0));
    assert!(detect(&scene.frame(0.0).unwrap()).is_some());
}

#[test]
fn the_ball_is_tracked_and_found_again_elsewhere() {
    let frame_of = |u: f64, v: f64| {
        let (scene, truth) = in_front_of_wall(&ball_at(u, v, 1.0));
        (scene.frame(0.0).unwrap(), truth)
    };
    let mut detector = ShapeDetector::new(&camera());
    // Small steps, a leap across the image, the border, nothing, and back.
    let places = [
        (100.0, 100.0),
        (104.0, 97.0),
        (108.0, 95.0),
        (520.0, 400.0),
        (632.0, 440.0),
        (300.0, 8.0),
    ];
    for (u, v) in places {
        let (frame, truth) = frame_of(u, v);
        let followed = detector.detect(&frame).unwrap();
        assert!(miss(followed, &truth) < 0.06, "{followed:?} {truth:?}");
        let alone = detect(&frame).unwrap();
        assert!(
            (followed.unwrap().circle.u - alone.circle.u).abs() < 0.1,
            "{followed:?} {alone:?}"
        );
    }
    assert_eq!(detector.detect(&wall(2.2).frame(0.0).unwrap()).unwrap(), None);
    let (frame, truth) = frame_of(60.0, 420.0);
    assert!(miss(detector.detect(&frame).unwrap(), &truth) < 0.06);
}

#[test]
fn a_ball_of_any_hue_is_found_by_its_own_detector_only() {
    let colours =
        [(0.0, [0.12, 0.08, 0.8]), (120.0, [0.1, 0.6, 0.08]), (220.0, [0.75, 0.25, 0.06])];
    for (hue, albedo) in colours {
        let (scene, truth) = in_front_of_wall(&Ball { albedo, ..usual_ball() });
        for (other, _) in colours {
            let found = ShapeDetector::new(&Camera { ball_hue: other, ..camera() })
                .detect(&scene.frame(0.0).unwrap())
                .unwrap();
            if other == hue {
                assert!(miss(found, &truth) < 0.03, "{hue}: {found:?}");
            } else {
                assert_eq!(found, None, "{hue} seen as {other}");
            }
        }
    }
}

#[test]
fn similar_objects_are_not_taken_for_the_ball() {
    let ball = ball_at(450.0, 300.0, 1.1);
    let other = |albedo: [f64; 3]| Ball { albedo, ..ball_at(200.0, 150.0, 0.8) };
    let twice = Ball { radius: 0.06, ..ball_at(200.0, 150.0, 0.8) };
    let half = Ball { radius: 0.015, ..ball_at(200.0, 150.0, 0.8) };
    let others = [
        ("white", other([0.9, 0.9, 0.9])),
        ("orange", other([0.1, 0.5, 0.9])),
        ("of skin", other([0.5, 0.62, 0.88])),
        ("blue", other([0.8, 0.2, 0.1])),
        ("twice as large", twice),
        ("half as large", half),
    ];
    for (name, other) in others {
        let (mut scene, _) = in_front_of_wall(&other);
        // Skin may be as pale as an overexposed ball, so it may be found.
        if name != "of skin" {
            assert_eq!(detect(&scene.frame(0.0).unwrap()), None, "{name} alone");
        }
        scene.add(&ball);
        let (found, truth) = (detect(&scene.frame(0.0).unwrap()), seen(&ball, &INTRINSICS));
        assert!(miss(found, &truth) < 0.1, "{name} beside it: {found:?}");
    }
}

#[test]
fn a_red_print_is_no_ball() {
    let mut scene = wall(0.9);
    scene.add(&usual_ball());
    // The image of a ball at the wall's depth, then at that of a box that is not much larger.
    scene.each_pixel(|_, _, _, depth| *depth = 4500);
    assert_eq!(detect(&scene.frame(0.0).unwrap()), None);
    scene.each_pixel(|_, (u, v), _, depth| {
        let on_box = (u - 250).abs() < 30 && (v - 200).abs() < 30;
        *depth = if on_box { 4500 } else { 11_000 };
    });
    assert_eq!(detect(&scene.frame(0.0).unwrap()), None);
}

#[test]
fn empty_and_tiny_images_are_searched() {
    assert_eq!(detect(&wall(1.0).frame(0.0).unwrap()), None);
    for (width, height) in [(1, 1), (3, 50), (50, 3)] {
        let colour = Image::filled(width, height, [0, 0, 255]);
        let depth = Image::filled(width, height, 900);
        let frame = RgbdFrame::new(0.0, colour, depth, INTRINSICS).unwrap();
        assert_eq!(detect(&frame), None, "{width}x{height}");
    }
}

#[test]
fn absurd_diameters_find_no_ball() {
    let (scene, _) = in_front_of_wall(&usual_ball());
    for diameter in [0.0, -1.0, 1e-9, 1e3, 1e300, f64::INFINITY, f64::NAN] {
        let camera = Camera { ball_diameter: diameter, ..camera() };
        let found = ShapeDetector::new(&camera).detect(&scene.frame(0.0).unwrap()).unwrap();
        assert_eq!(found, None, "{diameter}");
    }
}
