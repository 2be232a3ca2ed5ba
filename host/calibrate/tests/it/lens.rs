//! Intrinsics and distortion from views of the board: 200 synthetic lenses, and what is refused.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use nalgebra::{Isometry3, Point2, Point3};
use plumb_calibrate::board::CharucoSheet;
use plumb_calibrate::board_pose::SeenCorner;
use plumb_calibrate::calibration::Grade;
use plumb_calibrate::corners::find_corners;
use plumb_calibrate::lens::{LensCalibration, LensError, LensView, calibrate_lens};
use plumb_calibrate::render::{draw_board, shown_pose};
use plumb_frame::camera::{Distortion, DistortionCoefficients, Intrinsics};
use plumb_frame::image::ImageSize;
use plumb_frame::render::Scene;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SIZE: ImageSize = ImageSize { width: 640, height: 480 };
/// Standard deviation of a corner along each axis, pixels.
const NOISE: f64 = 0.15;
/// Views of each lens.
const VIEWS: u32 = 16;

/// Returns a lens of 50 to 65 degrees of view with a barrel distortion.
fn random_lens(random: &mut ChaCha8Rng) -> Intrinsics {
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    let focal = between(500.0, 680.0);
    let coefficients = DistortionCoefficients {
        k1: between(-0.3, 0.05),
        k2: between(0.06, 0.12),
        p1: between(-0.002, 0.002),
        p2: between(-0.002, 0.002),
        k3: 0.0,
    };
    Intrinsics {
        fx: focal,
        fy: focal * between(0.995, 1.005),
        cx: 319.5 + between(-15.0, 15.0),
        cy: 239.5 + between(-15.0, 15.0),
        depth_scale: 0.0,
        distortion: Distortion::new(coefficients),
    }
}

/// Returns the corners of the board that are in the picture, with noise.
fn view(
    lens: &Intrinsics,
    pose: &Isometry3<f64>,
    number: u32,
    random: &mut ChaCha8Rng,
) -> LensView {
    let corners =
        CharucoSheet::SHEET.corners().into_iter().enumerate().filter_map(|(id, board)| {
            let (u, v) = lens.project(&(pose * Point3::new(board.x, board.y, 0.0)))?;
            let mut noise = || NOISE * random.sample::<f64, _>(StandardNormal);
            let image = Point2::new(u + noise(), v + noise());
            let is_inside = (4.0..636.0).contains(&image.x) && (4.0..476.0).contains(&image.y);
            is_inside.then_some(SeenCorner { id, board, image, depth: None })
        });
    LensView { name: format!("{number}"), corners: corners.collect() }
}

fn views(lens: &Intrinsics, seed: u64) -> Vec<LensView> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let first = random.random_range(0..1000);
    let pose = |number: u32| shown_pose(lens, SIZE, &CharucoSheet::SHEET, number);
    (first..first + VIEWS).map(|number| view(lens, &pose(number), number, &mut random)).collect()
}

/// Returns the largest distance, pixels, between where two lenses see the rays of a picture, when
/// the second one is turned so that the rays in the middle agree.
fn largest_difference(a: &Intrinsics, b: &Intrinsics) -> f64 {
    let places = (0..=8).flat_map(|i| (0..=6).map(move |j| (i, j)));
    let rays: Vec<_> = places
        .map(|(i, j)| {
            let (u, v) = (80.0 * f64::from(i), 80.0 * f64::from(j));
            (b.deproject(u, v, 1.0), Point2::new(u, v))
        })
        .collect();
    let differences: Vec<_> = rays
        .iter()
        .filter_map(|(ray, seen)| a.project(ray).map(|(u, v)| Point2::new(u, v) - seen))
        .collect();
    let mean = differences.iter().sum::<nalgebra::Vector2<f64>>() / differences.len() as f64;
    differences.iter().map(|it| (it - mean).norm()).fold(0.0, f64::max)
}

/// Returns the median and the 95 % quantile.
fn quantiles(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [values[values.len() / 2], values[values.len() * 95 / 100]]
}

