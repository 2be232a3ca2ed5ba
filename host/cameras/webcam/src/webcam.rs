//! Webcams through V4L2.

use std::fs::File;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

use opencv::videoio::{
    CAP_PROP_AUTO_EXPOSURE, CAP_PROP_BUFFERSIZE, CAP_PROP_EXPOSURE, CAP_PROP_FOURCC, CAP_PROP_FPS,
    CAP_PROP_FRAME_HEIGHT, CAP_PROP_FRAME_WIDTH, CAP_PROP_GAIN, CAP_PROP_POS_MSEC, CAP_V4L2,
    VideoCapture, VideoCaptureTrait, VideoCaptureTraitConst,
};
use plumb_frame::clock::HostClock;

use crate::error::WebcamError;
use crate::picture::{Picture, check_size, failed, retrieve};
use crate::settings::{Mode, Settings};

/// Buffers of the driver. A picture waits in them while the one before it is read.
const BUFFERS: f64 = 2.0;
/// V4L2's value of the control `auto_exposure` for an exposure that is set by hand.
const MANUAL_EXPOSURE: f64 = 1.0;
/// Units of V4L2's exposure time in a second.
const EXPOSURE_UNITS: f64 = 10_000.0;
/// Number of pictures among which one must be whole when a camera is opened.
const FIRST_PICTURES: usize = 5;
/// Largest deviation of the rate that a driver sets from the rate that is wanted.
const RATE_TOLERANCE: f64 = 0.02;

/// Webcam that delivers pictures.
#[derive(Debug)]
pub struct Webcam {
    path: PathBuf,
    capture: VideoCapture,
    mode: Mode,
    notes: Vec<String>,
    clock: HostClock,
    latency: f64,
}

impl Webcam {
    /// Opens a camera, sets it, and reads a picture to see what it gives.
    ///
    /// # Errors
    /// Where the device cannot be opened, or cannot do what `settings` ask for. Another rate is a
    /// note ([`Webcam::notes`]).
    pub fn open(settings: &Settings) -> Result<Self, WebcamError> {
        let path = &settings.device;
        check_device(path)?;
        let failed = failed(path);
        let mut capture = VideoCapture::from_file(path, CAP_V4L2).map_err(&failed)?;
        if !capture.is_opened().map_err(&failed)? {
            return Err(refused(path));
        }
        set_all(&mut capture, settings)?;
        let Picture { width, height, .. } = first_picture(&mut capture, path)?;
        let rate = capture.get(CAP_PROP_FPS).map_err(&failed)?.max(0.0);
        let mode = Mode { width, height, rate };
        let notes = check_mode(settings.mode, mode, path)?.into_iter().collect();
        let (path, latency) = (path.clone(), settings.latency);
        Ok(Self { path, capture, mode, notes, clock: HostClock::new(latency), latency })
    }

    /// Returns the size and the rate that the camera gives.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Returns the path of the device.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns what the camera does not do as it was set, for a person.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Waits for the next picture. `now` returns the present time, seconds on the host's clock; it
    /// is called when the picture has arrived.
    ///
    /// The driver's time stamps are mapped to that clock. A picture without one is taken to be
    /// `latency` old.
    ///
    /// # Errors
    /// Where no picture comes any more, or it is damaged or has another size. OpenCV waits for 10 s
    /// at most.
    pub fn next_picture(&mut self, now: impl Fn() -> f64) -> Result<Picture, WebcamError> {
        let failed = failed(&self.path);
        if !self.capture.grab().map_err(&failed)? {
            return Err(WebcamError::Lost { path: self.path.clone() });
        }
        let arrival = now();
        let stamp = self.capture.get(CAP_PROP_POS_MSEC).map_err(&failed)? * 1e-3;
        let has_stamp = stamp.is_finite() && stamp > 0.0;
        let time =
            if has_stamp { self.clock.taken(stamp, arrival) } else { arrival - self.latency };
        let damaged = |source| WebcamError::Damaged { path: self.path.clone(), source };
        let picture = retrieve(&mut self.capture, time)
            .map_err(|error| damaged(Some(error.into())))?
            .ok_or_else(|| damaged(None))?;
        check_size(picture, (self.mode.width, self.mode.height), &self.path)
    }
}

