//! Plant models: a ball on three cables with three motors, and an observer with delay and noise.
//!
//! All values are SI and `f64`, in the rig frame: z up, y from B to A, C at smaller x. Motor
//! positions are full steps since the start, + pays cable out; fractions (microsteps) are allowed.
//!
//! - [`Geometry`]: positions of the motors, and cable per step.
//! - [`Plant`]: response of a rig to its motors. In [`QuasiStatic`] the ball is always at rest; in
//!   [`Elastic`] it has mass and hangs on springs that cannot push.
//! - [`CameraMonitor`]: positions with a camera's errors, for control loops without images.
//! - [`Task`], [`Population`]: the paper's task and random tasks.

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
pub use population::{Population, Task, Variations};
pub use quasi_static::QuasiStatic;

/// Returns the settings of the plants' property tests: the same cases in every run.
#[cfg(test)]
fn proptest_config() -> proptest::test_runner::Config {
    use proptest::test_runner::{Config, RngSeed};

    Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}
