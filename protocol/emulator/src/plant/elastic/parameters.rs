//! Parameters of the elastic rig.

use crate::plant::error::{RigError, check};

/// Gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// Internal sub-step as a phase of the rig's highest frequency, radians.
const SUBSTEP_RAD: f64 = 0.1;

/// Longest internal sub-step, seconds.
const LONGEST_SUBSTEP_S: f64 = 1e-3;

/// Parameters of the ball and the cables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticParameters {
    /// Mass of the ball, kg; > 0.
    pub mass_kg: f64,
    /// Stiffness of each cable, N/m, independent of its length; > 0; order A, B, C.
    pub stiffness_n_m: [f64; 3],
    /// Damping ratio ζ of the ball on a single cable: damping 2ζ√(km) of the stretch rate; 0 to
    /// 10.
    pub damping_ratio: f64,
}

impl Default for ElasticParameters {
    /// Returns 0.2 kg, 800 N/m, ζ = 0.1: the stiffer of the control notes' two rigs.
    fn default() -> Self {
        Self { mass_kg: 0.2, stiffness_n_m: [800.0; 3], damping_ratio: 0.1 }
    }
}

impl ElasticParameters {
    /// Checks the ranges.
    pub(super) fn check(&self) -> Result<(), RigError> {
        check("mass (kg)", self.mass_kg, "greater than 0", |m| m > 0.0)?;
        for k in self.stiffness_n_m {
            check("stiffness (N/m)", k, "greater than 0", |k| k > 0.0)?;
        }
        check("damping ratio", self.damping_ratio, "between 0 and 10", |z| {
            (0.0..=10.0).contains(&z)
        })?;
        Ok(())
    }

    /// Returns the sub-step for the stiffest motion, in which all cables pull in one direction.
    pub(super) fn substep_s(&self) -> f64 {
        let highest = (self.stiffness_n_m.iter().sum::<f64>() / self.mass_kg).sqrt()
            * (1.0 + 2.0 * self.damping_ratio);
        (SUBSTEP_RAD / highest).min(LONGEST_SUBSTEP_S)
    }
}
