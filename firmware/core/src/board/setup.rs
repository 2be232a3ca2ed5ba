//! The configuration in force.

use plumb_protocol::config::Config;
use plumb_protocol::message::{ConfigField, Refusal};

use crate::params::{BuildLimits, Params};

/// Limits of the build, and the configuration with what follows from it.
#[derive(Debug)]
pub(super) struct Setup {
    pub(super) build: BuildLimits,
    /// Parameters made from `config`: driver timing and law included.
    params: Option<Params>,
    config: Option<Config>,
    /// Number of configurations since the start; wraps.
    generation: u32,
}

impl Setup {
    /// Creates the setup of a board without a configuration.
    pub(super) fn new(build: BuildLimits) -> Self {
        Self { build, params: None, config: None, generation: 0 }
    }

    /// Checks `config` against its ranges and the limits of the build.
    ///
    /// # Errors
    /// Returns the first field that is out of its range.
    pub(super) fn check(&self, config: &Config) -> Result<Params, ConfigField> {
        Params::check(config, &self.build)
    }

    /// Puts `params`, which were made from `config`, into force.
    pub(super) fn apply(&mut self, params: Params, config: &Config) {
        self.params = Some(params);
        self.config = Some(*config);
        self.generation = self.generation.wrapping_add(1);
    }

    /// Returns the configuration in force.
    pub(super) fn config(&self) -> Option<&Config> {
        self.config.as_ref()
    }

    /// Returns the parameters in force.
    #[inline]
    pub(super) fn params(&self) -> Option<&Params> {
        self.params.as_ref()
    }

    /// Returns the parameters in force.
    ///
    /// # Errors
    /// [`Refusal::Unconfigured`] where there are none.
    pub(super) fn require(&self) -> Result<&Params, Refusal> {
        self.params.as_ref().ok_or(Refusal::Unconfigured)
    }

    /// Returns the number of configurations since the start; wraps.
    pub(super) fn generation(&self) -> u32 {
        self.generation
    }

    /// Checks that no motor stands outside its travel; `positions` in 1/16 steps from its
    /// zero.
    ///
    /// # Errors
    /// [`Refusal::OutsideTravel`] with the first such motor.
    pub(super) fn check_travel(&self, positions: [i32; 3]) -> Result<(), Refusal> {
        let outside = self
            .require()?
            .motors
            .iter()
            .zip(positions)
            .position(|(motor, at)| !(motor.travel_min.0..=motor.travel_max.0).contains(&at));
        outside.map_or(Ok(()), |motor| Err(Refusal::OutsideTravel(motor as u8)))
    }
}
