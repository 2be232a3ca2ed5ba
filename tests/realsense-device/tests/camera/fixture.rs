//! A software camera in the context of the real library.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use plumb_realsense::{Camera, Pair, RealSense, RealsenseError, Settings, Target};
use plumb_realsense_device::{
    Control, FOCAL_LENGTH, Fault, Model, SoftwareCamera, Stamp, UNIT, library,
};

/// One test at a time has a camera: the library does not survive a software device that vanishes
/// while another thread lists it.
static TURN: Mutex<()> = Mutex::new(());

/// Software camera of one test, and the library.
pub(crate) struct Fixture {
    pub(crate) library: RealSense,
    pub(crate) device: Arc<SoftwareCamera>,
    serial: String,
    _turn: MutexGuard<'static, ()>,
}

impl Fixture {
    /// Plugs in a camera without distortion whose depths are in millimetres. Returns `None` where
    /// the library is not installed.
    pub(crate) fn new(serial: &str) -> Option<Self> {
        Self::with_model(serial, Model::default())
    }

    /// Plugs in a camera of another model.
    pub(crate) fn with_model(serial: &str, model: Model) -> Option<Self> {
        Some(Self::with_library(library().unwrap()?, serial, model))
    }

    /// Plugs a camera into the context of a library with a fault.
    pub(crate) fn with_fault(fault: Fault) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let library = fault.library(folder.path()).unwrap()?;
        Some(Self::with_library(library, "faulty", Model::default()))
    }

    fn with_library(library: RealSense, serial: &str, model: Model) -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let device = SoftwareCamera::plug_in(&library, serial, model).unwrap();
        Self { library, device: Arc::new(device), serial: serial.to_owned(), _turn: turn }
    }

    pub(crate) fn open(&self, settings: Settings) -> Result<Camera, RealsenseError> {
        Camera::open(&self.library, &Target::Serial(self.serial.clone()), settings)
    }

    /// Sends both pictures of the default scene, each with its time stamp, seconds.
    pub(crate) fn send(&self, colour: f64, depth: f64) {
        let scene = scene();
        self.device.send_colour(&scene, Stamp::at(colour)).unwrap();
        self.device.send_depth(&scene, Stamp::at(depth), UNIT).unwrap();
    }
}

/// Returns a scene with a ball that is to the right of the axis and above it.
pub(crate) fn scene() -> Control {
    Control { ball: Some([0.25, -0.1, 1.2]), ..Control::default() }
}

/// Returns settings with a short timeout.
pub(crate) fn quick() -> Settings {
    Settings { latency: 0.0, timeout: Duration::from_millis(500), ..Settings::default() }
}

/// Checks that colour and depth of a pair show the ball of [`scene`] at its projection.
pub(crate) fn assert_shows_the_ball(pair: &Pair) {
    let middle = |is: &dyn Fn(usize) -> bool| {
        let hits: Vec<usize> = (0..640 * 480).filter(|&i| is(i)).collect();
        let mean = |f: &dyn Fn(usize) -> usize| {
            hits.iter().map(|&i| f(i) as f64).sum::<f64>() / hits.len() as f64
        };
        (mean(&|i| i % 640), mean(&|i| i / 640))
    };
    let k = FOCAL_LENGTH / 1.2;
    let expected = (319.5 + 0.25 * k, 239.5 - 0.1 * k);
    let red = |i: usize| pair.colour[3 * i] > pair.colour[3 * i + 1] + 40;
    // Depth without alignment is 22 pixels off.
    let near = |i: usize| (1000..1500).contains(&pair.depth[i]);
    for (u, v) in [middle(&red), middle(&near)] {
        assert!((u - expected.0).abs() < 1.5 && (v - expected.1).abs() < 1.5, "({u}, {v})");
    }
    let at = 640 * expected.1.round() as usize + expected.0.round() as usize;
    assert!((1157..1168).contains(&pair.depth[at]), "{}", pair.depth[at]);
}
