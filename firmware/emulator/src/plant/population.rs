//! Rigs and tasks for the comparison of laws: the paper's task and random ones.

use std::ops::RangeInclusive;

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use plumb_protocol::PerMotor;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::geometry::Geometry;
use super::interface::RigError;

/// Stream of the random numbers that give the further targets of a task.
const FURTHER_STREAM: u64 = 1 << 41;

/// Height of a random rig's motors above the rig frame's origin, metres. The ball stays above zero.
const MOTOR_HEIGHT_M: f64 = 1.2;

/// Rig with a start and a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task {
    /// The rig.
    pub geometry: Geometry,
    /// Position of the ball at the start, metres in the rig frame.
    pub start: Point3<f64>,
    /// Target, metres in the rig frame.
    pub target: Point3<f64>,
}

impl Task {
    /// Returns the paper's task: its rig, from P0 (0.540, 0.220, 0.459) to PT (0.400, 0.400, 0.150)
    /// m.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            geometry: Geometry::paper(),
            start: Point3::new(0.540, 0.220, 0.459),
            target: Point3::new(0.400, 0.400, 0.150),
        }
    }
}

/// Population of rigs and tasks from the control notes. Each quantity is uniform in its range.
///
/// A rig has A (W, D, H), B (W, 0, H), C (0, tD, H). Start and target are uniform in the part of
/// the triangle where all barycentric coordinates are at least `least_lambda`, each at its own
/// depth below the motors' plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Population {
    /// D = y_A - y_B, metres.
    pub depth_m: RangeInclusive<f64>,
    /// W = x_A - x_C, metres.
    pub width_m: RangeInclusive<f64>,
    /// t = (y_C - y_B)/D.
    pub apex: RangeInclusive<f64>,
    /// Pulley radius r of all three motors, metres.
    pub pulley_radius_m: RangeInclusive<f64>,
    /// Smallest barycentric coordinate of start and target; 0 to less than 1/3.
    pub least_lambda: f64,
    /// Distance of start and target below the plane of the motors, metres.
    pub below_m: RangeInclusive<f64>,
    /// Deviations of the rigs from the laws' assumptions; by default none.
    pub variations: Variations,
}

/// Deviations of built rigs from the laws' assumptions. The default is 0: nominal rigs.
///
/// Gravity stays along -z. Yaw and tilt rotate the motors about the centroid of their triangle, in
/// the frame in which positions are measured.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Variations {
    /// Largest yaw about the vertical in either direction, uniform; radians.
    pub yaw_rad: f64,
    /// Largest tilt of the motors' plane about a random level axis, uniform; radians.
    pub tilt_rad: f64,
    /// Largest relative deviation of each motor's pulley radius, uniform; 0.3 means ±30 %.
    pub radius_fraction: f64,
    /// Largest deviation of each motor's height, up or down, uniform; metres.
    pub height_m: f64,
}

impl Default for Population {
    /// Returns D, W 0.5-1.5 m; t 0.15-0.85; r 5-30 mm; λ >= 0.05; 0.1-1 m below the motors; no
    /// variations.
    fn default() -> Self {
        Self {
            depth_m: 0.5..=1.5,
            width_m: 0.5..=1.5,
            apex: 0.15..=0.85,
            pulley_radius_m: 0.005..=0.030,
            least_lambda: 0.05,
            below_m: 0.1..=1.0,
            variations: Variations::default(),
        }
    }
}

impl Population {
    /// Returns task number `index` of the population with this seed. It depends on nothing else:
    /// tasks may be drawn in any order, and a variation changes only its own quantity.
    ///
    /// # Errors
    /// The errors of [`Geometry::new`], if the ranges allow invalid rigs.
    pub fn sample(&self, seed: u64, index: u64) -> Result<Task, RigError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        let (d, w) = (uniform(&mut rng, &self.depth_m), uniform(&mut rng, &self.width_m));
        let t = uniform(&mut rng, &self.apex);
        let radius = uniform(&mut rng, &self.pulley_radius_m);
        let [from, to] =
            std::array::from_fn(|_| (self.lambda(&mut rng), uniform(&mut rng, &self.below_m)));

