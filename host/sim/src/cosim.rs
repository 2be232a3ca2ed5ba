//! The board in lock step with any physics engine: a line says how long time passes and what the
//! camera saw, the answer says where the motors went.

use plumb_core::{Board, LawWorker, Outbox, TICK_US};
use plumb_emulator::EMULATED;
use plumb_protocol::Config;
use plumb_protocol::frame::{self, FrameError};
use plumb_protocol::message::{
    Command, Fault, FromBoard, Hello, Position, Refusal, State, ToBoard,
};
use plumb_protocol::units::{Micros, Point, Rate, Steps16};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What an engine says; metres in the rig frame, seconds.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Request {
    /// The time at the beginning.
    pub t: f64,
    /// How long the board runs then; above 0, at most 10.
    pub dt: f64,
    /// Where the ball was seen in a picture that arrives at `t`; `null` where no picture arrives,
    /// or shows no ball.
    #[serde(default)]
    pub position: Option<[f64; 3]>,
    /// How old that picture is.
    #[serde(default)]
    pub age: f64,
    /// Where the ball is to go, where that changes.
    #[serde(default)]
    pub target: Option<[f64; 3]>,
}

/// What the board has done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// The time at the end, seconds.
    pub t: f64,
    /// Motor positions evenly over the span, the last at its end: full steps since the start, +
    /// pays out; A, B, C.
    pub steps: Vec<[f64; 3]>,
    /// Motor rates at the end, full steps/s.
    pub rates: [f64; 3],
    /// The board's state, as people read it.
    pub state: String,
    /// Whether the target was reached since it was set.
    pub reached: bool,
}

/// Why a request cannot be carried out.
#[derive(Debug, Error, PartialEq)]
pub enum CosimError {
    /// A number that cannot be.
    #[error("`{key}` = {value}: {why}")]
    Number {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        why: &'static str,
    },
    /// Time does not go on where it ended.
    #[error("`t` = {t}, but the board is at {now} s: each line begins where the last one ended")]
    Gap {
        /// What was said.
        t: f64,
        /// Where the board is.
        now: f64,
    },
    /// The board said no.
    #[error("the board refuses: {0}")]
    Refused(Refusal),
}

/// A host speaks at least so often, µs.
const HEARTBEAT_US: u64 = 100_000;
/// Farthest `t` from 0, seconds: 30 years, in which `f64` counts microseconds.
const FARTHEST_S: f64 = 1e9;
/// `t` may be off by so much, seconds: what an engine's sum of time steps is.
const SLIP_S: f64 = 1e-3;

/// A board that is run in steps.
pub struct Cosim {
    board: Board,
    law_worker: LawWorker,
    outbox: Outbox,
    /// The board's clock, and the engine's time at its zero.
    clock: Micros,
    zero_s: Option<f64>,
    heard: Micros,
    sequence: u16,
    /// Id of the last request.
    id: u16,
    target: Option<Point>,
    reached: bool,
}

impl Cosim {
    /// A board with this configuration.
    ///
    /// # Errors
    /// Where it refuses that.
    pub fn new(config: Config) -> Result<Self, CosimError> {
        let mut cosim = Self {
            board: Board::new(EMULATED),
            law_worker: LawWorker::new(),
            outbox: Outbox::new(),
            clock: Micros(0),
            zero_s: None,
            heard: Micros(0),
            sequence: 0,
            id: 0,
            target: None,
            reached: false,
        };
        cosim.send(Command::Hello(Hello::OURS))?;
        cosim.send(Command::Configure(config))?;
        Ok(cosim)
    }

