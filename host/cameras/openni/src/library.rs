//! Loading of the library, and the list of its cameras.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::api::Api;
use crate::error::OpenniError;
use crate::events::Events;
use crate::sys::{
    API_VERSION, LIBRARY_VARIABLE, NAMES, OniStatus, STATUS_OK, STATUS_TIME_OUT, owned, text,
};
use crate::threads;

/// Loaded library. Clones share it. It stays loaded until the program ends, because its drivers
/// have threads of their own and some crash when they are unloaded.
#[derive(Clone)]
pub struct OpenNi {
    pub(crate) inner: Arc<Inner>,
}

pub(crate) struct Inner {
    pub(crate) api: Api,
    pub(crate) events: &'static Events,
}

/// Camera that is plugged in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceInfo {
    /// URI, by which the camera is opened.
    pub uri: String,
    /// Maker.
    pub vendor: String,
    /// Model.
    pub name: String,
    /// USB identifiers of vendor and product.
    pub usb: (u16, u16),
}

/// Loaded libraries by the path or name that was asked for. Loading one twice would put two sets of
/// drivers on one camera.
static LOADED: Mutex<Vec<(PathBuf, OpenNi)>> = Mutex::new(Vec::new());

impl OpenNi {
    /// Loads the library and its drivers from the path in [`LIBRARY_VARIABLE`], else by its usual
    /// names. The working directory of the program changes during the call.
    ///
    /// # Errors
    /// [`OpenniError::NoLibrary`], [`OpenniError::NotOpenni`], [`OpenniError::Initialize`].
    pub fn load() -> Result<Self, OpenniError> {
        match std::env::var_os(LIBRARY_VARIABLE) {
            Some(path) => Self::load_from(Path::new(&path)),
            None => {
                let mut results = NAMES.iter().map(|name| Self::load_from(Path::new(name)));
                let first = results.next().unwrap_or(Err(OpenniError::NoDevice));
                // The error for the most usual name is the helpful one.
                first.or_else(|error| results.find_map(Result::ok).ok_or(error))
            }
        }
    }

