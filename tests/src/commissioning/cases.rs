//! Rigs of the population with no fault, one or two.

use nalgebra::{Affine3, Matrix3, Matrix4, Point3};
use plumb_emulator::plant::{
    Elastic, ElasticParameters, Geometry, Plant, Population, QuasiStatic, RigError, Task,
    Variations, lowest_point,
};
use plumb_runtime::rig::{Rig, Size};
use plumb_setup::commission::{Explanation, Fault, Frame, Output, Wiring};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{from_value, json};

/// Largest error of a length by tape measure, metres.
const TAPE_M: f64 = 0.015;

/// Fault of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mistake {
    /// Motors on the wrong outputs or with the wrong direction.
    Wiring(Wiring),
    /// A motor that does not turn.
    Still(Output),
    /// A slack cable, with this length to spare, metres.
    Slack(Output, f64),
    /// A cable that slips when it is wound in: half of it.
    Slips(Output),
    /// A camera's pose that is turned or mirrored.
    Frame(Frame),
}

/// A rig with its faults.
pub struct Case {
    /// Rig file.
    pub rig: Rig,
    /// Faults; none of a right rig.
    pub mistakes: Vec<Mistake>,
    /// Seed of the camera's noise.
    pub seed: u64,
    task: Task,
    /// Ball and cables; `None` for rigid cables.
    elastic: Option<ElasticParameters>,
}

impl Case {
    /// Returns case `index` of `seed` without a fault: a rig of the population with a pose that is
    /// a few degrees off, and every other rig with its size by tape measure.
    pub fn right(seed: u64, index: u64) -> Self {
        let degrees = std::f64::consts::PI / 180.0;
        let population = Population {
            least_lambda: 0.12,
            variations: Variations {
                yaw_rad: 5.0 * degrees,
                tilt_rad: 3.0 * degrees,
                radius_fraction: 0.1,
                ..Variations::default()
            },
            ..Population::default()
        };
        let task = population.sample(seed, index).expect("a rig of the population");
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ index << 32);
        let rig = rig_file(&task, index.is_multiple_of(2), &mut random);
        let elastic = (index % 4 >= 2).then(ElasticParameters::default);
        Self { rig, mistakes: Vec::new(), seed: index, task, elastic }
    }

    /// Returns the case with this ball and these cables; `None` for rigid cables.
    #[must_use]
    pub fn with_cables(self, elastic: Option<ElasticParameters>) -> Self {
        Self { elastic, ..self }
    }

    /// Returns the slowest period of a ball of this mass (kg) at the start, on cables of this
    /// stiffness (N/m), seconds: 2π √(m/k) over the least singular value of the matrix of the
    /// cables' unit vectors.
    pub fn slowest_period_s(&self, mass_kg: f64, stiffness_n_m: f64) -> f64 {
        let Task { geometry, start, .. } = self.task;
        let cables = geometry.motors().map(|motor| (start - motor).normalize());
        let least = Matrix3::from_columns(&cables).singular_values().min();
        std::f64::consts::TAU * (mass_kg / stiffness_n_m).sqrt() / least
    }

    /// Returns the lengths of the cables at the start, metres.
    pub fn lengths_m(&self) -> [f64; 3] {
        self.task.geometry.cable_lengths_m(&self.task.start)
    }

    /// Returns case `index` of `seed` with a fault: ten kinds in turn.
    pub fn wrong(seed: u64, index: u64) -> Self {
        let right = Self::right(seed, index);
        let mut random = ChaCha8Rng::seed_from_u64(!seed ^ index << 32);
        Self { mistakes: vec![mistake(index, &mut random)], ..right }
    }

    /// Returns case `index` of `seed` with two faults: one of the wiring and a mechanical one, or
    /// two mechanical ones; eight kinds in turn.
    pub fn doubly_wrong(seed: u64, index: u64) -> Self {
        let right = Self::right(seed, index);
        let mut random = ChaCha8Rng::seed_from_u64(!seed ^ index << 32);
        Self { mistakes: two_mistakes(index, &mut random).into(), ..right }
    }

    /// Returns the plant with its fault.
    ///
    /// # Panics
    /// Where the rig cannot hang.
    pub fn plant(&self) -> Box<dyn Plant + Send> {
        let Task { geometry, start, .. } = self.task;
        let wiring = self.wiring();
        let lengths = self.mistakes.iter().find_map(|mistake| match *mistake {
            Mistake::Slack(output, spare) => {
                Some(with_slack(&geometry, start, wiring.motors[output as usize], spare))
            }
            _ => None,
        });
        let plant: Box<dyn Plant + Send> = match (lengths, self.elastic) {
            (Some(lengths), None) => {
                Box::new(QuasiStatic::with_lengths(geometry, lengths).expect("a rig"))
            }
            (Some(lengths), Some(elastic)) => {
                Box::new(Elastic::with_lengths(geometry, elastic, lengths).expect("a rig"))
            }
            (None, None) => Box::new(QuasiStatic::new(geometry, start).expect("a rig")),
            (None, Some(elastic)) => {
                Box::new(Elastic::new(geometry, elastic, start).expect("a rig"))
            }
        };
        let mistakes = self.mistakes.clone();
        Box::new(Faulty { plant, wiring, mistakes, last: [0.0; 3], turned: [0.0; 3] })
    }

    /// Returns the wiring of the motors.
    fn wiring(&self) -> Wiring {
        let wiring = self.mistakes.iter().find_map(|mistake| match *mistake {
            Mistake::Wiring(wiring) => Some(wiring),
            _ => None,
        });
        wiring.unwrap_or(Wiring::RIGHT)
    }

    /// Returns the frame of the measured positions.
    fn frame(&self) -> Frame {
        let frame = self.mistakes.iter().find_map(|mistake| match *mistake {
            Mistake::Frame(frame) => Some(frame),
            _ => None,
        });
        frame.unwrap_or(Frame::RIGHT)
    }

    /// Returns the map from the rig frame to the frame of the measured positions.
    pub fn seen(&self) -> Affine3<f64> {
        // A pose that was taken in other axes with the same origin.
        let mut matrix = Matrix4::identity();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.frame().matrix());
        Affine3::from_matrix_unchecked(matrix)
    }

    /// Returns the faults that the rig has.
    pub fn faults(&self) -> Vec<Fault> {
        let mechanical = self.mistakes.iter().filter_map(|mistake| match *mistake {
            Mistake::Still(output) => Some(Fault::Still(output)),
            Mistake::Slack(output, _) => Some(Fault::Slack(output)),
            Mistake::Slips(output) => Some(Fault::Slips(output)),
            Mistake::Wiring(_) | Mistake::Frame(_) => None,
        });
        let explanation = Explanation { wiring: self.wiring(), frame: self.frame() };
        mechanical.chain(explanation.faults()).collect()
    }
}

