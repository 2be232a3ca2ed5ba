//! Plant model whose ball has mass and hangs on springs that cannot push.

use nalgebra::{Point3, Vector3};

use super::error::{RigError, check_advance};
use super::geometry::{Geometry, check_lengths};
use super::interface::Plant;
use equilibrium::equilibrium;
pub use parameters::{ElasticParameters, GRAVITY_M_S2};

mod equilibrium;
mod parameters;

/// Number of parts of a sub-step in which a cable goes slack or taut. The tension is discontinuous
/// there, which would reduce the method's order.
const PARTS_AT_A_JUMP: u32 = 32;

/// Point mass on three unilateral spring cables, without air drag.
///
/// A cable stretched by s > 0 pulls with max(0, k s + c ds/dt), where c = 2ζ√(km). An
/// unstretched cable does not pull. The motion is integrated with the classical Runge-Kutta method
/// of fourth order in fixed sub-steps, which are finer where a cable goes slack or taut. It is
/// deterministic.
#[derive(Debug, Clone, PartialEq)]
pub struct Elastic {
    geometry: Geometry,
    parameters: ElasticParameters,
    damping_n_s_m: [f64; 3],
    substep_s: f64,
    start_lengths_m: [f64; 3],
    lengths_m: [f64; 3],
    position: Point3<f64>,
    velocity: Vector3<f64>,
    tensions_n: [f64; 3],
}

impl Elastic {
    /// Creates a rig whose ball rests at `start` (metres, rig frame) on three stretched cables. The
    /// motors are at zero there.
    ///
    /// # Errors
    /// [`RigError::CannotHang`] if three cables cannot hold a ball at `start`;
    /// [`RigError::OutOfRange`] for the parameters; [`RigError::NoCable`] if a soft cable's
    /// unstretched length would be zero or less.
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
        lengths_m: [f64; 3],
    ) -> Result<Self, RigError> {
        parameters.check()?;
        check_lengths(lengths_m)?;
        let position = equilibrium(&geometry, &parameters, lengths_m);
        Self::with_position(geometry, parameters, lengths_m, position)
    }

    /// Creates a rig with these unstretched cable lengths and the ball at `position`, not moving.
    fn with_position(
        geometry: Geometry,
        parameters: ElasticParameters,
        lengths_m: [f64; 3],
        position: Point3<f64>,
    ) -> Result<Self, RigError> {
        check_lengths(lengths_m)?;
        let critical = |k: f64| 2.0 * (k * parameters.mass_kg).sqrt();
        let mut rig = Self {
            geometry,
            parameters,
            damping_n_s_m: parameters.stiffness_n_m.map(|k| parameters.damping_ratio * critical(k)),
            substep_s: parameters.substep_s(),
            start_lengths_m: lengths_m,
            lengths_m,
            position,
            velocity: Vector3::zeros(),
            tensions_n: [0.0; 3],
        };
        rig.tensions_n = rig.pull(&rig.position, &rig.velocity, lengths_m, [0.0; 3]).0;
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
    pub fn tensions_n(&self) -> [f64; 3] {
        self.tensions_n
    }

    /// Returns the tensions (N) and the ball's acceleration (m/s²) at position `p` (m) and
    /// velocity `v` (m/s), for cables of these lengths (m) that grow at these rates (m/s).
    fn pull(
        &self,
        p: &Point3<f64>,
        v: &Vector3<f64>,
        lengths: [f64; 3],
        rates: [f64; 3],
    ) -> ([f64; 3], Vector3<f64>) {
        let mut tensions = [0.0; 3];
        let mut force = Vector3::z() * (-GRAVITY_M_S2 * self.parameters.mass_kg);
        for i in 0..3 {
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
    fn pulling(&self, rates: [f64; 3]) -> [bool; 3] {
        self.pull(&self.position, &self.velocity, self.lengths_m, rates)
            .0
            .map(|tension| tension > 0.0)
    }

    /// Integrates `h` seconds: one sub-step, or smaller parts if a cable goes slack or taut in it.
    fn careful_substep(&mut self, h: f64, rates: [f64; 3]) {
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
    fn substep(&mut self, h: f64, rates: [f64; 3]) {
        let (p, v, start) = (self.position, self.velocity, self.lengths_m);
        let lengths = |t: f64| -> [f64; 3] { std::array::from_fn(|i| start[i] + rates[i] * t) };
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
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        check_advance(dt_s, motors)?;
        let goal = self.geometry.paid_out_m(self.start_lengths_m, motors)?;
        let mut rates = [0.0; 3];
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

    fn settle(&mut self, motors: [f64; 3]) -> Result<(), RigError> {
        check_advance(0.0, motors)?;
        let goal = self.geometry.paid_out_m(self.start_lengths_m, motors)?;
        self.lengths_m = goal;
        self.position = equilibrium(&self.geometry, &self.parameters, goal);
        self.velocity = Vector3::zeros();
        self.tensions_n = self.pull(&self.position, &self.velocity, goal, [0.0; 3]).0;
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        self.position
    }

    fn slack(&self) -> [bool; 3] {
        self.tensions_n.map(|tension| tension <= 0.0)
    }

    fn tensions_per_weight(&self) -> Option<[f64; 3]> {
        let weight_n = self.parameters.mass_kg * GRAVITY_M_S2;
        Some(self.tensions_n.map(|tension| tension / weight_n))
    }
}

#[cfg(test)]
mod tests;
