//! Course of an examination: jogs and pictures.

use std::sync::atomic::AtomicBool;

use nalgebra::Point3;
use plumb_frame::detect::BallDetector;
use plumb_frame::source::CameraSource;
use plumb_protocol::message::{Jog, Refusal};
use plumb_protocol::units::{Rate, Steps16};

use super::error::ExaminationError;
use super::fault::Output;
use super::look::Place;
use super::pictures::Pictures;
use super::report::Report;
use super::response::{Probe, Response};
use crate::link::{Link, LinkError, Transport};
use crate::observer::Observer;
use crate::rig::Rig;

/// Displacement of the ball that is enough, metres: some ten times the noise of a single picture.
const ENOUGH_M: f64 = 0.015;

/// First jog of a motor, full steps. The next ones go twice as far.
const FIRST_STEPS: f64 = 8.0;

/// Farthest jog from the start where the size of the rig is unknown, full steps: a revolution.
const MAX_STEPS: f64 = 200.0;

/// Cable of the farthest jog from the start, metres.
const MAX_CABLE_M: f64 = 0.06;

/// Number of pictures that measure a place.
const PICTURES: u32 = 20;

/// Number of pictures between two jogs in one direction.
const QUICK_PICTURES: u32 = 5;

/// Number of pictures that measure the middle of a swing: 2.5 s at 30 Hz, above its period.
const SWING_PICTURES: u32 = 75;

/// Scatter above which the ball swings, in multiples of its scatter before the first jog.
const SWING_SCATTER: f64 = 1.5;

/// Largest scatter of the positions of a ball at rest, metres.
const MAX_SCATTER_M: f64 = 0.012;

/// Parts of an examination that its caller chooses.
pub struct ExaminationParts<'a> {
    /// Source of the frames, which must be live.
    pub source: &'a mut dyn CameraSource,
    /// Detector of the ball.
    pub detector: &'a mut dyn BallDetector,
    /// Outputs, such as a simulated rig that follows the motors.
    pub observers: &'a mut [&'a mut dyn Observer],
    /// Receiver of a line of text before each step.
    pub progress: &'a mut dyn FnMut(&str),
    /// Flag that stops the motors and ends the examination when it is set from outside.
    pub interrupted: &'a AtomicBool,
}

/// Examination of a rig: the board is connected and configured, and its motors stand still.
pub struct Examination<'a, 'p, T> {
    pub(super) parts: &'a mut ExaminationParts<'p>,
    pub(super) link: Link<T>,
    rate: Rate,
    max_steps: f64,
    /// Number of pictures so far.
    pub(super) frames: u64,
    /// Number of pictures that were lost since the last good one.
    pub(super) lost_in_a_row: u32,
    /// Place of the ball before the first jog, metres.
    pub(super) start: Point3<f64>,
    /// Scatter of the ball's positions before the first jog, metres.
    start_scatter: f64,
    /// Begin of the examination, seconds on the source's clock.
    pub(super) begin: f64,
}

impl<'a, 'p, T: Transport> Examination<'a, 'p, T> {
    /// Examines `rig`, whose configured board is at the other end of `link`. The motors turn: by
    /// 60 mm of cable or a revolution at most, within `jog.max_distance` and the travel, at
    /// `jog.max_rate`, and back.
    ///
    /// # Errors
    /// Where the ball is not seen or does not hang still, the board stops by itself, the link or
    /// the camera fails, or somebody interrupts. The motors are then ramped down.
    pub fn run(
        rig: &Rig,
        link: Link<T>,
        parts: &'a mut ExaminationParts<'p>,
    ) -> Result<Report, ExaminationError> {
        if !parts.source.is_live() {
            return Err(ExaminationError::NotLive);
        }
        let begin = parts.source.now();
        let rate = rig.jog.max_rate.get().min(rig.motors.max_rate.get());
        let mut examination = Self {
            parts,
            link,
            rate: Rate::from_si(rate).unwrap_or(Rate(1)),
            max_steps: max_steps(rig),
            frames: 0,
            lost_in_a_row: 0,
            start: Point3::origin(),
            start_scatter: 0.0,
            begin,
        };
        let result = examination.examine(rig);
        if result.is_err() {
            examination.link.abandon();
        }
        result
    }

