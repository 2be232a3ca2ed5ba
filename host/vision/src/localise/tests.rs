//! Localisation on rendered depth.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::render::{Ball, Scene};

const INTRINSICS: Intrinsics = Intrinsics {
    fx: 525.0,
    fy: 520.0,
    cx: 159.5,
    cy: 119.5,
    depth_scale: 10_000.0,
    distortion: None,
};

fn camera(ball_radius: f64) -> Camera {
    let pose = Isometry3::new(Vector3::new(1.0, -0.5, 0.3), Vector3::new(0.3, -1.2, 0.8));
    Camera::new(INTRINSICS, pose, 2.0 * ball_radius)
}

/// Renders the depth of a sphere in front of a wall 3 m away; `replace` gives the raw depth of
/// pixels that show something else.
fn render(
    centre: &Point3<f64>,
    radius: f64,
    replace: impl Fn(i32, i32) -> Option<u16>,
) -> RgbdFrame {
    let mut scene = Scene::wall(320, 240, INTRINSICS, 3.0);
    scene.add(&Ball::red(*centre, radius));
    scene.each_pixel(|_, (u, v), _, depth| *depth = replace(u, v).unwrap_or(*depth));
    scene.frame(0.0).unwrap()
}

fn circle(centre: &Point3<f64>, ball_radius: f64) -> Circle {
    let (u, v) = INTRINSICS.project(centre).unwrap();
    Circle::rough(u, v, 520.0 * ball_radius / centre.z)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_rendered_sphere_is_localised_within_a_millimetre(
        z in 0.4..2.0f64, x in -0.15..0.15f64, y in -0.1..0.1f64, radius in 0.015..0.04f64,
        holes in 0..3i32, side in prop::bool::ANY,
    ) {
        let centre = Point3::new(x * z, y * z, z);
        let middle = INTRINSICS.project(&centre).unwrap().0 as i32;
        // Holes in a pattern, and half of the ball without depth: the rest must say the same.
        let frame = render(&centre, radius, |u, v| {
            let hole = (u + 2 * v) % 4 < holes || (side && u < middle);
            hole.then_some(0)
        });
        let camera = camera(radius);
        let found = localise(&circle(&centre, radius), &frame, &camera).unwrap();
        prop_assert!((camera.depth_of(&found.mean) - z).abs() < 1e-3, "{found:?} {z}");
        prop_assert!((found.mean - camera.pose * centre).norm() < 1e-3);
    }

    #[test]
    fn an_object_in_front_of_a_third_of_it_does_not_matter(
        z in 0.5..1.5f64, near in 0.1..0.3f64,
    ) {
        let centre = Point3::new(0.02, 0.01, z);
        let seen = circle(&centre, 0.03);
        let edge = (seen.u - 0.3 * seen.radius) as i32;
        let cover = ((z - near) * INTRINSICS.depth_scale) as u16;
        let frame = render(&centre, 0.03, |u, _| (u < edge).then_some(cover));
        let camera = camera(0.03);
        let found = localise(&seen, &frame, &camera).unwrap();
        prop_assert!((camera.depth_of(&found.mean) - z).abs() < 2e-3, "{found:?} {z}");
    }
}

#[test]
fn a_larger_object_in_front_is_not_taken_for_the_ball() {
    // Two thirds of it are hidden, but at that depth it would be seen twice as large.
    let centre = Point3::new(0.02, 0.01, 1.0);
    let seen = circle(&centre, 0.03);
    let edge = (seen.u + 0.3 * seen.radius) as i32;
    let frame = render(&centre, 0.03, |u, _| (u < edge).then_some(5000));
    let camera = camera(0.03);
    let found = localise(&seen, &frame, &camera).unwrap();
    assert!((camera.depth_of(&found.mean) - 1.0).abs() < 2e-3, "{found:?}");
}

#[test]
fn the_covariance_combines_pixels_and_depth_in_the_rig_frame() {
    let centre = Point3::new(0.0, 0.0, 1.3);
    let mut seen = circle(&centre, 0.03);
    seen.covariance = Matrix3::from_diagonal(&[4.0, 1.0, 9.0].into());
    let (frame, camera) = (render(&centre, 0.03, |_, _| None), camera(0.03));
    let found = localise(&seen, &frame, &camera).unwrap();
    let sd = |axis: Vector3<f64>| {
        let axis = camera.pose.rotation * axis;
        axis.dot(&(found.covariance * axis)).sqrt()
    };
    assert!((sd(Vector3::x()) / (2.0 * 1.3 / 525.0) - 1.0).abs() < 0.01);
    assert!((sd(Vector3::y()) / (1.3 / 520.0) - 1.0).abs() < 0.01);
    assert!((0.000_5..0.002).contains(&sd(Vector3::z())), "{}", sd(Vector3::z()));
}

#[test]
fn too_little_depth_gives_no_position() {
    let centre = Point3::new(0.0, 0.0, 1.0);
    let seen = circle(&centre, 0.03);
    let dotted =
        |every: i32| render(&centre, 0.03, move |u, v| (u % every + v % every != 0).then_some(0));
    assert!(localise(&seen, &dotted(2), &camera(0.03)).is_some());
    assert!(localise(&seen, &dotted(4), &camera(0.03)).is_none());
    let outside = Circle { u: -50.0, ..seen };
    assert!(localise(&outside, &dotted(1), &camera(0.03)).is_none());
    let absurd = Circle { radius: f64::NAN, ..seen };
    assert!(localise(&absurd, &dotted(1), &camera(0.03)).is_none());
}

