//! The detector `disc` on drawn ellipses.

use super::*;
use crate::detect::disc::DiscDetector;

/// An ellipse in the image.
#[derive(Clone, Copy)]
struct Drawn {
    u: f64,
    v: f64,
    /// Larger half axis, pixels.
    radius: f64,
    /// Angle between line of sight and normal, degrees.
    slant: f64,
    /// Direction of the larger half axis, radians.
    turn: f64,
}

const USUAL: Drawn = Drawn { u: 250.3, v: 200.6, radius: 22.0, slant: 40.0, turn: 0.7 };

impl Drawn {
    /// Returns the part of a pixel that is in the ellipse.
    fn coverage(&self, column: i32, row: i32) -> f64 {
        const RAYS: i32 = 8;
        let reach = self.radius + 1.0;
        if (f64::from(column) - self.u).hypot(f64::from(row) - self.v) > reach {
            return 0.0;
        }
        let offset = |k: i32| (f64::from(k) + 0.5) / f64::from(RAYS) - 0.5;
        let (sin, cos) = self.turn.sin_cos();
        let is_inside = |k: &i32| {
            let x = f64::from(column) + offset(k % RAYS) - self.u;
            let y = f64::from(row) + offset(k / RAYS) - self.v;
            let (along, across) = (x * cos + y * sin, y * cos - x * sin);
            along.hypot(across / self.slant.to_radians().cos()) < self.radius
        };
        let inside = (0..RAYS * RAYS).filter(is_inside).count();
        inside as f64 / f64::from(RAYS * RAYS)
    }
}

/// Draws shapes of one red, given as the part of a pixel that they cover, on a grey wall, without
/// depth.
fn frame(coverage: impl Fn(i32, i32) -> f64) -> RgbdFrame {
    const RED: Bgr = [40, 34, 180];
    let mut scene = wall(2.2);
    scene.each_pixel(|_, (u, v), pixel, depth| {
        let part = coverage(u, v);
        *depth = 0;
        for (channel, red) in pixel.iter_mut().zip(RED) {
            *channel = (f64::from(*channel) * (1.0 - part) + f64::from(red) * part).round() as u8;
        }
    });
    scene.add_noise(3);
    without_depth(&scene)
}

/// Returns the scene as a camera without depth sees it.
fn without_depth(scene: &Scene) -> RgbdFrame {
    let frame = scene.frame(0.0).unwrap();
    let (width, height) = (frame.colour().width(), frame.colour().height());
    let intrinsics = Intrinsics { depth_scale: 0.0, ..INTRINSICS };
    let depth = Image::filled(width, height, 0);
    RgbdFrame::new(0.0, frame.colour().clone(), depth, intrinsics).unwrap()
}

fn find(frame: &RgbdFrame) -> Option<BallObservation> {
    DiscDetector::new(&camera()).detect(frame).unwrap()
}

#[test]
fn a_disc_is_found_to_a_fraction_of_a_pixel_at_any_slant_and_turn() {
    for k in 0..6 {
        let (slant, turn) = (f64::from(10 * k), 0.5 + f64::from(k));
        for radius in [8.0, 22.0, 55.0] {
            let disc = Drawn { radius, slant, turn, ..USUAL };
            let found = find(&frame(|u, v| disc.coverage(u, v)));
            let circle = found.unwrap_or_else(|| panic!("{slant}°, {radius}")).circle;
            let off = (circle.u - disc.u).hypot(circle.v - disc.v);
            // The drawing has no perspective; the rays of the fit have that of a disc across the
            // line of sight.
            let perspective = 0.2 * radius * radius / INTRINSICS.fx;
            assert!(off < 0.12 + perspective, "{slant}°, {radius}: {off}");
            let allowed = 0.3 + 0.01 * radius;
            assert!(
                (circle.radius - radius).abs() < allowed,
                "{slant}°: {} {radius}",
                circle.radius
            );
        }
    }
}

#[test]
fn the_covariance_is_larger_along_the_smaller_half_axis_by_the_perspective() {
    let disc = Drawn { radius: 55.0, slant: 45.0, turn: 0.0, ..USUAL };
    let covariance = find(&frame(|u, v| disc.coverage(u, v))).unwrap().circle.covariance;
    let expected = 55.0_f64.powi(2) / INTRINSICS.fx * 0.5;
    assert!((covariance[(1, 1)].sqrt() / expected - 1.0).abs() < 0.1, "{covariance}");
    assert!(covariance[(0, 0)].sqrt() < 0.3, "{covariance}");
}

#[test]
fn squares_and_balls_are_no_discs() {
    let square = |u: i32, v: i32| f64::from((u - 250).abs() < 20 && (v - 200).abs() < 20);
    assert_eq!(find(&frame(square)), None);
    let (scene, _) = in_front_of_wall(&usual_ball());
    assert_eq!(find(&without_depth(&scene)), None);
}

#[test]
fn a_second_disc_is_a_rival() {
    let other = Drawn { u: 450.0, ..USUAL };
    let alone = frame(|u, v| USUAL.coverage(u, v));
    let both = frame(|u, v| USUAL.coverage(u, v).max(other.coverage(u, v)));
    let found = find(&alone).unwrap();
    let detector = DiscDetector::new(&camera());
    assert!(!detector.has_rival(&alone, &found).unwrap());
    assert!(detector.has_rival(&both, &found).unwrap());
}
