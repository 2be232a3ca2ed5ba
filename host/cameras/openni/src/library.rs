//! The library: found, loaded, asked what is plugged in.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::OpenniError;
use crate::api::Api;
use crate::events::{Events, owned, text};
use crate::sys::{API_VERSION, OniStatus, STATUS_OK, STATUS_TIME_OUT};

/// The environment variable that says where the library is, where it is not where the system keeps
/// them.
pub const LIBRARY_VARIABLE: &str = "PLUMB_OPENNI2";

/// Under these names the library is looked for.
const NAMES: [&str; 3] = ["libOpenNI2.so.0", "libOpenNI2.so", "libOpenNI2.dylib"];

/// The loaded library. Copies are the same library; it stays loaded until the program ends, since
/// drivers have threads of their own and not all survive being ended.
#[derive(Clone)]
pub struct OpenNi {
    pub(crate) inner: Arc<Inner>,
}

pub(crate) struct Inner {
    pub(crate) api: Api,
    pub(crate) events: &'static Events,
}

/// What is plugged in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceInfo {
    /// How it is opened.
    pub uri: String,
    /// Who made it.
    pub vendor: String,
    /// What it is called.
    pub name: String,
    /// USB vendor and product.
    pub usb: (u16, u16),
}

/// Those that were loaded, by what they were asked for with: a second loading would be a second set
/// of drivers at one camera.
static LOADED: Mutex<Vec<(PathBuf, OpenNi)>> = Mutex::new(Vec::new());

impl OpenNi {
    /// Loads the library from where [`LIBRARY_VARIABLE`] says, or else by its usual names, and its
    /// drivers. The folder that the program runs in is another one for that moment.
    ///
    /// # Errors
    /// [`OpenniError::NoLibrary`], [`OpenniError::NotOpenni`], [`OpenniError::Initialize`].
    pub fn load() -> Result<Self, OpenniError> {
        match std::env::var_os(LIBRARY_VARIABLE) {
            Some(path) => Self::load_from(Path::new(&path)),
            None => {
                let mut results = NAMES.iter().map(|name| Self::load_from(Path::new(name)));
                let first = results.next().unwrap_or(Err(OpenniError::NoDevice));
                // What the most usual name's absence says is what a person needs.
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
        let openni = Self::begin(Api::load(path)?)?;
        loaded.push((path.to_owned(), openni.clone()));
        Ok(openni)
    }

    fn begin(api: Api) -> Result<Self, OpenniError> {
        let events: &'static Events = Box::leak(Box::default());
        let inner = Inner { api, events };
        // SAFETY: the function is the library's, and may be called at any time.
        let status = unsafe { (inner.api.initialize)(API_VERSION) };
        inner
            .check(status)
            .map_err(|error| OpenniError::Initialize { path: inner.api.path.clone(), error })?;
        let mut callbacks = Events::callbacks();
        let mut handle = std::ptr::null_mut();
        // SAFETY: the library copies the three pointers; the cookie is never freed, and what the
        // callbacks do with it is made for any thread.
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

    /// Where the library was loaded from, as it was asked for.
    pub fn path(&self) -> &Path {
        &self.inner.api.path
    }

    /// Its drivers: the files in the folder beside it that it takes them from. Empty where that
    /// cannot be found out.
    pub fn drivers(&self) -> Vec<PathBuf> {
        let Some(folder) = self.folder() else { return Vec::new() };
        let entries = std::fs::read_dir(folder.join("OpenNI2/Drivers"));
        let mut files: Vec<PathBuf> =
            entries.into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        files.sort();
        files
    }

    /// The folder that it is in: as it was given, or where the system says that it found it.
    fn folder(&self) -> Option<PathBuf> {
        let path = &self.inner.api.path;
        if path.components().count() > 1 {
            return path.parent().map(Path::to_owned);
        }
        let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
        let line = maps.lines().find(|line| line.contains("/libOpenNI2."))?;
        Path::new(line.get(line.find('/')?..)?).parent().map(Path::to_owned)
    }

    /// The library's version, "2.2.0.33".
    pub fn version(&self) -> String {
        // SAFETY: the function only reads constants of the library.
        let version = unsafe { (self.inner.api.version)() };
        format!("{}.{}.{}.{}", version.major, version.minor, version.maintenance, version.build)
    }

    /// The cameras that its drivers know of.
    ///
    /// # Errors
    /// Where the library cannot tell.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>, OpenniError> {
        let (mut list, mut count) = (std::ptr::null_mut(), 0);
        // SAFETY: both pointers are to variables that live through the call.
        let status = unsafe { (self.inner.api.device_list)(&raw mut list, &raw mut count) };
        self.inner
            .check(status)
            .map_err(|error| OpenniError::Open { uri: "the list of cameras".to_owned(), error })?;
        if list.is_null() {
            return Ok(Vec::new());
        }
        // SAFETY: the library has made a list of `count` entries, which is its caller's until it is
        // released.
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

impl fmt::Debug for OpenNi {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OpenNi").field("path", &self.inner.api.path).finish_non_exhaustive()
    }
}

impl Inner {
    /// What `status` says, in the library's words.
    pub(crate) fn check(&self, status: OniStatus) -> Result<(), String> {
        if status == STATUS_OK {
            return Ok(());
        }
        // SAFETY: the library gives a string of this thread's, which stays until its next call from
        // here.
        let pointer = unsafe { (self.api.extended_error)() };
        // SAFETY: no call is made in between.
        let said = unsafe { owned(pointer) };
        let kind = match status {
            1 => "it failed",
            2 => "it is not implemented",
            3 => "it is not supported",
            4 => "a value or its size is not accepted",
            5 => "it is out of turn",
            6 => "the device is gone",
            STATUS_TIME_OUT => "it took too long",
            _ => "unknown status",
        };
        let lines: Vec<&str> =
            said.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        Err(if lines.is_empty() {
            kind.to_owned()
        } else {
            format!("{kind}: {}", lines.join("; "))
        })
    }
}
