//! The pose from a rendered board, with noise.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use plumb_calibrate::board::{CharucoSheet, Placement};
use plumb_calibrate::board_pose::{BoardView, SeenCorner, average, pose_from_board};
use plumb_calibrate::calibration::{CalibrationError, Grade};
use plumb_calibrate::corners::{SheetError, find_corners};
use plumb_calibrate::render::draw_board;
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{ColourImage, DepthImage, Image};
use plumb_frame::render::Scene;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const INTRINSICS: Intrinsics = Intrinsics {
    fx: 525.0,
    fy: 525.0,
    cx: 319.5,
    cy: 239.5,
    depth_scale: 5000.0,
    distortion: None,
};

/// Returns a number from a normal distribution with standard deviation 1.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Returns the pose of a board in camera axes whose middle is `distance` metres away, at about the
/// pixel (`u`, `v`), tilted by `tilt` radians about the direction `about` and turned by `turn`.
fn placed([u, v]: [f64; 2], distance: f64, [tilt, about, turn]: [f64; 3]) -> Isometry3<f64> {
    let axis = nalgebra::Unit::new_normalize(Vector3::new(about.cos(), about.sin(), 0.0));
    // Face on, the board's y axis points against the rows.
    let face_on = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let rotation = UnitQuaternion::from_axis_angle(&axis, tilt)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn)
        * face_on;
    let [w, h] = CharucoSheet::SHEET.size();
    let middle = Vector3::new(w / 2.0, h / 2.0, 0.0);
    let centre = INTRINSICS.deproject(u, v, distance).coords;
    Isometry3::from_parts(Translation3::from(centre - rotation * middle), rotation)
}

/// Renders a board before a wall, with noise of 2 grey levels and of 1.4 mm z² in depth.
fn frame(pose: &Isometry3<f64>, random: &mut ChaCha8Rng) -> RgbdFrame {
    let mut scene = Scene::wall(640, 480, INTRINSICS, 3.0);
    draw_board((&mut scene.colour, &mut scene.depth), &INTRINSICS, &CharucoSheet::SHEET, pose);
    for grey in scene.colour.channels_mut() {
        *grey = (f64::from(*grey) + 2.0 * normal(random)).round().clamp(0.0, 255.0) as u8;
    }
    for raw in scene.depth.pixels_mut() {
        let z = f64::from(*raw) / INTRINSICS.depth_scale;
        let noisy = z + 0.0014 * z * z * normal(random);
        *raw = (noisy * INTRINSICS.depth_scale).round() as u16;
    }
    scene.frame(0.0).unwrap()
}

fn without_depth(frame: &RgbdFrame) -> RgbdFrame {
    let depth = DepthImage::filled(640, 480, 0);
    RgbdFrame::new(0.0, frame.colour().clone(), depth, INTRINSICS).unwrap()
}

fn seen(frames: &[RgbdFrame]) -> Vec<SeenCorner> {
    let view = |frame: &RgbdFrame| {
        BoardView::new(&find_corners(frame.colour(), &CharucoSheet::SHEET).unwrap(), frame)
    };
    let views: Vec<_> = frames.iter().map(view).collect();
    average(&views, &CharucoSheet::SHEET).unwrap()
}

#[test]
fn the_pose_is_recovered_at_many_poses() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut worst_position, mut worst_rotation): (f64, f64) = (0.0, 0.0);
    for number in 0..40 {
        let pixel = [random.random_range(220.0..420.0), random.random_range(180.0..300.0)];
        let distance = random.random_range(0.55..1.3);
        let angles = [
            random.random_range(0.3..0.9),
            random.random_range(0.0..std::f64::consts::TAU),
            random.random_range(0.0..std::f64::consts::TAU),
        ];
        let pose = placed(pixel, distance, angles);
        let frames: Vec<_> = (0..3).map(|_| frame(&pose, &mut random)).collect();
        let found = pose_from_board(&seen(&frames), &INTRINSICS, &Placement::AT_ORIGIN).unwrap();
        assert_eq!(found.grade(), Grade::Good, "{number}: {found:?}");
        let error = found.pose * pose;
        let centre = Point3::new(0.126, 0.09, 0.0);
        let position = (error * centre - centre).norm();
        worst_position = worst_position.max(position);
        worst_rotation = worst_rotation.max(error.rotation.angle());
    }
    assert!(worst_position < 0.006, "{worst_position}");
    assert!(worst_rotation < 1.0_f64.to_radians(), "{worst_rotation}");
}

