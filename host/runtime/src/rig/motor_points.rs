//! Motor points of a rig, for the outputs that draw it.

use nalgebra::Point3;

use super::{Rig, Simulation, Size};

/// Names of the motors.
const EXACT: [&str; 3] = ["A", "B", "C"];

/// Names of motors whose places are approximate.
const APPROXIMATE: [&str; 3] = ["A (approximate)", "B (approximate)", "C (approximate)"];

/// Motor points of a rig. No law uses them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorPoints {
    /// Places of motors A, B, C, metres in the rig frame.
    pub places: [Point3<f64>; 3],
    /// Whether a person has measured them: they come from the table `[size]`.
    pub is_approximate: bool,
}

impl MotorPoints {
    /// Returns the names of the motors, with a mark where their places are approximate.
    pub fn names(&self) -> [&'static str; 3] {
        if self.is_approximate { APPROXIMATE } else { EXACT }
    }
}

impl Rig {
    /// Returns the motor points, by the table `[simulation]` of a simulated rig, or else by
    /// `[size]`; `None` where the rig file has neither.
    pub fn motor_points(&self) -> Option<MotorPoints> {
        let exact = self.simulation.as_ref().map(Simulation::motors);
        let exact = exact.map(|places| MotorPoints { places, is_approximate: false });
        let rough = || {
            let places = self.size.as_ref().map(Size::motors)?;
            Some(MotorPoints { places, is_approximate: true })
        };
        exact.or_else(rough)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_places_of_a_simulated_rig_are_exact_and_measured_ones_approximate() {
        let rig = Rig::paper().unwrap();
        let exact = rig.motor_points().unwrap();
        assert_eq!((exact.is_approximate, exact.names()), (false, ["A", "B", "C"]));
        let unknown = Rig { simulation: None, size: None, ..rig.clone() };
        assert_eq!(unknown.motor_points(), None);
        let size: Size = toml::from_str(
            "motors = [[1.0, 0.7, 0.6], [1.0, 0.0, 0.6], [0.0, 0.4, 0.6]]\n\
             cable_per_step = 0.0005",
        )
        .unwrap();
        let measured = Rig { size: Some(size), ..unknown }.motor_points().unwrap();
        assert_eq!((measured.is_approximate, measured.names()[2]), (true, "C (approximate)"));
        assert_eq!(measured.places[1], Point3::new(1.0, 0.0, 0.6));
    }
}