/// Returns the circle that a ball is seen as by its outline: the cone about the ball.
fn outline(centre: &Point3<f64>, ball_radius: f64) -> Circle {
    let (u, v) = INTRINSICS.project(centre).unwrap();
    let distance = centre.coords.norm();
    let tangent = (ball_radius / distance).asin().tan();
    Circle::rough(u, v, INTRINSICS.focal() * tangent * distance / centre.z)
}

proptest! {
    #[test]
    fn the_cone_through_the_outline_gives_the_position(
        z in 0.2..3.0f64, x in -0.8..0.8f64, y in -0.6..0.6f64, radius in 0.01..0.1f64,
    ) {
        let (centre, camera) = (Point3::new(x * z, y * z, z), camera(radius));
        let found = localise_by_outline(&outline(&centre, radius), &INTRINSICS, &camera).unwrap();
        prop_assert!((found.mean - camera.pose * centre).norm() < 1e-9, "{found}");
    }

    #[test]
    fn the_covariance_without_depth_is_that_of_small_changes_of_the_circle(
        z in 0.4..2.0f64, x in -0.5..0.5f64, y in -0.4..0.4f64,
    ) {
        let (centre, camera) = (Point3::new(x * z, y * z, z), camera(0.03));
        let mut seen = outline(&centre, 0.03);
        // A ball whose right side is covered: larger where it is farther to the right.
        let factor = Matrix3::new(0.3, 0.0, 0.0, 0.0, 0.1, 0.0, 0.25, 0.02, 0.1);
        seen.covariance = factor * factor.transpose();
        let at = |circle| localise_by_outline(&circle, &INTRINSICS, &camera).unwrap().mean;
        let mut expected = Matrix3::zeros();
        for column in factor.column_iter() {
            let step = column * 1e-4;
            let moved = Circle {
                u: seen.u + step.x, v: seen.v + step.y, radius: seen.radius + step.z, ..seen
            };
            let change = (at(moved) - at(seen)) / 1e-4;
            expected += change * change.transpose();
        }
        let found = localise_by_outline(&seen, &INTRINSICS, &camera).unwrap().covariance;
        prop_assert!((found - expected).norm() < 0.02 * expected.norm(), "{found} {expected}");
    }
}

#[test]
fn the_error_along_the_ray_grows_with_the_square_of_the_distance() {
    let camera = camera(0.03);
    for z in [0.6, 1.2] {
        let mut seen = outline(&Point3::new(0.0, 0.0, z), 0.03);
        seen.covariance = Matrix3::from_diagonal(&[0.01, 0.01, 0.04].into());
        let found = localise_by_outline(&seen, &INTRINSICS, &camera).unwrap();
        let along = camera.pose.rotation * Vector3::z();
        let sd = along.dot(&(found.covariance * along)).sqrt();
        let expected = z * z / (INTRINSICS.focal() * 0.03) * 0.2;
        assert!((sd / expected - 1.0).abs() < 0.01, "{sd} {expected}");
    }
}

#[test]
fn a_camera_without_depth_takes_the_position_from_the_outline() {
    let (centre, camera) = (Point3::new(0.1, 0.05, 1.0), camera(0.03));
    let intrinsics = Intrinsics { depth_scale: 0.0, ..INTRINSICS };
    let scene = Scene::wall(320, 240, INTRINSICS, 3.0);
    let frame = RgbdFrame::new(0.0, scene.colour, scene.depth, intrinsics).unwrap();
    assert_eq!(frame.depth_at(5, 5), None);
    let seen = outline(&centre, 0.03);
    let position = observe(seen, 1.0, &frame, &camera).position.unwrap();
    assert!((position.mean - camera.pose * centre).norm() < 1e-9, "{position}");
    let absurd = Circle { radius: f64::NAN, ..seen };
    assert_eq!(observe(absurd, 1.0, &frame, &camera).position, None);
}

#[test]
fn a_planar_ball_is_where_its_ray_meets_the_plane() {
    let lens = Intrinsics { depth_scale: 0.0, ..INTRINSICS };
    let camera = Camera { is_planar: true, intrinsics: lens, ..camera(0.02) };
    let place = Point3::new(0.0, -0.9, 0.2);
    let seen = camera.pose.inverse_transform_point(&place);
    let Some((u, v)) = lens.project(&seen) else { panic!("{seen} is not in front of the camera") };
    let found = localise_on_plane(&Circle::rough(u, v, 10.0), &lens, &camera).unwrap();
    assert!((found.mean - place).norm() < 1e-9, "{found:?}");
    // The covariance is that of small changes of the pixel.
    let circle = |du: f64, dv: f64| Circle::rough(u + du, v + dv, 10.0);
    let moved = |du, dv| localise_on_plane(&circle(du, dv), &lens, &camera).unwrap().mean - place;
    let derivatives =
        Matrix3::from_columns(&[moved(1e-3, 0.0), moved(0.0, 1e-3), Vector3::zeros()]);
    let derivatives = derivatives * 1e3;
    let expected = derivatives * circle(0.0, 0.0).covariance * derivatives.transpose();
    for (i, j) in [(1, 1), (1, 2), (2, 2)] {
        let error = (found.covariance[(i, j)] - expected[(i, j)]).abs();
        assert!(error < 1e-3 * expected[(1, 1)].max(expected[(2, 2)]), "{expected}");
    }
    assert_eq!(found.covariance[(0, 0)], found.covariance[(1, 1)].max(found.covariance[(2, 2)]));
    // Behind the camera the ray meets nothing.
    let away = Camera {
        pose: camera.pose * Isometry3::rotation(Vector3::x() * std::f64::consts::PI),
        ..camera
    };
    assert_eq!(localise_on_plane(&circle(0.0, 0.0), &lens, &away), None);
}
