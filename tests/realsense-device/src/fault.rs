//! Faults of a camera that the library's software device cannot have.

use std::path::{Path, PathBuf};
use std::process::Command;

use plumb_realsense::RealSense;

use crate::installed::{installed, library};

/// Fault of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The library says that the camera is unplugged.
    Unplugged,
    /// The call that opens a sensor does not return.
    Hangs,
    /// The library is of version 3.
    Version,
    /// The second sensor does not start. The process is aborted where the queue of the first one is
    /// deleted while the sensor runs.
    SecondSensor,
}

impl Fault {
    /// Loads librealsense2 with this fault, see [`Self::compile`]. Returns `None` where
    /// librealsense2 is not installed, which is said.
    ///
    /// # Errors
    /// As [`Self::compile`]; where the library cannot be loaded.
    pub fn library(self, folder: &Path) -> Result<Option<RealSense>, String> {
        let Some(path) = self.compile(folder)? else { return Ok(None) };
        RealSense::load_from(&path).map(Some).map_err(|error| error.to_string())
    }

    /// Compiles a library in `folder` that stands in front of the installed one and replaces some
    /// of its functions. Returns its path; `None` where librealsense2 is not installed, which is
    /// said.
    ///
    /// # Errors
    /// As [`library`]; where `rustc` does not compile the library.
    pub fn compile(self, folder: &Path) -> Result<Option<PathBuf>, String> {
        // Python's library, which the installed one needs, stays loaded.
        let (Some(_), Some(installed)) = (library()?, installed()) else { return Ok(None) };
        let name = match self {
            Self::Unplugged => "unplugged",
            Self::Hangs => "hangs",
            Self::Version => "version",
            Self::SecondSensor => "second-sensor",
        };
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("faults/library.rs");
        let path = folder.join(format!("lib{name}.so"));
        let mut compiler = Command::new("rustc");
        compiler.args(["--edition=2024", "--crate-type=cdylib", "--cap-lints=allow"]);
        compiler.args(["--cfg", &format!("fault=\"{name}\"")]);
        // The linker keeps a library of which nothing is used only where it is told to.
        compiler.args(["-C", "link-arg=-Wl,--no-as-needed", "-C"]);
        compiler.arg(format!("link-arg={}", installed.display()));
        // The installed library's own libraries are found when it is loaded.
        compiler.args(["-C", "link-arg=-Wl,--allow-shlib-undefined"]);
        compiler.arg(source).arg("-o").arg(&path);
        let output = compiler.output().map_err(|error| format!("rustc: {error}"))?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
        Ok(Some(path))
    }
}