        let h = MOTOR_HEIGHT_M;
        let level = [Point3::new(w, d, h), Point3::new(w, 0.0, h), Point3::new(0.0, t * d, h)];
        let (motors, radii) = self.variations.apply(&mut rng, level, radius);
        let place = |(lambda, below)| place(&motors, lambda, below);
        Ok(Task { geometry: Geometry::new(motors, radii)?, start: place(from), target: place(to) })
    }

    /// Returns `count` further targets of task number `index` of the population with this seed, in
    /// the rig of the task. They are distributed as the first one.
    pub fn further_targets(
        &self,
        task: &Task,
        (seed, index): (u64, u64),
        count: usize,
    ) -> Vec<Point3<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(FURTHER_STREAM | index);
        let motors = task.geometry.motors();
        let mut next = |_| {
            let (lambda, below) = (self.lambda(&mut rng), uniform(&mut rng, &self.below_m));
            place(motors, lambda, below)
        };
        (0..count).map(&mut next).collect()
    }

    /// Draws barycentric coordinates, uniform in the part of the triangle where all are at least
    /// `least_lambda`.
    fn lambda(&self, rng: &mut ChaCha8Rng) -> PerMotor<f64> {
        // Two uniform cuts of the unit interval give three parts that are uniform on the triangle.
        let cuts: [f64; 2] = [rng.random(), rng.random()];
        let (first, second) = (cuts[0].min(cuts[1]), cuts[0].max(cuts[1]));
        [first, second - first, 1.0 - second]
            .map(|part| self.least_lambda + (1.0 - 3.0 * self.least_lambda) * part)
    }
}

/// Returns the place with these barycentric coordinates in the triangle of the motors, `below`
/// metres under it.
fn place(motors: &PerMotor<Point3<f64>>, lambda: PerMotor<f64>, below: f64) -> Point3<f64> {
    let above: Vector3<f64> = motors.iter().zip(lambda).map(|(m, l)| m.coords * l).sum();
    Point3::from(above - Vector3::z() * below)
}

impl Variations {
    /// Returns the motors and pulley radii with these deviations from the nominal ones.
    fn apply(
        &self,
        rng: &mut ChaCha8Rng,
        motors: PerMotor<Point3<f64>>,
        radius: f64,
    ) -> (PerMotor<Point3<f64>>, PerMotor<f64>) {
        let yaw = self.yaw_rad * symmetric(rng);
        let tilt = self.tilt_rad * rng.random::<f64>();
        let heading = std::f64::consts::PI * symmetric(rng);
        let axis = Unit::new_normalize(Vector3::new(heading.cos(), heading.sin(), 0.0));
        let turn = Rotation3::from_axis_angle(&axis, tilt)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), yaw);
        let middle = Point3::from(motors.iter().map(|m| m.coords / 3.0).sum::<Vector3<f64>>());
        let radii = std::array::from_fn(|_| radius * (1.0 + self.radius_fraction * symmetric(rng)));
        let built = motors.map(|m| {
            middle + turn * (m - middle) + Vector3::z() * (self.height_m * symmetric(rng))
        });
        (built, radii)
    }
}

/// Population of rigs with two motors in a plane, and of their tasks. Each quantity is uniform in
/// its range.
///
/// A rig has A (0, D, H), B (0, 0, H). Start and target are between the motors' verticals, each at
/// its own depth below the lower motor.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarPopulation {
    /// D = y_A - y_B, metres.
    pub apart_m: RangeInclusive<f64>,
    /// Pulley radius r of both motors, metres.
    pub pulley_radius_m: RangeInclusive<f64>,
    /// Smallest distance of start and target from the motors' verticals, parts of D; 0 to less than
    /// 1/2.
    pub least_aside: f64,
    /// Smallest distance of start and target below the lower motor, parts of D; above 0.
    pub least_below: f64,
    /// Largest distance of start and target below the lower motor, metres.
    pub most_below_m: f64,
    /// Largest deviation of each motor's height, up or down, uniform; metres.
    pub height_m: f64,
}

impl Default for PlanarPopulation {
    /// Returns D 0.5-1.5 m; r 5-30 mm; 0.15 D inside the verticals; 0.15 D to 1 m below the motors,
    /// which are at one height.
    fn default() -> Self {
        Self {
            apart_m: 0.5..=1.5,
            pulley_radius_m: 0.005..=0.030,
            least_aside: 0.15,
            least_below: 0.15,
            most_below_m: 1.0,
            height_m: 0.0,
        }
    }
}

impl PlanarPopulation {
    /// Returns task number `index` of the population with this seed, as [`Population::sample`]
    /// does.
    ///
    /// # Errors
    /// The errors of [`Geometry::planar`], if the ranges allow invalid rigs.
    pub fn sample(&self, seed: u64, index: u64) -> Result<Task, RigError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        let d = uniform(&mut rng, &self.apart_m);
        let radius = uniform(&mut rng, &self.pulley_radius_m);
        let aside = d * self.least_aside..=d * (1.0 - self.least_aside);
        let below = d * self.least_below..=self.most_below_m;
        let [from, to] =
            std::array::from_fn(|_| (uniform(&mut rng, &aside), uniform(&mut rng, &below)));

