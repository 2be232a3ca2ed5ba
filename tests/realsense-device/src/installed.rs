//! The library that `scripts/realsense` installs.

use std::path::{Path, PathBuf};

use plumb_realsense::RealSense;

/// Returns the path of the library: the extension module of the wheel in `target/realsense`.
pub fn installed() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/realsense/lib");
    let entries = |folder: PathBuf| std::fs::read_dir(folder).into_iter().flatten().flatten();
    let module = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("pyrealsense2.cpython-") && name.ends_with(".so")
    };
    entries(root)
        .flat_map(|python| entries(python.path().join("site-packages/pyrealsense2")))
        .map(|entry| entry.path())
        .find(module)
}

/// Loads the library. Returns `None` where it is not installed, which is said.
///
/// # Errors
/// Where it is not installed although the environment variable `CI` is set, or cannot be loaded.
pub fn library() -> Result<Option<RealSense>, String> {
    let Some(path) = installed() else {
        let text = "librealsense2 is not installed: run scripts/realsense";
        if std::env::var_os("CI").is_some() {
            return Err(text.to_owned());
        }
        println!("skipped: {text}");
        return Ok(None);
    };
    RealSense::load_from(&path).map(Some).map_err(|error| error.to_string())
}
