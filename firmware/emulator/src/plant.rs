//! Plant models: a ball on motor-driven cables, and an observer with delay and noise.
//!
//! All values are SI and `f64`, in the rig frame: z up, y from B to A, C at smaller x. Motor
//! positions are full steps since the start, + pays cable out; fractions (microsteps) are allowed.
//!
//! Three cables hold the ball in space. Two hold it in the plane x = 0; motor C is then absent.
//!
//! - [`Geometry`]: number and positions of the motors, and cable per step.
//! - [`Plant`]: response of a rig to its motors. In [`QuasiStatic`] the ball is always at rest; in
//!   [`Elastic`] it has mass and hangs on springs that cannot push.
//! - [`CameraMonitor`]: positions with a camera's errors, for control loops without images.
//! - [`Task`], [`Population`], [`PlanarPopulation`]: the paper's task and random tasks.

mod camera_monitor;
mod elastic;
mod forward;
mod geometry;
mod interface;
mod population;
mod quasi_static;

pub use camera_monitor::{CameraMonitor, CameraMonitorParameters, DepthDrift, Observation};
pub use elastic::{Elastic, ElasticParameters, GRAVITY_M_S2};
pub use forward::{Hang, lowest_point};
pub use geometry::{FULL_STEPS_PER_REVOLUTION, Geometry};
pub use interface::{LONGEST_STEP_S, Plant, RigError};
pub use population::{PlanarPopulation, Population, Task, Variations};
pub use quasi_static::QuasiStatic;

/// Returns the settings of the plants' property tests: the same cases in every run.
#[cfg(test)]
fn proptest_config() -> proptest::test_runner::Config {
    use proptest::test_runner::{Config, RngSeed};

    Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// Returns a rig in a plane with motors at two heights and two pulleys.
#[cfg(test)]
fn planar_rig() -> Geometry {
    let motors = [1.0, 0.0].map(|y| nalgebra::Point3::new(0.0, y, 1.1 + 0.1 * y));
    Geometry::planar(motors, [0.015, 0.010]).expect("a valid rig")
}
