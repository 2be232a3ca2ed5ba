//! The paper's task in real time, with pictures from a camera's library: the emulated board is on
//! a pseudo-terminal, and the camera shows the ball of its rig.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard, Served, serve};
use plumb_frame::source::CameraSource;
use plumb_runtime::link::Serial;
use plumb_runtime::rig::{LawName, Rig};
use plumb_runtime::run::{Run, RunParts, Summary};
use plumb_vision::camera::{Camera, Intrinsics};
use plumb_vision::detect::DetectorKind;

/// Period at which the camera's scene follows the rig.
const LOOK: Duration = Duration::from_millis(2);

/// The paper's rig, served in real time, and its camera.
pub struct LiveRig {
    rig: Rig,
    /// Camera of the paper.
    pub camera: Camera,
    task: Task,
    served: Arc<Served>,
}

impl LiveRig {
    /// Serves the rig.
    ///
    /// # Errors
    /// Where there is no pseudo-terminal.
    pub fn serve() -> Result<Self, Box<dyn Error>> {
        let task = Task::paper();
        let plant = QuasiStatic::new(task.geometry, task.start)?;
        let served = Arc::new(serve(EmulatedBoard::with_plant(EMULATED, Box::new(plant)))?);
        Ok(Self { rig: rig()?, camera: camera_file::paper()?, task, served })
    }

    /// Returns the ball's centre at the start of the task, camera axes, metres.
    pub fn start(&self) -> Point3<f64> {
        self.camera.pose.inverse_transform_point(&self.task.start)
    }

    /// Runs the task with pictures of `source`, which have `intrinsics`. Meanwhile `show` gets the
    /// ball's centre in camera axes, metres. Returns the summary and the ball's distance from the
    /// target, metres.
    ///
    /// # Errors
    /// Where the board cannot be reached or the run breaks.
    pub fn run(
        &self,
        source: &mut dyn CameraSource,
        intrinsics: Intrinsics,
        mut show: impl FnMut(Point3<f64>) + Send,
    ) -> Result<(Summary, f64), Box<dyn Error>> {
        let over = AtomicBool::new(false);
        let summary = thread::scope(|scope| {
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed)
                    && let Some(ball) = self.served.board().ball()
                {
                    show(self.camera.pose.inverse_transform_point(&ball));
                    thread::sleep(LOOK);
                }
            });
            let summary = self.drive(source, intrinsics);
            over.store(true, Ordering::Relaxed);
            summary
        })?;
        let ball = self.served.board().ball().ok_or("the rig has no ball")?;
        Ok((summary, (ball - self.task.target).norm()))
    }

    fn drive(
        &self,
        source: &mut dyn CameraSource,
        intrinsics: Intrinsics,
    ) -> Result<Summary, Box<dyn Error>> {
        let camera = Camera { intrinsics, ..self.camera.clone() };
        let transport = Serial::open(&self.served.path().to_string_lossy(), self.rig.board.baud)?;
        let (mut detector, interrupted) =
            (DetectorKind::Ball.build(&camera), AtomicBool::new(false));
        let run = Run::connect(&self.rig, transport)?;
        Ok(run.drive(RunParts {
            source,
            detector: &mut *detector,
            observers: &mut [],
            operator: None,
            timeout: 60.0,
            interrupted: &interrupted,
        })?)
    }
}

/// Returns the paper's rig file with a higher gain, and with deadlines for a busy machine.
fn rig() -> Result<Rig, Box<dyn Error>> {
    let mut rig = Rig { law: LawName::Interval.into(), ..Rig::paper()? };
    rig.law.set_gamma(150.0)?;
    rig.deadlines.host = 5.0.try_into()?;
    rig.deadlines.position = 5.0.try_into()?;
    rig.deadlines.max_age = 4.9.try_into()?;
    Ok(rig)
}