#[test]
fn the_pose_is_recovered_without_depth() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let pose = placed([300.0, 250.0], 0.8, [0.6, 0.4, 0.2]);
    let frame = without_depth(&frame(&pose, &mut random));
    let found = pose_from_board(&seen(&[frame]), &INTRINSICS, &Placement::AT_ORIGIN).unwrap();
    let error = found.pose * pose;
    assert!(error.translation.vector.norm() < 0.005, "{error}");
    assert!(error.rotation.angle() < 0.012, "{error}");
    assert!(found.findings[0].contains("no depth"), "{:?}", found.findings);
}

#[test]
fn the_placement_moves_the_pose() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let pose = placed([300.0, 250.0], 0.8, [0.6, 0.4, 0.2]);
    let corners = seen(&[frame(&pose, &mut random)]);
    let placement = Placement { origin: Point3::new(0.4, 0.2, 0.1), turn: 0.7, is_upright: true };
    let at_origin = pose_from_board(&corners, &INTRINSICS, &Placement::AT_ORIGIN).unwrap();
    let moved = pose_from_board(&corners, &INTRINSICS, &placement).unwrap();
    let expected = placement.pose() * at_origin.pose;
    assert!((moved.pose.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12);
}

#[test]
fn a_covered_part_and_other_black_squares_do_no_harm() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let pose = placed([320.0, 240.0], 0.7, [0.5, 1.0, 0.3]);
    let frame = frame(&pose, &mut random);
    let width = 640;
    let colour = frame.colour().pixels().iter().enumerate().map(|(i, &pixel)| {
        let (u, v) = (i % width, i / width);
        let is_covered = (250..330).contains(&u) && (150..230).contains(&v);
        let is_square = (40..90).contains(&u) && (300..350).contains(&v);
        if is_covered || is_square { [20, 30, 60] } else { pixel }
    });
    let colour = ColourImage::new(640, 480, colour.collect()).unwrap();
    let frame = RgbdFrame::new(0.0, colour, frame.depth().clone(), INTRINSICS).unwrap();
    let found = pose_from_board(&seen(&[frame]), &INTRINSICS, &Placement::AT_ORIGIN).unwrap();
    let error = found.pose * pose;
    assert!(error.translation.vector.norm() < 0.006, "{error} {found:?}");
    assert!(error.rotation.angle() < 0.015, "{error}");
}

#[test]
fn a_board_that_was_printed_too_small_is_reported() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let pose = placed([320.0, 240.0], 0.7, [0.5, 1.0, 0.3]);
    let corners = find_corners(frame(&pose, &mut random).colour(), &CharucoSheet::SHEET).unwrap();
    // The user says 34 mm, the squares are 36 mm.
    let board = CharucoSheet::with_square(0.034).unwrap();
    let view = BoardView::new(&corners, &frame(&pose, &mut random));
    let seen = average(&[view], &board).unwrap();
    let found = pose_from_board(&seen, &INTRINSICS, &Placement::AT_ORIGIN).unwrap();
    assert!(found.findings[0].contains("farther than the size of its squares"), "{found:?}");
}

#[test]
fn images_without_a_board_or_with_a_mirrored_one_are_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let empty = Image::filled(640, 480, [120; 3]);
    let error = find_corners(&empty, &CharucoSheet::SHEET).unwrap_err();
    assert!(matches!(error, SheetError::NotSeen { markers: 0 }), "{error}");

    let pose = placed([320.0, 240.0], 0.7, [0.5, 1.0, 0.3]);
    let colour = frame(&pose, &mut random).colour().clone();
    let mirrored = Image::from_fn(640, 480, |u, v| colour.get(639 - u, v).unwrap());
    let error = find_corners(&mirrored, &CharucoSheet::SHEET).unwrap_err();
    assert!(matches!(error, SheetError::Mirrored), "{error}");
}