#[test]
fn two_hundred_lenses_are_estimated() {
    let (mut focal, mut centre, mut k1, mut picture, mut scaled) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for seed in 0..200 {
        let lens = random_lens(&mut ChaCha8Rng::seed_from_u64(seed));
        let found = calibrate_lens(&views(&lens, 1000 + seed), SIZE).unwrap();
        assert_ne!(found.grade(), Grade::Poor, "seed {seed}: {found:?}");
        let LensCalibration { intrinsics, focal_sd, rms, held_out, .. } = found;
        assert!((0.7..1.3).contains(&(rms / (NOISE * 2.0_f64.sqrt()))), "seed {seed}: {rms}");
        assert!(held_out < 2.0 * rms, "seed {seed}: {held_out} with {rms}");
        focal.push((intrinsics.fx / lens.fx - 1.0).abs());
        centre.push((intrinsics.cx - lens.cx).hypot(intrinsics.cy - lens.cy));
        let coefficient = |it: &Intrinsics| it.distortion.unwrap().coefficients().k1;
        k1.push((coefficient(&intrinsics) - coefficient(&lens)).abs());
        picture.push(largest_difference(&intrinsics, &lens));
        scaled.push((intrinsics.fx - lens.fx).abs() / focal_sd);
    }
    let all = [focal, centre, k1, picture, scaled].map(quantiles);
    println!("median and 95 %: f, c (px), k1, anywhere in the picture (px), f in its sd: {all:?}");
    let limits = [[0.002, 0.005], [2.0, 4.0], [0.003, 0.01], [1.3, 2.8], [0.9, 2.3]];
    for (found, limit) in all.iter().zip(limits) {
        assert!(found[0] < limit[0] && found[1] < limit[1], "{found:?} above {limit:?}");
    }
}

#[test]
fn wrong_corners_are_left_out_and_a_bad_view_is_named() {
    let lens = random_lens(&mut ChaCha8Rng::seed_from_u64(7));
    let mut views = views(&lens, 7);
    views[2].corners[3].image.x += 9.0;
    for (k, corner) in views[5].corners.iter_mut().enumerate() {
        corner.image.y += if k % 2 == 0 { 0.8 } else { -0.8 };
    }
    let found = calibrate_lens(&views, SIZE).unwrap();
    assert!(found.outliers >= 1, "{}", found.outliers);
    assert!((found.intrinsics.fx / lens.fx - 1.0).abs() < 0.01, "{:?}", found.intrinsics);
    let name = format!("{} fits worse", views[5].name);
    assert!(found.findings.iter().any(|text| text.starts_with(&name)), "{:?}", found.findings);
}

#[test]
fn views_that_do_not_suffice_are_refused_or_graded_poor() {
    let lens = random_lens(&mut ChaCha8Rng::seed_from_u64(8));
    let views = views(&lens, 8);
    let few = calibrate_lens(&views[..4], SIZE).unwrap_err();
    assert!(matches!(few, LensError::TooFewViews { found: 4 }), "{few:?}");
    // The board face on at one distance does not determine the focal length.
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let flat: Vec<_> = (0..12)
        .map(|n| {
            let mut pose = shown_pose(&lens, SIZE, &CharucoSheet::SHEET, n);
            let face_on =
                nalgebra::UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
            pose.rotation = face_on;
            let shift = 0.01 * f64::from(n);
            pose.translation.vector = [-0.15 + shift, 0.08 - shift / 2.0, 0.5].into();
            view(&lens, &pose, n, &mut random)
        })
        .collect();
    let found = calibrate_lens(&flat, SIZE);
    assert!(found.as_ref().is_err() || found.as_ref().unwrap().grade() == Grade::Poor, "{found:?}");
}

#[test]
fn a_lens_is_estimated_from_rendered_pictures() {
    let (k1, k2, p1, p2, k3) = (-0.3, 0.1, 0.001, -0.001, 0.0);
    let distortion = Distortion::new(DistortionCoefficients { k1, k2, p1, p2, k3 });
    let (fx, fy, cx, cy) = (525.0, 527.0, 325.0, 236.0);
    let lens = Intrinsics { fx, fy, cx, cy, depth_scale: 1000.0, distortion };
    let mut views = Vec::new();
    for number in 0..VIEWS {
        let pose = shown_pose(&lens, SIZE, &CharucoSheet::SHEET, number);
        let mut scene = Scene::wall(SIZE.width, SIZE.height, lens, 3.0);
        draw_board((&mut scene.colour, &mut scene.depth), &lens, &CharucoSheet::SHEET, &pose);
        let Ok(corners) = find_corners(&scene.colour, &CharucoSheet::SHEET) else { continue };
        let places = CharucoSheet::SHEET.corners();
        let seen = corners.iter().map(|corner| {
            let (id, image) = (corner.id, corner.image);
            SeenCorner { id, board: places[id], image, depth: None }
        });
        views.push(LensView { name: format!("{number}"), corners: seen.collect() });
    }
    let count: usize = views.iter().map(|view| view.corners.len()).sum();
    println!("{} views, {count} corners", views.len());
    assert!(views.len() > 12 && count > 200, "{} views, {count} corners", views.len());
    let found = calibrate_lens(&views, SIZE).unwrap();
    println!("{:?}, rms {}, held out {}", found.intrinsics, found.rms, found.held_out);
    let difference = largest_difference(&found.intrinsics, &lens);
    println!("difference {difference}, coverage {}, {:?}", found.coverage, found.findings);
    assert!(difference < 1.0 && found.grade() != Grade::Poor, "{difference}: {found:?}");
}
