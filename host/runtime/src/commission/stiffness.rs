//! Measurement of the cables' stiffness: one motor turns to and fro by a few steps, and the camera
//! watches the ball swing on its cables.
//!
//! The motor is the one that moves the ball most along its slowest mode. Each jog begins and ends
//! with a jerk that makes the ball swing. The pauses differ, so that no period is met by all
//! jogs or by none.

use nalgebra::{Point3, Vector3};
use plumb_protocol::units::{Rate, Steps16};

use super::ExaminationError;
use super::examination::Examination;
use super::fault::Output;
use super::mode::Mode;
use super::report::Report;
use super::response::Motion;
use super::swing::{Doubt, Drive, Measurement, Sample, Turn, Watch};
use crate::link::{LinkError, Transport};
use crate::rig::Rig;
use crate::rig::quantity::Mean;

/// Length of a jog, seconds: about half of the shortest period of soft cables.
const JOG_S: f64 = 0.12;

/// Highest speed of the ball, m/s: it moves by 6 mm, and the cables stay taut.
const SPEED_M_S: f64 = 0.05;

/// Number of jogs; every second one leads back.
const JOGS: usize = 20;
const _: () = assert!(JOGS.is_multiple_of(2));

/// Pauses after a jog, in turn, seconds.
const PAUSES_S: [f64; 8] = [0.03, 0.13, 0.07, 0.2, 0.1, 0.03, 0.17, 0.07];

/// Time for the ball to come to rest before, seconds.
const SETTLE_S: f64 = 1.0;

/// Time of watching the ball at rest, seconds.
const REST_S: f64 = 1.5;

/// Time of watching the ball after the last jog, seconds.
const WATCH_S: f64 = 1.5;

/// Longest time from a request to its answer with which the start of a jog is known, seconds.
const LONGEST_ANSWER_S: f64 = 0.05;

/// Time between two pictures above which the second one is late, over the usual time.
const LATE_PICTURE: f64 = 1.8;

/// Returns the rig without a running mean over the step plan, which would take out the swing.
fn without_mean(rig: &Rig) -> Rig {
    let mut rig = rig.clone();
    rig.law.set_mean(Mean::default());
    rig
}

/// Places of the ball along a direction.
struct Places {
    direction: Vector3<f64>,
    samples: Vec<Sample>,
    /// Times at which pictures were taken in, with a ball or without, seconds.
    taken_in: Vec<f64>,
}

impl Places {
    fn push(&mut self, time: f64, place: &Point3<f64>) {
        self.samples.push(Sample { time, along: self.direction.dot(&place.coords) });
    }

    /// Returns whether a picture came late: long after the one before, beside the median.
    fn has_late_pictures(&self) -> bool {
        let mut between: Vec<f64> = self.taken_in.windows(2).map(|two| two[1] - two[0]).collect();
        between.sort_by(f64::total_cmp);
        let usual = between.get(between.len() / 2);
        between.last().zip(usual).is_some_and(|(longest, usual)| *longest > LATE_PICTURE * usual)
    }
}

/// Jogs to and fro.
struct ToAndFro {
    output: Output,
    rate: Rate,
    /// First jog, and the second one back.
    distance: Steps16,
}

impl ToAndFro {
    /// Returns jogs of a motor at `rate` (full steps/s) at most, each of `max_steps` at most.
    fn of(mode: &Mode, rate: Rate, max_steps: f64) -> Self {
        let slower = Rate::from_si(SPEED_M_S / mode.step_m).unwrap_or(rate);
        let rate = Rate(rate.0.min(slower.0).max(1));
        let steps = (JOG_S * rate.to_si()).min(max_steps);
        let distance = Steps16(Steps16::from_si(steps).map_or(1, |steps| steps.0.max(1)));
        Self { output: mode.output, rate, distance }
    }
}

