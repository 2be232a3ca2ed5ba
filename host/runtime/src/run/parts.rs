//! Parts of a run that its caller chooses.

use std::sync::atomic::AtomicBool;

use plumb_cameras::source::CameraSource;
use plumb_frame::detect::BallDetector;

use crate::observer::Observer;
use crate::operator::OperatorReceiver;

/// Longest drive to one target where nothing else is set, seconds.
pub const DEFAULT_TIMEOUT: f64 = 120.0;

/// Parts of a run besides the rig and the board.
pub struct RunParts<'a> {
    /// Source of the frames, which must be live ([`CameraSource::is_live`]).
    pub source: &'a mut dyn CameraSource,
    /// Detector of the ball.
    pub detector: &'a mut dyn BallDetector,
    /// Outputs of the run.
    pub observers: &'a mut [&'a mut dyn Observer],
    /// Commands from other threads. With an operator the run goes on until the operator ends it.
    pub operator: Option<OperatorReceiver>,
    /// Longest drive to one target, seconds.
    pub timeout: f64,
    /// Flag that ends the run when it is set from outside.
    pub interrupted: &'a AtomicBool,
}

impl<'a> RunParts<'a> {
    /// Returns the parts of a run without outputs and operator, which ends after
    /// [`DEFAULT_TIMEOUT`] without reaching a target, and which nothing interrupts. Others are set
    /// by name: `RunParts { observers: &mut [&mut log], ..parts }`.
    pub fn new(source: &'a mut dyn CameraSource, detector: &'a mut dyn BallDetector) -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        let (timeout, interrupted) = (DEFAULT_TIMEOUT, &NEVER);
        Self { source, detector, observers: &mut [], operator: None, timeout, interrupted }
    }
}