        let motors = [d, 0.0]
            .map(|y| Point3::new(0.0, y, MOTOR_HEIGHT_M + self.height_m * symmetric(&mut rng)));
        let lower = motors[0].z.min(motors[1].z);
        let place = |(y, below)| Point3::new(0.0, y, lower - below);
        let geometry = Geometry::planar(motors, [radius; 2])?;
        Ok(Task { geometry, start: place(from), target: place(to) })
    }
}

/// Draws a uniform number from a range. Its bounds may be in any order and may be not finite.
fn uniform(rng: &mut ChaCha8Rng, range: &RangeInclusive<f64>) -> f64 {
    range.start() + (range.end() - range.start()) * rng.random::<f64>()
}

/// Draws a uniform number from -1 to 1.
fn symmetric(rng: &mut ChaCha8Rng) -> f64 {
    2.0 * rng.random::<f64>() - 1.0
}

#[cfg(test)]
mod tests {
    use plumb_protocol::MOTORS;

    use super::*;
    use crate::plant::{Plant, QuasiStatic, lowest_point};

    fn shape(g: &Geometry) -> (f64, f64, f64) {
        let [a, b, c] = g.motors();
        (a.y - b.y, a.x - c.x, (c.y - b.y) / (a.y - b.y))
    }

    #[test]
    fn rigs_fill_their_ranges_and_hold_the_ball_at_start_and_target() {
        let population = Population::default();
        let tasks: Vec<Task> = (0..2000).map(|i| population.sample(42, i).unwrap()).collect();
        let spread = |value: &dyn Fn(&Task) -> f64| {
            tasks
                .iter()
                .map(value)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        };
        let fills = |name: &str, (least, greatest): (f64, f64), low: f64, high: f64| {
            let margin = 0.02 * (high - low);
            assert!(
                (low..low + margin).contains(&least) && (high - margin..high).contains(&greatest),
                "{name}: {least} to {greatest}"
            );
        };
        fills("D", spread(&|t| shape(&t.geometry).0), 0.5, 1.5);
        fills("W", spread(&|t| shape(&t.geometry).1), 0.5, 1.5);
        fills("t", spread(&|t| shape(&t.geometry).2), 0.15, 0.85);
        fills("r", spread(&|t| t.geometry.pulley_radii_m()[1]), 0.005, 0.030);
        fills("h", spread(&|t| t.geometry.motors()[0].z - t.target.z), 0.1, 1.0);
        for corner in 0..MOTORS {
            let mean = tasks.iter().map(|t| t.geometry.barycentric(&t.start)[corner]).sum::<f64>()
                / 2000.0;
            assert!((mean - 1.0 / 3.0).abs() < 0.02, "λ is {mean} in the mean at corner {corner}");
        }
        for task in &tasks {
            for p in [task.start, task.target] {
                assert!(task.geometry.barycentric(&p).iter().all(|l| *l > 0.05 - 1e-9));
                assert_eq!(QuasiStatic::new(task.geometry, p).unwrap().slack(), [false; MOTORS]);
            }
        }
    }

    #[test]
    fn a_task_depends_on_its_seed_and_number_only() {
        let population = Population::default();
        assert_eq!(population.sample(1, 5), population.sample(1, 5));
        assert_ne!(population.sample(1, 5), population.sample(1, 6));
        assert_ne!(population.sample(1, 5), population.sample(2, 5));
    }

    #[test]
    fn further_targets_are_in_the_tasks_rig_and_depend_on_its_number_only() {
        let population = Population::default();
        for index in 0..200 {
            let task = population.sample(3, index).unwrap();
            let places = population.further_targets(&task, (3, index), 2);
            assert_eq!(places, population.further_targets(&task, (3, index), 2));
            assert!(places[0] != places[1] && places[0] != task.target);
            for place in places {
                assert!(task.geometry.barycentric(&place).iter().all(|l| *l > 0.05 - 1e-9));
                assert!((0.1..=1.0).contains(&(1.2 - place.z)), "{place}");
            }
        }
    }

