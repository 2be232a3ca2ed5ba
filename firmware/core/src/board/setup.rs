//! The wiring and the configuration in force, and the wiring of the next configuration.

use plumb_protocol::config::Config;
use plumb_protocol::message::{ConfigField, Refusal};
use plumb_protocol::prior::Prior;
use plumb_protocol::wiring::Wiring;

use crate::law::DeferredLawKind;
use crate::params::{BuildLimits, Params};

/// Limits of the build, the wiring and the configuration.
#[derive(Debug)]
pub(super) struct Setup {
    pub(super) build: BuildLimits,
    /// The configuration in force with what follows from it: driver timing and law included.
    params: Option<Params>,
    /// Wiring in force, if there is a configuration.
    wiring: Option<Wiring>,
    /// Wiring of the next configurations of this session.
    pub(super) staged: Option<Wiring>,
    /// Number of configurations since the start; wraps.
    generation: u32,
    /// Number of changes of the wiring or the microsteps since the start; wraps.
    wiring_generation: u32,
}

impl Setup {
    /// Creates the setup of a board without a configuration.
    pub(super) fn new(build: BuildLimits) -> Self {
        Self {
            build,
            params: None,
            wiring: None,
            staged: None,
            generation: 0,
            wiring_generation: 0,
        }
    }

    /// Checks `wiring`, and `config` with it, against their ranges and the limits of the build.
    ///
    /// # Errors
    /// The refusal of the first field that is out of its range.
    pub(super) fn check(&self, wiring: &Wiring, config: &Config) -> Result<Params, Refusal> {
        wiring.check(self.build.chip).map_err(Refusal::Wiring)?;
        if wiring.pins.motors.len() != config.motors.len() {
            return Err(Refusal::Config(ConfigField::Motors));
        }
        Params::check(config, &wiring.drivers, &self.build).map_err(Refusal::Config)
    }

    /// Checks a prior against its ranges, and the law and the motors of the configuration.
    ///
    /// # Errors
    /// [`Refusal::Unconfigured`], or a prior that does not fit the configuration.
    pub(super) fn check_prior(&self, prior: &Prior) -> Result<(), Refusal> {
        let params = self.require()?;
        let (law, motors) = (params.deferred_law(), params.config.motors.len());
        let reader = match prior {
            Prior::Jacobian(_) => DeferredLawKind::Adaptive,
            Prior::Rig(_) => DeferredLawKind::Taut,
        };
        let fits = law == Some(reader) && prior.is_valid(motors);
        if fits { Ok(()) } else { Err(Refusal::Config(ConfigField::Prior)) }
    }

    /// Puts `params`, which were made with `wiring`, into force. Returns whether the pins and
    /// drivers change: with another wiring or other microsteps.
    pub(super) fn apply(&mut self, params: Params, wiring: &Wiring) -> bool {
        let microsteps = self.config().map(|config| config.microsteps);
        let changed = self.wiring != Some(*wiring) || microsteps != Some(params.config.microsteps);
        if changed {
            self.wiring_generation = self.wiring_generation.wrapping_add(1);
        }
        (self.params, self.wiring) = (Some(params), Some(*wiring));
        self.generation = self.generation.wrapping_add(1);
        changed
    }

    /// Returns the wiring in force.
    pub(super) fn wiring(&self) -> Option<&Wiring> {
        self.wiring.as_ref()
    }

    /// Returns the time from ENABLE to the first pulse, µs.
    pub(super) fn enable_us(&self) -> u64 {
        let times = self.wiring.as_ref().and_then(|wiring| wiring.drivers.step_dir());
        times.map_or(0, |times| u64::from(times.enable.0) * 1000)
    }

    /// Returns the configuration in force.
    pub(super) fn config(&self) -> Option<&Config> {
        self.params.as_ref().map(|params| &params.config)
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

    /// Returns the number of changes of the wiring or the microsteps since the start; wraps.
    pub(super) fn wiring_generation(&self) -> u32 {
        self.wiring_generation
    }
}
