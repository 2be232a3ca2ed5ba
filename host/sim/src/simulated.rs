//! A simulated rig as a camera source: synthetic frames of its ball in virtual or real time.

mod clock;
mod error;
mod hil;
mod virtual_board;
mod wired;

use std::collections::VecDeque;

use nalgebra::Point3;
use plumb_emulator::plant::{Geometry, QuasiStatic, RigError};
use plumb_frame::camera::Camera;
use plumb_frame::clock::LiveClock;
use plumb_frame::frame::{GroundTruth, RgbdFrame};
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::{MOTORS, MotorList};
use plumb_runtime::rig::{Rig, Simulation};

use super::synthetic::{Background, RenderOptions, Room, Scene, SyntheticCamera};

pub use clock::{RealTimeBall, RealTimeRig, Seen, ServedRig, SimClock, VirtualRig};
pub use error::SimulationError;
pub use hil::{BoardMotion, HilObserver, HilPlant, HilRig};
pub use virtual_board::{DriveError, VirtualBoard};
pub use wired::wired;

/// Checks that the rig of a rig file can be simulated, with pictures of `camera`: as a run does
/// that begins with rigid cables.
///
/// # Errors
/// Where the table `[simulation]` describes no rig, or its pictures cannot be rendered.
pub fn check_simulation(
    rig: &Rig,
    simulation: &Simulation,
    camera: &Camera,
) -> Result<(), SimulationError> {
    let plant = QuasiStatic::new(geometry(simulation)?, simulation.start())?;
    let plant = HilPlant::new(wired(rig, simulation, Box::new(plant)), None);
    plant.observer().board_stands([0.0; MOTORS])?;
    Ok(SyntheticCamera::check(&rendered(simulation, camera), &RenderOptions::default())?)
}

/// Returns the camera that renders the simulated rig of a rig file in a furnished room; two motors
/// stand above a board.
///
/// # Errors
/// Where the camera file describes no camera of the pictures' size.
pub fn synthetic_camera(
    simulation: &Simulation,
    camera: &Camera,
) -> Result<SyntheticCamera, SimulationError> {
    let camera = rendered(simulation, camera);
    let mut room = Room::furnished_for(camera.ball_hue);
    if let &[a, b] = &simulation.motors()[..] {
        room = room.with_board([a, b], camera.pose.translation.vector.into());
    }
    let options = RenderOptions::default();
    Ok(SyntheticCamera::new(camera, Background::Room(room), options, 1)?)
}

/// Returns `camera` at the pose from which the simulated rig is rendered.
fn rendered(simulation: &Simulation, camera: &Camera) -> Camera {
    Camera { pose: simulation.camera_pose(camera.pose), ..camera.clone() }
}

/// Returns the geometry of a rig file's simulated rig.
///
/// # Errors
/// Where its values describe no rig.
pub fn geometry(simulation: &Simulation) -> Result<Geometry, RigError> {
    let radii = simulation.pulley_radii.map(|radius| radius.get());
    match (&simulation.motors()[..], &radii[..]) {
        (&[a, b], &[of_a, of_b]) => Geometry::planar([a, b], [of_a, of_b]),
        (&[a, b, c], &[of_a, of_b, of_c]) => Geometry::new([a, b, c], [of_a, of_b, of_c]),
        (motors, _) => Err(RigError::OutOfRange {
            name: "number of simulated motors",
            value: motors.len() as f64,
            allowed: "2 or 3, with as many pulley radii",
        }),
    }
}

/// Frame rate and latency of a simulated camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Frame rate, Hz.
    pub rate: f64,
    /// Time from capture to arrival at the host, seconds: exposure, transfer, driver.
    pub latency: f64,
}

impl Default for Timing {
    /// 30 Hz and 45 ms, as a PrimeSense camera at 640x480.
    fn default() -> Self {
        Self { rate: 30.0, latency: 0.045 }
    }
}

/// A [`SyntheticCamera`] that looks at a simulated rig.
pub struct SimulatedCamera<C> {
    rig: C,
    camera: SyntheticCamera,
    motors: MotorList<Point3<f64>>,
    timing: Timing,
    next_capture: f64,
    /// Frames between capture and arrival.
    in_transit: VecDeque<Capture>,
}

/// A captured frame before rendering.
#[derive(Debug, Clone, Copy)]
struct Capture {
    /// Time of capture, seconds.
    time: f64,
    seen: Seen,
}

