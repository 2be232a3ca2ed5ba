//! The conditions of a benchmark: rigs, tasks, camera, physics and threshold.

mod name;

use std::iter;

use nalgebra::{Point3, Vector3};
use plumb_emulator::plant::{
    CameraMonitorParameters, DepthDrift, Elastic, ElasticParameters, Geometry, PlanarPopulation,
    Plant, Population, QuasiStatic, RigError, Task, Variations,
};
use plumb_protocol::MOTORS;
use plumb_protocol::dimension::LEAST_MOTORS;
use plumb_protocol::prior::Prior;
use plumb_runtime::rig::{CableSettings, Stiffness};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::bounce::Bounce;
use super::eye::{Defect, Stand};
use super::kinematic::Kinematic;
use super::tape::TapeMeasure;
use crate::run_id::RunId;

pub use name::SuiteName;

/// Conditions of a benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct Suite {
    /// Name.
    pub name: SuiteName,
    /// Distribution of rigs and tasks. [`SuiteName::PaperTask`] does not use it.
    pub population: Rigs,
    /// Camera model: noise, outliers, latency.
    pub camera: CameraMonitorParameters,
    /// Angle by which the camera's pose is turned about the target, radians; `None` for the true
    /// pose.
    pub turned_rad: Option<f64>,
    /// Model of the ball's motion.
    pub physics: Physics,
    /// Greatest distance from the target at which the ball counts as arrived, metres.
    pub threshold_m: f64,
    /// Whether the board gets the true age of each position. Otherwise it gets
    /// [`assumed_frames`](Self::assumed_frames).
    pub ages_known: bool,
    /// Age that the board gets where the true one is unknown, frames.
    pub assumed_frames: f64,
    /// How the camera stands where only two jogs tell the frame of its picture.
    pub stand: Option<Stand>,
    /// What breaks in the run after the two jogs.
    pub defect: Option<Defect>,
    /// What the law begins with, by the two jogs.
    pub prior: Option<Prior>,
    /// Start of a run's clock. That of a further target starts when the board gets it.
    pub clock: Clock,
    /// What the rig file says about the cables.
    pub cables: CableSettings,
    /// Targets of each run, one after the other; at least 1.
    pub targets: usize,
    /// Whether each further target is that of a new run: the board is configured anew, and the rig
    /// is changed before the second one. `None`: all targets are of one run.
    pub new_runs: Option<RigChange>,
    /// How the rigs were measured; `None`: the rig file has no `[size]`.
    pub tape: Option<TapeMeasure>,
}

/// Distribution of rigs and tasks.
#[derive(Debug, Clone, PartialEq)]
pub enum Rigs {
    /// Three motors.
    Spatial(Population),
    /// Two motors in the plane x = 0.
    Planar(PlanarPopulation),
}

/// What somebody changes about a rig between two runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RigChange {
    /// Nothing.
    Nothing,
    /// A motor, A, B and C in turn, is moved by 5 cm in a random direction.
    Motor,
    /// All pulleys get 1.5 times their radius, or so much less, in turn.
    Pulleys,
}

/// Distance by which a motor is moved, metres.
const MOVED_M: f64 = 0.05;
/// Factor on the radius of the pulleys.
const PULLEY_FACTOR: f64 = 1.5;
/// Stream of the random numbers that give the direction in which a motor is moved.
const MOVED_STREAM: u64 = 1 << 42;

named! {
    /// Start of a run's clock. No controller without a model can act before the first frame.
    Clock:
    Picture "picture" "arrival of the first frame, with or without a ball";
    Target "target" "capture of the first frame, at which the board gets its target";
}

/// Model of the ball's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Physics {
    /// Rigid taut cables with the ball always at rest: the assumption of the paper and of
    /// docs/understand/method.md.
    QuasiStatic,
    /// Rigid cables that cannot push, with the ball always at rest.
    Unilateral,
    /// Rigid taut cables, and a resonance between their lowest point and the ball.
    Bounce {
        /// Natural frequency, Hz.
        frequency_hz: f64,
        /// Damping ratio ζ.
        damping_ratio: f64,
    },
    /// A ball of 0.1 to 0.3 kg on spring cables. Rigs get these stiffnesses (N/m) in turn.
    Elastic(&'static [f64]),
}

/// Latency that the board assumes where the true age is unknown, frames.
pub const ASSUMED_LATENCY_FRAMES: f64 = 1.5;

/// Stiffness of soft cables, N/m.
const SOFT_N_M: f64 = 150.0;
/// Stiffness of stiff cables, N/m.
const STIFF_N_M: f64 = 800.0;
/// Damping ratio of the ball on elastic cables.
const ELASTIC_DAMPING_RATIO: f64 = 0.1;
/// Least mass of the ball, kg.
const MIN_MASS_KG: f64 = 0.1;
/// Range of the ball's mass, kg.
const MASS_RANGE_KG: f64 = 0.2;

