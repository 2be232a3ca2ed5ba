//! A folder with the real library and this driver.
//!
//! The library loads drivers only from a folder next to itself, so that it must be copied.

use std::io;
use std::path::{Path, PathBuf};

/// File name of the library.
const LIBRARY: &str = "libOpenNI2.so.0";

/// Returns the path of the installed library, if there is one.
pub fn installed() -> Option<PathBuf> {
    let multiarch =
        std::fs::read_dir("/usr/lib").into_iter().flatten().flatten().map(|entry| entry.path());
    let folders = ["/usr/lib", "/usr/lib64", "/usr/local/lib"].map(PathBuf::from);
    folders
        .into_iter()
        .chain(multiarch)
        .map(|folder| folder.join(LIBRARY))
        .find(|path| path.is_file())
}

/// Copies the installed library, its driver for recordings and, with `driver`, this one into
/// `folder`. Returns the path of the library to load. For tests only: cargo puts the driver next to
/// them.
///
/// # Errors
/// [`io::ErrorKind::NotFound`] if the library is not installed; errors of copying.
pub fn stage(folder: &Path, driver: bool) -> io::Result<PathBuf> {
    let missing = |what: String| io::Error::new(io::ErrorKind::NotFound, what);
    let library =
        installed().ok_or_else(|| missing(format!("{LIBRARY} is not installed (libopenni2-0)")))?;
    let drivers = folder.join("OpenNI2/Drivers");
    std::fs::create_dir_all(&drivers)?;
    std::fs::copy(&library, folder.join(LIBRARY))?;
    let files = library.with_file_name("OpenNI2/Drivers/libOniFile.so.0");
    std::fs::copy(files, drivers.join("libOniFile.so.0"))?;
    if driver {
        // Cargo puts it next to the test program.
        let own = std::env::current_exe()?.with_file_name("libplumb_openni_driver.so");
        std::fs::copy(&own, drivers.join("libPlumbTest.so.0"))
            .map_err(|error| missing(format!("{}: {error}", own.display())))?;
    }
    Ok(folder.join(LIBRARY))
}