    /// Carries out a request; `samples` (1 or more) motor positions come back.
    ///
    /// # Errors
    /// Where a number cannot be, time has a gap, or the board refuses the target. Positions that it
    /// refuses (too old, out of its workspace) are lost, as they are on a rig.
    pub fn step(&mut self, request: &Request, samples: u32) -> Result<Answer, CosimError> {
        check("t", request.t, request.t.abs() <= FARTHEST_S, "-1e9 to 1e9 s")?;
        let zero = *self.zero_s.get_or_insert(request.t);
        let now = zero + self.clock.0 as f64 * 1e-6;
        let tick_s = f64::from(TICK_US) * 1e-6;
        check(
            "dt",
            request.dt,
            (0.0..=10.0).contains(&request.dt) && request.dt > 0.0,
            "above 0, at most 10 s",
        )?;
        let slip = (request.t - now).abs();
        if slip.is_nan() || slip > SLIP_S + tick_s {
            return Err(CosimError::Gap { t: request.t, now });
        }
        if let Some(target) = request.target {
            self.set_target(target)?;
        }
        if let Some(ball) = request.position {
            self.see(ball, request.age)?;
        }
        let mut steps = Vec::new();
        for k in 1..=samples {
            let end = request.t - zero + request.dt * f64::from(k) / f64::from(samples);
            self.run_to(Micros((end.max(0.0) * 1e6).round() as u64))?;
            steps.push(self.board.positions().map(|p| Steps16(p).to_si()));
        }
        self.reached |= self.board.state() == State::Holding;
        Ok(Answer {
            t: request.t + request.dt,
            steps,
            rates: self.board.rates().map(|r| Rate(r).to_si()),
            state: self.board.state().to_string(),
            reached: self.reached,
        })
    }

    fn set_target(&mut self, target: [f64; 3]) -> Result<(), CosimError> {
        let point = point("target", target)?;
        (self.target, self.reached) = (Some(point), false);
        self.send(Command::Target(point))
    }

    /// A picture has arrived. A board that has stopped because it saw nothing for too long is sent
    /// on.
    fn see(&mut self, ball: [f64; 3], age: f64) -> Result<(), CosimError> {
        check("age", age, (0.0..=60.0).contains(&age), "0 to 60 s")?;
        if self.board.state() == State::Fault(Fault::PositionLost) {
            let _still_moving = self.send(Command::ClearFault);
        }
        if let (State::Ready, Some(target)) = (self.board.state(), self.target) {
            self.send(Command::Target(target))?;
        }
        self.sequence = self.sequence.wrapping_add(1);
        let position = Position {
            sequence: self.sequence,
            age_us: (age * 1e6).round() as u32,
            ball: Some(point("position", ball)?),
            covariance: None,
        };
        let _lost = self.send(Command::Position(position));
        Ok(())
    }

    fn run_to(&mut self, end: Micros) -> Result<(), CosimError> {
        while self.clock.0 + u64::from(TICK_US) <= end.0 {
            if self.clock.since(self.heard) >= HEARTBEAT_US {
                self.send(Command::Status)?;
            }
            let _ = self.board.tick(self.clock, &mut self.law_worker, &mut self.outbox);
            self.outbox.clear();
            self.clock.0 += u64::from(TICK_US);
        }
        Ok(())
    }

    /// Sends a command; what the board refuses is an error.
    fn send(&mut self, command: Command) -> Result<(), CosimError> {
        self.heard = self.clock;
        self.id = self.id.checked_add(1).unwrap_or(1);
        // Every command fits a frame.
        if let Ok(frame) = frame::encode(&ToBoard { id: self.id, command }) {
            self.board.receive(self.clock, &frame, &mut self.outbox);
        }
        let mut accumulator = frame::Accumulator::new();
        let refusal = self.outbox.bytes().iter().find_map(|&byte| {
            let message: Option<Result<FromBoard, FrameError>> = accumulator.push(byte);
            match message {
                Some(Ok(FromBoard::Answer(answer))) => answer.refusal,
                _ => None,
            }
        });
        self.outbox.clear();
        refusal.map_or(Ok(()), |refusal| Err(CosimError::Refused(refusal)))
    }
}

fn check(key: &'static str, value: f64, holds: bool, why: &'static str) -> Result<(), CosimError> {
    if holds { Ok(()) } else { Err(CosimError::Number { key, value, why }) }
}

