//! Plant behind the wiring of a rig: swapped and reversed motors.

use nalgebra::Point3;
use plumb_emulator::plant::{Plant, RigError};
use plumb_protocol::{MOTORS, MotorList, PerMotor};
use plumb_runtime::rig::{Rig, Simulation};

/// Plant whose motors are wired to the outputs of a board.
struct Wired {
    plant: Box<dyn Plant + Send>,
    outputs: PerMotor<Output>,
}

/// Motor on an output of the board.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Output {
    /// Number of the motor: A 0, B 1, C 2.
    motor: usize,
    /// Turn of the motor for a step of the output: 1, or -1 where it turns the wrong way.
    sign: f64,
}

/// Connects the motors of `plant` to the board as `simulation` and the directions of `rig` say.
///
/// A motor turns the wrong way where either `motors.reversed` of its output or
/// `simulation.reversed` of the motor is set. Where both are set, it turns the right way.
pub fn wired(
    rig: &Rig,
    simulation: &Simulation,
    plant: Box<dyn Plant + Send>,
) -> Box<dyn Plant + Send> {
    let motors = simulation.wiring.motors();
    let outputs = std::array::from_fn(|output| {
        let motor = motors.get(output).copied().unwrap_or(output);
        let of = |list: Option<MotorList<bool>>, at| {
            list.is_some_and(|list| list.get(at) == Some(&true))
        };
        let is_reversed = of(rig.motors.reversed, output) != of(simulation.reversed, motor);
        Output { motor, sign: if is_reversed { -1.0 } else { 1.0 } }
    });
    Box::new(Wired { plant, outputs })
}

impl Wired {
    /// Returns the positions of the rig's motors for those of the board's outputs, full steps.
    fn turned(&self, outputs: PerMotor<f64>) -> PerMotor<f64> {
        let mut turned = [0.0; MOTORS];
        for (output, steps) in self.outputs.iter().zip(outputs) {
            turned[output.motor] = output.sign * steps;
        }
        turned
    }

    /// Returns the values of the cables in the order of the board's outputs.
    fn of_outputs<T: Copy>(&self, cables: PerMotor<T>) -> PerMotor<T> {
        self.outputs.map(|output| cables[output.motor])
    }
}

impl Plant for Wired {
    fn advance(&mut self, dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError> {
        self.plant.advance(dt_s, self.turned(motors))
    }

    fn settle(&mut self, motors: PerMotor<f64>) -> Result<(), RigError> {
        self.plant.settle(self.turned(motors))
    }

    fn run_off(&mut self, heights_m: PerMotor<f64>) {
        let mut of_motors = [0.0; MOTORS];
        for (output, height) in self.outputs.iter().zip(heights_m) {
            of_motors[output.motor] = height;
        }
        self.plant.run_off(of_motors);
    }

    fn hang_again(&mut self) {
        self.plant.hang_again();
    }

    fn ball(&self) -> Point3<f64> {
        self.plant.ball()
    }

    fn slack(&self) -> PerMotor<bool> {
        self.of_outputs(self.plant.slack())
    }

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        self.plant.tensions_per_weight().map(|tensions| self.of_outputs(tensions))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use plumb_config::toml_file::parse_toml;
    use plumb_emulator::plant::{QuasiStatic, Task};

    use super::*;

    /// Cable lengths after the board's motors have turned to these steps, with the lines `text` in
    /// the table `[simulation]` of the paper's rig, and these reversed outputs.
    fn lengths(text: &str, reversed: PerMotor<bool>, steps: PerMotor<f64>) -> PerMotor<f64> {
        let paper = include_str!("../../../rigs/paper.toml");
        let mut rig: Rig = parse_toml(Path::new("rig.toml"), &format!("{paper}\n{text}")).unwrap();
        rig.motors.reversed = Some(reversed.into());
        let simulation = rig.simulation.clone().unwrap();
        let Task { geometry, start, .. } = Task::paper();
        let plant = Box::new(QuasiStatic::new(geometry, start).unwrap());
        let mut plant = wired(&rig, &simulation, plant);
        plant.advance(0.1, steps).unwrap();
        let before = geometry.cable_lengths_m(&start);
        let after = geometry.cable_lengths_m(&plant.ball());
        std::array::from_fn(|i| ((after[i] - before[i]) / geometry.step_lengths_m()[i]).round())
    }

    #[test]
    fn tensions_come_in_the_order_of_the_outputs() {
        let Task { geometry, start, .. } = Task::paper();
        let plant = || Box::new(QuasiStatic::new(geometry, start).unwrap());
        let [a, b, c] = plant().tensions_per_weight().unwrap();
        let text =
            format!("{}\nwiring = ['B', 'C', 'A']", include_str!("../../../rigs/paper.toml"));
        let rig: Rig = parse_toml(Path::new("rig.toml"), &text).unwrap();
        let wired = wired(&rig, rig.simulation.as_ref().unwrap(), plant());
        assert_eq!(wired.tensions_per_weight(), Some([b, c, a]));
    }

    #[test]
    fn a_rig_is_wired_rightly_by_default() {
        assert_eq!(lengths("", [false; MOTORS], [30.0, 20.0, 10.0]), [30.0, 20.0, 10.0]);
    }

    #[test]
    fn a_swapped_motor_turns_with_the_other_output() {
        let swapped = "wiring = ['C', 'B', 'A']";
        assert_eq!(lengths(swapped, [false; MOTORS], [30.0, 20.0, 10.0]), [10.0, 20.0, 30.0]);
        let turned = "wiring = ['B', 'C', 'A']";
        assert_eq!(lengths(turned, [false; MOTORS], [30.0, 20.0, 10.0]), [10.0, 30.0, 20.0]);
    }

    #[test]
    fn the_rig_file_reverses_an_output_and_so_corrects_a_reversed_motor() {
        let reversed = "wiring = ['B', 'A', 'C']\nreversed = [false, true, false]";
        assert_eq!(lengths(reversed, [false; MOTORS], [30.0, 20.0, 10.0]), [20.0, -30.0, 10.0]);
        let corrected = [true, false, false];
        assert_eq!(lengths(reversed, corrected, [30.0, 20.0, 10.0]), [20.0, 30.0, 10.0]);
        assert_eq!(lengths("", corrected, [30.0, 20.0, 10.0]), [-30.0, 20.0, 10.0]);
    }
}
