//! Plant model whose ball has mass and hangs on springs that cannot push: its parameters, its
//! motion, and its rest position.

#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_protocol::{MOTORS, PerMotor};

use super::forward::lowest_point;
use super::geometry::{Geometry, add};
use super::interface::{Plant, RigError, check, check_advance};

/// Number of parts of a sub-step in which a cable goes slack or taut. The tension is discontinuous
/// there, which would reduce the method's order.
const PARTS_AT_A_JUMP: u32 = 32;

/// Point mass on unilateral spring cables, without air drag. On two cables it can swing out of
/// their plane as a pendulum.
///
/// A cable stretched by s > 0 pulls with max(0, k s + c ds/dt), where c = 2ζ√(km). An
/// unstretched cable does not pull. The motion is integrated with the classical Runge-Kutta method
/// of fourth order in fixed sub-steps, which are finer where a cable goes slack or taut. It is
/// deterministic.
#[derive(Debug, Clone, PartialEq)]
pub struct Elastic {
    geometry: Geometry,
    parameters: ElasticParameters,
    damping_n_s_m: PerMotor<f64>,
    substep_s: f64,
    start_lengths_m: PerMotor<f64>,
    /// Cable that has run off.
    run_off_m: PerMotor<f64>,
    lengths_m: PerMotor<f64>,
    position: Point3<f64>,
    velocity: Vector3<f64>,
    tensions_n: PerMotor<f64>,
}

impl Elastic {
    /// Creates a rig whose ball rests at `start` (metres, rig frame) on stretched cables. The
    /// motors are at zero there.
    ///
    /// # Errors
    /// [`RigError::CannotHang`] if the cables cannot hold a ball at `start`;
    /// [`RigError::OutOfRange`] for the parameters, or if `start` is off the plane of two motors;
    /// [`RigError::NoCable`] if a soft cable's unstretched length would be zero or less.
    pub fn new(
        geometry: Geometry,
        parameters: ElasticParameters,
        start: Point3<f64>,
    ) -> Result<Self, RigError> {
        parameters.check()?;
        let per_weight = geometry.check_hangs(&start)?;
        let straight = geometry.cable_lengths_m(&start);
        let weight = parameters.mass_kg * GRAVITY_M_S2;
        let lengths = std::array::from_fn(|i| {
            straight[i] - per_weight[i] * weight / parameters.stiffness_n_m[i]
        });
        Self::with_position(geometry, parameters, lengths, start)
    }

    /// Creates a rig with these unstretched cable lengths (metres; A, B, C) when the motors are at
    /// zero. The ball starts at rest. Cables may be slack.
    ///
    /// # Errors
    /// [`RigError::OutOfRange`], [`RigError::NoCable`].
    pub fn with_lengths(
        geometry: Geometry,
        parameters: ElasticParameters,
        lengths_m: PerMotor<f64>,
    ) -> Result<Self, RigError> {
        parameters.check()?;
        geometry.check_lengths(lengths_m)?;
        let position = equilibrium(&geometry, &parameters, lengths_m);
        Self::with_position(geometry, parameters, lengths_m, position)
    }

    /// Creates a rig with these unstretched cable lengths and the ball at `position`, not moving.
    fn with_position(
        geometry: Geometry,
        parameters: ElasticParameters,
        lengths_m: PerMotor<f64>,
        position: Point3<f64>,
    ) -> Result<Self, RigError> {
        geometry.check_lengths(lengths_m)?;
        let critical = |k: f64| 2.0 * (k * parameters.mass_kg).sqrt();
        let mut rig = Self {
            geometry,
            parameters,
            damping_n_s_m: parameters.stiffness_n_m.map(|k| parameters.damping_ratio * critical(k)),
            substep_s: parameters.substep_s(),
            start_lengths_m: lengths_m,
            run_off_m: [0.0; MOTORS],
            lengths_m,
            position,
            velocity: Vector3::zeros(),
            tensions_n: [0.0; MOTORS],
        };
        rig.tensions_n = rig.pull(&rig.position, &rig.velocity, lengths_m, [0.0; MOTORS]).0;
        Ok(rig)
    }

    /// Returns the rig's geometry.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Returns the ball's velocity, m/s in the rig frame.
    #[must_use]
    pub fn velocity(&self) -> Vector3<f64> {
        self.velocity
    }

    /// Returns the tension of each cable, newtons, >= 0; order A, B, C.
    #[must_use]
    pub fn tensions_n(&self) -> PerMotor<f64> {
        self.tensions_n
    }

