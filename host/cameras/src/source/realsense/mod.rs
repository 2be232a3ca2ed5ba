//! Intel RealSense cameras and their recordings (the crate `plumb-realsense`).

use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{Image, ImageError, ImageSize};
use plumb_realsense::{Camera, Opened, Pair, RealsenseError, Sensor};
use thiserror::Error;

use super::camera_source::CameraSource;
use super::clock::LiveClock;
use super::error::{InvalidFrame, SourceError};
use super::resolution;

mod settings;

pub use plumb_realsense::{LIBRARY_VARIABLE, RealSense, Settings, Target};
pub use settings::RealsenseSettings;

/// Largest distortion of a colour picture that counts as none, pixels. The camera model has no
/// distortion, and the detector's error is of this size.
const NEGLIGIBLE_DISTORTION: f64 = 0.5;

/// Camera or recording through librealsense2, with depth aligned to colour.
///
/// Time stamps are in seconds: of a camera on the host's clock since it was opened, of a recording
/// since its first pair.
#[derive(Debug)]
pub struct RealsenseSource {
    camera: Camera,
    intrinsics: Intrinsics,
    clock: Clock,
}

/// Clock that stamps the frames.
#[derive(Debug, Clone)]
enum Clock {
    /// The host's, since the camera was opened.
    Host(LiveClock),
    /// The recording's: time stamp of its last frame, seconds.
    Recording(f64),
}

/// Failure to open a camera or a recording through librealsense2, or to read it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RealsenseSourceError {
    /// librealsense2, the camera or the recording fails.
    #[error(transparent)]
    Realsense(#[from] RealsenseError),
    /// An image has another number of pixels than its mode.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The lens of the colour sensor bends the picture.
    #[error(
        "{id}: its lens bends the corners of the picture by {}, and Plumb's camera model has no \
         distortion. Choose another resolution, or accept the error with calibrated intrinsics in \
         the camera file and `intrinsics = \"file\"` in [camera.realsense]",
        .pixels.map_or_else(|| "an unknown amount".to_owned(), |pixels| format!("{pixels:.1} px"))
    )]
    Distortion {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// Largest distortion, pixels; `None` for an unknown model.
        pixels: Option<f64>,
    },
    /// The intrinsics are those of another image size.
    #[error(
        "{id}: its pictures are {width}x{height}, but the principal point of the camera file's \
         intrinsics, ({cx}, {cy}), is far from their middle: was it calibrated at another \
         resolution?"
    )]
    OtherIntrinsics {
        /// Serial number of the camera.
        id: String,
        /// Columns of its images.
        width: u16,
        /// Rows of its images.
        height: u16,
        /// Column of the principal point, pixels.
        cx: f64,
        /// Row of the principal point, pixels.
        cy: f64,
    },
}

impl RealsenseSource {
    /// Opens `target` and starts it. The frames have the device's intrinsics, or `calibrated` with
    /// the device's depth scale. `settings` apply to a camera only.
    ///
    /// # Errors
    /// As [`Camera::open`]; where the device's lens has a distortion, or calibrated intrinsics
    /// belong to images of another size.
    pub fn open(
        library: &RealSense,
        target: &Target,
        settings: Settings,
        calibrated: Option<Intrinsics>,
    ) -> Result<Self, RealsenseSourceError> {
        let camera = Camera::open(library, target, settings)?;
        let intrinsics = intrinsics(camera.opened(), calibrated)?;
        let clock = match target {
            Target::First | Target::Serial(_) => Clock::Host(LiveClock::since(camera.start())),
            Target::Recording(_) => Clock::Recording(0.0),
        };
        Ok(Self { camera, intrinsics, clock })
    }

    /// Returns the description of the camera or recording.
    pub fn opened(&self) -> &Opened {
        self.camera.opened()
    }

    /// Returns the intrinsics of the frames.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Makes a frame of a pair of images.
    fn frame(&self, pair: Pair) -> Result<RgbdFrame, SourceError> {
        let mode = self.camera.opened().mode;
        let [width, height] = [mode.width, mode.height].map(usize::from);
        let bgr = |rgb: &[u8; 3]| [rgb[2], rgb[1], rgb[0]];
        let colour = pair.colour.as_chunks().0.iter().map(bgr).collect();
        let colour = Image::new(width, height, colour).map_err(RealsenseSourceError::from)?;
        let depth = Image::new(width, height, pair.depth).map_err(RealsenseSourceError::from)?;
        let frame = RgbdFrame::new(pair.time, colour, depth, self.intrinsics);
        Ok(frame.map_err(InvalidFrame::of(&self.camera.opened().id))?)
    }
}