/// Stream of the random numbers that give the ball's mass.
const MASS_STREAM: u64 = 1 << 40;

impl Suite {
    /// Creates the suite of a name.
    #[must_use]
    pub fn new(name: SuiteName) -> Self {
        Self {
            name,
            population: population(name),
            camera: camera(name),
            turned_rad: match name {
                SuiteName::Frame5 => Some(5_f64.to_radians()),
                SuiteName::Frame10 => Some(10_f64.to_radians()),
                SuiteName::Frame20 => Some(20_f64.to_radians()),
                _ => None,
            },
            physics: physics(name),
            threshold_m: match name {
                SuiteName::Fine => 0.002,
                SuiteName::Drift => 0.003,
                _ => 0.010,
            },
            ages_known: !matches!(name, SuiteName::Ages | SuiteName::Latency) && !is_picture(name),
            assumed_frames: ASSUMED_LATENCY_FRAMES,
            stand: is_picture(name).then_some(Stand::InFront),
            defect: None,
            prior: None,
            clock: Clock::Picture,
            cables: CableSettings {
                stiffness: match name {
                    SuiteName::Stiff => Stiffness::Stiff,
                    _ => Stiffness::Unknown,
                },
            },
            targets: 1,
            new_runs: match name {
                SuiteName::Warm800 | SuiteName::Warm150 => Some(RigChange::Nothing),
                SuiteName::WarmMoved => Some(RigChange::Motor),
                SuiteName::WarmPulleys => Some(RigChange::Pulleys),
                _ => None,
            },
            tape: None,
        }
    }

    /// Returns the rig of the second run and of those after it; `None` if it is not changed.
    ///
    /// # Errors
    /// If the changed rig is invalid.
    pub fn changed(&self, rig: &Geometry, id: RunId) -> Result<Option<Geometry>, RigError> {
        let (mut motors, mut radii_m) = (*rig.motors(), rig.pulley_radii_m());
        match self.new_runs {
            None | Some(RigChange::Nothing) => return Ok(None),
            Some(RigChange::Motor) => {
                let mut rng = ChaCha8Rng::seed_from_u64(id.seed);
                rng.set_stream(MOVED_STREAM | id.rig);
                let direction = Vector3::from_fn(|_, _| rng.random::<f64>() - 0.5);
                motors[id.rig as usize % MOTORS] += MOVED_M * direction.normalize();
            }
            Some(RigChange::Pulleys) if id.rig.is_multiple_of(2) => {
                radii_m = radii_m.map(|radius| PULLEY_FACTOR * radius);
            }
            Some(RigChange::Pulleys) => radii_m = radii_m.map(|radius| radius / PULLEY_FACTOR),
        }
        Geometry::new(motors, radii_m).map(Some)
    }

    /// Returns the task of a run.
    ///
    /// # Errors
    /// If the population contains no valid rig. No suite of this module fails.
    pub fn task(&self, id: RunId) -> Result<Task, RigError> {
        match self.name {
            SuiteName::PaperTask => Ok(Task::paper()),
            _ => match &self.population {
                Rigs::Spatial(population) => population.sample(id.seed, id.rig),
                Rigs::Planar(population) => population.sample(id.seed, id.rig),
            },
        }
    }

    /// Returns the number of motors of each rig.
    #[must_use]
    pub fn motors(&self) -> usize {
        match self.population {
            Rigs::Spatial(_) => MOTORS,
            Rigs::Planar(_) => LEAST_MOTORS,
        }
    }

    /// Returns the targets of a run on `task`, the first one that of the task. Rigs of two motors
    /// have no further ones.
    #[must_use]
    pub fn places(&self, task: &Task, id: RunId) -> Vec<Point3<f64>> {
        let count = self.targets.saturating_sub(1);
        let further = match &self.population {
            Rigs::Spatial(population) => population.further_targets(task, (id.seed, id.rig), count),
            Rigs::Planar(_) => Vec::new(),
        };
        iter::once(task.target).chain(further).collect()
    }

    /// Returns the plant of a task with its ball at rest at the start.
    ///
    /// # Errors
    /// If no ball can hang at the start.
    pub fn plant(&self, task: &Task, id: RunId) -> Result<Box<dyn Plant>, RigError> {
        Ok(match (self.elasticity(id), self.physics) {
            (Some(parameters), _) => Box::new(Elastic::new(task.geometry, parameters, task.start)?),
            (None, Physics::Bounce { frequency_hz, damping_ratio }) => {
                let rig = Kinematic::new(task.geometry, task.start);
                Box::new(Bounce::new(rig, frequency_hz, damping_ratio))
            }
            (None, Physics::Unilateral) => Box::new(QuasiStatic::new(task.geometry, task.start)?),
            (None, _) => Box::new(Kinematic::new(task.geometry, task.start)),
        })
    }