    /// Returns the tensions (N) and the ball's acceleration (m/s²) at position `p` (m) and
    /// velocity `v` (m/s), for cables of these lengths (m) that grow at these rates (m/s).
    fn pull(
        &self,
        p: &Point3<f64>,
        v: &Vector3<f64>,
        lengths: PerMotor<f64>,
        rates: PerMotor<f64>,
    ) -> (PerMotor<f64>, Vector3<f64>) {
        let mut tensions = [0.0; MOTORS];
        let mut force = Vector3::z() * (-GRAVITY_M_S2 * self.parameters.mass_kg);
        for i in 0..self.geometry.count() {
            let from = p - self.geometry.motors()[i];
            let distance = from.norm();
            let stretch = distance - lengths[i];
            if stretch > 0.0 {
                let outward = from / distance;
                let rate = outward.dot(v) - rates[i];
                tensions[i] = (self.parameters.stiffness_n_m[i] * stretch
                    + self.damping_n_s_m[i] * rate)
                    .max(0.0);
                force -= outward * tensions[i];
            }
        }
        (tensions, force / self.parameters.mass_kg)
    }

    /// Returns which cables pull while their lengths grow at `rates` (m/s).
    fn pulling(&self, rates: PerMotor<f64>) -> PerMotor<bool> {
        self.pull(&self.position, &self.velocity, self.lengths_m, rates)
            .0
            .map(|tension| tension > 0.0)
    }

    /// Integrates `h` seconds: one sub-step, or smaller parts if a cable goes slack or taut in it.
    fn careful_substep(&mut self, h: f64, rates: PerMotor<f64>) {
        let before = (self.position, self.velocity, self.lengths_m);
        let pulling = self.pulling(rates);
        self.substep(h, rates);
        if self.pulling(rates) != pulling {
            (self.position, self.velocity, self.lengths_m) = before;
            for _ in 0..PARTS_AT_A_JUMP {
                self.substep(h / f64::from(PARTS_AT_A_JUMP), rates);
            }
        }
    }

    /// Integrates one Runge-Kutta sub-step of `h` seconds, in which the cable lengths grow from
    /// `self.lengths_m` at `rates` (m/s).
    fn substep(&mut self, h: f64, rates: PerMotor<f64>) {
        let (p, v, start) = (self.position, self.velocity, self.lengths_m);
        let lengths =
            |t: f64| -> PerMotor<f64> { std::array::from_fn(|i| start[i] + rates[i] * t) };
        let (middle, end) = (lengths(h / 2.0), lengths(h));
        let a1 = self.pull(&p, &v, start, rates).1;
        let v2 = v + a1 * (h / 2.0);
        let a2 = self.pull(&(p + v * (h / 2.0)), &v2, middle, rates).1;
        let v3 = v + a2 * (h / 2.0);
        let a3 = self.pull(&(p + v2 * (h / 2.0)), &v3, middle, rates).1;
        let v4 = v + a3 * h;
        let a4 = self.pull(&(p + v3 * h), &v4, end, rates).1;
        self.position += (v + (v2 + v3) * 2.0 + v4) * (h / 6.0);
        self.velocity += (a1 + (a2 + a3) * 2.0 + a4) * (h / 6.0);
        self.lengths_m = end;
    }
}

impl Plant for Elastic {
    /// Implements [`Plant::advance`]. The cable lengths change linearly. With `dt_s` = 0 the motors
    /// jump and the ball does not move.
    fn advance(&mut self, dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError> {
        check_advance(dt_s, motors)?;
        let goal = self.geometry.paid_out_m(add(self.start_lengths_m, self.run_off_m), motors)?;
        let mut rates = [0.0; MOTORS];
        if dt_s > 0.0 {
            rates = std::array::from_fn(|i| (goal[i] - self.lengths_m[i]) / dt_s);
            let substeps = (dt_s / self.substep_s).ceil().max(1.0);
            let h = dt_s / substeps;
            let mut left = substeps;
            while left > 0.0 {
                self.careful_substep(h, rates);
                left -= 1.0;
            }
        }
        self.lengths_m = goal;
        self.tensions_n = self.pull(&self.position, &self.velocity, goal, rates).0;
        Ok(())
    }

    fn settle(&mut self, motors: PerMotor<f64>) -> Result<(), RigError> {
        check_advance(0.0, motors)?;
        let goal = self.geometry.paid_out_m(add(self.start_lengths_m, self.run_off_m), motors)?;
        self.lengths_m = goal;
        self.position = equilibrium(&self.geometry, &self.parameters, goal);
        self.velocity = Vector3::zeros();
        self.tensions_n = self.pull(&self.position, &self.velocity, goal, [0.0; MOTORS]).0;
        Ok(())
    }

    fn run_off(&mut self, heights_m: PerMotor<f64>) {
        let more = self.geometry.lengthening_m(&self.position, heights_m);
        self.run_off_m = add(self.run_off_m, more);
    }

    fn hang_again(&mut self) {
        self.run_off_m = [0.0; MOTORS];
    }

    fn ball(&self) -> Point3<f64> {
        self.position
    }

    fn slack(&self) -> PerMotor<bool> {
        std::array::from_fn(|i| i < self.geometry.count() && self.tensions_n[i] <= 0.0)
    }

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        let weight_n = self.parameters.mass_kg * GRAVITY_M_S2;
        Some(self.tensions_n.map(|tension| tension / weight_n))
    }
}

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
    pub stiffness_n_m: PerMotor<f64>,
    /// Damping ratio ζ of the ball on a single cable: damping 2ζ√(km) of the stretch rate; 0 to
    /// 10.
    pub damping_ratio: f64,
}