/// Returns the rig file of `task`, with the size of the rig by tape measure where `has_size`.
fn rig_file(task: &Task, has_size: bool, random: &mut ChaCha8Rng) -> Rig {
    let mut rig = Rig::paper().expect("the paper's rig file");
    let mut measured = |value: f64| value + TAPE_M * (2.0 * random.random::<f64>() - 1.0);
    let motors = task.geometry.motors().map(|motor| [motor.x, motor.y, motor.z].map(&mut measured));
    let step = task.geometry.step_lengths_m()[0];
    let size = json!({ "motors": motors, "cable_per_step": step });
    rig.size = has_size.then(|| from_value::<Size>(size).expect("a size"));
    let corner = |sign: f64| [0, 1, 2].map(|k| task.start[k] + sign * 0.2);
    let workspace = json!({ "min": corner(-1.0), "max": corner(1.0) });
    rig.workspace = from_value(workspace).expect("a workspace");
    rig
}

/// Motors on the outputs after an exchange of two.
const SWAPS: [[usize; 3]; 3] = [[1, 0, 2], [2, 1, 0], [0, 2, 1]];

fn mistake(index: u64, random: &mut ChaCha8Rng) -> Mistake {
    let any = random.random_range(0..3usize);
    let output = Output::ALL[any];
    let only = |which: usize| [0, 1, 2].map(|k| k == which);
    let swap = Wiring { motors: SWAPS[any], ..Wiring::RIGHT };
    let turns = Frame { yaw_deg: 90 * (1 + any as u16), ..Frame::RIGHT };
    match index % 10 {
        0 => Mistake::Wiring(swap),
        1 => Mistake::Wiring(Wiring { motors: [[1, 2, 0], [2, 0, 1]][any % 2], ..Wiring::RIGHT }),
        2 => Mistake::Wiring(Wiring { reversed: only(any), ..Wiring::RIGHT }),
        3 => Mistake::Wiring(Wiring { reversed: only(any).map(|it| !it), ..Wiring::RIGHT }),
        4 => Mistake::Wiring(Wiring { reversed: only(random.random_range(0..3)), ..swap }),
        5 => Mistake::Still(output),
        6 => Mistake::Slack(output, 0.005 + 0.025 * random.random::<f64>()),
        7 => Mistake::Slips(output),
        8 => Mistake::Frame(turns),
        _ => Mistake::Frame(Frame { mirrored: true, ..Frame::RIGHT }),
    }
}

