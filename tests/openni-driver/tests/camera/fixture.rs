//! A camera of the test driver behind the real library.

use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::Duration;

use plumb_openni::{Camera, OpenNi, OpenniError, Pair, Settings, Target, Timeouts};
use plumb_openni_driver::{Control, ControlFile};
use tempfile::TempDir;

/// Returns the library with this crate's driver; `None` if it is not installed (an error with CI
/// set).
pub(crate) fn openni() -> Option<&'static OpenNi> {
    static OPENNI: OnceLock<Option<(TempDir, OpenNi)>> = OnceLock::new();
    let staged = OPENNI.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        match plumb_openni_driver::stage(folder.path(), true) {
            Ok(library) => Some((folder, OpenNi::load_from(&library).unwrap())),
            Err(error) => {
                assert!(std::env::var_os("CI").is_none(), "{error}");
                println!("skipped: {error}");
                None
            }
        }
    });
    staged.as_ref().map(|(_, openni)| openni)
}

/// A camera and its control file.
pub(crate) struct TestCamera {
    folder: TempDir,
    pub(crate) file: ControlFile,
}

impl TestCamera {
    pub(crate) fn new(control: &Control) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = ControlFile::create(&folder.path().join("control"), control).unwrap();
        Self { folder, file }
    }

    pub(crate) fn open(&self, settings: Settings) -> Result<Camera, OpenniError> {
        Camera::open(openni().unwrap(), &Target::Uri(self.file.uri()), settings)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

pub(crate) fn quick() -> Timeouts {
    Timeouts { picture: Duration::from_millis(500), ..Timeouts::default() }
}

/// Returns the pixel of the red ball, and its smallest depth, mm.
pub(crate) fn seen(pair: &Pair, width: usize) -> (f64, f64, u16) {
    let red = |p: &[u8]| i32::from(p[0]) - i32::from(p[1].max(p[2])) > 40;
    let hits: Vec<usize> =
        (0..pair.depth.len()).filter(|&i| red(&pair.colour[3 * i..3 * i + 3])).collect();
    let mean = |f: &dyn Fn(usize) -> usize| {
        hits.iter().map(|&i| f(i) as f64).sum::<f64>() / hits.len() as f64
    };
    let (u, v) = (mean(&|i| i % width), mean(&|i| i / width));
    (u, v, pair.depth[v.round() as usize * width + u.round() as usize])
}

/// Returns the next pair; ignores lost ones.
pub(crate) fn next(camera: &mut Camera) -> Pair {
    loop {
        match camera.next_pair() {
            Ok(Some(pair)) => return pair,
            Ok(None) => panic!("a camera does not end"),
            Err(error) => assert!(error.is_transient(), "{error}"),
        }
    }
}
