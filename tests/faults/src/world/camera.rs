//! The camera, with its faults.

use std::collections::VecDeque;
use std::time::Duration;

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};
use plumb_protocol::units::Micros;
use plumb_tests::links::tracking_frame;
use plumb_tests::noise::{normal, position_noise};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::Image;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Shared;
use crate::kind::Kind;
use crate::plan::Fault;

/// Time between two pictures, µs: 30 Hz.
const PERIOD_US: u64 = 33_333;
/// Time from the exposure to the arrival at the host, µs.
const LATENCY_US: u64 = 45_000;
/// Middle of the workspace, m.
const MIDDLE: [f64; 3] = [0.5, 0.3, 0.3];

/// A picture on its way.
#[derive(Debug, Clone, Copy)]
struct Picture {
    arrives: u64,
    /// Time stamp, s.
    stamp: f64,
    /// Where the ball is seen, m.
    ball: Point3<f64>,
    has_depth: bool,
}

/// Camera that sees the ball of a world; a driver thread keeps its newest picture.
pub struct FaultyCamera {
    world: Shared,
    camera: Camera,
    random: ChaCha8Rng,
    next_capture: u64,
    in_transit: VecDeque<Picture>,
    /// The last place of the ball before the picture froze, m.
    frozen: Option<Point3<f64>>,
}

impl FaultyCamera {
    /// Returns a camera at the pose of `camera`.
    pub fn new(world: &Shared, camera: &Camera) -> Self {
        let (seed, now) = (world.borrow().plan.seed, world.borrow().now().0);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(3);
        Self {
            world: world.clone(),
            camera: camera.clone(),
            random,
            next_capture: now + seed % PERIOD_US,
            in_transit: VecDeque::new(),
            frozen: None,
        }
    }

    /// Returns the faults that act now.
    fn acting(&self) -> Vec<Fault> {
        let world = self.world.borrow();
        let now = world.now();
        world.plan.faults.iter().copied().filter(|fault| fault.acts(now)).collect()
    }

    /// Lets time pass while the host is stopped.
    fn pause(&mut self) {
        let paused = self.acting().into_iter().find(|fault| fault.kind == Kind::PausedHost);
        let Some(fault) = paused else { return };
        while self.world.borrow().now() < fault.to {
            self.tick();
        }
    }

    fn is_gone(&self) -> bool {
        self.acting().iter().any(|fault| fault.kind == Kind::CameraGone)
    }

    /// Runs the world for a tick, and takes a picture if one is due.
    fn tick(&mut self) {
        self.world.borrow_mut().tick();
        let now = self.world.borrow().now().0;
        if now >= self.next_capture {
            self.next_capture += PERIOD_US;
            self.capture(now);
        }
    }

    /// Takes a picture.
    fn capture(&mut self, now: u64) {
        let noise = position_noise(&mut self.random);
        let mut picture = Picture {
            arrives: now + LATENCY_US,
            stamp: now as f64 * 1e-6,
            ball: self.world.borrow().ball() + noise,
            has_depth: true,
        };
        let acting = self.acting();
        if acting.iter().any(|fault| fault.kind == Kind::NoFrames) {
            return;
        }
        for fault in &acting {
            self.disturb(fault, noise, &mut picture);
        }
        self.frozen = Some(picture.ball);
        self.in_transit.push_back(picture);
    }

    /// Applies a fault to a picture with `noise`, m.
    fn disturb(&mut self, fault: &Fault, noise: Vector3<f64>, picture: &mut Picture) {
        match fault.kind {
            Kind::FrozenPicture => picture.ball = self.frozen.unwrap_or(picture.ball),
            Kind::LateFrames => picture.arrives += fault.between(100_000.0, 2_000_000.0) as u64,
            Kind::Jumps if self.random.random::<f64>() < fault.between(0.05, 1.0) => {
                let distance = self.random.random_range(0.05..0.5);
                picture.ball += self.direction() * distance;
            }
            Kind::WrongBall => picture.ball = other_ball(fault) + noise,
            Kind::NoDepth => picture.has_depth = false,
            Kind::TimeBackwards => picture.stamp -= fault.between(0.05, 2.0),
            Kind::BumpedCamera => picture.ball = turned(fault, picture.ball),
            _ => {}
        }
    }

    /// Returns a random direction.
    fn direction(&mut self) -> Vector3<f64> {
        let vector = Vector3::from([(); 3].map(|()| normal(&mut self.random)));
        Unit::try_new(vector, 1e-9).map_or_else(Vector3::x, Unit::into_inner)
    }

    fn has_frame(&self) -> bool {
        let now = self.world.borrow().now().0;
        self.in_transit.front().is_some_and(|picture| picture.arrives <= now)
    }

    /// Renders a picture.
    fn render(&self, picture: &Picture) -> Result<RgbdFrame, SourceError> {
        let frame = tracking_frame(&self.camera, picture.stamp, picture.ball)?;
        if picture.has_depth {
            return Ok(frame);
        }
        let colour = frame.colour().clone();
        let none = Image::filled(colour.width(), colour.height(), 0);
        let frame = RgbdFrame::new(picture.stamp, colour, none, *frame.intrinsics());
        Ok(frame.map_err(InvalidFrame::of("a picture without depth".to_owned()))?)
    }
}

impl CameraSource for FaultyCamera {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        self.pause();
        while !self.has_frame() {
            if self.is_gone() {
                return Err(SourceError::over("the camera was unplugged"));
            }
            self.tick();
        }
        let now = self.world.borrow().now().0;
        // The newest picture replaces the others that have arrived.
        let mut newest = None;
        while let Some(picture) = self.in_transit.pop_front_if(|picture| picture.arrives <= now) {
            newest = Some(picture);
        }
        newest.map(|picture| self.render(&picture)).transpose()
    }

    fn now(&self) -> f64 {
        self.world.borrow().now().0 as f64 * 1e-6
    }

    fn is_live(&self) -> bool {
        true
    }

    fn wait(&mut self, limit: Duration) -> bool {
        self.pause();
        let end = Micros(self.world.borrow().now().0 + limit.as_micros() as u64);
        while !self.has_frame() && !self.is_gone() {
            if self.world.borrow().now() >= end {
                return false;
            }
            self.tick();
        }
        true
    }
}

/// Returns the place of another ball, m.
fn other_ball(fault: &Fault) -> Point3<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(fault.seed);
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    Point3::new(between(0.3, 0.75), between(0.15, 0.45), between(0.1, 0.5))
}

/// Returns where a camera that was turned sees a ball at `ball`, m.
fn turned(fault: &Fault, ball: Point3<f64>) -> Point3<f64> {
    let angle = fault.between(30.0, 180.0).to_radians();
    let middle = Point3::from(MIDDLE);
    middle + Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * (ball - middle)
}
