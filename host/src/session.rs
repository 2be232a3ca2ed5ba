//! A run from its parts to its end: rig, board, camera, outputs and operators.
//!
//! ```text
//! Task -> prepare: outputs, operators -> connect: the board -> drive: the camera -> conclude
//! ```

pub(crate) mod camera;
pub(crate) mod connection;
mod end;
pub(crate) mod find_ball;
pub(crate) mod goal;
pub(crate) mod operators;
pub(crate) mod options;
pub(crate) mod outputs;
pub(crate) mod page;
pub(crate) mod real_time;
mod report;
pub(crate) mod ros2;
pub(crate) mod viewers;

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use plumb_cameras::record::{Overflow, RecordFolder};
use plumb_frame::source::CameraSource;
use plumb_log::{FigureSettings, OutputDir, RunLog};
use plumb_runtime::link::Transport;
use plumb_runtime::observer::{FrameRecorder, Observer};
use plumb_runtime::operator::operator;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts, TargetUse, Waypoint};
use plumb_runtime::targets::{TargetReceiver, TargetStream};
use plumb_vision::camera::Camera;
use plumb_vision::detect::BallDetector;

use crate::cli::choices::DetectorName;
use crate::cli::exit::Failure;
use crate::cli::print::tell;
use crate::session::camera::RunCamera;
use crate::session::find_ball::find_ball;
use crate::session::goal::Goal;
use crate::session::operators::Operators;
use crate::session::options::RunOptions;
use crate::session::outputs::{Output, Outputs, RunFolder, run_progress};
use end::EndedSession;

/// Time to an answer of the board from which on a user is told. With 0.4 s the paper's task takes
/// 2.5 times as long as with 0.06 s, with 0.2 s 1.1 times (`plumb emulate --latency`, half of it).
const SLOW_ANSWER: Duration = Duration::from_millis(300);

/// Task of a run.
pub(crate) struct Task {
    pub(crate) rig: Rig,
    /// Text of the camera file, for a recording.
    pub(crate) camera_text: String,
    pub(crate) goal: Goal,
    pub(crate) output_dir: OutputDir,
    /// Behaviour of an output whose queue is full. In virtual time nothing is late, and it is to
    /// block.
    pub(crate) overflow: Overflow,
    /// Command that clears a fault of the board.
    pub(crate) clear: String,
}

/// A run whose outputs and operators are open.
pub(crate) struct Session {
    pub(crate) task: Task,
    detector: DetectorName,
    timeout: f64,
    recording: Option<RecordFolder>,
    viewers: Option<Box<dyn Output>>,
    operators: Operators,
    /// Thread that reads targets that move, and the receiver of them.
    moving: Option<(TargetStream, Option<TargetReceiver>)>,
}

impl Session {
    /// Opens the outputs and operators that the options ask for, of a rig that `camera` sees.
    pub(crate) fn prepare(
        task: Task,
        camera: &Camera,
        options: &RunOptions,
    ) -> Result<Self, Failure> {
        let rig = &task.rig;
        let (sender, mut receiver) = operator();
        let stream = task.goal.stream(rig, sender.targets().clone())?;
        let recording = options.record.as_deref().map(RecordFolder::create).transpose()?;
        task.output_dir.check()?;
        let viewers = options.viewers.start(rig, camera, task.overflow)?;
        let moving = stream.map(|stream| (stream, receiver.take_targets()));
        let operators = Operators::start(options, rig, camera, (sender, receiver))?;
        let (detector, timeout) = (options.detector, options.timeout);
        Ok(Self { task, detector, timeout, recording, viewers, operators, moving })
    }

    /// Returns the path for the recording of a device.
    pub(crate) fn oni(&self) -> Option<PathBuf> {
        self.recording.as_ref().map(RecordFolder::oni)
    }

    /// Connects to the board at `transport`, configures it, and gives the goal to the run.
    pub(crate) fn connect<T: Transport>(&mut self, transport: T) -> Result<Run<T>, RunError> {
        let mut run = Run::connect(&self.task.rig, transport)?;
        if let Some(time) = run.answer_time().filter(|time| *time >= SLOW_ANSWER) {
            tell!(
                "the link to the board is slow: an answer takes {:.1} s. The ball may swing, or be \
                 driven away from its target",
                time.as_secs_f64()
            );
        }
        if let Some(targets) = self.moving.as_mut().and_then(|(_, targets)| targets.take()) {
            run.set_targets(Box::new(targets), TargetUse::Goal);
        }
        if let Some(fault) = run.cleared_fault() {
            tell!("an earlier run left the board in a fault, cleared: {fault}");
        }
        self.task.goal.set(&mut run)?;
        Ok(run)
    }

    /// Drives with the pictures of `camera`, for the outputs, the operators and `observer`. The
    /// camera is closed at the end.
    pub(crate) fn drive<T: Transport>(
        self,
        mut run: Run<T>,
        camera: RunCamera,
        observer: Option<&mut dyn Observer>,
        interrupted: &AtomicBool,
    ) -> Result<EndedSession, Failure> {
        let Self { task, recording, mut operators, .. } = self;
        let RunCamera { mut source, camera, oni, mut follower } = camera;
        let recorder = recording
            .map(|folder| folder.begin(&task.camera_text, &camera.intrinsics, task.overflow))
            .transpose()?;
        let mut detector = self.detector.detector(&camera);
        if let Goal::PresentPlace = task.goal {
            hold(&mut run, &mut *source, &mut *detector, interrupted)?;
        }
        let log = RunLog::create(&task.output_dir, FigureSettings::of(&task.rig))?;
        let folder = log.path().to_owned();
        let log = RunFolder::start(log, task.overflow)?;
        let recorder = recorder.map(|recorder| Box::new(FrameRecorder::new(recorder)) as _);
        let list = [Some(Box::new(log) as _), recorder, self.viewers].into_iter().flatten();
        let operator = operators.take_operator();
        let progress = run_progress::start(run.target_count())?;
        let mut outputs = Outputs::new(list.collect(), progress, operator.is_some());
        let mut observers: Vec<&mut dyn Observer> = vec![&mut outputs];
        observers.extend(observer.map(|observer| observer as &mut dyn Observer));
        observers.extend(follower.as_mut().map(|follower| follower as &mut dyn Observer));
        observers.extend(operators.observers(source.clock()));
        let result = run.drive(RunParts {
            source: &mut *source,
            detector: &mut *detector,
            observers: &mut observers,
            operator,
            timeout: self.timeout,
            interrupted,
        });
        let page = operators.take_page();
        drop((operators, self.moving));
        // A device ends its own recording.
        drop(source);
        if let Some(oni) = &oni
            && let Err(error) = RecordFolder::check_oni(oni)
        {
            tell!("plumb: {}: {error}; use the pictures beside it", oni.display());
        }
        let is_endless = task.goal.is_endless();
        Ok(EndedSession { result, is_endless, outputs, folder, clear: task.clear, page })
    }
}

/// Sets the place of the ball as the target.
fn hold<T: Transport>(
    run: &mut Run<T>,
    source: &mut dyn CameraSource,
    detector: &mut dyn BallDetector,
    interrupted: &AtomicBool,
) -> Result<(), Failure> {
    let target = find_ball(source, detector, interrupted)?;
    let waypoint = Waypoint { dwell_s: f64::INFINITY, ..Waypoint::new(target) };
    run.set_waypoints(&[waypoint], false).map_err(|error| {
        Failure::from(error)
            .with_advice("The ball is there now: jog it back into the workspace, `plumb jog`")
    })
}
