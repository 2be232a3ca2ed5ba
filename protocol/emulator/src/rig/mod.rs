//! Plant models: a ball on three cables, three motors, and an observer with delay and noise.
//!
//! SI and `f64` throughout, in the rig frame of the control notes: z up, y from B to A, C on the
//! side of smaller x. Motor positions are full steps since the start, + pays cable out, fractions
//! (microsteps) allowed.
//!
//! - [`Geometry`]: positions of the motors, and cable of a step.
//! - [`Plant`]: the response of a rig to its motors. [`QuasiStatic`]: the ball is always at rest;
//!   [`Elastic`]: it has mass and hangs on springs that cannot push.
//! - [`Observer`]: positions as a camera reports them, for loops without images.
//! - [`Task`], [`Population`]: the paper's task and random ones.

mod elastic;
mod error;
mod forward;
mod geometry;
mod observer;
mod plant;
mod population;
mod quasi_static;

pub use elastic::{Elastic, ElasticParameters, GRAVITY_M_S2};
pub use error::RigError;
pub use forward::{Hang, lowest_point};
pub use geometry::{FULL_STEPS_PER_REVOLUTION, Geometry};
pub use observer::{DepthDrift, Observation, Observer, ObserverParameters};
pub use plant::Plant;
pub use population::{Population, Task, Variations};
pub use quasi_static::QuasiStatic;
