//! Longest times in which motors come to rest: after a stop, and at the end of a jog. A board that
//! reports that its motors turn for longer is not believed.

use plumb_protocol::message::Jog;
use plumb_protocol::units::Rate;

use super::*;

/// Least acceleration that a board accepts, full steps/s² (`motors.max_acceleration` in
/// docs/use/rig-file.md).
const LEAST_ACCELERATION: f64 = 40.0;

/// Longest ramp of a board whose configuration this link does not know. At the least acceleration
/// it is 72 000 full steps long: 34 m of cable at 0.471 mm a step, more than a rig has.
const LONGEST_RAMP: Duration = Duration::from_secs(60);

/// Longest running mean over the step plan, which delays the end of a ramp (`law.*.mean` in
/// docs/use/rig-file.md).
const LONGEST_MEAN: Duration = Duration::from_millis(400);

/// Highest rate of a jog from beyond the travel back into it, full steps/s. The host does not know
/// which jogs those are.
const RETURN_RATE: f64 = 20.0;

/// Time that is allowed beyond the longest honest one: delays of the link, and an emulated board
/// that is late on a busy computer.
const MARGIN: Duration = Duration::from_secs(5);

/// Jog that the board has accepted.
#[derive(Debug, Clone, Copy)]
pub(super) struct JogUnderWay {
    begin: Duration,
    longest: Duration,
}

/// Motors that ramp down after a stop.
#[derive(Debug)]
pub(super) struct RampDown {
    begin: Duration,
    /// Longest time of the ramp; known from the first rates on.
    longest: Option<Duration>,
    /// Least sum of the rates so far, 1/256 full steps/s.
    slowest: u64,
    /// Time of that sum.
    since: Duration,
}

impl RampDown {
    /// Begins at the time `now` of the stop.
    pub(super) fn begin(now: Duration) -> Self {
        Self { begin: now, longest: None, slowest: u64::MAX, since: now }
    }
}

impl<T: Transport> Link<T> {
    /// Checks that motors with these rates come to rest in time.
    ///
    /// # Errors
    /// [`LinkError::NotAtRest`] where they have not slowed down for a while;
    /// [`LinkError::StillTurning`] where their ramp takes longer than the board's configuration
    /// allows.
    pub(super) fn check_ramp(
        &self,
        ramp: &mut RampDown,
        rates: [Rate; 3],
    ) -> Result<(), LinkError> {
        let (now, port) = (self.transport.now(), self.transport.name());
        let sum = rates.iter().map(|rate| u64::from(rate.0.unsigned_abs())).sum();
        if sum < ramp.slowest {
            (ramp.slowest, ramp.since) = (sum, now);
        }
        let waited = now.saturating_sub(ramp.since);
        if waited > ANSWER_TIMEOUT {
            return Err(LinkError::NotAtRest { port, waited });
        }
        let longest = *ramp.longest.get_or_insert_with(|| self.longest_ramp(rates));
        let waited = now.saturating_sub(ramp.begin);
        if waited > longest {
            return Err(LinkError::StillTurning { port, what: "the stop", waited, longest });
        }
        Ok(())
    }

    /// Returns the longest time in which motors with these rates come to rest: by the highest rate
    /// and the acceleration of the configuration in force, or else by the least acceleration that
    /// a board accepts.
    pub(super) fn longest_ramp(&self, rates: [Rate; 3]) -> Duration {
        let ramp = match &self.config {
            Some(config) => longest(
                config
                    .motors
                    .map(|motor| seconds(motor.max_rate.to_si() / motor.max_acceleration.to_si())),
            ),
            None => longest(rates.map(|rate| seconds(rate.to_si().abs() / LEAST_ACCELERATION)))
                .min(LONGEST_RAMP),
        };
        ramp + LONGEST_MEAN + MARGIN
    }

    /// Returns the jog that begins now.
    pub(super) fn jog_under_way(&self, jog: &Jog) -> JogUnderWay {
        // A jog too short for its rate takes less time than the way at this rate and its ramp.
        let way = seconds(jog.distance.to_si().abs() / jog.rate.to_si().abs().min(RETURN_RATE));
        let ramp = self.longest_ramp([jog.rate; 3]);
        JogUnderWay { begin: self.transport.now(), longest: way.saturating_add(ramp) }
    }

    /// Returns whether the last [`jog`](Self::jog) is under way, by the board's newest `telemetry`:
    /// the motor turns, or comes to rest.
    ///
    /// # Errors
    /// [`LinkError::StillTurning`] where it takes longer than its distance does at its rate.
    pub fn is_jogging(&self, telemetry: &Telemetry) -> Result<bool, LinkError> {
        // With a running mean over the step plan the motor comes to rest after the jog's end.
        if !matches!(telemetry.state, State::Jogging | State::Stopping) {
            return Ok(false);
        }
        let Some(JogUnderWay { begin, longest }) = self.jog else { return Ok(true) };
        let waited = self.transport.now().saturating_sub(begin);
        if waited > longest {
            let port = self.transport.name();
            return Err(LinkError::StillTurning { port, what: "the jog", waited, longest });
        }
        Ok(true)
    }
}

/// Returns the longest of three times.
fn longest(times: [Duration; 3]) -> Duration {
    times.into_iter().max().unwrap_or_default()
}

/// Converts seconds; a time without an end to the longest one.
fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}
