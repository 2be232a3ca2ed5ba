//! Rest position of a ball on unilateral springs.

use nalgebra::{Matrix3, Point3, Vector3};

use super::parameters::{ElasticParameters, GRAVITY_M_S2};
use crate::plant::forward::lowest_point;
use crate::plant::geometry::Geometry;

/// Returns the ball's rest position: the minimum of its potential energy, which is convex. The
/// search takes damped Newton steps (Levenberg-Marquardt) from the rest position on rigid cables.
pub(super) fn equilibrium(
    geometry: &Geometry,
    parameters: &ElasticParameters,
    lengths: [f64; 3],
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
pub(super) struct Potential {
    pub(super) energy: f64,
    gradient: Vector3<f64>,
    hessian: Matrix3<f64>,
}

/// Returns the potential energy of a ball at `p` on cables of these unstretched lengths (m).
pub(super) fn potential(
    geometry: &Geometry,
    parameters: &ElasticParameters,
    lengths: [f64; 3],
    p: &Point3<f64>,
) -> Potential {
    let weight = parameters.mass_kg * GRAVITY_M_S2;
    let mut sum = Potential {
        energy: weight * p.z,
        gradient: Vector3::z() * weight,
        hessian: Matrix3::zeros(),
    };
    for ((motor, k), length) in geometry.motors().iter().zip(parameters.stiffness_n_m).zip(lengths)
    {
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
