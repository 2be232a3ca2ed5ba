//! Webcam: a video device, set up, with its pictures decoded and timed.

use std::io::ErrorKind;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::errno::Errno;
use plumb_config::quantity::CameraTime;
use plumb_frame::clock::HostClock;
use plumb_frame::image::{ColourImage, Image, ImageSize};
use plumb_pictures::decode::{self, DecodeError};
use plumb_pictures::raw;

use crate::controls::Controls;
use crate::error::WebcamError;
use crate::kernel::KernelNode;
use crate::mode::Mode;
use crate::node::{Filled, Format, Node};
use crate::nodes::{capture_nodes, find};
use crate::settings::{PixelFormat, WebcamSettings};

/// Longest wait for a picture, below that of a capture.
const SILENCE: Duration = Duration::from_secs(2);
/// Number of pictures among which one must be whole when a camera is opened.
const FIRST_PICTURES: usize = 5;
/// Largest deviation of the rate that a driver sets from the rate that is wanted.
const RATE_TOLERANCE: f64 = 0.02;
/// Time in which a camera finds its white balance, seconds.
const WHITE_BALANCE_S: usize = 2;
/// Time from exposure to arrival where neither the driver nor the settings state one, seconds: one
/// and a half periods of 30 Hz, a guess.
const LATENCY_S: f64 = 0.05;

/// Webcam that delivers pictures.
pub struct Webcam {
    path: PathBuf,
    node: Box<dyn Node>,
    format: Format,
    mode: Mode,
    notes: Vec<String>,
    times: PictureTimes,
    /// Bytes of the last picture.
    bytes: Vec<u8>,
}

/// Mapping of the driver's time stamps to the host's clock.
struct PictureTimes {
    /// That of the fastest picture.
    clock: HostClock,
    /// Time from exposure to arrival that the settings state, seconds.
    latency: Option<f64>,
    /// Time stamp of the last picture, seconds.
    last: f64,
}

impl Webcam {
    /// Opens a camera, sets it, and reads a picture to see what it gives.
    ///
    /// # Errors
    /// Where the device cannot be opened, or has no picture of the format or the size. Another rate
    /// and other controls are notes ([`Webcam::notes`]).
    pub fn open(settings: &WebcamSettings) -> Result<Self, WebcamError> {
        let path = find(settings.device.as_deref(), &capture_nodes())?;
        let device = |source| WebcamError::Device { path: path.clone(), source };
        if !path.metadata().map_err(device)?.file_type().is_char_device() {
            return Err(WebcamError::NoDevice { path });
        }
        let node = KernelNode::open(&path).map_err(device)?;
        Self::with_node(path.clone(), Box::new(node), settings)
    }

