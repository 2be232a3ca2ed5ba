//! Finds a ball in an RGB-D frame that is rendered in memory, and prints where it is.
//!
//! Usage: `cargo run --release -p plumb-vision --example find_ball`

use std::error::Error;

use nalgebra::{Isometry3, Point3};
use plumb_vision::camera::{Camera, Intrinsics};
use plumb_vision::detect::DetectorKind;
use plumb_vision::render::{Ball, Scene};

fn main() -> Result<(), Box<dyn Error>> {
    // A camera in the origin of the rig frame that looks along z for a red ball of 60 mm.
    let intrinsics = Intrinsics {
        fx: 525.0,
        fy: 525.0,
        cx: 319.5,
        cy: 239.5,
        depth_scale: 1000.0,
        distortion: None,
    };
    let pose = Isometry3::identity();
    let camera = Camera::new(intrinsics, pose, 0.06);
    let mut detector = DetectorKind::Ball.build(&camera);

    let mut scene = Scene::wall(640, 480, intrinsics, 2.2);
    scene.add(&Ball::red(Point3::new(0.1, -0.05, 0.8), 0.03));
    let frame = scene.frame(0.0)?;

    let ball = detector.detect(&frame)?.ok_or("no ball")?;
    println!("circle: {}, score {:.3}", ball.circle, ball.score);
    println!("position: {}", ball.position.ok_or("too little depth")?);
    Ok(())
}