impl<T: Transport> Examination<'_, '_, T> {
    /// Measures the stiffness of the cables where the steps before found no fault. A motor turns
    /// to and fro, by 6 mm of the ball's way at most, within the limits of a jog and the travel.
    pub(super) fn measure_stiffness(
        &mut self,
        rig: &Rig,
        report: &Report,
    ) -> Result<Measurement, ExaminationError> {
        if !report.is_right() {
            return Ok(Measurement::Unknown(Doubt::Fault));
        }
        let per_step = report.responses.map(|response| match response.motion() {
            Motion::Follows { per_step, .. } => per_step,
            _ => Vector3::zeros(),
        });
        let Some(mode) = Mode::of(per_step) else {
            return Ok(Measurement::Unknown(Doubt::Unexplained));
        };
        (self.parts.progress)(&format!("output {}: a little to and fro", mode.output));
        self.configure(&without_mean(rig))?;
        let measured = self.swing(&mode, rig.motors.max_acceleration.get());
        // Also after an error, which is told before one of this.
        let restored = self.configure(rig);
        let measured = measured?;
        restored?;
        Ok(measured)
    }

    /// Configures the board, whose motors stand.
    fn configure(&mut self, rig: &Rig) -> Result<(), ExaminationError> {
        let wiring = rig.wiring().map_err(|error| LinkError::Other(error.into()))?;
        let config = rig.config().map_err(|error| LinkError::Other(error.into()))?;
        Ok(self.link.configure(wiring, config)?)
    }

    /// Turns the motor of `mode` to and fro with this acceleration (full steps/s²), and judges the
    /// swing of the ball.
    fn swing(&mut self, mode: &Mode, acceleration: f64) -> Result<Measurement, ExaminationError> {
        let mut places =
            Places { direction: mode.direction, samples: Vec::new(), taken_in: Vec::new() };
        self.watch(SETTLE_S, &mut places)?;
        places.samples.clear();
        self.watch(REST_S, &mut places)?;
        let at_rest = std::mem::take(&mut places.samples);
        let jogs = ToAndFro::of(mode, self.rate, self.max_steps);
        let turns = match self.turn_to_and_fro(&jogs, &mut places)? {
            Ok(turns) => turns,
            Err(doubt) => return Ok(Measurement::Unknown(doubt)),
        };
        self.watch(WATCH_S, &mut places)?;
        let is_late = places.has_late_pictures();
        let drive = Drive { turns, rate: jogs.rate.to_si(), acceleration };
        let watch = Watch { at_rest, moved: places.samples, drive, gain: mode.gain };
        Ok(match watch.judge() {
            Measurement::Unknown(_) if is_late => Measurement::Unknown(Doubt::Late),
            measured => measured,
        })
    }

    /// Turns a motor to and fro. Returns its jogs, or why they tell nothing.
    fn turn_to_and_fro(
        &mut self,
        jogs: &ToAndFro,
        places: &mut Places,
    ) -> Result<Result<Vec<Turn>, Doubt>, ExaminationError> {
        let mut turns: Vec<Turn> = Vec::new();
        let mut is_late = false;
        let mut distance = jogs.distance;
        for pause in PAUSES_S.into_iter().cycle().take(JOGS) {
            let mut begin = self.parts.source.now();
            if !self.begin_jog(jogs.output, distance, jogs.rate)? {
                // At one end of the travel the motor turns to the other side.
                distance = Steps16(-distance.0);
                begin = self.parts.source.now();
                let is_first = turns.is_empty();
                if !(is_first && self.begin_jog(jogs.output, distance, jogs.rate)?) {
                    return Ok(Err(Doubt::Travel));
                }
            }
            is_late |= self.parts.source.now() - begin > LONGEST_ANSWER_S;
            turns.push(Turn { begin, steps: distance.to_si() });
            distance = Steps16(-distance.0);
            while self.is_jogging(places)? {}
            self.watch(pause, places)?;
        }
        Ok(if is_late { Err(Doubt::Link) } else { Ok(turns) })
    }

    /// Takes the next picture. Returns whether the motor still turned then.
    fn is_jogging(&mut self, places: &mut Places) -> Result<bool, ExaminationError> {
        let mut is_taken = false;
        let telemetry = self.tend(|(time, ball)| {
            is_taken = true;
            if let Some(position) = ball.and_then(|ball| ball.position) {
                places.push(time, &position.mean);
            }
        })?;
        if is_taken {
            places.taken_in.push(self.parts.source.now());
        }
        Ok(self.link.is_jogging(&telemetry)?)
    }

    /// Watches the ball for this time, seconds.
    fn watch(&mut self, time: f64, places: &mut Places) -> Result<(), ExaminationError> {
        let end = self.parts.source.now() + time;
        while self.parts.source.now() < end {
            self.is_jogging(places)?;
        }
        Ok(())
    }
}
