//! Recording to an .oni file, by the library.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::device::Device;
use crate::library::OpenNi;
use crate::picture::Sensor;
use crate::{OpenniError, oni_file, sys};

/// The library's recorder begins in a thread of its own and does not say when it has; its file
/// does. A stream that is recorded from its second picture on would be played a picture out of
/// step: the file's times begin with each stream's first.
const BEGIN: Duration = Duration::from_secs(3);
const QUIET: Duration = Duration::from_millis(200);
const LOOK: Duration = Duration::from_millis(10);

/// A recorder; the file is complete when it is dropped, which has to be before its device is.
pub(crate) struct Recorder {
    openni: OpenNi,
    handle: sys::OniRecorderHandle,
    path: PathBuf,
}

impl Recorder {
    /// Records both streams of `device` to `path`, without loss. To be called before they are
    /// started.
    pub(crate) fn begin(device: &Device, path: &Path) -> Result<Self, OpenniError> {
        let openni = device.openni().clone();
        let failed = |error: String| OpenniError::Record { path: path.to_owned(), error };
        let text =
            path.to_str().ok_or_else(|| failed("OpenNI2 takes paths in UTF-8 only".to_owned()))?;
        let name = CString::new(text).map_err(|error| failed(error.to_string()))?;
        // The library's own message would be "it failed".
        std::fs::File::create(path).map_err(|error| failed(error.to_string()))?;
        let mut handle = std::ptr::null_mut();
        // SAFETY: the string has its closing zero and lives through the call, as does the variable.
        let status = unsafe { (openni.inner.api.create_recorder)(name.as_ptr(), &raw mut handle) };
        openni.inner.check(status).map_err(failed)?;
        let recorder = Self { openni, handle, path: path.to_owned() };
        let api = &recorder.openni.inner.api;
        for sensor in [Sensor::Depth, Sensor::Colour] {
            let stream = device.stream_handle(sensor);
            // SAFETY: recorder and stream live; the stream outlives the recorder.
            let status = unsafe { (api.recorder_attach)(handle, stream, 0) };
            recorder.openni.inner.check(status).map_err(failed)?;
        }
        // SAFETY: the recorder lives and has streams.
        let status = unsafe { (api.recorder_start)(handle) };
        recorder.openni.inner.check(status).map_err(failed)?;
        wait_for_begin(path).map_err(failed)?;
        Ok(recorder)
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // SAFETY: the recorder lives.
        unsafe { (self.openni.inner.api.recorder_stop)(self.handle) };
        // SAFETY: the recorder lives, and is not used after this; it writes what is left first.
        unsafe { (self.openni.inner.api.recorder_destroy)(&raw mut self.handle) };
        // It leaves as much again behind the last record. A file that it could not complete is told
        // of by who reads it.
        let _ = oni_file::trim(&self.path);
    }
}

/// Returns when the file's beginning has been written: it has some length, which has stayed for a
/// while.
fn wait_for_begin(path: &Path) -> Result<(), String> {
    let begin = Instant::now();
    let (mut length, mut since) = (0, begin);
    loop {
        std::thread::sleep(LOOK);
        let now = std::fs::metadata(path).map_err(|error| error.to_string())?.len();
        if now != length {
            (length, since) = (now, Instant::now());
        }
        if length > 0 && since.elapsed() >= QUIET {
            return Ok(());
        }
        if begin.elapsed() > BEGIN {
            return Err("nothing is written".to_owned());
        }
    }
}
