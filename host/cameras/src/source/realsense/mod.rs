//! Intel RealSense cameras and their recordings (the crate `plumb-realsense`).

use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{Image, ImageError, ImageSize};
use plumb_realsense::{Camera, Opened, Pair, RealsenseError, Sensor};
use thiserror::Error;

use super::camera_source::CameraSource;
use super::clock::{DeviceClock, LiveClock};
use super::error::{InvalidFrame, SourceError};
use super::resolution::{self, OtherResolution};
use super::rgb;

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
    clock: DeviceClock,
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
    #[error(transparent)]
    OtherIntrinsics(#[from] OtherResolution),
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
            Target::First | Target::Serial(_) => DeviceClock::since(camera.start()),
            Target::Recording(_) => DeviceClock::recording(),
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
        let colour = Image::new(width, height, rgb::pixels(&pair.colour))
            .map_err(RealsenseSourceError::from)?;
        let depth = Image::new(width, height, pair.depth).map_err(RealsenseSourceError::from)?;
        let frame = RgbdFrame::new(pair.time, colour, depth, self.intrinsics);
        Ok(frame.map_err(InvalidFrame::of(&self.camera.opened().id))?)
    }
}

impl CameraSource for RealsenseSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(pair) = self.camera.next_pair().map_err(lost)? else { return Ok(None) };
        self.clock.follow(pair.time);
        self.frame(pair).map(Some)
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn is_live(&self) -> bool {
        self.clock.live().is_some()
    }

    fn clock(&self) -> Option<LiveClock> {
        self.clock.live().cloned()
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
    if let Some(known) = calibrated {
        let [width, height] = [mode.width, mode.height].map(usize::from);
        resolution::check(&known, ImageSize { width, height }, &opened.id)?;
        return Ok(Intrinsics { depth_scale, ..known });
    }
    let plumb_realsense::Intrinsics { fx, fy, cx, cy, .. } = opened.intrinsics;
    match opened.intrinsics.largest_distortion(mode) {
        Some(pixels) if pixels <= NEGLIGIBLE_DISTORTION => {
            Ok(Intrinsics { fx, fy, cx, cy, depth_scale })
        }
        pixels => Err(RealsenseSourceError::Distortion { id: opened.id.clone(), pixels }),
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