impl<C: SimClock> SimulatedCamera<C> {
    /// Creates a camera that looks at `rig` with motors at `motors` (metres, rig frame).
    pub fn new(
        rig: C,
        camera: SyntheticCamera,
        motors: impl Into<MotorList<Point3<f64>>>,
        timing: Timing,
    ) -> Self {
        let (next_capture, motors) = (rig.now(), motors.into());
        Self { rig, camera, motors, timing, next_capture, in_transit: VecDeque::new() }
    }

    /// Returns the rig.
    pub fn rig(&self) -> &C {
        &self.rig
    }

    /// Waits until the next frame is due and captures it.
    fn capture(&mut self) -> Result<(), RigError> {
        self.rig.wait_until(self.next_capture)?;
        let now = self.rig.now();
        let seen = Seen { ball: self.rig.ball(), tensions: self.rig.tensions_per_weight() };
        self.in_transit.push_back(Capture { time: now, seen });
        // A host that is too slow misses frames.
        let period = 1.0 / self.timing.rate;
        self.next_capture +=
            period * ((now - self.next_capture) / period).floor().max(0.0) + period;
        Ok(())
    }

    /// Waits until the next frame arrives and renders it.
    fn wait_for_frame(&mut self) -> Result<RgbdFrame, SimulationError> {
        loop {
            if let Some(&Capture { time, seen }) = self.in_transit.front()
                && time + self.timing.latency <= self.next_capture
            {
                self.in_transit.pop_front();
                self.rig.wait_until(time + self.timing.latency)?;
                let Seen { ball, tensions } = self.rig.seen_at(time)?.unwrap_or(seen);
                let hue = self.camera.camera().ball_hue;
                let scene = Scene::rig(ball, self.motors).with_ball_hue(hue);
                let frame = self.camera.render(time, &scene)?;
                let ground_truth = tensions.map(|tensions| GroundTruth { tensions });
                return Ok(frame.with_ground_truth(ground_truth));
            }
            self.capture()?;
        }
    }
}

impl<C: SimClock> CameraSource for SimulatedCamera<C> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        Ok(Some(self.wait_for_frame()?))
    }

    fn now(&self) -> f64 {
        self.rig.now()
    }

    fn is_live(&self) -> bool {
        true
    }

    fn clock(&self) -> Option<LiveClock> {
        self.rig.live_clock()
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error;

    use plumb_config::error_chain::ErrorChain;
    use plumb_emulator::plant::{Elastic, ElasticParameters, Plant, QuasiStatic, Task};

    use super::*;
    use crate::synthetic::SyntheticError;

    #[test]
    fn a_failed_rig_ends_the_frames_a_failed_frame_does_not() {
        let slack = RigError::OutOfRange { name: "cable", value: -1.0, allowed: "above 0" };
        let rig = SourceError::from(SimulationError::Rig(slack));
        assert!(rig.is_over());
        let message = ErrorChain(&rig).to_string();
        assert!(message.contains("the simulated rig cannot follow its motors: "), "{message}");
        assert!(rig.source().is_some_and(|error| error.is::<SimulationError>()));
        let value = SyntheticError::Value { what: "it", value: -1.0, must: "be above 0" };
        assert!(!SourceError::from(SimulationError::Synthetic(value)).is_over());
    }

    #[test]
    fn a_rig_begins_where_the_motors_of_its_board_stand() {
        let Task { geometry, start, .. } = Task::paper();
        let plants = || -> [Box<dyn Plant + Send>; 2] {
            let elastic = Elastic::new(geometry, ElasticParameters::default(), start).unwrap();
            [Box::new(QuasiStatic::new(geometry, start).unwrap()), Box::new(elastic)]
        };
        for (first, second) in plants().into_iter().zip(plants()) {
            let [first, second] = [first, second].map(|plant| HilPlant::new(plant, None));
            let mut follower = first.observer();
            assert!((first.ball() - start).norm() < 1e-3, "{}", first.ball());
            follower.board_stands([100.0, -50.0, 7.0]).unwrap();
            assert!((first.ball() - start).norm() > 1e-2, "{}", first.ball());
            // The rig of the next run of the same board.
            second.observer().board_stands([100.0, -50.0, 7.0]).unwrap();
            assert_eq!(first.ball(), second.ball());
            second.seen_at(second.now()).unwrap();
            assert!((first.ball() - second.ball()).norm() < 1e-3, "at rest: {}", second.ball());
        }
    }
}