    #[test]
    fn each_variation_changes_its_own_quantity() {
        let with =
            |variations| Population { variations, ..Population::default() }.sample(9, 3).unwrap();
        let plain = with(Variations::default());
        let radii = with(Variations { radius_fraction: 0.3, ..Default::default() });
        assert_eq!((radii.geometry.motors(), radii.start), (plain.geometry.motors(), plain.start));
        for (varied, nominal) in
            radii.geometry.pulley_radii_m().into_iter().zip(plain.geometry.pulley_radii_m())
        {
            assert!((varied / nominal - 1.0).abs() <= 0.3 && varied != nominal);
        }
        let yaw = with(Variations { yaw_rad: 0.35, ..Default::default() });
        assert!(
            yaw.geometry
                .motors()
                .iter()
                .zip(plain.geometry.motors())
                .all(|(a, b)| a.z == b.z && a != b)
        );
        assert!(
            (yaw.geometry.cable_lengths_m(&yaw.start)[0]
                - plain.geometry.cable_lengths_m(&plain.start)[0])
                .abs()
                < 1e-12
        );
        let heights = with(Variations { height_m: 0.1, ..Default::default() });
        assert!(heights.geometry.motors().iter().all(|m| (m.z - 1.2).abs() <= 0.1 && m.z != 1.2));
        let tilt = with(Variations { tilt_rad: 0.35, ..Default::default() });
        let normal = |t: &Task| {
            let [a, b, c] = t.geometry.motors();
            (a - c).cross(&(b - c)).normalize().z.abs()
        };
        assert!(normal(&tilt) < 1.0 - 1e-6 && normal(&tilt) >= 0.35f64.cos());
    }

    #[test]
    fn varied_rigs_still_hold_their_balls() {
        let variations =
            Variations { yaw_rad: 0.35, tilt_rad: 0.35, radius_fraction: 0.3, height_m: 0.1 };
        let population = Population { variations, ..Population::default() };
        for index in 0..500 {
            let task = population.sample(7, index).unwrap();
            for p in [task.start, task.target] {
                assert_eq!(
                    QuasiStatic::new(task.geometry, p).unwrap().slack(),
                    [false; MOTORS],
                    "task {index}"
                );
            }
        }
    }

    /// Returns 1 000 tasks in a plane, with motors at different heights.
    fn planar_tasks() -> Vec<Task> {
        let population = PlanarPopulation { height_m: 0.1, ..Default::default() };
        assert_ne!(population.sample(2, 5), population.sample(2, 6));
        (0..1000).map(|index| population.sample(2, index).unwrap()).collect()
    }

    #[test]
    fn tasks_in_a_plane_keep_their_distances() {
        for task in planar_tasks() {
            let [a, b, _] = *task.geometry.motors();
            assert!((0.5..1.5).contains(&a.y) && b.y == 0.0 && a.z != b.z);
            for p in [task.start, task.target] {
                let below = a.z.min(b.z) - p.z;
                assert!((0.15 * a.y - 1e-12..1.0).contains(&below), "{below} m below for {a}");
                assert!((0.15 * a.y..=0.85 * a.y).contains(&p.y), "{p} for {a}");
                let rig = QuasiStatic::new(task.geometry, p).unwrap();
                assert!((rig.ball() - p).norm() < 1e-9, "{} is not {p}", rig.ball());
                assert_eq!(rig.slack(), [false; MOTORS]);
            }
        }
    }

    #[test]
    fn in_a_plane_the_cables_have_the_same_signs_everywhere() {
        for Task { geometry, start, .. } in planar_tasks() {
            let j = geometry.jacobian(&start).unwrap();
            let signs = j.map(|entry| if entry == 0.0 { 0.0 } else { entry.signum() });
            #[rustfmt::skip]
            let expected = nalgebra::Matrix3::new(
                0.0, 0.0, 0.0,
                -1.0, 1.0, 0.0,
                -1.0, -1.0, 0.0,
            );
            assert_eq!(signs, expected, "{j} at {start}");
            let tensions = geometry.tensions_per_weight(&start).unwrap();
            let pulls = geometry.motors().iter().zip(tensions);
            let force: Vector3<f64> = pulls.map(|(m, t)| (m - start).normalize() * t).sum();
            assert!((force - Vector3::z()).norm() < 1e-12, "{tensions:?} at {start}");
            // The derivative of the forward kinematics, by central differences.
            for motor in 0..MOTORS {
                let at = |change: f64| {
                    let mut lengths = geometry.cable_lengths_m(&start);
                    lengths[motor] += change;
                    lowest_point(&geometry, lengths).unwrap().ball
                };
                let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
                assert!((slope - j.column(motor)).norm() < 1e-6, "{slope} for {j} at {start}");
            }
        }
    }

    #[test]
    fn impossible_ranges_are_refused() {
        let flat = Population { width_m: 0.0..=0.0, ..Population::default() };
        assert!(matches!(flat.sample(1, 1), Err(RigError::Flat { .. })));
        let nan = Population { pulley_radius_m: f64::NAN..=f64::NAN, ..Population::default() };
        assert!(matches!(nan.sample(1, 1), Err(RigError::OutOfRange { .. })));
        let upright = PlanarPopulation { apart_m: 0.0..=0.0, ..Default::default() };
        assert!(matches!(upright.sample(1, 1), Err(RigError::AboveOneAnother { .. })));
    }
}
