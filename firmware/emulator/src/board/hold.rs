//! Motors that hold their cables, or let them run off without current.

use plumb_core::TICK_US;
use plumb_protocol::{MOTORS, PerMotor};

use crate::plant::{GRAVITY_M_S2, Plant};

/// Height of the floor, metres in the rig frame.
const FLOOR_M: f64 = 0.0;

/// Motors of a rig by their current.
///
/// Until a motor first has current, a hand holds its cable. The cable of a motor that has lost its
/// current runs off as fast as a ball falls, until it is slack or the ball is on the floor. No step
/// is counted for it.
#[derive(Debug, Default)]
pub(super) struct Hold {
    /// Whether the drivers are on.
    pub(super) enabled: bool,
    /// Whether each motor has had current since the rig's start.
    had_current: PerMotor<bool>,
    /// Speed of each cable that runs off, m/s.
    speeds_m_s: PerMotor<f64>,
}

impl Hold {
    /// Holds every cable by hand until its motor has current.
    pub(super) fn hold_by_hand(&mut self) {
        *self = Self { enabled: self.enabled, ..Self::default() };
    }

    /// Lets the cables of `plant` run off for a tick. `currents` tells which drivers on a UART give
    /// current while they are on; `None` for other drivers, which all do.
    pub(super) fn advance(&mut self, currents: Option<PerMotor<bool>>, plant: &mut dyn Plant) {
        let currents = currents.unwrap_or([true; MOTORS]).map(|current| current && self.enabled);
        if currents == [true; MOTORS] {
            (self.had_current, self.speeds_m_s) = (currents, [0.0; MOTORS]);
            return;
        }
        let dt_s = f64::from(TICK_US) * 1e-6;
        let (slack, on_floor) = (plant.slack(), plant.ball().z <= FLOOR_M);
        let heights_m = std::array::from_fn(|motor| {
            self.had_current[motor] |= currents[motor];
            let runs = self.had_current[motor] && !currents[motor];
            let speed = if runs { self.speeds_m_s[motor] + GRAVITY_M_S2 * dt_s } else { 0.0 };
            self.speeds_m_s[motor] = speed;
            if slack[motor] || on_floor { 0.0 } else { speed * dt_s }
        });
        plant.run_off(heights_m);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

    use plumb_protocol::boards::PICO;
    use plumb_protocol::frame;
    use plumb_protocol::message::{Command, Hello, ToBoard};
    use plumb_protocol::units::{Micros, Milliamperes};
    use plumb_protocol::wiring::{Drivers, Tmc2209};
    use plumb_protocol::{Config, Wiring};

    use super::*;
    use crate::plant::{QuasiStatic, Task};
    use crate::{EMULATED, EmulatedBoard};

    fn wiring(hold: u16) -> Wiring {
        let driver = Tmc2209 { hold: Milliamperes(hold), ..Tmc2209::of(&PICO) };
        Wiring::pico(Drivers::Tmc2209(driver))
    }

    /// Configures the board, and runs it for half a second. Returns how far the ball has fallen, m,
    /// and for how long the drivers were off, s.
    fn configure(board: &mut EmulatedBoard, wiring: Wiring) -> (f64, f64) {
        let (before, mut off) = (board.ball().unwrap().z, 0.0);
        let commands = [
            Command::Hello(Hello::OURS),
            Command::Wire(wiring),
            Command::Configure(Config::example()),
        ];
        for (command, id) in commands.into_iter().zip(1..) {
            board.write(&frame::encode(&ToBoard { id, command }).unwrap());
        }
        for _ in 0..2500 {
            board.run_to(Micros(board.now().0 + u64::from(TICK_US))).unwrap();
            off += if board.hold.enabled { 0.0 } else { f64::from(TICK_US) * 1e-6 };
        }
        (before - board.ball().unwrap().z, off)
    }

    #[test]
    fn the_ball_falls_while_motors_that_had_current_have_none() {
        let Task { geometry, start, .. } = Task::paper();
        let plant = QuasiStatic::new(geometry, start).unwrap();
        let mut board = EmulatedBoard::with_plant(EMULATED, Box::new(plant));
        assert_eq!(configure(&mut board, wiring(800)).0, 0.0, "a hand holds it at first");
        assert_eq!(configure(&mut board, wiring(800)), (0.0, 0.0), "the same wiring");
        // Other currents: the drivers are set up anew.
        let (fallen, off) = configure(&mut board, wiring(700));
        let free = 0.5 * GRAVITY_M_S2 * off * off;
        assert!((0.08..0.1).contains(&off), "{off} s");
        assert!((fallen - free).abs() < 0.03 * free, "{fallen} m for {free} m");
        assert_eq!(board.motors(), [0.0; MOTORS], "and nothing is counted");
    }
}