    fn examine(&mut self, rig: &Rig) -> Result<Report, ExaminationError> {
        (self.parts.progress)("looking at the ball");
        let place = self.first_place()?;
        (self.start, self.start_scatter) = (place.median, place.scatter);
        let mut responses = Vec::new();
        let mut present = place;
        for output in Output::ALL {
            let out = self.probe(output, 1.0, &mut present)?;
            let wound = self.probe(output, -1.0, &mut present)?;
            responses.push(Response { out, wound });
        }
        match <[Response; 3]>::try_from(responses) {
            Ok(responses) => Ok(Report::of(rig, place.median, responses)),
            Err(_) => Err(ExaminationError::EndOfFrames),
        }
    }

    /// Returns the place of the ball before the first jog.
    fn first_place(&mut self) -> Result<Place, ExaminationError> {
        let pictures = self.look(PICTURES)?;
        let Pictures { positions, frames, seen } = &pictures;
        let with_depth = positions.len() as u32;
        let not_seen = ExaminationError::BallNotSeen { frames: *frames, seen: *seen, with_depth };
        let place = Place::of(positions).filter(|_| 2 * with_depth > *frames).ok_or(not_seen)?;
        if place.scatter > MAX_SCATTER_M {
            return Err(ExaminationError::Unsteady { scatter_mm: place.scatter * 1e3 });
        }
        Ok(place)
    }

    /// Turns a motor in the direction `sign` until the ball has moved enough, and back. `present`
    /// is the place of the ball before, and then after it.
    fn probe(
        &mut self,
        output: Output,
        sign: f64,
        present: &mut Place,
    ) -> Result<Probe, ExaminationError> {
        let what = if sign > 0.0 { "pay out" } else { "wind in" };
        (self.parts.progress)(&format!("output {output}: {what}"));
        let mut steps = 0.0;
        while steps < self.max_steps {
            let goal = (2.0 * steps).max(FIRST_STEPS).min(self.max_steps);
            if !self.jog(output, sign * (goal - steps))? {
                break;
            }
            steps = goal;
            let place = self.place_of(output, sign * steps, QUICK_PICTURES)?;
            if place.since(present).norm() > ENOUGH_M {
                break;
            }
        }
        let away = self.place(output, sign * steps)?;
        self.jog(output, -sign * steps)?;
        let back = self.place(output, 0.0)?;
        let probe = Probe {
            steps: sign * steps,
            moved: away.since(present),
            remainder: back.since(present),
            sd: away.sd.hypot(present.sd),
        };
        *present = back;
        Ok(probe)
    }

    /// Turns a motor by `steps` (full steps, + pays out) and waits until it stands. Returns false
    /// where the travel ends before.
    fn jog(&mut self, output: Output, steps: f64) -> Result<bool, ExaminationError> {
        let distance = Steps16::from_si(steps).unwrap_or(Steps16(0));
        let jog = Jog { motor: output as u8, distance, rate: self.rate };
        match self.link.jog(jog) {
            Ok(()) => {}
            Err(LinkError::Refused { refusal: Refusal::JogTravel, .. }) => return Ok(false),
            Err(error) => return Err(error.into()),
        }
        loop {
            let telemetry = self.tend(|_| ())?;
            if !self.link.is_jogging(&telemetry)? {
                return Ok(true);
            }
        }
    }

    /// Returns the place of the ball after the motor of `output` has turned by `steps`: the middle
    /// of its swing, where it swings.
    fn place(&mut self, output: Output, steps: f64) -> Result<Place, ExaminationError> {
        let place = self.place_of(output, steps, PICTURES)?;
        if place.scatter <= SWING_SCATTER * self.start_scatter {
            return Ok(place);
        }
        self.place_of(output, steps, SWING_PICTURES)
    }

    fn place_of(
        &mut self,
        output: Output,
        steps: f64,
        pictures: u32,
    ) -> Result<Place, ExaminationError> {
        // Of a few pictures most may be without a ball by chance.
        for pictures in [pictures, PICTURES] {
            let Pictures { positions, frames, .. } = self.look(pictures)?;
            let is_seen = 2 * positions.len() as u32 > frames;
            if let Some(place) = Place::of(&positions).filter(|_| is_seen) {
                return Ok(place);
            }
        }
        Err(ExaminationError::BallLost { output, steps })
    }
}

/// Returns the farthest jog from the start, full steps.
fn max_steps(rig: &Rig) -> f64 {
    let limit = rig.jog.max_distance.get();
    let of_cable = rig.size.as_ref().map(|size| MAX_CABLE_M / size.cable_per_step.get());
    of_cable.unwrap_or(MAX_STEPS).min(limit)
}
