//! Pictures of an examination: the board hears from the host while they are taken.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use nalgebra::Point3;
use plumb_frame::observation::BallObservation;
use plumb_protocol::message::{State, Telemetry};

use super::error::ExaminationError;
use super::examination::Examination;
use crate::link::Transport;
use crate::observer::FrameRecord;

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
        self.frames += 1;
        Ok(Some(FrameRecord {
            number: self.frames - 1,
            time: frame.time() - self.begin,
            filtered_error: None,
            ground_truth: frame.ground_truth(),
            path: None,
            frame: Some(Arc::new(frame)),
            observation,
            target: self.start,
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
