//! What each command does.

use plumb_protocol::config::Config;
use plumb_protocol::message::{
    BoardHello, Command, Fault, FromBoard, Hello, Jog, Position, Refusal, State, ToBoard,
};
use plumb_protocol::units::{Micrometres, Micros, Point};

use super::seek::{Seek, Sight};
use super::{Activity, Board, Outbox, answer};
use crate::params::{Own, Params};
use crate::plan::Jogging;

/// The ball is given up when this many pictures in a row show it outside the workspace: one may be a mistake of the
/// detector.
const OUTSIDE_PICTURES: u8 = 3;

impl Board {
    /// Carries out one command.
    pub(super) fn handle(&mut self, now: Micros, message: &ToBoard, out: &mut Outbox) {
        self.heard = now;
        let ToBoard { id, ref command } = *message;
        let result = match *command {
            Command::Hello(hello) => return self.hello(id, hello, out),
            Command::Stop => {
                self.stop();
                Ok(())
            }
            Command::Bootloader => {
                self.stop();
                self.bootloader = true;
                Ok(())
            }
            _ if !self.greeted => Err(Refusal::NotGreeted),
            Command::Configure(ref config) => self.configure(config),
            Command::Position(ref position) => return self.see(now, id, position, out),
            Command::Target(target) => self.target(now, target, out),
            Command::Jog(jog) => self.jog(jog),
            Command::Hold => self.hold(now),
            Command::ClearFault => self.clear_fault(now),
            Command::Status => {
                self.tell(now, out);
                Ok(())
            }
            Command::Store => match self.store(id) {
                // The answer comes when it is written.
                Ok(()) => return,
                refused => refused,
            },
        };
        answer(out, id, result);
    }

    /// Takes in a position, command `id`, for who tells them from other commands himself.
    #[inline(never)]
    pub fn see(&mut self, now: Micros, id: u16, position: &Position, out: &mut Outbox) {
        (self.attending, self.heard) = (true, now);
        let result = if self.greeted { self.position(now, position, out) } else { Err(Refusal::NotGreeted) };
        match result {
            // Telemetry answers to it.
            Ok(()) => self.telling = true,
            refused => answer(out, id, refused),
        }
    }

    /// A host of another version may look, and stop, but not move anything.
    fn hello(&mut self, id: u16, hello: Hello, out: &mut Outbox) {
        self.greeted = hello == Hello::OURS;
        if self.greeted {
            // A new host counts its pictures anew.
            self.sight.sequence = None;
        } else {
            self.stop();
        }
        out.send(&FromBoard::Hello(BoardHello {
            id,
            hello: Hello::OURS,
            max_pulse_rate: self.build.max_pulse_rate,
            accepted: self.greeted,
        }));
        if self.greeted {
            out.send(&FromBoard::Started(self.start_cause));
        }
    }

    fn stop(&mut self) {
        if !matches!(self.activity, Activity::Faulted(_)) {
            self.activity = Activity::Idle;
        }
    }

    /// The parameters, where the board is configured and has not stopped by itself.
    fn usable(&self) -> Result<&Params, Refusal> {
        match (&self.params, &self.activity) {
            (_, Activity::Faulted(fault)) => Err(Refusal::Faulted(*fault)),
            (None, _) => Err(Refusal::Unconfigured),
            // The motors must stand still while the configuration is written.
            _ if self.storing.is_some() => Err(Refusal::Busy(self.state())),
            (Some(params), _) => Ok(params),
        }
    }

    /// Refuses what must not happen while a motor turns or a target is held.
    fn at_rest(&self) -> Result<(), Refusal> {
        let under_way = matches!(self.activity, Activity::Seeking(_) | Activity::Jogging(_));
        if under_way || self.planner.moving() { Err(Refusal::Busy(self.state())) } else { Ok(()) }
    }

    fn configure(&mut self, config: &Config) -> Result<(), Refusal> {
        if let State::Fault(fault) = self.state() {
            return Err(Refusal::Faulted(fault));
        }
        self.at_rest()?;
        let params = Params::check(config, &self.build, self.positions()).map_err(Refusal::Config)?;
        self.take_up(params, config);
        self.asking.begin_anew();
        // What was seen was judged by another workspace.
        self.asking.forget();
        let Sight { sequence, law, .. } = self.sight;
        self.sight = Sight { sequence, law, ..Sight::default() };
        Ok(())
    }

    /// Goes by `params`, which were made from `config`, from now on; at standstill.
    pub(super) fn take_up(&mut self, params: Params, config: &Config) {
        self.planner.configure(&params);
        // Here, where there is time for it.
        self.sight.law = match params.law() {
            Own::Quick(law) => Some(law),
            Own::Slow(_) => None,
        };
        self.params = Some(params);
        self.config = Some(*config);
        self.configurations = self.configurations.wrapping_add(1);
    }