/// Reads the first whole picture. Some cameras begin with damaged ones.
fn first_picture(capture: &mut VideoCapture, path: &Path) -> Result<Picture, WebcamError> {
    let failed = failed(path);
    let mut error = refused(path);
    for _ in 0..FIRST_PICTURES {
        if !capture.grab().map_err(&failed)? {
            break;
        }
        match retrieve(capture, 0.0) {
            Ok(Some(picture)) => return Ok(picture),
            Ok(None) => {}
            Err(cause) => error = failed(cause),
        }
    }
    Err(error)
}

/// Returns the error of a device that OpenCV does not take.
fn refused(path: &Path) -> WebcamError {
    WebcamError::Refused { path: path.to_owned(), is_device: true }
}

/// Checks that `path` is a device that this user may read.
fn check_device(path: &Path) -> Result<(), WebcamError> {
    let open = |source| WebcamError::Open { path: path.to_owned(), source };
    let kind = path.metadata().map_err(open)?.file_type();
    if !kind.is_char_device() {
        return Err(WebcamError::NoDevice { path: path.to_owned() });
    }
    File::open(path).map_err(open).map(drop)
}

/// Sets format, size, rate, exposure and gain. The format is first: it decides which sizes and
/// rates there are. The size is read back from a picture, later.
fn set_all(capture: &mut VideoCapture, settings: &Settings) -> Result<(), WebcamError> {
    let path = &settings.device;
    let failed = failed(path);
    if let Some(format) = settings.format {
        // The first character is in the lowest byte.
        let code = i32::from_le_bytes(format);
        capture.set(CAP_PROP_FOURCC, f64::from(code)).map_err(&failed)?;
        if capture.get(CAP_PROP_FOURCC).map_err(&failed)? as i32 != code {
            let wanted = String::from_utf8_lossy(&format).into_owned();
            return Err(WebcamError::Format { path: path.clone(), wanted });
        }
    }
    let Mode { width, height, rate } = settings.mode;
    let usual = [
        (CAP_PROP_FRAME_WIDTH, width as f64),
        (CAP_PROP_FRAME_HEIGHT, height as f64),
        (CAP_PROP_FPS, rate),
        (CAP_PROP_BUFFERSIZE, BUFFERS),
    ];
    for (property, value) in usual {
        capture.set(property, value).map_err(&failed)?;
    }
    let mut require = |property: i32, value: f64, option: &'static str| match capture
        .set(property, value)
        .map_err(&failed)?
    {
        true => Ok(()),
        false => Err(WebcamError::Option { path: path.clone(), option }),
    };
    if let Some(exposure) = settings.exposure {
        require(CAP_PROP_AUTO_EXPOSURE, MANUAL_EXPOSURE, "exposure")?;
        require(CAP_PROP_EXPOSURE, (exposure * EXPOSURE_UNITS).round().max(1.0), "exposure")?;
    }
    if let Some(gain) = settings.gain {
        require(CAP_PROP_GAIN, gain, "gain")?;
    }
    Ok(())
}

/// Compares what a camera gives with what was wanted. Returns a note about another rate.
fn check_mode(wanted: Mode, given: Mode, path: &Path) -> Result<Option<String>, WebcamError> {
    if (wanted.width, wanted.height) != (given.width, given.height) {
        return Err(WebcamError::Mode { path: path.to_owned(), wanted, given });
    }
    let is_near = (given.rate - wanted.rate).abs() <= RATE_TOLERANCE * wanted.rate;
    let note = format!(
        "it gives {} pictures a second where {} were set: light, exposure and the pixel format \
         limit the rate (`format = \"MJPG\"` is often faster)",
        given.rate, wanted.rate
    );
    Ok((given.rate > 0.0 && !is_near).then_some(note))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_size_is_refused_and_another_rate_is_a_note() {
        let (path, wanted) = (Path::new("/dev/video0"), Settings::default().mode);
        assert_eq!(check_mode(wanted, wanted, path).unwrap(), None);
        let unknown = Mode { rate: 0.0, ..wanted };
        assert_eq!(check_mode(wanted, unknown, path).unwrap(), None);
        let slow = check_mode(wanted, Mode { rate: 7.5, ..wanted }, path).unwrap().unwrap();
        assert!(slow.contains("7.5") && slow.contains("MJPG"), "{slow}");
        let large = check_mode(wanted, Mode { width: 1280, ..wanted }, path).unwrap_err();
        let text = large.to_string();
        assert!(text.contains("1280x480 at 30 Hz where 640x480 at 30 Hz was set"), "{text}");
    }
}
