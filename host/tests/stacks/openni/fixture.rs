//! A camera of the test driver, a board and the program.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use plumb_openni_driver::{CONTROL_VARIABLE, Control, ControlFile};
use tempfile::TempDir;

/// Folder with the library, a camera and a rig file.
pub(crate) struct Fixture {
    folder: TempDir,
    library: PathBuf,
    pub(crate) camera: ControlFile,
}

/// Target of the rig file in the axes of the camera of `rigs/camera.toml`, metres: PT, 1.337 m in
/// front of it.
pub(crate) const AT_TARGET: [f64; 3] = [0.400 - 0.286, -(0.150 - 0.225), 1.737 - 0.400];

impl Fixture {
    /// Prepares the folder, with the test driver where `driver` is set. Returns `None` where the
    /// library is not installed; with CI set, that fails the test.
    pub(crate) fn new(driver: bool) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let library = match plumb_openni_driver::stage(&folder.path().join("openni"), driver) {
            Ok(library) => library,
            Err(error) => {
                assert!(std::env::var_os("CI").is_none(), "{error}");
                println!("skipped: {error}");
                return None;
            }
        };
        let camera = ControlFile::create(&folder.path().join("control"), &Self::control()).unwrap();
        Some(Self { folder, library, camera })
    }

    /// Returns a control file's contents with the ball at the target.
    pub(crate) fn control() -> Control {
        Control { ball: Some(AT_TARGET), ..Control::default() }
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Returns a command of the program that uses the folder's library and camera.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command
            .args(arguments)
            .current_dir(self.path())
            .env(plumb_openni::LIBRARY_VARIABLE, &self.library)
            .env(CONTROL_VARIABLE, self.camera.path());
        command
    }

    /// Runs the program to its end.
    pub(crate) fn plumb(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs and records. Returns the path of the `.oni` file and its bytes.
    pub(crate) fn record(&self) -> (PathBuf, Vec<u8>) {
        let run = self.plumb(&["run", "--record", "recording", "--out", "run"]);
        assert!(run.status.success(), "{}", stderr(&run));
        let path = self.path().join("recording/recording.oni");
        let whole = fs::read(&path).unwrap();
        (path, whole)
    }

    /// Writes the paper's rig file for a board on `port`, without its simulated rig and with the
    /// lines `camera` in its table `[camera]`.
    pub(crate) fn rig(&self, port: &str, camera: &str) {
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
        let text = fs::read_to_string(rigs.join("paper.toml")).unwrap();
        let text = text[..text.find("\n[simulation]").unwrap()].replace("/dev/ttyACM0", port);
        let text =
            text.replace("file = \"camera.toml\"", &format!("file = \"camera.toml\"\n{camera}"));
        // Longer deadlines, so that a busy machine does not stop the run.
        let text =
            text.replace("host = 0.3", "host = 5.0").replace("position = 0.5", "position = 5.0");
        let text = text.replace("max_age = 0.25", "max_age = 4.9");
        fs::write(self.path().join("rig.toml"), text).unwrap();
        fs::copy(rigs.join("camera.toml"), self.path().join("camera.toml")).unwrap();
    }
}

/// `plumb emulate` in the background, one at a time, because boards have deadlines. Dropping it
/// ends the process.
pub(crate) struct Emulator {
    child: Child,
    pub(crate) port: String,
    _turn: MutexGuard<'static, ()>,
}

static TURN: Mutex<()> = Mutex::new(());

impl Emulator {
    pub(crate) fn start() -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .arg("emulate")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut port = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut port).unwrap();
        Self { child, port: port.trim().to_owned(), _turn: turn }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits until the run log has `count` rows or the run has ended.
pub(crate) fn until_rows(run: &mut Child, folder: &Path, count: usize) {
    let rows =
        || fs::read_to_string(folder.join("run/run.csv")).unwrap_or_default().lines().count();
    while rows() < count && run.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(20));
    }
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Returns the fields of a CSV's rows, without its header.
pub(crate) fn rows(text: &str) -> Vec<Vec<String>> {
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}