    fn store(&mut self, id: u16) -> Result<(), Refusal> {
        if !self.build.storage {
            return Err(Refusal::Unsupported);
        }
        self.config.ok_or(Refusal::Unconfigured)?;
        self.at_rest()?;
        self.storing = Some(id);
        Ok(())
    }

    fn position(&mut self, now: Micros, position: &Position, out: &mut Outbox) -> Result<(), Refusal> {
        let params = self.params.as_ref().ok_or(Refusal::Unconfigured)?;
        if self.sight.sequence.is_some_and(|last| (position.sequence.wrapping_sub(last) as i16) <= 0) {
            return Err(Refusal::PositionOutOfOrder);
        }
        // 16 + 10 bits.
        if position.age_us > u32::from(params.deadlines.max_age.0) * 1000 {
            return Err(Refusal::PositionStale);
        }
        self.sight.sequence = Some(position.sequence);
        let Some(ball) = position.ball else { return Ok(()) };
        if !params.workspace.contains(ball) {
            self.ball_outside(now, out);
            return Err(Refusal::BallOutside);
        }
        let (captured, ball) = (now.back(u64::from(position.age_us)), ball.micrometres());
        self.sight.saw(captured, ball);
        if let Activity::Seeking(seek) = &mut self.activity {
            match params.slow() {
                Some(_) => self.asking.saw(captured, ball, position.covariance),
                None => seek.answer(now, &mut self.sight, params),
            }
            self.judging = true;
        }
        Ok(())
    }

    /// Looks how things go after a picture. There is time for that once the tick is under way.
    #[inline(never)]
    pub(super) fn judge(&mut self, now: Micros, out: &mut Outbox) {
        self.judging = false;
        if let (Activity::Seeking(seek), Some(params)) = (&mut self.activity, &self.params)
            && seek.judge(now, &self.sight, params)
        {
            self.fault(now, Fault::ErrorGrowing, out);
        }
    }

    /// Counts a picture with the ball outside; under way the board stops when it happens repeatedly.
    fn ball_outside(&mut self, now: Micros, out: &mut Outbox) {
        self.sight.outside = self.sight.outside.saturating_add(1);
        let under_way = matches!(self.activity, Activity::Seeking(_) | Activity::Jogging(_));
        if under_way && self.sight.outside >= OUTSIDE_PICTURES {
            self.fault(now, Fault::BallOutside, out);
        }
    }

    fn target(&mut self, now: Micros, target: Point, out: &mut Outbox) -> Result<(), Refusal> {
        let params = self.usable()?;
        if !params.workspace.contains(target) {
            if matches!(self.activity, Activity::Seeking(_)) {
                self.fault(now, Fault::TargetOutside, out);
            }
            return Err(Refusal::TargetOutside);
        }
        if matches!(self.activity, Activity::Jogging(_)) {
            return Err(Refusal::Busy(self.state()));
        }
        self.activity = Activity::Seeking(Seek::new(target, now, false));
        Ok(())
    }

    fn hold(&mut self, now: Micros) -> Result<(), Refusal> {
        let params = self.usable()?;
        let fresh = self
            .sight
            .captured
            .is_some_and(|captured| now.since(captured) <= u64::from(params.deadlines.position.0) * 1000);
        let here = self.sight.filtered().filter(|_| fresh).ok_or(Refusal::NoPosition)?;
        let target = Point(here.map(Micrometres));
        self.activity = Activity::Seeking(Seek::new(target, now, true));
        Ok(())
    }

    fn jog(&mut self, jog: Jog) -> Result<(), Refusal> {
        let params = self.usable()?;
        self.at_rest()?;
        let motor = usize::from(jog.motor);
        let limits = params.motors.get(motor).ok_or(Refusal::NoSuchMotor)?;
        if !(1..=limits.max_rate.0).contains(&jog.rate.0) {
            return Err(Refusal::JogRate);
        }
        let end = self.planner.positions()[motor].saturating_add(jog.distance.0);
        if !(limits.travel_min.0..=limits.travel_max.0).contains(&end) {
            return Err(Refusal::JogTravel);
        }
        self.activity = Activity::Jogging(Jogging::new(motor, end, jog.rate.0));
        Ok(())
    }

    fn clear_fault(&mut self, now: Micros) -> Result<(), Refusal> {
        if let Activity::Faulted(fault) = self.activity {
            if self.emergency == Some(now) {
                // The loop is still open: not even for a tick do the drivers hold.
                return Err(Refusal::Faulted(fault));
            }
            self.at_rest()?;
            self.activity = Activity::Idle;
            self.sight.outside = 0;
        }
        Ok(())
    }
}