fn point(key: &'static str, metres: [f64; 3]) -> Result<Point, CosimError> {
    let farthest = metres.into_iter().fold(0.0, |a, b| if b.abs() > f64::abs(a) { b } else { a });
    Point::from_metres(metres).ok_or(CosimError::Number {
        key,
        value: farthest,
        why: "metres, within 2 km",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Limits;
    use plumb_emulator::rig::{Elastic, ElasticParameters, Plant, Task};
    use plumb_runtime::rig::LawSettings;

    fn cosim(law: &str) -> Cosim {
        let law = LawSettings::named(law).unwrap();
        let mean = law.mean().config("mean").unwrap();
        Cosim::new(Limits::default().config(law.config().unwrap(), mean, 0.010)).unwrap()
    }

    fn request(t: f64, dt: f64) -> Request {
        Request { t, dt, position: None, age: 0.0, target: None }
    }

    /// The paper's task on springs, pictures two frames late: an engine that is driven by the
    /// answers alone.
    #[test]
    fn an_engine_that_follows_the_steps_gets_there() {
        let task = Task::paper();
        let mut plant =
            Elastic::new(task.geometry, ElasticParameters::default(), task.start).unwrap();
        let mut cosim = cosim("taut");
        let (dt, late) = (1.0 / 30.0, 2);
        let mut seen = vec![task.start; late];
        for frame in 0..300 {
            seen.push(plant.ball());
            let mut line = request(f64::from(frame) * dt, dt);
            line.position = Some(seen[seen.len() - 1 - late].into());
            line.age = dt * late as f64;
            line.target = (frame == 0).then_some(task.target.into());
            let answer = cosim.step(&line, 20).unwrap();
            for motors in &answer.steps {
                plant.advance(dt / 20.0, *motors).unwrap();
            }
            assert_eq!(answer.steps.len(), 20);
            if answer.reached {
                assert!((plant.ball() - task.target).norm() < 0.010);
                return;
            }
        }
        panic!("not there after 10 s: {}", plant.ball());
    }

    #[test]
    fn long_spans_do_not_make_the_host_silent_and_gaps_are_named() {
        let mut cosim = cosim("sign");
        let answer = cosim.step(&request(5.0, 3.0), 2).unwrap();
        assert_eq!((answer.t, answer.state.as_str(), answer.reached), (8.0, "ready", false));
        assert!(matches!(cosim.step(&request(9.0, 0.1), 1), Err(CosimError::Gap { .. })));
        assert!(matches!(
            cosim.step(&request(8.0, 0.0), 1),
            Err(CosimError::Number { key: "dt", .. })
        ));
        for t in [1e10, -1e300, f64::NAN] {
            assert!(matches!(
                cosim.step(&request(t, 0.1), 1),
                Err(CosimError::Number { key: "t", .. })
            ));
        }
        let far = Request { target: Some([9.0, 0.0, 0.0]), ..request(8.0, 0.1) };
        assert_eq!(cosim.step(&far, 1), Err(CosimError::Refused(Refusal::TargetOutside)));
    }

    #[test]
    fn a_board_that_saw_nothing_for_a_second_goes_on_when_it_sees_again() {
        let mut cosim = cosim("adaptive");
        let line = |t, position| Request {
            position,
            target: (t == 0.0).then_some([0.4, 0.4, 0.15]),
            ..request(t, 0.1)
        };
        cosim.step(&line(0.0, Some([0.54, 0.22, 0.459])), 1).unwrap();
        let states: Vec<String> = (1..20)
            .map(|k| cosim.step(&line(f64::from(k) * 0.1, None), 1).unwrap().state)
            .collect();
        assert!(states.last().unwrap().starts_with("fault: no fresh position"), "{states:?}");
        let answer = cosim.step(&line(2.0, Some([0.54, 0.22, 0.459])), 1).unwrap();
        assert_eq!(answer.state, "seeking");
    }
}
