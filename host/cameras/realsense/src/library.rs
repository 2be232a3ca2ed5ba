//! Loading of the library, and the list of its cameras.

use std::ffi::CString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use libloading::Library;

use crate::api::{Api, text};
use crate::error::RealsenseError;
use crate::handle::Owned;
use crate::sys::{self, Handle, LIBRARY_VARIABLE};

/// File names of the library, the most usual first: the plain name, then those of the versions
/// that the packages install, whose names contain the minor version.
fn names() -> impl Iterator<Item = PathBuf> {
    let versions = (50..100).rev().map(|minor| format!("librealsense2.so.2.{minor}"));
    std::iter::once("librealsense2.so".to_owned()).chain(versions).map(PathBuf::from)
}

/// Loaded library with its context. Clones share it. It stays loaded until the program ends,
/// because it has threads of its own.
#[derive(Clone)]
pub struct RealSense {
    pub(crate) inner: Arc<Inner>,
}

pub(crate) struct Inner {
    pub(crate) api: Api,
    /// Context, which lives until the program ends.
    context: Handle,
    /// Hub of the context's devices, which knows the ones that are plugged in.
    hub: Handle,
    version: i32,
}

// SAFETY: librealsense2 locks its context and its hub; calls may come from any thread.
unsafe impl Send for Inner {}
// SAFETY: as above.
unsafe impl Sync for Inner {}

/// Camera that is plugged in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Serial number, by which the camera is opened.
    pub serial: String,
    /// Model, "Intel RealSense D435".
    pub name: String,
}

/// Loaded libraries by the path or name that was asked for. A second context would compete for the
/// cameras.
static LOADED: Mutex<Vec<(PathBuf, RealSense)>> = Mutex::new(Vec::new());

impl RealSense {
    /// Loads the library from the path in [`LIBRARY_VARIABLE`], else by its usual names.
    ///
    /// # Errors
    /// [`RealsenseError::NoLibrary`], [`RealsenseError::NotRealsense`],
    /// [`RealsenseError::Version`], [`RealsenseError::Library`].
    pub fn load() -> Result<Self, RealsenseError> {
        if let Some(path) = std::env::var_os(LIBRARY_VARIABLE) {
            return Self::load_from(Path::new(&path));
        }
        let mut results = names().map(|name| Self::load_from(&name));
        let absent =
            |result: &Result<_, _>| matches!(result, Err(RealsenseError::NoLibrary { .. }));
        let first = results.next().unwrap_or(Err(RealsenseError::NoDevice));
        if !absent(&first) {
            return first;
        }
        results.find(|result| !absent(result)).unwrap_or(first)
    }

    /// Loads the library at `path`; a file name alone is searched among the system's libraries.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_from(path: &Path) -> Result<Self, RealsenseError> {
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, library)) = loaded.iter().find(|(from, _)| from == path) {
            return Ok(library.clone());
        }
        let library = Self::initialise(Api::find(open(path)?, path)?)?;
        loaded.push((path.to_owned(), library.clone()));
        Ok(library)
    }

    /// Checks the version, and creates the context and its hub.
    fn initialise(api: Api) -> Result<Self, RealsenseError> {
        let failed = |error| RealsenseError::Library { error };
        // SAFETY: the function only returns a constant of the library.
        let version = api.check(|error| unsafe { (api.api_version)(error) }).map_err(failed)?;
        check_version(&api.path, version)?;
        // SAFETY: the version is the library's own.
        let context = api.check(|error| unsafe { (api.create_context)(version, error) });
        let context = context.map_err(failed)?;
        // SAFETY: the context lives until the program ends.
        let hub = api.check(|error| unsafe { (api.create_hub)(context, error) }).map_err(failed)?;
        Ok(Self { inner: Arc::new(Inner { api, context, hub, version }) })
    }

    /// Returns the path or name from which the library was loaded.
    pub fn path(&self) -> &Path {
        &self.inner.api.path
    }

    /// Returns the library's version, "2.59.1".
    pub fn version(&self) -> String {
        version_text(self.inner.version)
    }

    /// Returns the library's context, for a software device that another crate adds to it.
    pub fn context(&self) -> Handle {
        self.inner.context
    }

    /// Lists the cameras that are plugged in.
    ///
    /// # Errors
    /// Where the library fails.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>, RealsenseError> {
        let devices = self.inner.devices().map_err(|error| RealsenseError::Library { error })?;
        Ok(devices.iter().map(|device| self.inner.describe(device)).collect())
    }
}

impl fmt::Debug for RealSense {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RealSense").field("path", &self.path()).finish_non_exhaustive()
    }
}

impl Inner {
    /// Returns handles of the cameras that can be opened.
    pub(crate) fn devices(&self) -> Result<Vec<Owned>, String> {
        let api = &self.api;
        // SAFETY: the context lives as long as the library.
        let list = api.check(|error| unsafe { (api.query_devices)(self.context, error) })?;
        let list = Owned::new(list, api.delete_device_list)?;
        // SAFETY: the list lives.
        let count = api.check(|error| unsafe { (api.device_count)(list.raw(), error) })?;
        // A device that vanished since the query cannot be created, or states nothing; calls into
        // it may crash.
        Ok((0..count)
            .filter_map(|index| {
                // SAFETY: the list lives, and has more than `index` devices.
                let create = |error| unsafe { (api.create_device)(list.raw(), index, error) };
                let device = Owned::new(api.check(create).ok()?, api.delete_device).ok()?;
                (!self.describe(&device).serial.is_empty()).then_some(device)
            })
            .collect())
    }

