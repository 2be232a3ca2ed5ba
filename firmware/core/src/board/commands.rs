//! What each command does.

use plumb_protocol::config::Config;
use plumb_protocol::message::{
    BoardHello, Command, Fault, FromBoard, Hello, Jog, Position, Refusal, State, ToBoard,
};
use plumb_protocol::units::{Micrometres, Micros, Point};

use super::requests::LastRequest;
use super::seek::{Guards, Seek, Sight};
use super::{Activity, Board, Outbox, answer};
use crate::estimate;
use crate::law::LawSelection;
use crate::params::Params;
use crate::plan::Jogging;

/// The ball is given up when this many pictures in a row show it outside the workspace: one may be
/// a mistake of the detector.
const OUTSIDE_PICTURES: u8 = 3;

/// Highest rate of a motor on its way back into its travel, Q8 steps/s: 20 steps/s, about a
/// centimetre a second.
const CRAWL: i32 = 20 << 8;

impl Board {
    /// Carries out one command.
    pub(super) fn on_command(&mut self, now: Micros, message: &ToBoard, out: &mut Outbox) {
        self.last_rx = now;
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
            Command::Position(ref position) => return self.on_position(now, id, position, out),
            Command::Status => {
                self.send_telemetry(now, out);
                Ok(())
            }
            _ => return self.on_request(now, message, out),
        };
        answer(now, out, id, result);
    }

    /// Carries out a command that must not be carried out twice. One that repeats the last of them,
    /// with its id and content, is answered again; a Store that is still being written is answered
    /// once it is.
    fn on_request(&mut self, now: Micros, message: &ToBoard, out: &mut Outbox) {
        let repeated = self
            .last_request
            .is_some_and(|last| last.is_repeated_by(message, self.config.as_ref()));
        let result = if repeated { Ok(()) } else { self.carry_out(now, message, out) };
        if result.is_ok() {
            self.last_request = LastRequest::of(message);
        }
        let is_pending = message.command == Command::Store && self.storing == Some(message.id);
        if !is_pending {
            answer(now, out, message.id, result);
        }
    }

    fn carry_out(
        &mut self,
        now: Micros,
        message: &ToBoard,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let ToBoard { id, ref command } = *message;
        match *command {
            Command::Configure(ref config) => self.configure(id, config),
            Command::Target(target) => self.target(now, id, target, out),
            Command::Hold => self.hold(now, id),
            Command::Jog(jog) => self.jog(now, jog),
            Command::ClearFault => self.clear_fault(),
            Command::Store => self.store(id),
            // `handle` has carried these out.
            Command::Hello(_)
            | Command::Stop
            | Command::Bootloader
            | Command::Position(_)
            | Command::Status => Ok(()),
        }
    }

    /// Takes in a position, command `id`, for who tells them from other commands himself.
    #[inline(never)]
    pub fn on_position(&mut self, now: Micros, id: u16, position: &Position, out: &mut Outbox) {
        (self.dirty, self.last_rx) = (true, now);
        let result =
            if self.greeted { self.position(now, position, out) } else { Err(Refusal::NotGreeted) };
        match result {
            // Telemetry answers to it.
            Ok(()) => self.telemetry_due = true,
            refused => answer(now, out, id, refused),
        }
    }

    /// Begins a session. A host of another version may look, and stop, but not move anything.
    fn hello(&mut self, id: u16, hello: Hello, out: &mut Outbox) {
        self.greeted = hello == Hello::OURS;
        if self.greeted {
            // A new host counts its pictures and its requests anew.
            (self.sight.sequence, self.configuration, self.last_request) = (None, None, None);
            if let Activity::Seeking(seek) = &mut self.activity {
                seek.command = None;
            }
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
            _ if self.is_reserved() => Err(Refusal::Busy(self.state())),
            (Some(params), _) => Ok(params),
        }
    }

    /// Whether the motors must stand still for something else: the configuration is being written,
    /// or the board is on its way into the bootloader.
    fn is_reserved(&self) -> bool {
        self.storing.is_some() || self.bootloader
    }

    /// Refuses what must not happen while a motor turns or a target is held.
    fn at_rest(&self) -> Result<(), Refusal> {
        let under_way = matches!(self.activity, Activity::Seeking(_) | Activity::Jogging(_));
        if under_way || self.is_reserved() || self.planner.moving() {
            Err(Refusal::Busy(self.state()))
        } else {
            Ok(())
        }
    }

    fn configure(&mut self, id: u16, config: &Config) -> Result<(), Refusal> {
        if let State::Fault(fault) = self.state() {
            return Err(Refusal::Faulted(fault));
        }
        self.at_rest()?;
        let params = Params::check(config, &self.build).map_err(Refusal::Config)?;
        self.apply_config(params, config);
        self.configuration = Some(id);
        self.law_client.reset();
        // What was seen was judged by another workspace.
        self.law_client.discard_pending();
        let Sight { sequence, law, .. } = self.sight;
        self.sight = Sight { sequence, law, ..Sight::default() };
        Ok(())
    }

    /// Goes by `params`, which were made from `config`, from now on; at standstill.
    pub(super) fn apply_config(&mut self, params: Params, config: &Config) {
        self.planner.configure(&params);
        // Here, where there is time for it.
        self.sight.law = match params.law() {
            LawSelection::Inline(law) => Some(law),
            LawSelection::Deferred(_) => None,
        };
        self.params = Some(params);
        self.config = Some(*config);
        self.generation = self.generation.wrapping_add(1);
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

    fn position(
        &mut self,
        now: Micros,
        position: &Position,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let params = self.params.as_ref().ok_or(Refusal::Unconfigured)?;
        if self
            .sight
            .sequence
            .is_some_and(|last| (position.sequence.wrapping_sub(last) as i16) <= 0)
        {
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
            match params.deferred_law() {
                Some(_) => self.law_client.on_position(captured, ball, position.covariance),
                None => seek.answer(now, &mut self.sight, params),
            }
            self.progress_due = true;
        }
        Ok(())
    }

    /// Checks after a picture whether the target is reached, and whether the ball is driven away
    /// from it. There is time for that once the tick is under way.
    #[inline(never)]
    pub(super) fn check_progress(&mut self, now: Micros, out: &mut Outbox) {
        self.progress_due = false;
        let (Activity::Seeking(seek), Some(params)) = (&mut self.activity, &self.params) else {
            return;
        };
        let Some(filtered) = self.sight.filtered() else { return };
        let error = estimate::magnitude(estimate::error(filtered, seek.target));
        seek.note_arrival(error, &self.sight, params);
        if self.guards.diverges(now, filtered, error, seek.target, params) {
            self.fault(now, Fault::ErrorGrowing, out);
        }
    }

    /// Counts a picture with the ball outside; under way the board stops when it happens
    /// repeatedly.
    fn ball_outside(&mut self, now: Micros, out: &mut Outbox) {
        self.sight.outside = self.sight.outside.saturating_add(1);
        let under_way = matches!(self.activity, Activity::Seeking(_) | Activity::Jogging(_));
        if under_way && self.sight.outside >= OUTSIDE_PICTURES {
            self.fault(now, Fault::BallOutside, out);
        }
    }

    fn target(
        &mut self,
        now: Micros,
        id: u16,
        target: Point,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let params = self.usable()?;
        if !params.workspace.contains(target) {
            if matches!(self.activity, Activity::Seeking(_)) {
                self.fault(now, Fault::TargetOutside, out);
            }
            return Err(Refusal::TargetOutside);
        }
        self.may_seek()?;
        self.seek(now, Seek::new(target, id, now, false));
        Ok(())
    }

    fn hold(&mut self, now: Micros, id: u16) -> Result<(), Refusal> {
        let params = self.usable()?;
        let fresh = self.sight.captured.is_some_and(|captured| {
            now.since(captured) <= u64::from(params.deadlines.position.0) * 1000
        });
        self.may_seek()?;
        let here = self.sight.filtered().filter(|_| fresh).ok_or(Refusal::NoPosition)?;
        self.seek(now, Seek::new(Point(here.map(Micrometres)), id, now, true));
        Ok(())
    }

    /// Refuses a target while a motor is jogged, or stands outside its travel.
    fn may_seek(&self) -> Result<(), Refusal> {
        if matches!(self.activity, Activity::Jogging(_)) {
            return Err(Refusal::Busy(self.state()));
        }
        let positions = self.positions();
        let outside = self
            .usable()?
            .motors
            .iter()
            .zip(positions)
            .position(|(motor, at)| !(motor.travel_min.0..=motor.travel_max.0).contains(&at));
        outside.map_or(Ok(()), |motor| Err(Refusal::OutsideTravel(motor as u8)))
    }

    /// Begins to drive by `seek`, or goes on with another target. The guards of a drive end with it
    /// at standstill, not before: targets that come often must not disarm them.
    fn seek(&mut self, now: Micros, seek: Seek) {
        if !matches!(self.activity, Activity::Seeking(_)) {
            if self.planner.moving() {
                self.guards.resume(now);
            } else {
                self.guards = Guards::new(now);
            }
        }
        self.activity = Activity::Seeking(seek);
    }

    /// Turns one motor. One that stands outside its travel may only come back, at a crawl.
    fn jog(&mut self, now: Micros, jog: Jog) -> Result<(), Refusal> {
        let params = self.usable()?;
        self.at_rest()?;
        let motor = usize::from(jog.motor);
        let limits = params.motors.get(motor).ok_or(Refusal::NoSuchMotor)?;
        if !(1..=limits.max_rate.0).contains(&jog.rate.0) {
            return Err(Refusal::JogRate);
        }
        let position = self.planner.positions()[motor];
        let end = position.saturating_add(jog.distance.0);
        let (low, high) = (limits.travel_min.0, limits.travel_max.0);
        if !(low.min(position)..=high.max(position)).contains(&end) {
            return Err(Refusal::JogTravel);
        }
        let inside = (low..=high).contains(&position);
        let rate = if inside { jog.rate.0 } else { jog.rate.0.min(CRAWL) };
        self.activity = Activity::Jogging(Jogging::new(motor, end, rate));
        // The last drive has ended, also where the next one begins before this motor stands.
        self.guards = Guards::new(now);
        Ok(())
    }

    fn clear_fault(&mut self) -> Result<(), Refusal> {
        if let Activity::Faulted(fault) = self.activity {
            if self.emergency_ticks > 0 {
                // The loop is still open, as far as is known.
                return Err(Refusal::Faulted(fault));
            }
            self.at_rest()?;
            self.activity = Activity::Idle;
            self.sight.outside = 0;
        }
        Ok(())
    }
}
