//! An emulated board in this process and its simulated rig, in virtual time.

use std::cell::RefCell;
use std::rc::Rc;

use nalgebra::Point3;
use plumb_emulator::plant::{Plant, QuasiStatic, RigError, Task};
use plumb_emulator::{EMULATED, EmulatedBoard, Wire};
use plumb_frame::camera::Camera;
use plumb_frame::detect::BallDetector;
use plumb_protocol::MotorList;
use plumb_runtime::observer::Observer;
use plumb_runtime::operator::OperatorReceiver;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts, Summary};
use thiserror::Error;

use super::{SimulatedCamera, Timing, VirtualRig};
use crate::memory::Memory;
use crate::synthetic::{Background, RenderOptions, Room, SyntheticCamera, SyntheticError};

/// Reason that [`VirtualBoard::drive`] returns no summary.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DriveError {
    /// The rig file has no simulated rig, whose motors the camera shows.
    #[error("the rig file has no table [simulation]")]
    NotSimulated,
    /// The camera cannot be rendered.
    #[error(transparent)]
    Camera(#[from] SyntheticError),
    /// The run did not begin, or broke.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// An emulated board in this process that moves a simulated rig, in virtual time. It makes the
/// transport and the camera of a run; they share the board.
///
/// ```
/// use plumb_cameras::camera_file;
/// use plumb_runtime::rig::Rig;
/// use plumb_runtime::run::{Run, RunParts};
/// use plumb_sim::emulator::plant::Task;
/// use plumb_sim::simulated::VirtualBoard;
/// use plumb_vision::detect::DetectorKind;
///
/// let (board, camera) = (VirtualBoard::paper()?, camera_file::paper()?);
/// let mut source = board.camera(&camera, *Task::paper().geometry.motors(), 1)?;
/// let mut detector = DetectorKind::Ball.build(&camera);
/// let run = Run::connect(&Rig::paper()?, board.transport())?;
/// let summary = run.drive(RunParts::new(&mut source, &mut *detector))?;
/// assert!(summary.reached);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct VirtualBoard(Rc<RefCell<EmulatedBoard>>);

impl VirtualBoard {
    /// Creates a board whose motors move `plant`, behind an ideal link.
    pub fn new(plant: Box<dyn Plant + Send>) -> Self {
        Self(Rc::new(RefCell::new(EmulatedBoard::with_plant(EMULATED, plant))))
    }

    /// Creates a board that moves the paper's rig on rigid cables, behind an ideal link.
    ///
    /// # Errors
    /// [`RigError`] if the rig cannot be built; the paper's can.
    pub fn paper() -> Result<Self, RigError> {
        let Task { geometry, start, .. } = Task::paper();
        Ok(Self::new(Box::new(QuasiStatic::new(geometry, start)?)))
    }

    /// Puts `wire` between the host and the board.
    #[must_use]
    pub fn with_wire(self, wire: Wire) -> Self {
        self.0.borrow_mut().set_wire(wire);
        self
    }

    /// Returns the board.
    pub fn board(&self) -> &Rc<RefCell<EmulatedBoard>> {
        &self.0
    }

    /// Returns a transport to the board.
    pub fn transport(&self) -> Memory {
        Memory::new(Rc::clone(&self.0))
    }

    /// Returns the rig, on the board's clock.
    pub fn rig(&self) -> VirtualRig {
        VirtualRig { board: Rc::clone(&self.0), is_paced: false, pace: None }
    }

    /// Returns the rig, on the board's clock, which runs no faster than real time.
    pub fn paced_rig(&self) -> VirtualRig {
        VirtualRig { is_paced: true, ..self.rig() }
    }

    /// Returns a camera in a furnished room that looks at the rig with motors at `motors` (metres,
    /// rig frame). `seed` seeds the noise.
    ///
    /// # Errors
    /// [`SyntheticError`] if `camera` cannot be rendered.
    pub fn camera(
        &self,
        camera: &Camera,
        motors: impl Into<MotorList<Point3<f64>>>,
        seed: u64,
    ) -> Result<SimulatedCamera<VirtualRig>, SyntheticError> {
        let room = Background::Room(Room::furnished_for(camera.ball_hue));
        let options = RenderOptions::default();
        let synthetic = SyntheticCamera::new(camera.clone(), room, options, seed)?;
        Ok(SimulatedCamera::new(self.rig(), synthetic, motors, Timing::default()))
    }

    /// Drives the ball to the targets of `rig` with pictures of `camera` and `detector`. The seed
    /// of the camera's noise is 1.
    ///
    /// # Errors
    /// [`DriveError`].
    pub fn drive(
        &self,
        rig: &Rig,
        camera: &Camera,
        detector: &mut dyn BallDetector,
        observers: Vec<&mut dyn Observer>,
        operator: Option<OperatorReceiver>,
    ) -> Result<Summary, DriveError> {
        let simulation = rig.simulation.as_ref().ok_or(DriveError::NotSimulated)?;
        let mut source = self.camera(camera, simulation.motors(), 1)?;
        // Their common lifetime is that of the parts.
        let mut observers: Vec<&mut dyn Observer> =
            observers.into_iter().map(|observer| observer as &mut dyn Observer).collect();
        let parts = RunParts {
            observers: &mut observers,
            operator,
            ..RunParts::new(&mut source, detector)
        };
        Ok(Run::connect(rig, self.transport())?.drive(parts)?)
    }
}
