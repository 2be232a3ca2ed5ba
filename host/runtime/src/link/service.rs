//! Commands for commissioning and maintenance (jog, home, clear, save, bootloader), and the longest
//! times in which motors come to rest after a stop and at the end of a jog. A board that reports
//! that its motors turn for longer is an error.

use plumb_protocol::diagnostics::ChipMeasurement;
use plumb_protocol::message::Jog;
use plumb_protocol::units::Rate;

use super::error::GREETING;
use super::*;

/// Timeout of the greeting with which [`Link::bootloader`] checks that the board has gone.
const CHECK_TIMEOUT: Duration = Duration::from_millis(300);

/// Longest wait for a board whose motors stand to restart into its bootloader. Motors that turn
/// ramp down first.
const RESTART_TIMEOUT: Duration = Duration::from_secs(3);

impl<T: Transport> Link<T> {
    /// Begins to turn one motor, and returns at once. The board stops the motor if nothing comes
    /// from the host for its deadline: ask for [`Link::status`] until the jog has ended
    /// ([`Link::is_jogging`]).
    ///
    /// # Errors
    /// Where the board refuses it, or the link fails.
    pub fn jog(&mut self, jog: Jog) -> Result<(), LinkError> {
        self.request("the jog", Command::Jog(jog))?;
        self.jog = Some(self.jog_under_way(&jog));
        Ok(())
    }

    /// Ramps down, and clears the fault for which the board stopped by itself. Without a fault it
    /// only stops.
    ///
    /// # Errors
    /// Where the emergency input is still open, or the link fails.
    pub fn clear_fault(&mut self) -> Result<(), LinkError> {
        self.stop()?;
        self.request_at_rest("the request to clear its fault", Command::ClearFault)?;
        self.fault = None;
        Ok(())
    }

    /// Makes the present motor positions the zero of travel; at standstill.
    ///
    /// # Errors
    /// Where the board is not ready: it turns, or stands in a fault; or the link fails.
    pub fn home(&mut self) -> Result<(), LinkError> {
        self.request_at_rest("the request for a new zero of travel", Command::Home).map(drop)
    }

    /// Saves the configuration in the board's flash, for the time after a loss of power.
    ///
    /// # Errors
    /// Where the board has no flash for it or cannot write it, or the link fails.
    pub fn save(&mut self) -> Result<(), LinkError> {
        self.request("the request to store its configuration", Command::Store).map(drop)
    }

    /// Returns the program that the board runs, and its chip.
    ///
    /// # Errors
    /// Where the link fails.
    pub fn provenance(&mut self) -> Result<Provenance, LinkError> {
        if let Some(provenance) = self.provenance {
            return Ok(provenance);
        }
        // It was lost, or is on its way. A board that is greeted again tells it again.
        let greeting = Command::Hello(Hello::OURS);
        self.exchange(GREETING, greeting, ANSWER_TIMEOUT, |_, message| match message {
            FromBoard::Provenance(provenance) => Some(*provenance),
            _ => None,
        })
    }

    /// Returns what the board has counted since its start.
    ///
    /// # Errors
    /// Where the link fails.
    pub fn diagnostics(&mut self) -> Result<Diagnostics, LinkError> {
        let what = "the request for its diagnostics";
        self.exchange(what, Command::Diagnose, ANSWER_TIMEOUT, |id, message| match message {
            FromBoard::Diagnostics(diagnostics) if diagnostics.id == id => Some(*diagnostics),
            _ => None,
        })
    }

    /// Returns what the board's chip has measured. The first call begins to count its pulses.
    ///
    /// # Errors
    /// Where the board refuses: motors turn, it stands in a fault, coils are configured, or it has
    /// no chip; or the link fails.
    pub fn measure(&mut self) -> Result<ChipMeasurement, LinkError> {
        let what = "the request for a measurement";
        self.exchange(what, Command::Measure, ANSWER_TIMEOUT, |id, message| match message {
            FromBoard::Measurement(measurement) if measurement.id == id => {
                Some(Ok(measurement.chip))
            }
            FromBoard::Answer(Answer { id: answered, refusal: Some(refusal), .. })
                if *answered == id =>
            {
                Some(Err(LinkError::Refused { what, refusal: *refusal }))
            }
            _ => None,
        })?
    }

