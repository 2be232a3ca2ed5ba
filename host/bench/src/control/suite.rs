//! What the controllers are put to: which rigs, which physics, which camera.

use super::kinematic::Kinematic;
use plumb_emulator::rig::{
    DepthDrift, Elastic, ElasticParameters, ObserverParameters, Plant, Population, QuasiStatic,
    RigError, Task, Variations,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A population, a camera and a physics, by name.
#[derive(Debug, Clone, PartialEq)]
pub struct Suite {
    /// Its name.
    pub name: &'static str,
    /// What it is, for people.
    pub about: &'static str,
    /// The rigs and their tasks.
    pub population: Population,
    /// How the camera errs.
    pub camera: ObserverParameters,
    /// How the ball moves.
    pub physics: Physics,
    /// Distance from the target that the ball is to be within, metres.
    pub threshold_m: f64,
    /// Whether all rigs are the paper's, with the paper's task.
    pub paper: bool,
    /// Whether the board is told how old each picture is; otherwise all are taken for
    /// [`ASSUMED_LATENCY_FRAMES`] old.
    pub ages_known: bool,
    /// When a run's clock starts.
    pub clock: Clock,
}

/// When a run's clock starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// When the first picture arrives, ball or no ball: nobody without a model can act before.
    Picture,
    /// When the target is told, at which the first picture is taken.
    Target,
}

/// How the ball moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Physics {
    /// Rigid cables that are all taut, the ball always at rest: what the paper and
    /// docs/understand/method.md take for granted.
    QuasiStatic,
    /// Rigid cables that do not push, the ball always at rest.
    Unilateral,
    /// As that, and the ball's position goes through a resonance.
    Bounce {
        /// Its frequency, Hz.
        frequency_hz: f64,
        /// Its damping ratio.
        damping_ratio: f64,
    },
    /// A ball of 0.1 to 0.3 kg on spring cables: these stiffnesses (N/m) in turn.
    Elastic(&'static [f64]),
}

/// Latency that the board is told where nobody knows it, frames.
pub const ASSUMED_LATENCY_FRAMES: f64 = 1.5;

const SOFT: f64 = 150.0;
const STIFF: f64 = 800.0;

/// Stream of a task's random numbers that the mass is drawn from.
const MASS_STREAM: u64 = 1 << 40;

