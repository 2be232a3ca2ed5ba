use nalgebra::UnitQuaternion;
use plumb_frame::camera::Camera;
use plumb_frame::image::Image;

use super::*;

const WORKSPACE: Corners = [[0.1, 0.1, 0.05], [0.8, 0.5, 0.6]];

/// Returns a camera at `x` = 1.7 m that looks along -x, or one above that looks down.
fn camera(looks_down: bool) -> Camera {
    let (fx, fy, cx, cy, depth_scale) = (525.0, 525.0, 319.5, 239.5, 1000.0);
    let lens = Intrinsics { fx, fy, cx, cy, depth_scale, distortion: None };
    let pose = if looks_down {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts(Vector3::new(0.45, 0.3, 1.8).into(), turn)
    } else {
        let turn = nalgebra::Quaternion::new(0.5, -0.5, -0.5, 0.5);
        let turn = UnitQuaternion::from_quaternion(turn);
        Isometry3::from_parts(Vector3::new(1.7, 0.3, 0.3).into(), turn)
    };
    Camera::new(lens, pose, 0.08)
}

/// Returns a frame whose depth is `depth` millimetres everywhere.
fn frame(camera: &Camera, depth: u16) -> RgbdFrame {
    let (colour, depths) = (Image::filled(640, 480, [90; 3]), Image::filled(640, 480, depth));
    RgbdFrame::new(0.0, colour, depths, camera.intrinsics).unwrap()
}

fn click(pixel: [f64; 2], through: [f64; 3]) -> Click {
    Click { pixel, through, with_depth: true }
}

#[test]
fn a_click_where_a_point_of_the_plane_is_seen_means_that_point() {
    for (looks_down, axis) in [(false, "x"), (true, "z")] {
        let camera = camera(looks_down);
        let sight = Sight::of(&camera);
        let frame = frame(&camera, 0);
        for point in [Point3::new(0.4, 0.2, 0.15), Point3::new(0.7, 0.45, 0.5)] {
            let (u, v) =
                camera.intrinsics.project(&camera.pose.inverse_transform_point(&point)).unwrap();
            let click = click([u, v], point.into());
            let (found, by) = sight.point(&frame, None, &WORKSPACE, &click).unwrap();
            assert!((found - point).norm() < 1e-9, "{found} in place of {point}");
            assert_eq!(by, Source::Plane);
            let pixel = sight.pixel(&camera.intrinsics, &point).unwrap();
            assert!((pixel[0] - u).hypot(pixel[1] - v) < 0.1);
            let plane = sight.plane(&camera.intrinsics, &WORKSPACE, &point);
            assert_eq!((plane.axis, plane.lines.len()), (axis, 2 * (PARTS + 1)));
            assert!(plane.lines.iter().flatten().all(Option::is_some));
            assert_eq!(serde_json::to_string(&sight).unwrap(), format!("{axis:?}"));
        }
    }
}

#[test]
fn with_depth_a_click_means_the_ball_that_touches_the_surface() {
    let camera = camera(false);
    let sight = Sight::of(&camera);
    let frame = frame(&camera, 1200);
    let middle = click([319.5, 239.5], [0.2, 0.3, 0.3]);
    let (point, by) = sight.point(&frame, None, &WORKSPACE, &middle).unwrap();
    // The surface is at x = 0.5 m, and the ball's radius 40 mm.
    assert!((point - Point3::new(0.54, 0.3, 0.3)).norm() < 1e-6, "{point}");
    assert_eq!(by, Source::Depth);
    let without = Click { with_depth: false, ..middle };
    let (point, by) = sight.point(&frame, None, &WORKSPACE, &without).unwrap();
    assert!((point.x, by) == (0.2, Source::Plane));
    // A wall behind the workspace is no target.
    let frame = super::tests::frame(&camera, 3000);
    assert_eq!(sight.point(&frame, None, &WORKSPACE, &middle).unwrap().1, Source::Plane);
}

#[test]
fn a_click_on_the_ball_means_its_place() {
    let camera = camera(false);
    let frame = frame(&camera, 1200);
    let ball = SeenBall { circle: [319.5, 239.5, 18.0], position: [0.5, 0.3, 0.3] };
    let click = click([325.0, 235.0], [0.2, 0.3, 0.3]);
    let found = Sight::of(&camera).point(&frame, Some(&ball), &WORKSPACE, &click).unwrap();
    assert_eq!(found, (Point3::new(0.5, 0.3, 0.3), Source::Ball));
}

#[test]
fn a_click_that_means_no_point_of_the_workspace_is_refused_in_words() {
    let camera = camera(false);
    let sight = Sight::of(&camera);
    let frame = frame(&camera, 0);
    let refused =
        |pixel, through| sight.point(&frame, None, &WORKSPACE, &click(pixel, through)).unwrap_err();
    for (pixel, through, wanted) in [
        ([0.0, 0.0], [0.4, 0.3, 0.3], "outside the workspace"),
        ([320.0, 240.0], [0.9, 0.3, 0.3], "outside the workspace"),
        ([320.0, 240.0], [1.7, 0.3, 0.3], "does not meet the plane"),
        ([320.0, 240.0], [1e300, 0.3, 0.3], "does not meet the plane"),
        ([-1.0, 240.0], [0.4, 0.3, 0.3], "outside the picture of 640x480 pixels"),
        ([639.5, 240.0], [0.4, 0.3, 0.3], "outside the picture"),
        ([320.0, 1e300], [0.4, 0.3, 0.3], "outside the picture"),
        ([f64::NAN, 240.0], [0.4, 0.3, 0.3], "outside the picture"),
    ] {
        let text = refused(pixel, through);
        assert!(text.contains(wanted) && text.len() < 200, "{text}");
    }
    assert_eq!(sight.pixel(&camera.intrinsics, &Point3::new(2.0, 0.3, 0.3)), None);
}

#[test]
fn a_place_without_a_ray_is_refused() {
    let mut camera = camera(false);
    let coefficients = plumb_frame::camera::DistortionCoefficients {
        k1: -0.5,
        k2: 0.1,
        p1: 0.0,
        p2: 0.0,
        k3: 0.0,
    };
    camera.intrinsics.distortion = plumb_frame::camera::Distortion::new(coefficients);
    let frame = frame(&camera, 0);
    let click = click([2.0, 2.0], [0.4, 0.3, 0.3]);
    let text = Sight::of(&camera).point(&frame, None, &WORKSPACE, &click).unwrap_err();
    assert!(text.contains("lens"), "{text}");
}
