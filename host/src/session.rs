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
pub(crate) mod options;
pub(crate) mod outputs;
pub(crate) mod picture;
pub(crate) mod real_time;
pub(crate) mod ros2;
pub(crate) mod viewers;

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use plumb_cameras::record::{Overflow, RecordError, RecordFolder};
use plumb_frame::source::CameraSource;
use plumb_log::{FigureSettings, OutputDir, RunLog};
use plumb_page::Page;
use plumb_runtime::link::{Link, Transport};
use plumb_runtime::observer::{FrameRecorder, Observer};
use plumb_runtime::operator::{OperatorReceiver, operator};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts, TargetUse, Waypoint};
use plumb_runtime::targets::{TargetReceiver, TargetStream};
use plumb_vision::camera::Camera;
use plumb_vision::detect::{BallDetector, DetectorKind};

use crate::cli::choices;
use crate::cli::exit::Failure;
use crate::session::camera::RunCamera;
use crate::session::find_ball::find_ball;
use crate::session::goal::Goal;
use crate::session::options::RunOptions;
use crate::session::outputs::{Output, Outputs, RunFolder, run_progress};
use crate::session::ros2::Ros2Output;
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
    detector: DetectorKind,
    timeout: f64,
    recording: Option<RecordFolder>,
    viewers: Option<Box<dyn Output>>,
    page: Option<Page>,
    ros2: Option<Ros2Output>,
    /// Receiver of the commands of page and ROS 2; `None` where no option asks for one of them.
    operator: Option<OperatorReceiver>,
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
        let page = options.page.start(rig, camera, &sender)?;
        let ros2 = options.ros2.start(camera, &sender)?;
        let operator = (page.is_some() || ros2.is_some()).then_some(receiver);
        let (detector, timeout) = (options.detector, options.timeout);
        Ok(Self { task, detector, timeout, recording, viewers, page, ros2, operator, moving })
    }

    /// Returns the path for the recording of a device.
    pub(crate) fn oni(&self) -> Option<PathBuf> {
        self.recording.as_ref().map(RecordFolder::oni)
    }

    /// Connects to the board at `transport`, configures it, and gives the goal to the run.
    pub(crate) fn connect<T: Transport>(&mut self, transport: T) -> Result<Run<T>, RunError> {
        let run = Run::connect(&self.task.rig, transport)?;
        self.ready(run)
    }

    /// Configures the board of `link`, and gives the goal to the run.
    pub(crate) fn connect_on<T: Transport>(&mut self, link: Link<T>) -> Result<Run<T>, RunError> {
        let run = Run::on(&self.task.rig, link)?;
        self.ready(run)
    }

    /// Tells what is to be known of a connected run, and gives the goal to it.
    fn ready<T: Transport>(&mut self, mut run: Run<T>) -> Result<Run<T>, RunError> {
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
        if run.has_prior() && self.task.rig.picture.is_none() {
            tell!("law taut begins with `[size]`, or with the rig of an earlier run");
        }
        self.task.goal.set(&mut run)?;
        Ok(run)
    }

    /// Drives with the pictures of `camera`, for the outputs, the operators and `observer`. The
    /// camera is closed at the end.
    pub(crate) fn drive<T: Transport>(
        mut self,
        mut run: Run<T>,
        camera: RunCamera,
        observer: Option<&mut dyn Observer>,
        interrupted: &AtomicBool,
    ) -> Result<EndedSession, Failure> {
        let RunCamera { mut source, camera, oni, mut follower, is_paced } = camera;
        let recorder = self.recorder(&camera)?;
        let mut detector = choices::detector(self.detector, &camera);
        if let Goal::PresentPlace = self.task.goal {
            hold(&mut run, &mut *source, &mut *detector, interrupted)?;
        }
        let log = RunLog::create(&self.task.output_dir, FigureSettings::of(&self.task.rig))?;
        let folder = log.path().to_owned();
        let log: Box<dyn Output> = Box::new(RunFolder::start(log, self.task.overflow)?);
        let list = [Some(log), recorder, self.viewers].into_iter().flatten().collect();
        let progress = run_progress::start(run.target_count())?;
        let mut outputs = Outputs::new(list, progress, self.operator.is_some());
        if let (Some(ros2), Some(clock)) = (&self.ros2, source.clock()) {
            ros2.set_clock(clock);
        }
        let mut observers: Vec<&mut dyn Observer> = vec![&mut outputs];
        observers.extend(observer.map(|observer| observer as &mut dyn Observer));
        observers.extend(follower.as_mut().map(|follower| follower as &mut dyn Observer));
        observers.extend(self.page.as_mut().map(|page| page as &mut dyn Observer));
        observers.extend(self.ros2.as_mut().map(|ros2| ros2 as &mut dyn Observer));
        let (begin, taken) = (Instant::now(), source.now());
        let result = run.drive(RunParts {
            source: &mut *source,
            detector: &mut *detector,
            observers: &mut observers,
            operator: self.operator,
            timeout: self.timeout,
            interrupted,
        });
        let pace = is_paced.then(|| (source.now() - taken) / begin.elapsed().as_secs_f64());
        drop((self.ros2, self.moving));
        // A device ends its own recording.
        drop(source);
        if let Some(oni) = &oni
            && let Err(error) = RecordFolder::check_oni(oni)
        {
            tell!("plumb: {}: {error}; use the pictures beside it", oni.display());
        }
        let (is_endless, clear) = (self.task.goal.is_endless(), self.task.clear);
        Ok(EndedSession { result, is_endless, pace, outputs, folder, clear, page: self.page })
    }

    /// Begins the recording of the pictures of `camera`, where there is to be one.
    fn recorder(&mut self, camera: &Camera) -> Result<Option<Box<dyn Output>>, RecordError> {
        let Some(folder) = self.recording.take() else { return Ok(None) };
        let Task { camera_text, overflow, .. } = &self.task;
        let recorder = folder.begin(camera_text, &camera.intrinsics, *overflow)?;
        Ok(Some(Box::new(FrameRecorder::new(recorder))))
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
