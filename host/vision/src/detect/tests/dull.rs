//! Balls that are dark and dull, without depth.

use nalgebra::Vector3;

use super::{INTRINSICS, camera, detect, miss};
use crate::camera::Intrinsics;
use crate::detect::scene::{Disturbances, seen, wall};
use crate::image::Bgr;
use crate::render::{Ball, sphere_depth};

/// Red, green and blue of the balls where they are fully lit, 0 to 255.
const COLOURS: [[f64; 3]; 6] = [
    [75.0, 38.0, 42.0],
    [60.0, 35.0, 38.0],
    [90.0, 30.0, 32.0],
    [110.0, 45.0, 45.0],
    [95.0, 50.0, 52.0],
    [65.0, 38.0, 40.0],
];
/// Columns, rows and radii of the balls, pixels.
const PLACES: [[f64; 3]; 4] =
    [[150.0, 120.0, 14.0], [470.0, 200.0, 22.0], [300.0, 330.0, 33.0], [520.0, 380.0, 46.0]];
/// Part of the light that comes from all sides.
const AMBIENT: f64 = 0.45;

/// Returns the colour of a dull ball where `ray` (camera axes, z = 1) meets it, if it does.
fn shade(ball: &Ball, ray: &Vector3<f64>) -> Option<Bgr> {
    let z = sphere_depth(ray, &ball.centre.coords, ball.radius)?;
    let normal = (ray * z - ball.centre.coords) / ball.radius;
    let lit = normal.dot(&Vector3::new(0.2, -0.6, -0.75).normalize()).max(0.0);
    Some(ball.albedo.map(|albedo| (albedo * (AMBIENT + (1.0 - AMBIENT) * lit)) as u8))
}

#[test]
fn dark_dull_balls_are_found_without_depth() {
    let lens = Intrinsics { depth_scale: 0.0, ..INTRINSICS };
    let mut lost = Vec::new();
    for [red, green, blue] in COLOURS {
        for [u, v, radius] in PLACES {
            let z = lens.fx * camera().ball_diameter / 2.0 / radius;
            let ball = Ball { albedo: [blue, green, red], ..super::ball_at(u, v, z) };
            let mut scene = wall(2.0);
            scene.each_pixel(|lens, (u, v), colour, depth| {
                let ray = lens.deproject(f64::from(u), f64::from(v), 1.0).coords;
                *colour = shade(&ball, &ray).unwrap_or(*colour);
                *depth = 0;
            });
            scene.blur(0.8);
            scene.add_noise(3);
            let off = miss(detect(&scene.frame(0.0).unwrap()), &seen(&ball, &lens));
            if off > 0.15 {
                lost.push((red, radius, off));
            }
        }
    }
    println!("lost: {lost:?}");
    assert!(lost.len() <= 2, "{lost:?}");
}
