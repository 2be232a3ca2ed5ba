//! Observers: the outputs of a run. Each one receives every frame record, the events and the
//! summary. The recorder of the frames is one of them.

use std::sync::Arc;

use nalgebra::Point3;
use plumb_cameras::record::{RecordError, Recorder, Recording};
use plumb_frame::frame::{GroundTruth, RgbdFrame};
use plumb_frame::observation::BallObservation;
use plumb_frame::source::BoxedError;
use plumb_protocol::message::State;

use crate::board_fault::{BoardFault, FaultCause};
use crate::board_report::BoardReport;
use crate::summary::Summary;

pub use crate::deviation::PathPoint;
pub use crate::event::{EventKind, EventRecord, RunEvent, TargetsEvent, Tone};

/// Output of a run.
///
/// The control loop calls an observer between two frames, so an observer must return at once. One
/// that writes to a disk, a terminal or a network runs behind a
/// [`BoundedObserver`](crate::bounded_observer::BoundedObserver).
pub trait Observer {
    /// Receives the record of a frame.
    fn frame(&mut self, record: &FrameRecord);

    /// Receives an event.
    fn event(&mut self, _event: &EventRecord) {}

    /// Receives the summary at the end, also of a run that failed.
    fn end(&mut self, _summary: &Summary) {}

    /// Returns a new error that must end the run, such as a full disk below the run log. The run
    /// calls this after every frame.
    fn failure(&mut self) -> Option<BoxedError> {
        None
    }

    /// Returns the number of records that this observer should have kept and dropped instead.
    fn dropped(&self) -> u64 {
        0
    }
}

/// An observer that a run may lack: `None` receives nothing.
impl<O: Observer> Observer for Option<O> {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(observer) = self {
            observer.frame(record);
        }
    }

    fn event(&mut self, event: &EventRecord) {
        if let Some(observer) = self {
            observer.event(event);
        }
    }

    fn end(&mut self, summary: &Summary) {
        if let Some(observer) = self {
            observer.end(summary);
        }
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.as_mut()?.failure()
    }

    fn dropped(&self) -> u64 {
        self.as_ref().map_or(0, O::dropped)
    }
}

/// Everything that is known about one frame. The default is the first frame of a run, of which
/// nothing is known.
#[derive(Debug, Clone, Default)]
pub struct FrameRecord {
    /// Number of the frame in the run, from 0.
    pub number: u64,
    /// Time stamp of the frame, seconds since the run's start.
    pub time: f64,
    /// The frame; `None` behind a queue that leaves frames out.
    pub frame: Option<Arc<RgbdFrame>>,
    /// The ball as detected; `None` if it was not found, or if the detector could not search the
    /// frame (then [`RunEvent::FrameLost`] follows).
    pub observation: Option<BallObservation>,
    /// The present target, metres in the rig frame. While the ball follows a path, it is the place
    /// on the path at the time of the frame. After a Hold it is the last measured position
    /// once the board holds the ball, after a Stop the last target; `None` before the first one.
    pub target: Option<Point3<f64>>,
    /// The newest report of the board; `None` before its first telemetry.
    pub board: Option<BoardReport>,
    /// Cause of the fault for which the board has stopped by itself; `None` where none is known.
    pub fault_cause: Option<FaultCause>,
    /// State of the board, if its telemetry is about the present target.
    pub state: Option<State>,
    /// |e| of the position that the board has filtered, metres, from the newest telemetry; `None`
    /// without a target, and before the board has accepted a position of the ball.
    pub filtered_error: Option<f64>,
    /// What a simulation knows of the frame; `None` for a real camera.
    pub ground_truth: Option<GroundTruth>,
    /// Point of the path that the ball follows; `None` without a path.
    pub path: Option<PathPoint>,
}

impl FrameRecord {
    /// Returns the fault that the board reports, with its cause where that is known.
    pub fn board_fault(&self) -> Option<BoardFault> {
        match self.board?.state {
            State::Fault(fault) => Some(BoardFault { fault, cause: self.fault_cause }),
            _ => None,
        }
    }

    /// Returns the state of the board, if its telemetry is about the present target or it has
    /// stopped by itself.
    pub fn board_state(&self) -> Option<State> {
        self.state.or_else(|| self.board_fault().map(|it| State::Fault(it.fault)))
    }

    /// Returns the ball's measured position, metres in the rig frame; `None` if it is unknown.
    pub fn position(&self) -> Option<Point3<f64>> {
        self.observation.and_then(|ball| ball.position).map(|position| position.mean)
    }

    /// Returns the distance of the measured position from the target, metres.
    pub fn error(&self) -> Option<f64> {
        Some((self.position()? - self.target?).norm())
    }
}

/// Observer that records the frames. The recorder has a queue and a thread of its own.
#[derive(Debug)]
pub struct FrameRecorder(Recorder);

impl FrameRecorder {
    /// Records to `recorder`.
    pub fn new(recorder: Recorder) -> Self {
        Self(recorder)
    }

    /// Ends the recording. Returns what was recorded.
    ///
    /// # Errors
    /// Where the recording could not be written to its end.
    pub fn finish(self) -> Result<Recording, RecordError> {
        self.0.finish()
    }
}

impl Observer for FrameRecorder {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(frame) = &record.frame {
            self.0.add(frame);
        }
    }

    fn dropped(&self) -> u64 {
        self.0.dropped()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::Point3;
    use plumb_cameras::camera_file;
    use plumb_cameras::record::{Overflow, RecordFolder};
    use plumb_frame::frame::RgbdFrame;
    use plumb_frame::image::Image;
    use std::fs;
    use std::sync::Arc;

    use super::*;

    /// Returns the record of a dark frame without a ball, the first of a run.
    pub(crate) fn record() -> FrameRecord {
        let intrinsics = camera_file::paper().unwrap().intrinsics;
        let (colour, depth) = (Image::filled(4, 4, [0; 3]), Image::filled(4, 4, 0));
        let frame = RgbdFrame::new(0.0, colour, depth, intrinsics).unwrap();
        FrameRecord {
            frame: Some(Arc::new(frame)),
            target: Some(Point3::origin()),
            ..FrameRecord::default()
        }
    }

    #[test]
    fn frames_that_cannot_be_written_count_as_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record");
        let record = record();
        let intrinsics = record.frame.as_ref().unwrap().intrinsics();
        let recorder = RecordFolder::create(&path)
            .unwrap()
            .begin(camera_file::PAPER, intrinsics, Overflow::Block)
            .unwrap();
        fs::remove_dir_all(path.join("depth")).unwrap();
        let mut recorder = FrameRecorder::new(recorder);
        let added = (1..1000).find(|_| {
            recorder.frame(&record);
            recorder.dropped() > 0
        });
        assert!(added.is_some_and(|added| added > 1), "{added:?}");
        assert!(recorder.finish().is_err());
    }
}
