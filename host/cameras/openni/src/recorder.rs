//! The device's own recording to an `.oni` file, made by the library.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plumb_frame::pairing::Sensor;

use crate::device::Device;
use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::{oni_file, sys};

/// Longest time until the recorder has started.
///
/// The library's recorder starts in a thread of its own without a signal; its file shows it. A
/// stream that is recorded from its second picture on would be played one picture out of step,
/// because the file's times begin with each stream's first picture.
const START_TIMEOUT: Duration = Duration::from_secs(3);
/// Time without growth after which the beginning of the file is complete.
const QUIET: Duration = Duration::from_millis(200);
/// Poll interval of the file's length.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Recorder of a device. Dropping it completes the file; the device must live longer.
pub(crate) struct Recorder {
    openni: OpenNi,
    handle: sys::OniRecorderHandle,
    path: PathBuf,
}

impl Recorder {
    /// Records both streams of `device` to `path`, without loss. Must be called before the streams
    /// are started.
    pub(crate) fn start(device: &Device, path: &Path) -> Result<Self, OpenniError> {
        let openni = device.openni().clone();
        let failed = |error: String| OpenniError::Record { path: path.to_owned(), error };
        let text =
            path.to_str().ok_or_else(|| failed("OpenNI2 takes paths in UTF-8 only".to_owned()))?;
        let name = CString::new(text).map_err(|error| failed(error.to_string()))?;
        // This error names its reason; the library's own is only "it failed".
        std::fs::File::create(path).map_err(|error| failed(error.to_string()))?;
        let mut handle = std::ptr::null_mut();
        // SAFETY: the string ends with a zero; it and the variable live through the call.
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
        wait_for_start(path).map_err(failed)?;
        Ok(recorder)
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // SAFETY: the recorder lives.
        unsafe { (self.openni.inner.api.recorder_stop)(self.handle) };
        // SAFETY: the recorder lives, and is not used after this. It writes the rest of its file
        // first.
        unsafe { (self.openni.inner.api.recorder_destroy)(&raw mut self.handle) };
        // The recorder leaves unused bytes behind the last record. An incomplete file is reported
        // when it is read.
        let _ = oni_file::trim(&self.path);
    }
}

/// Waits until the beginning of the file is written: until its length stays above zero for
/// [`QUIET`].
fn wait_for_start(path: &Path) -> Result<(), String> {
    let begin = Instant::now();
    let (mut length, mut since) = (0, begin);
    loop {
        std::thread::sleep(POLL_INTERVAL);
        let now = std::fs::metadata(path).map_err(|error| error.to_string())?.len();
        if now != length {
            (length, since) = (now, Instant::now());
        }
        if length > 0 && since.elapsed() >= QUIET {
            return Ok(());
        }
        if begin.elapsed() > START_TIMEOUT {
            return Err("nothing is written".to_owned());
        }
    }
}
