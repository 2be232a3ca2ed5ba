//! Pictures of the ball while the motors are jogged. The board hears from the host meanwhile.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nalgebra::Point3;
use plumb_frame::detect::{BallDetector, DetectError};
use plumb_frame::image::ImageSize;
use plumb_frame::observation::BallObservation;
use plumb_frame::source::{BoxedError, CameraSource, SourceError};
use plumb_protocol::message::{State, Telemetry};
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::doubt::DepthComparison;
use plumb_runtime::link::{Link, LinkError, Transport};
use plumb_runtime::observer::{FrameRecord, Observer};
use thiserror::Error;

/// Longest wait for a picture before the board is asked for its state, so that the board does not
/// stop for a silent host.
const MAX_WAIT: Duration = Duration::from_millis(50);

/// Number of lost pictures in a row after which the camera counts as gone, as in a run.
const MAX_LOST_IN_A_ROW: u32 = 30;

/// Parts of a watch that its caller chooses.
pub struct WatchParts<'a> {
    /// Source of the frames, which must be live.
    pub source: &'a mut dyn CameraSource,
    /// Detector of the ball.
    pub detector: &'a mut dyn BallDetector,
    /// Outputs, such as a simulated rig that follows the motors.
    pub observers: &'a mut [&'a mut dyn Observer],
    /// Receiver of a line of text before each step.
    pub progress: &'a mut dyn FnMut(&str),
    /// Flag that stops the motors and ends the work when it is set from outside.
    pub interrupted: &'a AtomicBool,
}

/// Reason that a watch ended. The motors stand or ramp down.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WatchError {
    /// The link to the board failed, or the board refused a jog.
    #[error("link to the board")]
    Link(#[from] LinkError),
    /// The camera delivers no frames any more.
    #[error("camera")]
    Source(#[from] SourceError),
    /// The frames ended.
    #[error("the camera delivers no more frames")]
    EndOfFrames,
    /// The source is not live.
    #[error("the source of the frames is not live: a recording does not show what the motors do")]
    NotLive,
    /// The detector failed.
    #[error("detector")]
    Detect(#[from] DetectError),
    /// The simulated rig or another observer failed.
    #[error("output of the check")]
    Observer(#[source] BoxedError),
    /// The board stopped by itself.
    #[error("the board has stopped by itself: {0}")]
    Stopped(BoardFault),
    /// Somebody interrupted the work.
    #[error("interrupted: the motors have stopped on the way")]
    Interrupted,
}

/// Watch over a board and its ball.
pub(crate) struct Watch<'a, 'p, T> {
    pub(crate) parts: &'a mut WatchParts<'p>,
    pub(crate) link: &'a mut Link<T>,
    /// Number of pictures so far.
    frames: u64,
    /// Number of pictures that were lost since the last good one.
    lost_in_a_row: u32,
    /// Place of the ball for the outputs, metres.
    pub(crate) target: Option<Point3<f64>>,
    /// Comparison of the ball's two depths.
    pub(crate) depths: DepthComparison,
    /// Size of the last picture.
    pub(crate) size: Option<ImageSize>,
    /// Start of the watch, seconds on the source's clock.
    begin: f64,
}

impl<'a, 'p, T: Transport> Watch<'a, 'p, T> {
    /// Begins to watch.
    pub(crate) fn new(
        link: &'a mut Link<T>,
        parts: &'a mut WatchParts<'p>,
    ) -> Result<Self, WatchError> {
        if !parts.source.is_live() {
            return Err(WatchError::NotLive);
        }
        let begin = parts.source.now();
        Ok(Self {
            parts,
            link,
            frames: 0,
            lost_in_a_row: 0,
            target: None,
            depths: DepthComparison::default(),
            size: None,
            begin,
        })
    }

    /// Waits for the next picture and gives its time and its ball to `see`. Asks the board for its
    /// state meanwhile, so that the board hears from the host.
    pub(crate) fn tend(
        &mut self,
        mut see: impl FnMut((f64, Option<BallObservation>)),
    ) -> Result<Telemetry, WatchError> {
        if self.parts.interrupted.load(Ordering::Relaxed) {
            self.link.stop()?;
            return Err(WatchError::Interrupted);
        }
        let has_picture = self.parts.source.wait(MAX_WAIT);
        let picture = if has_picture { self.picture()? } else { None };
        self.link.poll()?;
        let telemetry = self.link.status()?;
        if let State::Fault(fault) = telemetry.state {
            let fault = self.link.board_fault().unwrap_or_else(|| fault.into());
            return Err(WatchError::Stopped(fault));
        }
        if let Some(record) = picture {
            see((record.time + self.begin, record.observation));
            self.publish(FrameRecord { board: Some((&telemetry).into()), ..record })?;
        }
        Ok(telemetry)
    }

    /// Takes the next picture and looks for the ball in it; `None` where it is lost.
    fn picture(&mut self) -> Result<Option<FrameRecord>, WatchError> {
        let frame = match self.parts.source.next_frame() {
            Ok(Some(frame)) => frame,
            Ok(None) => return Err(WatchError::EndOfFrames),
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
        self.size = Some(frame.colour().size());
        self.frames += 1;
        Ok(Some(FrameRecord {
            number: self.frames - 1,
            time: frame.time() - self.begin,
            filtered_error: None,
            ground_truth: frame.ground_truth(),
            path: None,
            frame: Some(Arc::new(frame)),
            observation,
            target: self.target,
            board: None,
            fault_cause: None,
            state: None,
        }))
    }

    fn publish(&mut self, record: FrameRecord) -> Result<(), WatchError> {
        for observer in self.parts.observers.iter_mut() {
            observer.frame(&record);
            if let Some(error) = observer.failure() {
                return Err(WatchError::Observer(error));
            }
        }
        Ok(())
    }
}
