//! Open device: a camera, or a recording in its place.

use std::ffi::CString;
use std::path::Path;
use std::sync::Arc;

use crate::error::RealsenseError;
use crate::handle::Owned;
use crate::library::{DeviceInfo, Inner};
use crate::settings::Target;
use crate::sys;

/// Open device.
pub(crate) struct Device {
    inner: Arc<Inner>,
    /// Is `None` only while the device is dropped.
    handle: Option<Owned>,
    /// Recorder that the device's sensors are read through.
    recorder: Option<Owned>,
    /// Path of a recording, which belongs to the context until it is removed.
    recording: Option<CString>,
    /// Serial number of a camera, path of a recording.
    pub(crate) id: String,
    pub(crate) name: String,
}

impl Device {
    /// Opens `target`, which also records to the file `record`.
    pub(crate) fn open(
        inner: &Arc<Inner>,
        target: &Target,
        record: Option<&Path>,
    ) -> Result<Self, RealsenseError> {
        let (handle, recording, id) = match target {
            Target::First => {
                let handle = find(inner, |_| true)?.ok_or(RealsenseError::NoDevice)?;
                let id = inner.describe(&handle).serial;
                (handle, None, id)
            }
            Target::Serial(serial) => {
                let found = find(inner, |device| device.serial == *serial)?;
                (found.ok_or_else(|| no_serial(inner, serial))?, None, serial.clone())
            }
            Target::Recording(path) => {
                let (handle, path, id) = open_recording(inner, path)?;
                (handle, Some(path), id)
            }
        };
        let name = inner.describe(&handle).name;
        let inner = Arc::clone(inner);
        let mut device = Self { inner, handle: Some(handle), recorder: None, recording, id, name };
        device.recorder = record.map(|path| device.start_recorder(path)).transpose()?;
        Ok(device)
    }

    /// Returns the device whose sensors are to be read: the recorder where there is one.
    pub(crate) fn sensors(&self) -> Option<&Owned> {
        self.recorder.as_ref().or(self.handle.as_ref())
    }

    /// Returns whether the device is a recording.
    pub(crate) fn is_recording(&self) -> bool {
        self.recording.is_some()
    }

    /// Returns whether the camera is plugged in.
    pub(crate) fn is_connected(&self) -> bool {
        self.handle.as_ref().is_some_and(|handle| self.inner.is_connected(handle))
    }

    /// Returns whether the recording was played to its end.
    pub(crate) fn has_ended(&self) -> bool {
        let (api, Some(handle)) = (&self.inner.api, &self.handle) else { return true };
        // SAFETY: the device lives, and is a recording.
        let status = api.check(|error| unsafe { (api.playback_status)(handle.raw(), error) });
        status.is_ok_and(|status| status == sys::PLAYBACK_STOPPED)
    }

    /// Makes a recording wait until its frames are read, or go on at the speed at which it was
    /// recorded. One that waits cannot be paused or closed while its queue is full.
    pub(crate) fn set_waiting(&self, waits: bool) -> Result<(), String> {
        let (api, Some(handle)) = (&self.inner.api, &self.handle) else { return Ok(()) };
        let real_time = i32::from(!waits);
        // SAFETY: the device lives, and is a recording.
        api.check(|error| unsafe { (api.playback_real_time)(handle.raw(), real_time, error) })
    }

    /// Plays a recording, whose sensors are started, from its beginning and frame by frame. It
    /// begins with the first sensor that is started, before the second one delivers. `drain`
    /// removes the frames that came until then.
    pub(crate) fn rewind(&self, drain: impl FnOnce()) -> Result<(), String> {
        let (api, Some(handle)) = (&self.inner.api, &self.handle) else { return Ok(()) };
        let raw = handle.raw();
        // SAFETY: the device lives, and is a recording.
        api.check(|error| unsafe { (api.playback_pause)(raw, error) })?;
        drain();
        // SAFETY: as above.
        api.check(|error| unsafe { (api.playback_seek)(raw, 0, error) })?;
        self.set_waiting(true)?;
        // SAFETY: as above.
        api.check(|error| unsafe { (api.playback_resume)(raw, error) })
    }

    /// Starts to record what is read to the file `path`.
    fn start_recorder(&self, path: &Path) -> Result<Owned, RealsenseError> {
        let failed = |error| RealsenseError::Setting {
            id: self.id.clone(),
            what: "recording to a file",
            error,
        };
        let file = c_path(path).map_err(failed)?;
        let (api, handle) = (&self.inner.api, self.handle.as_ref());
        let handle = handle.ok_or_else(|| failed("the device is closed".to_owned()))?;
        // SAFETY: the device lives; the path has a final zero.
        let create = |error| unsafe { (api.create_recorder)(handle.raw(), file.as_ptr(), error) };
        let recorder = api.check(create).map_err(failed)?;
        Owned::new(recorder, api.delete_device).map_err(failed)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.recorder = None;
        self.handle = None;
        if let Some(path) = &self.recording {
            self.inner.remove_recording(path);
        }
    }
}

/// Returns the first camera that `fits`.
fn find(
    inner: &Inner,
    fits: impl Fn(&DeviceInfo) -> bool,
) -> Result<Option<Owned>, RealsenseError> {
    let devices = inner.devices().map_err(|error| RealsenseError::Library { error })?;
    Ok(devices.into_iter().find(|device| fits(&inner.describe(device))))
}

/// Returns the error about a serial number that no camera has.
fn no_serial(inner: &Inner, serial: &str) -> RealsenseError {
    let devices = inner.devices().unwrap_or_default();
    let names = devices.iter().map(|device| inner.describe(device));
    let names: Vec<String> =
        names.map(|device| format!("{} ({})", device.serial, device.name)).collect();
    let found = match names.as_slice() {
        [] => "none is plugged in".to_owned(),
        _ => format!("plugged in: {}", names.join(", ")),
    };
    RealsenseError::NoSerial { serial: serial.to_owned(), found }
}

/// Opens a recording. Returns its path in both forms.
fn open_recording(inner: &Inner, path: &Path) -> Result<(Owned, CString, String), RealsenseError> {
    let id = path.display().to_string();
    let failed = |error: String| RealsenseError::Open { id: id.clone(), error };
    // The library's own message for a file that is absent names its source code.
    std::fs::File::open(path).map_err(|error| failed(error.to_string()))?;
    let file = c_path(path).map_err(failed)?;
    let handle = inner.add_recording(&file).map_err(failed)?;
    Ok((handle, file, id))
}

/// Returns a path in the library's form.
fn c_path(path: &Path) -> Result<CString, String> {
    let text = path.to_str().ok_or("librealsense2 takes paths in UTF-8 only")?;
    CString::new(text).map_err(|error| error.to_string())
}