impl Suite {
    /// A suite by its name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|suite| suite.name == name)
    }

    /// Every suite.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::plain("quasi-static", "the population as it is")];
        all.extend(Self::askew());
        all.extend(Self::seen_badly());
        all.extend(Self::soft());
        all.extend(Self::narrow());
        all
    }

    fn plain(name: &'static str, about: &'static str) -> Self {
        Self {
            name,
            about,
            population: Population::default(),
            camera: ObserverParameters::default(),
            physics: Physics::QuasiStatic,
            threshold_m: 0.010,
            paper: false,
            ages_known: true,
            clock: Clock::Picture,
        }
    }

    fn varied(name: &'static str, about: &'static str, variations: Variations) -> Self {
        let population = Population { variations, ..Population::default() };
        Self { population, ..Self::plain(name, about) }
    }

    fn askew() -> [Self; 5] {
        let degrees = |d: f64| d.to_radians();
        let none = Variations::default();
        [
            Self::varied(
                "yaw",
                "turned by up to ±20°",
                Variations { yaw_rad: degrees(20.0), ..none },
            ),
            Self::varied(
                "tilt",
                "motor plane tilted by up to 10°",
                Variations { tilt_rad: degrees(10.0), ..none },
            ),
            Self::varied(
                "tilt20",
                "motor plane tilted by up to 20°",
                Variations { tilt_rad: degrees(20.0), ..none },
            ),
            Self::varied("radii", "each pulley ±30 %", Variations { radius_fraction: 0.3, ..none }),
            Self::varied("heights", "each motor ±10 cm", Variations { height_m: 0.1, ..none }),
        ]
    }

    fn seen_badly() -> [Self; 5] {
        let with = |name, about, camera| Self { camera, ..Self::plain(name, about) };
        let usual = ObserverParameters::default();
        let guessed = |suite: Self| Self { ages_known: false, ..suite };
        let drift = Some(DepthDrift { sd_m: 2e-3, correlation: 0.9 });
        [
            with(
                "noise",
                "noise of 6, 3, 3 mm",
                ObserverParameters { noise_sd_m: [6e-3, 3e-3, 3e-3], ..usual },
            ),
            with(
                "outliers",
                "5 % outliers of 50 mm",
                ObserverParameters { outlier_probability: 0.05, ..usual },
            ),
            guessed(with("ages", "1 to 2 frames late, all taken for 1.5", usual)),
            guessed(with(
                "latency",
                "4 frames late, taken for 1.5",
                ObserverParameters { latency_frames: (4.0, 4.0), ..usual },
            )),
            with(
                "drift",
                "depth noise AR(1) 0.9 of 2 mm, 3 mm to be reached",
                ObserverParameters {
                    depth_drift: drift,
                    noise_sd_m: [0.5e-3, 1e-3, 1e-3],
                    ..usual
                },
            )
            .within(0.003),
        ]
    }

    fn soft() -> [Self; 7] {
        let with = |name, about, physics| Self { physics, ..Self::plain(name, about) };
        let bounce = |frequency_hz, damping_ratio| Physics::Bounce { frequency_hz, damping_ratio };
        [
            with("unilateral", "rigid cables that do not push", Physics::Unilateral),
            with("bounce4", "a ball mode of 4 Hz, ζ = 0.1", bounce(4.0, 0.1)),
            with("bounce3", "a ball mode of 3 Hz, ζ = 0.1", bounce(3.0, 0.1)),
            with("bounce2", "a ball mode of 2 Hz, ζ = 0.05", bounce(2.0, 0.05)),
            with(
                "elastic",
                "0.1-0.3 kg on 800 and 150 N/m in turn",
                Physics::Elastic(&[STIFF, SOFT]),
            ),
            with("elastic800", "0.1-0.3 kg on 800 N/m", Physics::Elastic(&[STIFF])),
            with("elastic150", "0.1-0.3 kg on 150 N/m", Physics::Elastic(&[SOFT])),
        ]
    }

    fn narrow() -> [Self; 4] {
        let plain = Population::default();
        let with = |name, about, population| Self { population, ..Self::plain(name, about) };
        [
            with(
                "edge",
                "start and target with λ >= 0.005",
                Population { least_lambda: 0.005, ..plain.clone() },
            ),
            with(
                "high",
                "5 to 20 cm below the motors",
                Population { below_m: 0.05..=0.2, ..plain },
            ),
            Self::plain("fine", "2 mm to be reached").within(0.002),
            Self {
                paper: true,
                ..Self::plain("paper-task", "the paper's rig and task with the usual camera")
            },
        ]
    }

    fn within(self, threshold_m: f64) -> Self {
        Self { threshold_m, ..self }
    }

    /// Task number `index` for this seed.
    ///
    /// # Errors
    /// None for the suites of this module.
    pub fn task(&self, seed: u64, index: u64) -> Result<Task, RigError> {
        if self.paper { Ok(Task::paper()) } else { self.population.sample(seed, index) }
    }

    /// The rig of a task, its ball at rest at the start.
    ///
    /// # Errors
    /// Where no ball can hang there.
    pub fn plant(&self, task: &Task, seed: u64, index: u64) -> Result<Box<dyn Plant>, RigError> {
        Ok(match (self.elasticity(seed, index), self.physics) {
            (Some(parameters), _) => Box::new(Elastic::new(task.geometry, parameters, task.start)?),
            (None, Physics::Bounce { frequency_hz, damping_ratio }) => {
                let rig = Kinematic::new(task.geometry, task.start);
                Box::new(super::bounce::Bounce::new(rig, frequency_hz, damping_ratio))
            }
            (None, Physics::Unilateral) => Box::new(QuasiStatic::new(task.geometry, task.start)?),
            (None, _) => Box::new(Kinematic::new(task.geometry, task.start)),
        })
    }

    /// Ball and cables of a task; `None` where the cables are rigid.
    #[must_use]
    pub fn elasticity(&self, seed: u64, index: u64) -> Option<ElasticParameters> {
        let Physics::Elastic(stiffnesses) = self.physics else { return None };
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(MASS_STREAM | index);
        Some(ElasticParameters {
            mass_kg: 0.1 + 0.2 * rng.random::<f64>(),
            stiffness_n_m: [stiffnesses[index as usize % stiffnesses.len()]; 3],
            damping_ratio: 0.1,
        })
    }
}
