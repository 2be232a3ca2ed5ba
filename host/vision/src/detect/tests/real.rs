//! The detector `ball` on real pictures, and on balls drawn into them.

use nalgebra::Point3;
use plumb_cameras::tum::TumFolder;
use plumb_frame::source::CameraSource;

use super::{detect, miss};
use crate::camera::Intrinsics;
use crate::detect::scene::{Disturbances, INTRINSICS, pictures, red_ball, seen};
use crate::frame::RgbdFrame;
use crate::render::{Ball, Scene};

/// Reads the frames of a folder of real pictures; none if the folder is absent.
fn real(name: &str, intrinsics: Intrinsics) -> Vec<RgbdFrame> {
    let Some(folder) = pictures(name) else { return Vec::new() };
    let mut source = TumFolder::open(&folder, intrinsics).unwrap();
    let frames: Vec<RgbdFrame> = std::iter::from_fn(|| source.next_frame().unwrap()).collect();
    assert!(!frames.is_empty(), "{name}");
    frames
}

fn desk() -> Vec<RgbdFrame> {
    real(
        "tum-desk",
        Intrinsics {
            fx: 520.9,
            fy: 521.0,
            cx: 325.1,
            cy: 249.7,
            depth_scale: 5000.0,
            distortion: None,
        },
    )
}

#[test]
fn no_ball_is_found_on_the_real_desk_and_table() {
    for (i, frame) in desk().iter().chain(&real("osd", INTRINSICS)).enumerate() {
        assert_eq!(detect(frame), None, "frame {i}");
    }
}

#[test]
fn balls_in_real_pictures_are_found() {
    let frames: Vec<RgbdFrame> = real("osd", INTRINSICS)
        .into_iter()
        .chain(std::iter::repeat_n(desk(), 8).flatten())
        .collect();
    let (mut hits, mut wrong, mut all) = (0, 0, 0);
    for (i, frame) in frames.iter().enumerate() {
        for k in 0..4 {
            // Spread evenly, in front of what is there.
            let at = |step: f64, from: f64, to: f64| {
                from + ((4 * i + k) as f64 * step).fract() * (to - from)
            };
            let (u, v, z) =
                (at(0.7549, 60.0, 580.0), at(0.5698, 60.0, 420.0), at(0.6180, 0.45, 1.9));
            let free = frame.depth_at(u as i32, v as i32).unwrap_or(f64::INFINITY);
            let intrinsics = *frame.intrinsics();
            let z = z.min(free - 0.08).max(0.45);
            let ball = Ball {
                light: [1.0, 0.3, 2.2, 1.0][k],
                ..red_ball(Point3::from(intrinsics.deproject(u, v, z).coords))
            };
            let (colour, depth) = (frame.colour().clone(), frame.depth().clone());
            let mut scene = Scene { colour, depth, intrinsics };
            scene.add(&ball);
            if k == 3 {
                scene.blur(1.5);
            }
            scene.add_cable((u, v), at(0.33, -3.0, 0.0), 2, [20.0, 230.0][i % 2]);
            scene.add_noise(6);
            let (found, truth) = (detect(&scene.frame(0.0).unwrap()), seen(&ball, &intrinsics));
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