    /// Returns mass and stiffness of a run's ball and cables; `None` if the cables are rigid.
    #[must_use]
    pub fn elasticity(&self, id: RunId) -> Option<ElasticParameters> {
        let Physics::Elastic(stiffnesses) = self.physics else { return None };
        let mut rng = ChaCha8Rng::seed_from_u64(id.seed);
        rng.set_stream(MASS_STREAM | id.rig);
        Some(ElasticParameters {
            mass_kg: MIN_MASS_KG + MASS_RANGE_KG * rng.random::<f64>(),
            stiffness_n_m: [stiffnesses[id.rig as usize % stiffnesses.len()]; MOTORS],
            damping_ratio: ELASTIC_DAMPING_RATIO,
        })
    }
}

/// Returns whether the rigs of a suite are seen by a camera of unknown place.
fn is_picture(name: SuiteName) -> bool {
    matches!(name, SuiteName::Picture | SuiteName::Picture800 | SuiteName::Picture150)
}

/// Returns the rigs and tasks of a suite.
fn population(name: SuiteName) -> Rigs {
    match name {
        _ if is_picture(name) => Rigs::Planar(PlanarPopulation::default()),
        SuiteName::Planar | SuiteName::Planar800 | SuiteName::Planar150 => {
            Rigs::Planar(PlanarPopulation::default())
        }
        _ => Rigs::Spatial(spatial(name)),
    }
}

/// Returns the rigs and tasks of a suite of three motors.
fn spatial(name: SuiteName) -> Population {
    let none = Variations::default();
    let variations = match name {
        SuiteName::Yaw => Variations { yaw_rad: 20_f64.to_radians(), ..none },
        SuiteName::Tilt => Variations { tilt_rad: 10_f64.to_radians(), ..none },
        SuiteName::Radii => Variations { radius_fraction: 0.3, ..none },
        SuiteName::Heights => Variations { height_m: 0.1, ..none },
        _ => none,
    };
    let population = Population { variations, ..Population::default() };
    match name {
        SuiteName::Edge => Population { least_lambda: 0.005, ..population },
        SuiteName::High => Population { below_m: 0.05..=0.2, ..population },
        _ => population,
    }
}

/// Returns the camera model of a suite.
fn camera(name: SuiteName) -> CameraMonitorParameters {
    let default = CameraMonitorParameters::default();
    match name {
        SuiteName::Noise => CameraMonitorParameters { noise_sd_m: [6e-3, 3e-3, 3e-3], ..default },
        SuiteName::Outliers => CameraMonitorParameters { outlier_probability: 0.05, ..default },
        SuiteName::Latency => CameraMonitorParameters { latency_frames: (4.0, 4.0), ..default },
        SuiteName::Drift => CameraMonitorParameters {
            depth_drift: Some(DepthDrift { sd_m: 2e-3, correlation: 0.9 }),
            noise_sd_m: [0.5e-3, 1e-3, 1e-3],
            ..default
        },
        _ => default,
    }
}

/// Returns the model of the ball's motion in a suite.
fn physics(name: SuiteName) -> Physics {
    let bounce = |frequency_hz, damping_ratio| Physics::Bounce { frequency_hz, damping_ratio };
    match name {
        SuiteName::Unilateral | SuiteName::Planar | SuiteName::Picture => Physics::Unilateral,
        SuiteName::Bounce4 => bounce(4.0, 0.1),
        SuiteName::Bounce3 => bounce(3.0, 0.1),
        SuiteName::Bounce2 => bounce(2.0, 0.05),
        SuiteName::Elastic => Physics::Elastic(&[STIFF_N_M, SOFT_N_M]),
        // Two rigs in turn have one stiffness, and other rigs in turn larger and smaller pulleys.
        SuiteName::WarmMoved | SuiteName::WarmPulleys => {
            Physics::Elastic(&[STIFF_N_M, STIFF_N_M, SOFT_N_M, SOFT_N_M])
        }
        SuiteName::Elastic800
        | SuiteName::Stiff
        | SuiteName::Warm800
        | SuiteName::Planar800
        | SuiteName::Picture800 => Physics::Elastic(&[STIFF_N_M]),
        SuiteName::Elastic150
        | SuiteName::Warm150
        | SuiteName::Planar150
        | SuiteName::Picture150 => Physics::Elastic(&[SOFT_N_M]),
        _ => Physics::QuasiStatic,
    }
}