/// Returns a picture of a board, face on, whose squares have this side, pixels. Its markers have 5
/// by 5 cells in a black border, as in OpenCV's dictionaries `DICT_5X5`.
fn board_of_another_dictionary(side: usize) -> ColourImage {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let codes: Vec<u32> = (0..64).map(|_| random.random()).collect();
    Image::from_fn(640, 480, |u, v| {
        let (column, row) = (u / side, v / side);
        let (x, y) = (u % side, v % side);
        let margin = side / 8;
        let is_marker = (column + row) % 2 == 1;
        let is_inner = |k: usize| (margin..side - margin).contains(&k);
        let is_black = if !is_marker {
            true
        } else if is_inner(x) && is_inner(y) {
            let cell = |k: usize| (k - margin) * 7 / (side - 2 * margin);
            let is_border = |k: usize| k == 0 || k == 6;
            let (cell_x, cell_y) = (cell(x), cell(y));
            let bit = || codes[row * 8 + column] >> ((cell_y - 1) * 5 + cell_x - 1) & 1 == 0;
            is_border(cell_x) || is_border(cell_y) || bit()
        } else {
            false
        };
        [if is_black { 35 } else { 215 }; 3]
    })
}

#[test]
fn another_board_is_named() {
    let error = find_corners(&board_of_another_dictionary(80), &CharucoSheet::SHEET).unwrap_err();
    // A code of 5 by 5 cells may be read as one of 4 by 4.
    assert!(matches!(error, SheetError::Other { unknown: 20.., misplaced: ..4 }), "{error}");

    // The same markers at other places: columns of squares are exchanged.
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let distance = 0.4;
    let pose = placed([319.5, 239.5], distance, [0.0; 3]);
    let colour = frame(&pose, &mut random).colour().clone();
    find_corners(&colour, &CharucoSheet::SHEET).unwrap();
    let square = CharucoSheet::SHEET.square() * INTRINSICS.fx / distance;
    let left = 319.5 - 3.5 * square;
    let exchanged = Image::from_fn(640, 480, |u, v| {
        let column = ((u as f64 - left) / square).floor();
        let moved = match column as i32 {
            0 | 3 if column >= 0.0 => 2.0 * square,
            2 | 5 => -2.0 * square,
            _ => 0.0,
        };
        colour.get((u as f64 + moved).round() as usize, v).unwrap()
    });
    let error = find_corners(&exchanged, &CharucoSheet::SHEET).unwrap_err();
    assert!(matches!(error, SheetError::Other { unknown: 0, misplaced: 8.. }), "{error}");

    // A few markers of another board beside the whole one do not matter.
    let far = placed([220.0, 240.0], 0.7, [0.1, 1.0, 0.0]);
    let colour = frame(&far, &mut random).colour().clone();
    let other = board_of_another_dictionary(80);
    let both = Image::from_fn(640, 480, |u, v| {
        if u < 480 { colour.get(u, v).unwrap() } else { other.get(u, v).unwrap() }
    });
    assert!(find_corners(&both, &CharucoSheet::SHEET).unwrap().len() > 20);
}

#[test]
fn a_board_that_moves_is_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let views = [300.0, 306.0].map(|u| {
        let frame = frame(&placed([u, 240.0], 0.7, [0.5, 1.0, 0.3]), &mut random);
        BoardView::new(&find_corners(frame.colour(), &CharucoSheet::SHEET).unwrap(), &frame)
    });
    let error = average(&views, &CharucoSheet::SHEET).unwrap_err();
    assert!(matches!(error, CalibrationError::Moved { .. }), "{error}");
}

#[test]
fn a_far_board_without_depth_is_ambiguous() {
    let pose = placed([320.0, 240.0], 4.0, [0.2, 1.0, 0.3]);
    let corner = |(id, board): (usize, nalgebra::Point2<f64>)| {
        let (u, v) = INTRINSICS.project(&(pose * Point3::new(board.x, board.y, 0.0))).unwrap();
        SeenCorner { id, board, image: nalgebra::Point2::new(u, v), depth: None }
    };
    let corners: Vec<_> =
        CharucoSheet::SHEET.corners().into_iter().enumerate().map(corner).collect();
    let error = pose_from_board(&corners, &INTRINSICS, &Placement::AT_ORIGIN).unwrap_err();
    assert_eq!(error, CalibrationError::Ambiguous);
}