impl CameraSource for RealsenseSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(pair) = self.camera.next_pair().map_err(lost)? else { return Ok(None) };
        if let Clock::Recording(now) = &mut self.clock {
            *now = pair.time;
        }
        self.frame(pair).map(Some)
    }

    fn now(&self) -> f64 {
        match &self.clock {
            Clock::Host(clock) => clock.now(),
            Clock::Recording(now) => *now,
        }
    }

    fn is_live(&self) -> bool {
        matches!(self.clock, Clock::Host(_))
    }

    fn clock(&self) -> Option<LiveClock> {
        match &self.clock {
            Clock::Host(clock) => Some(clock.clone()),
            Clock::Recording(_) => None,
        }
    }
}

impl From<RealsenseSourceError> for SourceError {
    fn from(error: RealsenseSourceError) -> Self {
        Self::new(error)
    }
}

/// Converts an error of the camera. The time stamp of a lost colour picture is that of the lost
/// frame.
fn lost(error: RealsenseError) -> SourceError {
    let stamp = match error {
        RealsenseError::Unpaired { sensor: Sensor::Colour, time, .. } => Some(time),
        _ => None,
    };
    let is_transient = error.is_transient();
    let cause = RealsenseSourceError::from(error);
    let error = if is_transient { SourceError::new(cause) } else { SourceError::over(cause) };
    stamp.into_iter().fold(error, SourceError::with_stamp)
}

/// Returns the intrinsics of the device's images: `calibrated`, else the device's.
fn intrinsics(
    opened: &Opened,
    calibrated: Option<Intrinsics>,
) -> Result<Intrinsics, RealsenseSourceError> {
    let (mode, depth_scale) = (opened.mode, 1.0 / opened.depth_unit);
    let id = || opened.id.clone();
    if let Some(known) = calibrated {
        let [width, height] = [mode.width, mode.height].map(usize::from);
        if resolution::fits(&known, ImageSize { width, height }) {
            return Ok(Intrinsics { depth_scale, ..known });
        }
        let (width, height) = (mode.width, mode.height);
        let Intrinsics { cx, cy, .. } = known;
        return Err(RealsenseSourceError::OtherIntrinsics { id: id(), width, height, cx, cy });
    }
    let plumb_realsense::Intrinsics { fx, fy, cx, cy, .. } = opened.intrinsics;
    match opened.intrinsics.largest_distortion(mode) {
        Some(pixels) if pixels <= NEGLIGIBLE_DISTORTION => {
            Ok(Intrinsics { fx, fy, cx, cy, depth_scale })
        }
        pixels => Err(RealsenseSourceError::Distortion { id: id(), pixels }),
    }
}

#[cfg(test)]
mod tests {
    use plumb_realsense::{DistortionModel, Mode};

    use super::*;

    fn opened(k1: f64) -> Opened {
        let coefficients = [k1, 0.0, 0.0, 0.0, 0.0];
        let model = DistortionModel::InverseBrownConrady;
        let (fx, fy, cx, cy) = (605.0, 606.0, 322.0, 241.0);
        Opened {
            id: "0815".to_owned(),
            name: "a camera".to_owned(),
            mode: Mode { width: 640, height: 480, rate: 30 },
            depth_unit: 0.0001,
            intrinsics: plumb_realsense::Intrinsics { fx, fy, cx, cy, model, coefficients },
        }
    }

    #[test]
    fn the_devices_intrinsics_are_taken_without_distortion() {
        let got = intrinsics(&opened(0.0), None).unwrap();
        let expected =
            Intrinsics { fx: 605.0, fy: 606.0, cx: 322.0, cy: 241.0, depth_scale: 10_000.0 };
        assert_eq!(got, expected);
        let text = intrinsics(&opened(0.1), None).unwrap_err().to_string();
        assert!(text.contains("0815") && text.contains("px"), "{text}");
    }

    #[test]
    fn calibrated_intrinsics_take_the_devices_depth_scale() {
        let known = Intrinsics { fx: 600.0, fy: 601.0, cx: 318.0, cy: 242.0, depth_scale: 1000.0 };
        let got = intrinsics(&opened(0.1), Some(known)).unwrap();
        assert_eq!(got, Intrinsics { depth_scale: 10_000.0, ..known });
        let other = Intrinsics { cx: 959.5, ..known };
        let text = intrinsics(&opened(0.0), Some(other)).unwrap_err().to_string();
        assert!(text.contains("640x480") && text.contains("959.5"), "{text}");
    }
}
