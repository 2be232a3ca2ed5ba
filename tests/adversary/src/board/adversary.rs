//! The choice of the board's next event.

use plumb_core::config_store::Stored;
use plumb_protocol::frame::encode;
use plumb_protocol::message::*;
use plumb_protocol::units::*;
use plumb_protocol::{Config, MOTORS};

use crate::frames::{damage, framed, noise};
use crate::generate;
use crate::random::Random;

/// Cable per step, m.
const METRES_A_STEP: f64 = 0.0004;

/// Jacobian of the simulated rig, with the sign pattern (12).
const JACOBIAN: [[f64; 3]; 3] = [[-0.5, -0.5, 1.0], [-1.0, 1.0, 0.0], [-0.7, -0.7, -0.7]];

/// Next action.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one action exists at a time")]
pub enum Action {
    /// Sends a command.
    Send(Command),
    /// Sends a wiring and a configuration, or the configuration alone.
    Configure(Stored, bool),
    /// Repeats the last frame, or the last frame with a request.
    Repeat,
    /// Sends noise, or a damaged frame.
    Bytes(Vec<u8>),
    /// Opens the emergency input for some ticks.
    Emergency(u64),
    /// Restarts the chip.
    Restart(StartCause),
}

/// State of the board that the adversary uses.
#[derive(Debug, Clone, Copy)]
pub struct View {
    /// Current configuration.
    pub config: Option<Config>,
    /// Motor positions, 1/16 steps from the zero of travel.
    pub positions: [i32; 3],
    /// The state.
    pub state: State,
}

/// Positions that the board receives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Camera {
    /// Positions of the simulated ball.
    Honest,
    /// Any positions.
    Any,
}

/// Source of actions for one board.
#[derive(Debug, Clone)]
pub struct Adversary {
    camera: Camera,
    /// Whether the configurations are typical, and disturbances rare.
    ordinary: bool,
    ball: [f64; 3],
    /// Motion of the ball per step, m; negative for a rig with reversed motors.
    metres_a_step: f64,
    sequence: u16,
    /// Whether the last Hello had the right version.
    greeted: bool,
}

impl Adversary {
    /// Returns an adversary with random settings.
    pub fn new(random: &mut Random) -> Self {
        let sign = if random.percent(15) { -1.0 } else { 1.0 };
        Self {
            camera: if random.percent(60) { Camera::Honest } else { Camera::Any },
            ordinary: random.percent(35),
            ball: [0.5, 0.2, 0.4],
            metres_a_step: sign * METRES_A_STEP,
            sequence: 0,
            greeted: false,
        }
    }

    /// Records a command that was sent.
    pub fn sent(&mut self, command: &Command) {
        if let Command::Hello(hello) = command {
            self.greeted = *hello == Hello::OURS;
        }
    }

    /// Records a restart of the board.
    pub fn restarted(&mut self) {
        self.greeted = false;
    }

    /// Returns a wiring and a configuration that should be accepted.
    pub fn setup(&self, random: &mut Random, view: &View) -> Stored {
        if self.ordinary {
            generate::typical_setup(random)
        } else {
            generate::accepted(random, view.positions)
        }
    }

    /// Returns the action that configures the board, usually with its wiring.
    fn configure(&self, random: &mut Random, view: &View) -> Action {
        Action::Configure(self.setup(random, view), !random.one_in(10))
    }

    /// Returns the same with a value that is usually out of range.
    fn configure_wrongly(random: &mut Random, view: &View) -> Action {
        Action::Configure(generate::invalid(random, view.positions), true)
    }

    /// Moves the ball with the motors, by 1/16 steps.
    pub fn motors_moved(&mut self, by: [i32; 3]) {
        if by == [0; 3] {
            return;
        }
        let steps = by.map(|b| f64::from(b) / 16.0 * self.metres_a_step);
        for (coordinate, row) in self.ball.iter_mut().zip(JACOBIAN) {
            let change: f64 = row.iter().zip(steps).map(|(j, s)| j * s).sum();
            *coordinate = (*coordinate + change).clamp(-4.0, 4.0);
        }
    }

    /// Chooses the next action.
    pub fn choose(&mut self, random: &mut Random, view: &View) -> Action {
        if let Some(way_on) = self.way_on(random, view) {
            return way_on;
        }
        let roll = random.below(if self.ordinary { 4000 } else { 1000 });
        match roll {
            0..=9 => Action::Send(Command::Hello(hello(random))),
            10..=24 => self.configure(random, view),
            25..=34 => Self::configure_wrongly(random, view),
            35..=104 => Action::Send(Command::Target(target(random, view))),
            105..=144 => Action::Send(Command::Jog(jog(random, view))),
            145..=164 => Action::Send(Command::Hold),
            165..=184 => Action::Send(Command::ClearFault),
            185..=206 => Action::Send(Command::Status),
            207..=210 => Action::Send(Command::Diagnose),
            211..=214 => Action::Send(Command::Measure),
            215..=219 => Action::Send(Command::Store),
            220..=222 => Action::Send(Command::TestFlash),
            304..=309 => Action::Send(Command::Home),
            310..=329 => Action::Send(Command::Follow(generate::reference(random, view.config))),
            223..=232 => Action::Send(Command::Stop),
            233 => Action::Send(Command::Bootloader),
            234..=263 => Action::Repeat,
            264..=279 => Action::Bytes(any_bytes(random)),
            280..=299 => Action::Bytes(self.damaged(random, view)),
            300..=302 => Action::Emergency(1 + random.below(20)),
            303 => Action::Restart(restart(random)),
            _ => Action::Send(self.position(random, view)),
        }
    }