    /// Loads the library at `path`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_from(path: &Path) -> Result<Self, OpenniError> {
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, openni)) = loaded.iter().find(|(from, _)| from == path) {
            return Ok(openni.clone());
        }
        let openni = on_thread(path, {
            let path = path.to_owned();
            move || Self::initialise(Api::load(&path)?)
        })?;
        loaded.push((path.to_owned(), openni.clone()));
        Ok(openni)
    }

    /// Initialises the library and registers its callbacks.
    fn initialise(api: Api) -> Result<Self, OpenniError> {
        let events: &'static Events = Box::leak(Box::default());
        let inner = Inner { api, events };
        // SAFETY: the function is the library's, and may be called at any time.
        let status = unsafe { (inner.api.initialize)(API_VERSION) };
        inner
            .check(status)
            .map_err(|error| OpenniError::Initialize { path: inner.api.path.clone(), error })?;
        let mut callbacks = Events::callbacks();
        let mut handle = std::ptr::null_mut();
        // SAFETY: the library copies the three pointers. The cookie is never freed, and the
        // callbacks may use it from any thread.
        let status = unsafe {
            (inner.api.register_callbacks)(
                &raw mut callbacks,
                std::ptr::from_ref(events).cast_mut().cast(),
                &raw mut handle,
            )
        };
        inner
            .check(status)
            .map_err(|error| OpenniError::Initialize { path: inner.api.path.clone(), error })?;
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Returns the path or name from which the library was loaded.
    pub fn path(&self) -> &Path {
        &self.inner.api.path
    }

    /// Returns the library's drivers: the files in the folder `OpenNI2/Drivers` beside it. Empty
    /// where the folder is unknown.
    pub fn drivers(&self) -> Vec<PathBuf> {
        let Some(folder) = self.folder() else { return Vec::new() };
        let entries = std::fs::read_dir(folder.join("OpenNI2/Drivers"));
        let mut files: Vec<PathBuf> =
            entries.into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        files.sort();
        files
    }

    /// Returns the library's folder: that of its path, else the one where the system found it.
    fn folder(&self) -> Option<PathBuf> {
        let path = &self.inner.api.path;
        if path.components().count() > 1 {
            return path.parent().map(Path::to_owned);
        }
        let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
        let line = maps.lines().find(|line| line.contains("/libOpenNI2."))?;
        Path::new(line.get(line.find('/')?..)?).parent().map(Path::to_owned)
    }

    /// Returns the library's version, "2.2.0.33".
    pub fn version(&self) -> String {
        // SAFETY: the function only reads constants of the library.
        let version = unsafe { (self.inner.api.version)() };
        format!("{}.{}.{}.{}", version.major, version.minor, version.maintenance, version.build)
    }

    /// Lists the cameras of the library's drivers.
    ///
    /// # Errors
    /// Where the library fails.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>, OpenniError> {
        let openni = self.clone();
        on_thread(self.path(), move || openni.list())
    }

    /// Lists the cameras, on a thread of the library.
    fn list(&self) -> Result<Vec<DeviceInfo>, OpenniError> {
        let (mut list, mut count) = (std::ptr::null_mut(), 0);
        // SAFETY: both variables live through the call.
        let status = unsafe { (self.inner.api.device_list)(&raw mut list, &raw mut count) };
        self.inner
            .check(status)
            .map_err(|error| OpenniError::Open { uri: "the list of cameras".to_owned(), error })?;
        if list.is_null() {
            return Ok(Vec::new());
        }
        // SAFETY: the library made a list of `count` entries, which stays until it is released.
        let entries =
            unsafe { std::slice::from_raw_parts(list, usize::try_from(count).unwrap_or(0)) };
        let devices = entries
            .iter()
            .map(|info| DeviceInfo {
                uri: text(&info.uri),
                vendor: text(&info.vendor),
                name: text(&info.name),
                usb: (info.usb_vendor, info.usb_product),
            })
            .collect();
        // SAFETY: the list is released once, and `entries` is not used any more.
        unsafe { (self.inner.api.release_device_list)(list) };
        Ok(devices)
    }
}

/// Returns the result of `job`, which calls the library at `path` on one of its threads.
fn on_thread<T: Send + 'static>(
    path: &Path,
    job: impl FnOnce() -> Result<T, OpenniError> + Send + 'static,
) -> Result<T, OpenniError> {
    let failed = |error: String| OpenniError::Initialize { path: path.to_owned(), error };
    let result = threads::run(job).map_err(|error| failed(error.to_string()))?;
    result.recv().map_err(|_| failed("its thread has panicked".to_owned()))?
}

impl fmt::Debug for OpenNi {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OpenNi").field("path", &self.inner.api.path).finish_non_exhaustive()
    }
}

impl Inner {
    /// Returns the message of `status` as an error, unless it is a success.
    pub(crate) fn check(&self, status: OniStatus) -> Result<(), String> {
        if status == STATUS_OK {
            return Ok(());
        }
        // SAFETY: the library returns a string of this thread, which stays until the thread's next
        // call.
        let pointer = unsafe { (self.api.extended_error)() };
        // SAFETY: no call is made in between.
        let message = unsafe { owned(pointer) };
        let kind = match status {
            1 => "it failed",
            2 => "it is not implemented",
            3 => "it is not supported",
            4 => "a value or its size is not accepted",
            5 => "it was called out of order",
            6 => "the device is gone",
            STATUS_TIME_OUT => "it took too long",
            _ => "unknown status",
        };
        let lines: Vec<&str> =
            message.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        Err(if lines.is_empty() {
            kind.to_owned()
        } else {
            format!("{kind}: {}", lines.join("; "))
        })
    }
}