    /// Has the board erase, write and read a sector of its flash that holds nothing. Returns
    /// whether it then held what was written.
    ///
    /// # Errors
    /// Where the board refuses, or the link fails.
    pub fn test_flash(&mut self) -> Result<bool, LinkError> {
        match self.request_at_rest("the request to test its flash", Command::TestFlash) {
            Ok(_) => Ok(true),
            Err(LinkError::Refused { refusal: Refusal::NotStored, .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Waits while messages of the board are handled.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn wait(&mut self, time: Duration) -> Result<(), LinkError> {
        let end = self.transport.now() + time;
        while self.transport.now() < end {
            self.listen(end.saturating_sub(self.transport.now()))?;
        }
        Ok(())
    }

    /// Sends the board into its chip's bootloader, where it waits for new firmware; one of any
    /// version, which needs no greeting. Its motors ramp down first. Waits until the board has
    /// gone.
    ///
    /// # Errors
    /// [`LinkError::StillThere`] where the board accepts the request and still answers 3 s after
    /// the longest ramp of its motors; others where nothing answers, or the link fails.
    pub fn bootloader(transport: T) -> Result<(), LinkError> {
        let mut link = Self::open(transport)?;
        link.request("the request to go into its bootloader", Command::Bootloader)?;
        let (begin, mut ramp) = (link.transport.now(), None);
        let waited = loop {
            match link.hello(CHECK_TIMEOUT) {
                Err(LinkError::Silent { .. } | LinkError::Lost { .. }) => return Ok(()),
                Ok(()) | Err(LinkError::Version { .. }) => link.listen(POLL_INTERVAL).map(drop)?,
                Err(error) => return Err(error),
            }
            if let Some(Telemetry { rates, .. }) = link.telemetry
                && rates.iter().any(|rate| rate.0 != 0)
            {
                ramp.get_or_insert_with(|| link.longest_ramp(&rates));
            }
            let waited = link.transport.now().saturating_sub(begin);
            if waited > RESTART_TIMEOUT + ramp.unwrap_or_default() {
                break waited;
            }
        };
        Err(LinkError::StillThere { port: link.transport.name(), waited })
    }
}

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

impl<T: Transport> Link<T> {
    /// Checks that motors with these rates come to rest in time.
    ///
    /// # Errors
    /// [`LinkError::NotAtRest`] where they have not slowed down for a while;
    /// [`LinkError::StillTurning`] where their ramp takes longer than the board's configuration
    /// allows.
    pub(super) fn check_ramp(&self, ramp: &mut RampDown, rates: &[Rate]) -> Result<(), LinkError> {
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
    pub(super) fn longest_ramp(&self, rates: &[Rate]) -> Duration {
        let ramp = match &self.config {
            Some(config) => longest(
                config
                    .motors
                    .iter()
                    .map(|motor| seconds(motor.max_rate.to_si() / motor.max_acceleration.to_si())),
            ),
            None => {
                let times = rates.iter().map(|rate| rate.to_si().abs() / LEAST_ACCELERATION);
                longest(times.map(seconds)).min(LONGEST_RAMP)
            }
        };
        ramp + LONGEST_MEAN + MARGIN
    }

    /// Returns the jog that begins now.
    pub(super) fn jog_under_way(&self, jog: &Jog) -> JogUnderWay {
        // A jog too short for its rate takes less time than the way at this rate and its ramp.
        let way = seconds(jog.distance.to_si().abs() / jog.rate.to_si().abs().min(RETURN_RATE));
        let ramp = self.longest_ramp(&[jog.rate]);
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

/// Returns the longest of these times.
fn longest(times: impl Iterator<Item = Duration>) -> Duration {
    times.max().unwrap_or_default()
}

/// Converts seconds; a time without an end to the longest one.
fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}