    /// Returns the serial number and the name of a device, each empty where it is not stated.
    pub(crate) fn describe(&self, device: &Owned) -> DeviceInfo {
        DeviceInfo {
            serial: self.info(device, sys::INFO_SERIAL_NUMBER),
            name: self.info(device, sys::INFO_NAME),
        }
    }

    fn info(&self, device: &Owned, kind: i32) -> String {
        let (api, raw) = (&self.api, device.raw());
        // SAFETY: the device lives.
        let supports = api.check(|error| unsafe { (api.supports_info)(raw, kind, error) });
        if supports.unwrap_or(0) == 0 {
            return String::new();
        }
        // SAFETY: the device lives.
        match api.check(|error| unsafe { (api.device_info)(raw, kind, error) }) {
            // SAFETY: the string belongs to the device, which lives.
            Ok(pointer) => unsafe { text(pointer) },
            Err(_) => String::new(),
        }
    }

    /// Returns whether the device is plugged in.
    pub(crate) fn is_connected(&self, device: &Owned) -> bool {
        let (api, hub) = (&self.api, self.hub);
        // SAFETY: the hub lives as long as the library, and the device lives.
        let call = |error| unsafe { (api.is_connected)(hub, device.raw(), error) };
        api.check(call).is_ok_and(|answer| answer != 0)
    }

    /// Opens the recording at `path`, for [`Self::remove_recording`] after use.
    pub(crate) fn add_recording(&self, path: &CString) -> Result<Owned, String> {
        let api = &self.api;
        // SAFETY: the context lives as long as the library; the path has a final zero.
        let add = |error| unsafe { (api.add_recording)(self.context, path.as_ptr(), error) };
        Owned::new(api.check(add)?, api.delete_device)
    }

    /// Removes the recording at `path` from the context, so that it can be opened again.
    pub(crate) fn remove_recording(&self, path: &CString) {
        let api = &self.api;
        // SAFETY: as in `add_recording`. There is no one to report an error to.
        let remove = |error| unsafe { (api.remove_recording)(self.context, path.as_ptr(), error) };
        let _ = api.check(remove);
    }
}

/// Opens the library's file. The wheel's extension module needs Python's own library first.
fn open(path: &Path) -> Result<Library, RealsenseError> {
    let absent = |error: String| RealsenseError::NoLibrary { path: path.to_owned(), error };
    if let Some(python) = python_library(path) {
        use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};
        // SAFETY: loading runs Python's initialisers, which start nothing.
        let library = unsafe { Library::open(Some(&python), RTLD_NOW | RTLD_GLOBAL) };
        // It stays loaded, as the module that needs it.
        std::mem::forget(library.map_err(|error| {
            let package = python.split(".so").next().unwrap_or_default();
            absent(format!("it needs {python}, Debian's package {package}: {error}"))
        })?);
    }
    // SAFETY: loading runs the library's initialisers, as linking would. The user guarantees that
    // the file is librealsense2, as with every plug-in.
    unsafe { Library::new(path) }.map_err(|error| absent(error.to_string()))
}

/// Returns the name of Python's library for the wheel's extension module, "libpython3.11.so.1.0"
/// for "pyrealsense2.cpython-311-x86_64-linux-gnu.so"; `None` for another file.
fn python_library(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let minor = name.strip_prefix("pyrealsense2.cpython-3")?.split('-').next()?;
    minor.parse::<u8>().ok().map(|minor| format!("libpython3.{minor}.so.1.0"))
}

/// Returns the version that `number` stands for: 25901 is "2.59.1".
fn version_text(number: i32) -> String {
    format!("{}.{}.{}", number / 10_000, number / 100 % 100, number % 100)
}

/// Checks that the library's version is 2.50 or a later version of 2.
fn check_version(path: &Path, number: i32) -> Result<(), RealsenseError> {
    if (25_000..30_000).contains(&number) {
        return Ok(());
    }
    Err(RealsenseError::Version { path: path.to_owned(), version: version_text(number) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_versions_are_refused() {
        let path = Path::new("librealsense2.so");
        assert_eq!(check_version(path, 25_901), Ok(()));
        assert_eq!(check_version(path, 25_501), Ok(()));
        for (number, version) in [(24_900, "2.49.0"), (30_001, "3.0.1")] {
            let text = check_version(path, number).unwrap_err().to_string();
            assert!(text.contains(version) && text.contains("2.50"), "{text}");
        }
    }

    #[test]
    fn the_wheels_module_needs_its_python() {
        let python = |name| python_library(Path::new(name));
        let module = "a/pyrealsense2.cpython-311-x86_64-linux-gnu.so";
        assert_eq!(python(module).as_deref(), Some("libpython3.11.so.1.0"));
        assert_eq!(python("librealsense2.so.2.55"), None);
        assert_eq!(python("pyrealsense2.cpython-3"), None);
    }
}
