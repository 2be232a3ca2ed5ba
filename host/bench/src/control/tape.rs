//! The size of a simulated rig as somebody measures it: the table `[size]` of its rig file.

use nalgebra::Vector3;
use plumb_config::quantity::{Coordinate, NumberError};
use plumb_emulator::plant::{Geometry, Task};
use plumb_runtime::rig::Size;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::run_id::RunId;

named! {
    /// How the rigs were measured. Each coordinate of a motor is off by up to a share of the
    /// longest side between two motors, and the cable of a step by up to the same share, uniform.
    TapeMeasure:
    Exact "exact" "the true size";
    Within5 "5" "within 5 %";
    Within10 "10" "within 10 %";
    Within20 "20" "within 20 %";
    Within40 "40" "within 40 %";
    Exchanged "exchanged" "motors A and B exchanged";
    Turned "turned" "motors A, B, C named C, A, B";
    Feet "feet" "feet, read as metres";
}

/// Feet in a metre.
const FEET: f64 = 3.280_84;

/// Stream of the random numbers that give the errors.
const TAPE_STREAM: u64 = 1 << 43;

impl TapeMeasure {
    /// Returns the largest error as a share.
    fn error(self) -> f64 {
        match self {
            Self::Within5 => 0.05,
            Self::Within10 => 0.1,
            Self::Within20 => 0.2,
            Self::Within40 => 0.4,
            Self::Exact | Self::Exchanged | Self::Turned | Self::Feet => 0.0,
        }
    }

    /// Returns the measured size of a task's rig.
    ///
    /// # Errors
    /// If a rig file takes no such size.
    pub(super) fn size(self, task: &Task, id: RunId) -> Result<Size, NumberError> {
        let mut rng = ChaCha8Rng::seed_from_u64(id.seed);
        rng.set_stream(TAPE_STREAM | id.rig);
        let mut off = || self.error() * rng.random_range(-1.0..=1.0);
        let side = longest_side(&task.geometry);
        let mut motors =
            task.geometry.motors().map(|motor| motor.coords.map(|at| at + side * off()));
        let cable = task.geometry.step_lengths_m().iter().sum::<f64>() / 3.0 * (1.0 + off());
        let unit = if self == Self::Feet { FEET } else { 1.0 };
        match self {
            Self::Exchanged => motors.swap(0, 1),
            Self::Turned => motors.rotate_right(1),
            _ => {}
        }
        let [a, b, c] = motors.map(|motor| place(motor * unit));
        Ok(Size {
            motors: [a?, b?, c?].into(),
            floor: Coordinate::default(),
            cable_per_step: (cable * unit).try_into()?,
        })
    }
}

/// Returns a place of a rig file, metres.
fn place(metres: Vector3<f64>) -> Result<[Coordinate; 3], NumberError> {
    let [x, y, z] = metres.into();
    Ok([x.try_into()?, y.try_into()?, z.try_into()?])
}

/// Returns the longest side between two motors, metres.
fn longest_side(geometry: &Geometry) -> f64 {
    let [a, b, c] = geometry.motors();
    (a - b).norm().max((b - c).norm()).max((c - a).norm())
}