    /// Returns, sometimes, the action that leaves a state in which few commands are accepted.
    fn way_on(&self, random: &mut Random, view: &View) -> Option<Action> {
        if random.percent(60) {
            return None;
        }
        let command = match view.state {
            _ if !self.greeted => Command::Hello(Hello::OURS),
            State::Fault(_) => Command::ClearFault,
            State::Unconfigured => return Some(self.configure(random, view)),
            State::Ready => match random.below(16) {
                0 => return Some(self.configure(random, view)),
                1 => return Some(Self::configure_wrongly(random, view)),
                2 if random.one_in(4) => Command::TestFlash,
                2 => Command::Store,
                6 if random.one_in(4) => Command::Home,
                3..=5 => Command::Jog(jog(random, view)),
                _ => Command::Target(target(random, view)),
            },
            State::Following => Command::Follow(generate::reference(random, view.config)),
            State::Jogging | State::Seeking | State::Holding | State::Stopping | State::Storing => {
                return None;
            }
        };
        Some(Action::Send(command))
    }

    /// Returns a position: mostly a fresh one of the ball; sometimes late, out of order,
    /// without a ball or far outside.
    pub fn position(&mut self, random: &mut Random, view: &View) -> Command {
        let strange = !self.ordinary || random.one_in(8);
        if strange {
            self.sequence = next_sequence(random, self.sequence);
        } else {
            self.sequence = self.sequence.wrapping_add(1);
        }
        let age_us = if strange { age_us(random, view) } else { random.below(30_000) as u32 };
        let ball = if strange { self.any_ball(random, view) } else { Some(self.seen(view)) };
        let covariance = generate::covariance(random);
        Command::Position(Position { sequence: self.sequence, age_us, ball, covariance })
    }

    /// Returns the ball's position. The host of two motors sends x = 0.
    fn seen(&self, view: &View) -> Point {
        let [x, y, z] = self.ball.map(|metres| Micrometres((metres * 1e6) as i32));
        let is_planar = view.config.is_some_and(|config| config.motors.len() < MOTORS);
        Point([if is_planar { Micrometres(0) } else { x }, y, z])
    }

    fn any_ball(&self, random: &mut Random, view: &View) -> Option<Point> {
        let workspace = view.config.map(|config| config.workspace);
        match random.below(30) {
            0 => None,
            1 => Some(generate::any_point(random)),
            2..=6 => workspace.map(|workspace| generate::point_in(random, &workspace)),
            _ if self.camera == Camera::Honest => Some(self.seen(view)),
            7..=12 => workspace.map(|workspace| workspace.min),
            13..=18 => workspace.map(|workspace| workspace.max),
            _ => workspace.map(|workspace| generate::point_in(random, &workspace)),
        }
    }

    /// Returns a frame with random damage, which may be none.
    fn damaged(&mut self, random: &mut Random, view: &View) -> Vec<u8> {
        let mut frame = framed(&ToBoard { id: 1, command: self.position(random, view) });
        damage(random, &mut frame);
        frame
    }
}

/// Returns noise, or an intact frame that is not a command.
fn any_bytes(random: &mut Random) -> Vec<u8> {
    if random.percent(50) {
        // The number of a command that does not exist, and its id.
        return encode(&(random.bits() as u16, 200u8))
            .map(|frame| frame.to_vec())
            .unwrap_or_default();
    }
    let length = random.below(400);
    noise(random, length)
}

fn hello(random: &mut Random) -> Hello {
    if random.percent(80) {
        Hello::OURS
    } else {
        Hello { version: random.bits() as u16, ..Hello::OURS }
    }
}

fn restart(random: &mut Random) -> StartCause {
    random.pick(&[
        StartCause::PowerOn,
        StartCause::ResetPin,
        StartCause::Watchdog,
        StartCause::Panic(1),
        StartCause::HardFault,
        StartCause::Requested,
    ])
}

fn target(random: &mut Random, view: &View) -> Point {
    match view.config {
        Some(config) if random.percent(92) => generate::point_in(random, &config.workspace),
        _ => generate::any_point(random),
    }
}

fn jog(random: &mut Random, view: &View) -> Jog {
    let motors = if random.percent(90) { 3 } else { 256 };
    let motor = random.below(motors) as u8;
    let limit = view.config.and_then(|config| config.motors.get(usize::from(motor)).copied());
    let position = view.positions.get(usize::from(motor)).copied().unwrap_or(0);
    let distance = match random.below(10) {
        // Towards the start position, which every travel contains.
        0..=2 => -random.corner(0, i64::from(position.unsigned_abs())) as i32 * position.signum(),
        3..=7 => random.any_i32() % 4000,
        _ => random.any_i32(),
    };
    let distance = Steps16(distance);
    let rate = match limit {
        Some(motor) if random.percent(85) => random.corner(1, motor.max_rate.0.into()) as i32,
        _ => random.any_i32(),
    };
    Jog { motor, distance, rate: Rate(rate) }
}

fn next_sequence(random: &mut Random, last: u16) -> u16 {
    match random.below(40) {
        0 => last,
        1 => last.wrapping_sub(1),
        2 => random.bits() as u16,
        3 => last.wrapping_add(32_767),
        4 => last.wrapping_add(32_768),
        _ => last.wrapping_add(1),
    }
}

fn age_us(random: &mut Random, view: &View) -> u32 {
    let max_age = view.config.map_or(0, |config| u32::from(config.deadlines.max_age.0) * 1000);
    match random.below(20) {
        0 => u32::MAX,
        1 => max_age + 1,
        2 => max_age,
        3 => random.bits() as u32,
        _ => random.below(u64::from(max_age.min(60_000)) + 1) as u32,
    }
}