    /// Sets up the device `node` at `path`.
    pub(crate) fn with_node(
        path: PathBuf,
        mut node: Box<dyn Node>,
        settings: &WebcamSettings,
    ) -> Result<Self, WebcamError> {
        let device = |source| WebcamError::Device { path: path.clone(), source };
        let [width, height] = [settings.width, settings.height].map(usize::from);
        let wanted = Mode { size: ImageSize { width, height }, rate: settings.rate.into() };
        let format = set_format(&mut *node, settings.format, wanted.size, &path)?;
        // A device without rates states none.
        let rate = node.set_rate(settings.rate).unwrap_or(0.0);
        let mode = Mode { size: format.size, rate };
        let notes = check_mode(wanted, mode, &path)?.into_iter().collect();
        let mut controls = Controls::default();
        controls.set_all(&*node, settings);
        node.start().map_err(device)?;
        let latency = settings.latency.map(CameraTime::get);
        let clock = HostClock::new(latency.unwrap_or(LATENCY_S));
        let times = PictureTimes { clock, latency, last: f64::NEG_INFINITY };
        let mut webcam = Self { path, node, format, mode, notes, times, bytes: Vec::new() };
        if Controls::finds_white_balance(&*webcam.node) {
            for _ in 0..WHITE_BALANCE_S * usize::from(settings.rate) {
                webcam.next_buffer()?;
            }
            controls.fix_white_balance(&*webcam.node);
        }
        webcam.notes.extend(controls.notes(&webcam.path));
        webcam.first_picture()?;
        Ok(webcam)
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

    /// Waits for the next picture, for 2 s at most. Returns it with the time at which it was taken.
    /// `now` returns the present time, seconds on the host's clock; it is called when the picture
    /// has arrived.
    ///
    /// # Errors
    /// Where no picture comes any more, or it is damaged, has another size, or is not newer than
    /// the one before.
    pub fn next_picture(
        &mut self,
        now: impl Fn() -> f64,
    ) -> Result<(f64, ColourImage), WebcamError> {
        let filled = self.next_buffer()?;
        let arrival = now();
        let path = || self.path.clone();
        let time = self
            .times
            .taken(filled, arrival)
            .map_err(|(stamp, last)| WebcamError::NotNewer { path: path(), stamp, last })?;
        Ok((time, self.decoded(filled)?))
    }

    /// Decodes the last picture.
    fn decoded(&self, filled: Filled) -> Result<ColourImage, WebcamError> {
        let damaged = |source| WebcamError::Damaged { path: self.path.clone(), source };
        if filled.is_damaged {
            return Err(damaged(None));
        }
        let Format { pixels, size, stride } = self.format;
        match pixels {
            Some(PixelFormat::Yuyv) => {
                let row = 2 * size.width;
                let rows = self.bytes.chunks_exact(stride.max(row)).take(size.height);
                let pixels = rows.flat_map(|bytes| raw::bgr_of_yuyv(&bytes[..row])).collect();
                Image::new(size.width, size.height, pixels).map_err(DecodeError::from)
            }
            _ => decode::of_size(&self.bytes, size, decode::colour),
        }
        .map_err(|error| damaged(Some(error)))
    }

    /// Waits for a buffer of the driver. One that the driver cannot fill is damaged.
    fn next_buffer(&mut self) -> Result<Filled, WebcamError> {
        loop {
            match self.node.next_buffer(SILENCE, &mut self.bytes) {
                Ok(filled) => return Ok(filled),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) if error.raw_os_error() == Some(Errno::EIO as i32) => {
                    return Ok(Filled { is_damaged: true, ..Filled::default() });
                }
                Err(source) => return Err(WebcamError::Lost { path: self.path.clone(), source }),
            }
        }
    }

    /// Reads the first whole picture. Some cameras begin with damaged ones.
    fn first_picture(&mut self) -> Result<(), WebcamError> {
        let mut result = Ok(());
        for _ in 0..FIRST_PICTURES {
            let filled = self.next_buffer()?;
            result = self.decoded(filled).map(drop);
            if result.is_ok() {
                break;
            }
        }
        result
    }
}

impl PictureTimes {
    /// Returns the time of a picture, seconds on the host's clock, that arrived at `arrival`: its
    /// time stamp, where that is on the computer's monotonic clock and the settings have no
    /// latency, otherwise as [`HostClock`] maps it.
    ///
    /// # Errors
    /// The time stamp and the last one, where it is not newer.
    fn taken(&mut self, filled: Filled, arrival: f64) -> Result<f64, (f64, f64)> {
        let Some(stamp) = filled.stamp else {
            return Ok(arrival - self.latency.unwrap_or(LATENCY_S));
        };
        let last = std::mem::replace(&mut self.last, stamp);
        if stamp <= last {
            return Err((stamp, last));
        }
        let mapped = self.clock.taken(stamp, arrival);
        let age = filled.age.filter(|_| self.latency.is_none());
        Ok(age.map_or(mapped, |age| arrival - age.max(0.0)))
    }
}

/// Sets format and size. Without a `format`, it is MJPG, or YUYV where the device has no MJPG.
fn set_format(
    node: &mut dyn Node,
    format: Option<PixelFormat>,
    size: ImageSize,
    path: &Path,
) -> Result<Format, WebcamError> {
    let choice = [PixelFormat::Mjpg, PixelFormat::Yuyv];
    let wanted = format.as_ref().map_or(&choice[..], std::slice::from_ref);
    for &format in wanted {
        let set = node.set_format(format, size);
        let given = set.map_err(|source| WebcamError::Device { path: path.to_owned(), source })?;
        if given.pixels == Some(format) {
            return Ok(given);
        }
    }
    let wanted = format.map_or("MJPG or YUYV".to_owned(), |it| format!("{it:?}").to_uppercase());
    Err(WebcamError::Format { path: path.to_owned(), wanted })
}

/// Compares what a camera gives with what was wanted. Returns a note about another rate.
fn check_mode(wanted: Mode, given: Mode, path: &Path) -> Result<Option<String>, WebcamError> {
    if wanted.size != given.size {
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
mod tests;
