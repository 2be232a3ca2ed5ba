//! The default detector on rendered and on real pictures.

use nalgebra::{Point3, Vector2};
use proptest::prelude::*;

use super::ball::Ball;
use super::scene::{INTRINSICS, Scene, Sphere, pictures};
use super::{Detection, Detector};
use crate::camera::Intrinsics;
use crate::frame::RgbdFrame;
use crate::source::Source;
use crate::source::tum::TumFolder;

fn detect(frame: &RgbdFrame) -> Option<Detection> {
    Ball::new(0.06).detect(frame).unwrap()
}

/// How far off a detection is, in radii; infinite where there is none.
fn miss(found: Option<Detection>, truth: &Detection) -> f64 {
    found.map_or(f64::INFINITY, |f| (f.u - truth.u).hypot(f.v - truth.v) / truth.radius)
}

/// A ball that is seen at a pixel.
fn ball_at(u: f64, v: f64, z: f64) -> Sphere {
    Sphere::red(INTRINSICS.deproject(u, v, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_ball_is_found_to_a_fraction_of_a_pixel_wherever_it_is(
        u in 60.0..580.0f64, v in 60.0..420.0f64, z in 0.45..1.9f64, light in 0.4..1.6f64,
    ) {
        let ball = Sphere { light, ..ball_at(u, v, z) };
        let mut scene = Scene::wall(2.5);
        scene.add(&ball);
        let (found, truth) = (detect(&scene.frame()), ball.seen(&INTRINSICS));
        prop_assert!(miss(found, &truth) * truth.radius < 0.4, "{found:?} {truth:?}");
        let radius = found.unwrap().radius;
        prop_assert!((radius / truth.radius - 1.0).abs() < 0.06, "{found:?} {truth:?}");
    }
}

#[test]
fn what_spoils_the_view_does_not_lose_it() {
    let ball = ball_at(250.0, 200.0, 0.9);
    let truth = ball.seen(&INTRINSICS);
    let (u, v, r) = (truth.u, truth.v, truth.radius);
    type Spoil = Box<dyn Fn(&mut Scene)>;
    let cases: [(&str, f64, Spoil); 8] = [
        ("dim", 0.25, Box::new(|_| ())),
        ("overexposed", 2.5, Box::new(|_| ())),
        ("a dark cable", 1.0, Box::new(move |s| s.add_cable((u, v), 1.2, 4, 15.0))),
        ("a white cable", 1.0, Box::new(move |s| s.add_cable((u + 4.0, v), 2.0, 4, 235.0))),
        ("blurred", 1.0, Box::new(|s| s.blur(3.0))),
        ("noisy", 1.0, Box::new(|s| s.add_noise(20))),
        (
            "no depth on it",
            1.0,
            Box::new(|s| {
                s.each_pixel(|_, _, _, d| {
                    if *d < 10_000 {
                        *d = 0
                    }
                })
            }),
        ),
        (
            "a hand's breadth in front of a third of it",
            1.0,
            Box::new(move |s| {
                s.each_pixel(|_, at, pixel, depth| {
                    if f64::from(at.0) < u - 0.35 * r {
                        (*pixel, *depth) = ([90, 130, 170].into(), 3500);
                    }
                });
            }),
        ),
    ];
    for (name, light, spoil) in cases {
        let mut scene = Scene::wall(2.2);
        scene.add(&Sphere { light, ..ball });
        spoil(&mut scene);
        let found = detect(&scene.frame());
        assert!(miss(found, &truth) < 0.15, "{name}: {found:?} {truth:?}");
    }
}

#[test]
fn a_narrow_post_before_half_of_it_does_not_shift_it() {
    for (from, to) in [(0.05, 1.3), (-0.1, 1.1), (-1.2, -0.05)] {
        let ball = ball_at(250.0, 200.0, 0.9);
        let truth = ball.seen(&INTRINSICS);
        let mut scene = Scene::wall(2.2);
        scene.add(&ball);
        scene.each_pixel(|_, at, pixel, depth| {
            let off = (f64::from(at.0) - truth.u) / truth.radius;
            if (from..to).contains(&off) {
                (*pixel, *depth) = ([105, 110, 112].into(), 4000);
            }
        });
        let found = detect(&scene.frame());
        assert!(miss(found, &truth) * truth.radius < 0.4, "{from} to {to}: {found:?} {truth:?}");
    }
}

#[test]
fn something_red_as_near_as_the_ball_beside_it_does_not_hide_it() {
    let ball = ball_at(250.0, 200.0, 0.9);
    let truth = ball.seen(&INTRINSICS);
    let mut scene = Scene::wall(2.2);
    scene.add(&ball);
    scene.each_pixel(|_, at, pixel, depth| {
        let [x, y] = [f64::from(at.0) - truth.u, f64::from(at.1) - truth.v].map(|way| way / truth.radius);
        if (1.15..3.0).contains(&x) && y.abs() < 0.9 {
            (*pixel, *depth) = ([30, 25, 150].into(), 4500);
        }
    });
    let found = detect(&scene.frame());
    assert!(miss(found, &truth) * truth.radius < 0.4, "{found:?} {truth:?}");
}

#[test]
fn a_red_print_on_the_wall_behind_does_not_hide_it() {
    let ball = ball_at(250.0, 200.0, 0.9);
    let truth = ball.seen(&INTRINSICS);
    let mut scene = Scene::wall(2.2);
    scene.each_pixel(|_, (u, v), pixel, _| {
        let [x, y] = [f64::from(u) - truth.u, f64::from(v) - truth.v].map(|way| way / truth.radius);
        if (-0.5..1.3).contains(&x) && y.abs() < 1.2 && (v % 4 != 0 || (u / 5) % 3 == 0) {
            *pixel = [45, 38, 190].into();
        }
    });
    scene.add(&ball);
    let found = detect(&scene.frame());
    assert!(miss(found, &truth) * truth.radius < 1.5, "{found:?} {truth:?}");
}

#[test]
fn a_shaded_red_oval_without_depth_is_no_ball() {
    let mut scene = Scene::wall(2.2);
    let oval = |high: f64| {
        move |_: &Intrinsics, at: (i32, i32), pixel: &mut opencv::core::Vec3b, depth: &mut u16| {
            let (x, y) = ((f64::from(at.0) - 250.0) / 20.0, (f64::from(at.1) - 200.0) / 20.0 / high);
            if x * x + y * y < 1.0 {
                let red = 150.0 - 40.0 * x - 40.0 * y;
                *pixel = [(0.15 * red) as u8, (0.1 * red) as u8, red as u8].into();
            }
            *depth = 0;
        }
    };
    scene.each_pixel(oval(0.7));
    assert_eq!(detect(&scene.frame()), None);
    // The same, round.
    scene.each_pixel(oval(1.0));
    assert!(detect(&scene.frame()).is_some());
}

#[test]
fn it_is_followed_and_found_again_when_it_is_elsewhere() {
    let frame_of = |u: f64, v: f64| {
        let ball = ball_at(u, v, 1.0);
        let mut scene = Scene::wall(2.2);
        scene.add(&ball);
        (scene.frame(), ball.seen(&INTRINSICS))
    };
    let mut detector = Ball::new(0.06);
    // Small steps, a leap across the picture, the border, nothing, and back.
    let places = [(100.0, 100.0), (104.0, 97.0), (108.0, 95.0), (520.0, 400.0), (632.0, 440.0), (300.0, 8.0)];
    for (u, v) in places {
        let (frame, truth) = frame_of(u, v);
        let followed = detector.detect(&frame).unwrap();
        assert!(miss(followed, &truth) < 0.06, "{followed:?} {truth:?}");
        let alone = detect(&frame).unwrap();
        assert!((followed.unwrap().u - alone.u).abs() < 0.1, "{followed:?} {alone:?}");
    }
    assert_eq!(detector.detect(&Scene::wall(2.2).frame()).unwrap(), None);
    let (frame, truth) = frame_of(60.0, 420.0);
    assert!(miss(detector.detect(&frame).unwrap(), &truth) < 0.06);
}

#[test]
fn a_ball_of_any_hue_is_found_by_its_own_detector_only() {
    let colours = [(0.0, [0.12, 0.08, 0.8]), (120.0, [0.1, 0.6, 0.08]), (220.0, [0.75, 0.25, 0.06])];
    for (hue, albedo) in colours {
        let ball = Sphere { albedo, ..ball_at(250.0, 200.0, 0.9) };
        let mut scene = Scene::wall(2.2);
        scene.add(&ball);
        for (other, _) in colours {
            let found = Ball::new(0.06).with_hue(other).detect(&scene.frame()).unwrap();
            if other == hue {
                assert!(miss(found, &ball.seen(&INTRINSICS)) < 0.03, "{hue}: {found:?}");
            } else {
                assert_eq!(found, None, "{hue} seen as {other}");
            }
        }
    }
}

#[test]
fn where_less_of_the_edge_is_seen_its_place_is_less_sure_in_that_direction() {
    // The right half of it is out of the picture: the column is known by one side only.
    let ball = ball_at(639.0, 240.0, 0.8);
    let mut scene = Scene::wall(2.2);
    scene.add(&ball);
    let half = detect(&scene.frame()).unwrap();
    assert!(miss(Some(half), &ball.seen(&INTRINSICS)) < 0.04, "{half:?}");
    let ball = ball_at(320.0, 240.0, 0.8);
    let mut scene = Scene::wall(2.2);
    scene.add(&ball);
    let whole = detect(&scene.frame()).unwrap();
    assert!(half.covariance[(0, 0)] > 1.5 * half.covariance[(1, 1)], "{half:?}");
    assert!(half.covariance[(0, 0)] > 1.5 * whole.covariance[(0, 0)], "{half:?} {whole:?}");
    assert!((whole.covariance[(0, 0)] / whole.covariance[(1, 1)] - 1.0).abs() < 0.3, "{whole:?}");
}

#[test]
fn a_ball_without_depth_is_less_sure() {
    let ball = ball_at(250.0, 200.0, 0.9);
    let mut scene = Scene::wall(2.2);
    scene.add(&ball);
    let with_depth = detect(&scene.frame()).unwrap();
    scene.each_pixel(|_, _, _, depth| *depth = 0);
    let without = detect(&scene.frame()).unwrap();
    assert!(without.score < with_depth.score, "{without:?} {with_depth:?}");
    assert!((without.radius / with_depth.radius - 1.0).abs() < 0.05, "{without:?} {with_depth:?}");
}

#[test]
fn the_ball_is_told_from_what_is_like_it() {
    let ball = ball_at(450.0, 300.0, 1.1);
    let other = |albedo: [f64; 3]| Sphere { albedo, ..ball_at(200.0, 150.0, 0.8) };
    let twice = Sphere { radius: 0.06, ..ball_at(200.0, 150.0, 0.8) };
    let half = Sphere { radius: 0.015, ..ball_at(200.0, 150.0, 0.8) };
    let others = [
        ("white", other([0.9, 0.9, 0.9])),
        ("orange", other([0.1, 0.5, 0.9])),
        ("of skin", other([0.5, 0.62, 0.88])),
        ("blue", other([0.8, 0.2, 0.1])),
        ("twice as large", twice),
        ("half as large", half),
    ];
    for (name, other) in others {
        let mut scene = Scene::wall(2.2);
        scene.add(&other);
        // Skin may be as pale as an overexposed ball.
        if name != "of skin" {
            assert_eq!(detect(&scene.frame()), None, "{name} alone");
        }
        scene.add(&ball);
        let (found, truth) = (detect(&scene.frame()), ball.seen(&INTRINSICS));
        assert!(miss(found, &truth) < 0.1, "{name} beside it: {found:?}");
    }
}

#[test]
fn a_red_print_is_no_ball() {
    let (ball, mut scene) = (ball_at(250.0, 200.0, 0.9), Scene::wall(0.9));
    scene.add(&ball);
    // The picture of a ball on the wall's depth, then on that of a box that is not much larger.
    scene.each_pixel(|_, _, _, depth| *depth = 4500);
    assert_eq!(detect(&scene.frame()), None);
    scene.each_pixel(|_, (u, v), _, depth| {
        let on_box = (u - 250).abs() < 30 && (v - 200).abs() < 30;
        *depth = if on_box { 4500 } else { 11_000 };
    });
    assert_eq!(detect(&scene.frame()), None);
}

#[test]
fn pictures_with_nothing_in_them_or_of_no_size_to_speak_of_are_searched() {
    assert_eq!(detect(&Scene::wall(1.0).frame()), None);
    use opencv::core::{CV_8UC3, CV_16UC1, Mat, Scalar};
    for (rows, columns) in [(1, 1), (3, 50), (50, 3)] {
        let red = Scalar::new(0.0, 0.0, 255.0, 0.0);
        let colour = Mat::new_rows_cols_with_default(rows, columns, CV_8UC3, red).unwrap();
        let depth = Mat::new_rows_cols_with_default(rows, columns, CV_16UC1, Scalar::all(900.0)).unwrap();
        let frame = RgbdFrame::new(0.0, colour, depth, INTRINSICS).unwrap();
        assert_eq!(detect(&frame), None, "{rows}x{columns}");
    }
}

#[test]
fn balls_of_absurd_size_are_not_found() {
    let mut scene = Scene::wall(2.2);
    scene.add(&ball_at(250.0, 200.0, 0.9));
    for diameter in [0.0, -1.0, 1e-9, 1e3, 1e300, f64::INFINITY, f64::NAN] {
        assert_eq!(Ball::new(diameter).detect(&scene.frame()).unwrap(), None, "{diameter}");
    }
}

/// The frames of a folder of real pictures.
fn real(name: &str, intrinsics: Intrinsics) -> Vec<RgbdFrame> {
    let Some(folder) = pictures(name) else { return Vec::new() };
    let mut source = TumFolder::open(&folder, intrinsics).unwrap();
    let frames: Vec<_> = std::iter::from_fn(|| source.next_frame().unwrap()).collect();
    assert!(!frames.is_empty(), "{name}");
    frames
}

fn desk() -> Vec<RgbdFrame> {
    real("tum-desk", Intrinsics { fx: 520.9, fy: 521.0, cx: 325.1, cy: 249.7, depth_scale: 5000.0 })
}

#[test]
fn there_is_no_ball_on_the_real_desk_nor_on_the_real_table() {
    for (i, frame) in desk().iter().chain(&real("osd", INTRINSICS)).enumerate() {
        assert_eq!(detect(frame), None, "frame {i}");
    }
}

#[test]
fn balls_in_real_pictures_are_found() {
    let frames: Vec<RgbdFrame> =
        real("osd", INTRINSICS).into_iter().chain(std::iter::repeat_n(desk(), 8).flatten()).collect();
    let (mut hits, mut wrong, mut all) = (0, 0, 0);
    for (i, frame) in frames.iter().enumerate() {
        for k in 0..4 {
            // Spread evenly, in front of what is there.
            let at = |step: f64, from: f64, to: f64| from + ((4 * i + k) as f64 * step).fract() * (to - from);
            let (u, v, z) = (at(0.7549, 60.0, 580.0), at(0.5698, 60.0, 420.0), at(0.6180, 0.45, 1.9));
            let free = frame.depth_at(u as i32, v as i32).unwrap_or(f64::INFINITY);
            let intrinsics = *frame.intrinsics();
            let z = z.min(free - 0.08).max(0.45);
            let ball = Sphere {
                light: [1.0, 0.3, 2.2, 1.0][k],
                ..Sphere::red(Point3::from(intrinsics.deproject(u, v, z).coords))
            };
            let (colour, depth) = (frame.colour().clone(), frame.depth().clone());
            let mut scene = Scene { colour, depth, intrinsics };
            scene.add(&ball);
            if k == 3 {
                scene.blur(1.5);
            }
            scene.add_cable((u, v), at(0.33, -3.0, 0.0), 2, [20.0, 230.0][i % 2]);
            scene.add_noise(6);
            let (found, truth) = (detect(&scene.frame()), ball.seen(&intrinsics));
            let hit = miss(found, &truth) < 0.5;
            all += 1;
            hits += usize::from(hit);
            wrong += usize::from(found.is_some() && !hit);
        }
    }
    println!("{hits} of {all} found, {wrong} wrong");
    assert!(hits * 100 >= all * 97, "{hits} of {all} found");
    assert!(wrong * 100 <= all, "{wrong} of {all} are something else");
}

/// Means of e' C⁻¹ e of centres in the picture and of the covariances' traces, of balls before a wall of many colours, seen
/// through `spoil`.
fn consistency(spoil: impl Fn(&mut Scene, &Detection)) -> [f64; 2] {
    let mut wall = Scene::wall(2.0);
    wall.each_pixel(|_, (u, v), pixel, _| {
        let bright = [30, 75, 120, 165, 210][((u / 23 + v / 31) % 5) as usize];
        *pixel = [bright, 255 - bright, bright / 2 + 40 * (u / 47 % 2) as u8].into();
    });
    let mut means = [0.0; 2];
    for i in 0..24 {
        let k = f64::from(i);
        let ball = ball_at(90.3 + 19.7 * k, 120.2 + 83.3 * f64::from(i % 4), 0.8 + 0.1 * f64::from(i % 5));
        let (mut scene, truth) = (wall.clone(), ball.seen(&INTRINSICS));
        scene.add(&ball);
        spoil(&mut scene, &truth);
        scene.add_noise(4);
        let found = detect(&scene.frame()).unwrap_or_else(|| panic!("ball {i} is not found"));
        let error = Vector2::new(found.u - truth.u, found.v - truth.v);
        let normalised = error.dot(&(found.covariance.try_inverse().unwrap() * error));
        means[0] += normalised / 24.0;
        means[1] += found.covariance.trace() / 24.0;
    }
    means
}

#[test]
fn the_covariance_is_not_much_larger_than_errors_are_and_not_smaller() {
    let sharp = consistency(|_, _| ());
    let smeared = consistency(|scene, truth| {
        scene.add_cable((truth.u, truth.v), 0.9, 5, 20.0);
        scene.blur(3.0);
    });
    // 2 on the average where it is just right; ten times too small it would be 2.5 here at least.
    for (name, [normalised, _]) in [("sharp", sharp), ("smeared", smeared)] {
        assert!((0.1..2.0).contains(&normalised), "{name}: {normalised}");
    }
    assert!(smeared[1] > 2.0 * sharp[1], "{smeared:?} {sharp:?}");
}