impl Default for ElasticParameters {
    /// Returns 0.2 kg, 800 N/m, ζ = 0.1: the stiffer of the control notes' two rigs.
    fn default() -> Self {
        Self { mass_kg: 0.2, stiffness_n_m: [800.0; MOTORS], damping_ratio: 0.1 }
    }
}

impl ElasticParameters {
    /// Checks the ranges.
    fn check(&self) -> Result<(), RigError> {
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
    fn substep_s(&self) -> f64 {
        let highest = (self.stiffness_n_m.iter().sum::<f64>() / self.mass_kg).sqrt()
            * (1.0 + 2.0 * self.damping_ratio);
        (SUBSTEP_RAD / highest).min(LONGEST_SUBSTEP_S)
    }
}

/// Returns the ball's rest position: the minimum of its potential energy, which is convex. The
/// search takes damped Newton steps (Levenberg-Marquardt) from the rest position on rigid cables.
fn equilibrium(
    geometry: &Geometry,
    parameters: &ElasticParameters,
    lengths: PerMotor<f64>,
) -> Point3<f64> {
    let weight = parameters.mass_kg * GRAVITY_M_S2;
    let softest = parameters.stiffness_n_m.iter().fold(f64::INFINITY, |a, k| a.min(*k));
    let rigid = lowest_point(geometry, lengths).map_or_else(
        |_| Point3::from(geometry.motors().iter().map(|m| m.coords / 3.0).sum::<Vector3<f64>>()),
        |hang| hang.ball,
    );
    let mut p = rigid - Vector3::z() * (weight / softest);
    let mut lambda = softest;
    let mut here = potential(geometry, parameters, lengths, &p);
    for _ in 0..500 {
        if here.gradient.norm() < 1e-12 * weight {
            break;
        }
        let damped = here.hessian + Matrix3::identity() * lambda;
        let Some(step) = damped.cholesky().map(|c| c.solve(&here.gradient)) else {
            lambda *= 4.0;
            continue;
        };
        let there = potential(geometry, parameters, lengths, &(p - step));
        // Near the minimum, rounding hides the change of the energy, but not of the gradient.
        if there.energy < here.energy || there.gradient.norm() < here.gradient.norm() {
            (p, here, lambda) = (p - step, there, lambda / 8.0);
        } else {
            lambda *= 4.0;
        }
    }
    p
}

/// Potential energy of the ball (J), its gradient (N) and its Hessian (N/m).
struct Potential {
    energy: f64,
    gradient: Vector3<f64>,
    hessian: Matrix3<f64>,
}

/// Returns the potential energy of a ball at `p` on cables of these unstretched lengths (m).
fn potential(
    geometry: &Geometry,
    parameters: &ElasticParameters,
    lengths: PerMotor<f64>,
    p: &Point3<f64>,
) -> Potential {
    let weight = parameters.mass_kg * GRAVITY_M_S2;
    let mut sum = Potential {
        energy: weight * p.z,
        gradient: Vector3::z() * weight,
        hessian: Matrix3::zeros(),
    };
    let cables = geometry.motors().iter().zip(parameters.stiffness_n_m).zip(lengths);
    for ((motor, k), length) in cables.take(geometry.count()) {
        let from = p - motor;
        let distance = from.norm();
        let stretch = distance - length;
        if stretch > 0.0 {
            let n = from / distance;
            let along = n * n.transpose();
            sum.energy += 0.5 * k * stretch * stretch;
            sum.gradient += n * (k * stretch);
            sum.hessian += (along + (Matrix3::identity() - along) * (stretch / distance)) * k;
        }
    }
    sum
}