/// Returns two faults of one rig, those of cables and motors on different outputs.
fn two_mistakes(index: u64, random: &mut ChaCha8Rng) -> [Mistake; 2] {
    let first = random.random_range(0..3usize);
    let second = (first + 1 + random.random_range(0..2usize)) % 3;
    let [one, other] = [first, second].map(|k| Output::ALL[k]);
    let swap = Mistake::Wiring(Wiring { motors: SWAPS[first], ..Wiring::RIGHT });
    let reversed = [0, 1, 2].map(|k| k == first);
    let reversal = Mistake::Wiring(Wiring { reversed, ..Wiring::RIGHT });
    let spare = 0.005 + 0.025 * random.random::<f64>();
    let slack = |output| Mistake::Slack(output, spare);
    match index % 8 {
        0 => [swap, Mistake::Still(other)],
        1 => [swap, slack(other)],
        2 => [swap, Mistake::Slips(other)],
        3 => [reversal, Mistake::Still(other)],
        4 => [reversal, slack(other)],
        5 => [reversal, Mistake::Slips(other)],
        6 => [Mistake::Still(one), slack(other)],
        _ => [Mistake::Still(one), Mistake::Still(other)],
    }
}

/// Returns the cable lengths of a ball that hangs on two cables, the third with `spare` left.
fn with_slack(geometry: &Geometry, start: Point3<f64>, motor: usize, spare: f64) -> [f64; 3] {
    let mut lengths = geometry.cable_lengths_m(&start);
    lengths[motor] += 10.0;
    let hang = lowest_point(geometry, lengths).expect("a ball on two cables");
    lengths[motor] = (hang.ball - geometry.motors()[motor]).norm() + spare;
    lengths
}

/// Plant with faults between the board and the cables.
struct Faulty {
    plant: Box<dyn Plant + Send>,
    wiring: Wiring,
    mistakes: Vec<Mistake>,
    /// Positions of the outputs at the last call, steps.
    last: [f64; 3],
    /// Turn of the motors since the start, steps.
    turned: [f64; 3],
}

impl Faulty {
    /// Returns the share of `turn` (steps of the motor on `output`) that moves its cable.
    fn share(&self, output: Output, turn: f64) -> f64 {
        let shares = self.mistakes.iter().map(|mistake| match *mistake {
            Mistake::Still(still) if still == output => 0.0,
            Mistake::Slips(slips) if slips == output && turn < 0.0 => 0.5,
            _ => 1.0,
        });
        shares.product()
    }
}

impl Plant for Faulty {
    fn advance(&mut self, dt_s: f64, outputs: [f64; 3]) -> Result<(), RigError> {
        for (output, position) in Output::ALL.into_iter().zip(outputs) {
            let number = output as usize;
            let sign = if self.wiring.reversed[number] { -1.0 } else { 1.0 };
            let turn = sign * (position - self.last[number]);
            self.turned[self.wiring.motors[number]] += self.share(output, turn) * turn;
        }
        self.last = outputs;
        self.plant.advance(dt_s, self.turned)
    }

    fn ball(&self) -> Point3<f64> {
        self.plant.ball()
    }

    fn slack(&self) -> [bool; 3] {
        self.plant.slack()
    }
}
