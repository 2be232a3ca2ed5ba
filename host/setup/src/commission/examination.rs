//! Course of an examination: jogs, pictures, and the ball's place at rest from several pictures.
//! The board hears from the host while pictures are taken.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nalgebra::{Point3, Vector3};
use plumb_frame::detect::BallDetector;
use plumb_frame::observation::BallObservation;
use plumb_frame::source::CameraSource;
use plumb_protocol::message::{Jog, Refusal, State, Telemetry};
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::doubt::DepthComparison;
use plumb_runtime::link::{Link, LinkError, Transport};
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::Rig;

use super::ExaminationError;
use super::fault::Output;
use super::report::Report;
use super::response::{Probe, Response};

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
    /// Highest rate of a jog.
    pub(super) rate: Rate,
    /// Farthest jog from the start, full steps.
    pub(super) max_steps: f64,
    /// Number of pictures so far.
    pub(super) frames: u64,
    /// Number of pictures that were lost since the last good one.
    pub(super) lost_in_a_row: u32,
    /// Place of the ball before the first jog, metres.
    pub(super) start: Point3<f64>,
    /// Comparison of the ball's two depths.
    depths: DepthComparison,
    /// Scatter of the ball's positions before the first jog, metres.
    start_scatter: f64,
    /// Start of the examination, seconds on the source's clock.
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
            depths: DepthComparison::default(),
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
        let Ok(responses) = <[Response; 3]>::try_from(responses) else {
            return Err(ExaminationError::EndOfFrames);
        };
        let report = Report::of(rig, place.median, responses);
        Ok(Report { doubt: self.depths.doubt(), ..report })
    }

    /// Returns the place of the ball before the first jog.
    fn first_place(&mut self) -> Result<Place, ExaminationError> {
        let pictures = self.look(PICTURES)?;
        let Pictures { positions, frames, seen } = &pictures;
        let with_depth = positions.len() as u32;
        let doubt = self.depths.doubt();
        let not_seen =
            ExaminationError::BallNotSeen { frames: *frames, seen: *seen, with_depth, doubt };
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
        if !self.begin_jog(output, distance, self.rate)? {
            return Ok(false);
        }
        loop {
            let telemetry = self.tend(|_| ())?;
            if !self.link.is_jogging(&telemetry)? {
                return Ok(true);
            }
        }
    }

    /// Begins to turn a motor by `distance`, + pays out. Returns false where the travel
    /// ends before.
    pub(super) fn begin_jog(
        &mut self,
        output: Output,
        distance: Steps16,
        rate: Rate,
    ) -> Result<bool, ExaminationError> {
        match self.link.jog(Jog { motor: output as u8, distance, rate }) {
            Ok(()) => Ok(true),
            Err(LinkError::Refused { refusal: Refusal::JogTravel, .. }) => Ok(false),
            Err(error) => Err(error.into()),
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

/// Standard deviation of a normal distribution for a median absolute deviation of 1.
const SD_PER_MAD: f64 = 1.4826;

/// Standard deviation of a median of n values for a standard deviation of 1 of each, times √n.
const MEDIAN_SD: f64 = 1.2533;

/// Place of the ball from several pictures. Single outliers have no effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Median of the positions, metres.
    pub median: Point3<f64>,
    /// Scatter of a single position: the largest standard deviation of the axes, metres.
    pub scatter: f64,
    /// Standard deviation of the median along the axis with the largest, metres.
    pub sd: f64,
}

impl Place {
    /// Returns the place from these positions; `None` without any.
    pub(super) fn of(positions: &[Point3<f64>]) -> Option<Self> {
        let axis = |k: usize| positions.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let axes = [axis(0), axis(1), axis(2)];
        let [x, y, z] = [median(&axes[0])?, median(&axes[1])?, median(&axes[2])?];
        let centre = [x, y, z];
        let scatter = axes.iter().zip(centre).filter_map(|(values, centre)| {
            let distances: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
            median(&distances)
        });
        let scatter = SD_PER_MAD * scatter.fold(0.0, f64::max);
        let sd = MEDIAN_SD * scatter / (positions.len() as f64).sqrt();
        Some(Self { median: Point3::from(centre), scatter, sd })
    }

    /// Returns the displacement since `before`, metres.
    pub(super) fn since(&self, before: &Self) -> Vector3<f64> {
        self.median - before.median
    }
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let upper = *sorted.get(middle)?;
    if sorted.len() % 2 == 1 { Some(upper) } else { Some((upper + sorted[middle - 1]) / 2.0) }
}

/// Time from the end of a jog to the first picture that counts, seconds.
const SETTLE_S: f64 = 0.4;

/// Longest wait for a picture before the board is asked for its state, so that the board does not
/// stop for a silent host.
const MAX_WAIT: Duration = Duration::from_millis(50);

/// Number of lost pictures in a row after which the camera counts as gone, as in a run.
const MAX_LOST_IN_A_ROW: u32 = 30;

/// Pictures of the ball at rest.
pub(super) struct Pictures {
    /// Positions where the ball was located, metres in the rig frame.
    pub(super) positions: Vec<Point3<f64>>,
    /// Number of pictures.
    pub(super) frames: u32,
    /// Number of pictures with a ball.
    pub(super) seen: u32,
}

impl<T: Transport> Examination<'_, '_, T> {
    /// Takes pictures of the ball at rest: those from [`SETTLE_S`] after now.
    pub(super) fn look(&mut self, pictures: u32) -> Result<Pictures, ExaminationError> {
        let begin = self.parts.source.now() + SETTLE_S;
        let mut taken = Pictures { positions: Vec::new(), frames: 0, seen: 0 };
        while taken.frames < pictures {
            self.tend(|(time, ball)| {
                if time < begin {
                    return;
                }
                taken.frames += 1;
                taken.seen += u32::from(ball.is_some());
                taken.positions.extend(ball.and_then(|ball| ball.position).map(|it| it.mean));
            })?;
        }
        Ok(taken)
    }

    /// Waits for the next picture and gives its time and its ball to `see`. Asks the board for its
    /// state meanwhile, so that the board hears from the host.
    pub(super) fn tend(
        &mut self,
        mut see: impl FnMut((f64, Option<BallObservation>)),
    ) -> Result<Telemetry, ExaminationError> {
        if self.parts.interrupted.load(Ordering::Relaxed) {
            self.link.stop()?;
            return Err(ExaminationError::Interrupted);
        }
        let has_picture = self.parts.source.wait(MAX_WAIT);
        let picture = if has_picture { self.picture()? } else { None };
        self.link.poll()?;
        let telemetry = self.link.status()?;
        if let State::Fault(fault) = telemetry.state {
            let fault = self.link.board_fault().unwrap_or_else(|| fault.into());
            return Err(ExaminationError::Stopped(fault));
        }
        if let Some(record) = picture {
            see((record.time + self.begin, record.observation));
            self.publish(FrameRecord { board: Some((&telemetry).into()), ..record })?;
        }
        Ok(telemetry)
    }

    /// Takes the next picture and looks for the ball in it; `None` where it is lost.
    fn picture(&mut self) -> Result<Option<FrameRecord>, ExaminationError> {
        let frame = match self.parts.source.next_frame() {
            Ok(Some(frame)) => frame,
            Ok(None) => return Err(ExaminationError::EndOfFrames),
            Err(error) if error.is_over() || self.lost_in_a_row >= MAX_LOST_IN_A_ROW => {
                return Err(error.into());
            }
            Err(_lost) => {
                self.lost_in_a_row += 1;
                return Ok(None);
            }
        };
        self.lost_in_a_row = 0;
        let observation = self.parts.detector.detect(&frame)?;
        self.depths.look(&*self.parts.detector, &frame, observation.as_ref());
        self.frames += 1;
        Ok(Some(FrameRecord {
            number: self.frames - 1,
            time: frame.time() - self.begin,
            filtered_error: None,
            ground_truth: frame.ground_truth(),
            path: None,
            frame: Some(Arc::new(frame)),
            observation,
            target: Some(self.start),
            board: None,
            fault_cause: None,
            state: None,
        }))
    }

    fn publish(&mut self, record: FrameRecord) -> Result<(), ExaminationError> {
        for observer in self.parts.observers.iter_mut() {
            observer.frame(&record);
            if let Some(error) = observer.failure() {
                return Err(ExaminationError::Observer(error));
            }
        }
        Ok(())
    }
}
