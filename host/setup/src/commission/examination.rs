//! Course of an examination: jogs, pictures, and the ball's place at rest from several pictures.
//! The board hears from the host while pictures are taken.

use nalgebra::{Point3, Vector3};
use plumb_protocol::message::{Jog, Refusal};
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::link::{Link, LinkError, Transport};
use plumb_runtime::rig::Rig;

use super::ExaminationError;
use super::fault::Output;
use super::report::Report;
use super::response::{Probe, Response};
use crate::watch::{Watch, WatchError, WatchParts};

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

/// Examination of a rig: the board is connected and configured, and its motors stand still.
pub struct Examination<'a, 'p, T> {
    watch: Watch<'a, 'p, T>,
    /// Highest rate of a jog.
    rate: Rate,
    /// Farthest jog from the start, full steps.
    max_steps: f64,
    /// Scatter of the ball's positions before the first jog, metres.
    start_scatter: f64,
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
        link: &'a mut Link<T>,
        parts: &'a mut WatchParts<'p>,
    ) -> Result<Report, ExaminationError> {
        let watch = Watch::new(link, parts)?;
        let rate = rig.jog.max_rate.get().min(rig.motors.max_rate.get());
        let mut examination = Self {
            watch,
            rate: Rate::from_si(rate).unwrap_or(Rate(1)),
            max_steps: max_steps(rig),
            start_scatter: 0.0,
        };
        let result = examination.examine(rig);
        if result.is_err() {
            examination.watch.link.abandon();
        }
        result
    }

    fn examine(&mut self, rig: &Rig) -> Result<Report, ExaminationError> {
        (self.watch.parts.progress)("looking at the ball");
        let place = self.first_place()?;
        (self.watch.target, self.start_scatter) = (Some(place.median), place.scatter);
        let mut responses = Vec::new();
        let mut present = place;
        for output in Output::ALL {
            let out = self.probe(output, 1.0, &mut present)?;
            let wound = self.probe(output, -1.0, &mut present)?;
            responses.push(Response { out, wound });
        }
        let Ok(responses) = <[Response; 3]>::try_from(responses) else {
            return Err(WatchError::EndOfFrames.into());
        };
        let report = Report::of(rig, place.median, responses);
        Ok(Report { doubt: self.watch.depths.doubt(), ..report })
    }

    /// Returns the place of the ball before the first jog.
    fn first_place(&mut self) -> Result<Place, ExaminationError> {
        let pictures = self.look(PICTURES)?;
        let Pictures { positions, frames, seen } = &pictures;
        let with_depth = positions.len() as u32;
        let doubt = self.watch.depths.doubt();
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
        (self.watch.parts.progress)(&format!("output {output}: {what}"));
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
            let telemetry = self.watch.tend(|_| ())?;
            if !self.watch.link.is_jogging(&telemetry).map_err(WatchError::from)? {
                return Ok(true);
            }
        }
    }

    /// Begins to turn a motor by `distance`, + pays out. Returns false where the travel
    /// ends before.
    fn begin_jog(
        &mut self,
        output: Output,
        distance: Steps16,
        rate: Rate,
    ) -> Result<bool, ExaminationError> {
        match self.watch.link.jog(Jog { motor: output as u8, distance, rate }) {
            Ok(()) => Ok(true),
            Err(LinkError::Refused { refusal: Refusal::JogTravel, .. }) => Ok(false),
            Err(error) => Err(WatchError::from(error).into()),
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
struct Place {
    /// Median of the positions, metres.
    median: Point3<f64>,
    /// Scatter of a single position: the largest standard deviation of the axes, metres.
    scatter: f64,
    /// Standard deviation of the median along the axis with the largest, metres.
    sd: f64,
}

impl Place {
    /// Returns the place from these positions; `None` without any.
    fn of(positions: &[Point3<f64>]) -> Option<Self> {
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
    fn since(&self, before: &Self) -> Vector3<f64> {
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

/// Pictures of the ball at rest.
struct Pictures {
    /// Positions where the ball was located, metres in the rig frame.
    positions: Vec<Point3<f64>>,
    /// Number of pictures.
    frames: u32,
    /// Number of pictures with a ball.
    seen: u32,
}

impl<T: Transport> Examination<'_, '_, T> {
    /// Takes pictures of the ball at rest: those from [`SETTLE_S`] after now.
    fn look(&mut self, pictures: u32) -> Result<Pictures, ExaminationError> {
        let begin = self.watch.parts.source.now() + SETTLE_S;
        let mut taken = Pictures { positions: Vec::new(), frames: 0, seen: 0 };
        while taken.frames < pictures {
            self.watch.tend(|(time, ball)| {
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
}
