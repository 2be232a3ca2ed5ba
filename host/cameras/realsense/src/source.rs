//! Intel RealSense cameras and their recordings as sources of frames.

use plumb_frame::camera::{Distortion, DistortionCoefficients, Intrinsics};
use plumb_frame::clock::DeviceClock;
use plumb_frame::file_intrinsics::{self, FileIntrinsics, UnfitIntrinsics};
use plumb_frame::pairing::Sensor;
use plumb_frame::source::SourceError;
use plumb_pictures::pair::PairSource;
use thiserror::Error;

use crate::camera::Camera;
use crate::error::RealsenseError;
use crate::library::RealSense;
use crate::settings::{self, DistortionModel, Opened, Settings, Target};

/// Largest error of the camera model that is accepted, pixels. The detector's error is of this
/// size.
const NEGLIGIBLE_ERROR: f64 = 0.5;

/// Failure to open a camera or a recording through librealsense2, or to read it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RealsenseSourceError {
    /// librealsense2, the camera or the recording fails.
    #[error(transparent)]
    Realsense(#[from] RealsenseError),
    /// The distortion of the colour sensor's lens is of a model that is not known.
    #[error(
        "{id}: its lens bends the picture by {} by the model {model}, and Plumb knows the model \
         Brown Conrady only. Choose another resolution; or, for a camera, set \
         `intrinsics = \"file\"` in [camera.realsense], and then run `plumb calibrate --lens`",
        .pixels.map_or_else(|| "an unknown amount".to_owned(), |pixels| format!("{pixels:.1} px"))
    )]
    Distortion {
        /// Serial number of the camera, or path of the recording.
        id: String,
        /// Model of the distortion.
        model: DistortionModel,
        /// Largest distortion, pixels; `None` for an unknown model.
        pixels: Option<f64>,
    },
    /// The intrinsics do not fit the images.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
}

/// Opens `target` and starts it. The frames have the device's intrinsics, or `calibrated` with
/// the device's depth scale. `settings` apply to a camera only.
///
/// # Errors
/// As [`Camera::open`]; where the device's distortion is of an unknown model, or the intrinsics
/// do not fit the images.
pub fn open_source(
    library: &RealSense,
    target: &Target,
    settings: Settings,
    calibrated: Option<FileIntrinsics>,
) -> Result<PairSource<Camera>, RealsenseSourceError> {
    let camera = Camera::open(library, target, settings)?;
    let intrinsics = intrinsics(camera.opened(), calibrated)?;
    let clock = match target {
        Target::First | Target::Serial(_) => DeviceClock::since(camera.start()),
        Target::Recording(_) => DeviceClock::recording(),
    };
    let opened = camera.opened();
    let (name, size) = (opened.id.clone(), opened.mode.size());
    let next_pair = |camera: &mut Camera| camera.next_pair().map_err(lost);
    Ok(PairSource { camera, next_pair, name, size, intrinsics, clock })
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
    SourceError::lost(RealsenseSourceError::from(error), is_transient).with_stamp(stamp)
}

/// Returns the intrinsics of the device's images: `calibrated`, else the device's.
fn intrinsics(
    opened: &Opened,
    calibrated: Option<FileIntrinsics>,
) -> Result<Intrinsics, RealsenseSourceError> {
    let depth_scale = 1.0 / opened.depth_unit;
    let size = opened.mode.size();
    match calibrated {
        Some(known) => {
            let known = known.of_pictures(size, &opened.id)?;
            Ok(Intrinsics { depth_scale, ..known })
        }
        None => {
            let settings::Intrinsics { fx, fy, cx, cy, .. } = opened.intrinsics;
            let distortion = distortion(opened)?;
            let device = Intrinsics { fx, fy, cx, cy, depth_scale, distortion };
            file_intrinsics::check(&device, size, &opened.id)?;
            Ok(device)
        }
    }
}

/// Returns the distortion that the device states.
///
/// The model Brown-Conrady is Plumb's. The modified one is the same but for the tangential part.
/// The library documents the inverse one as a map from the picture to the rays, but computes it as
/// the modified one (`rs2_project_point_to_pixel`, librealsense issues 1380 and 6382), also where
/// it aligns depth to colour. realsense-ros states its coefficients as `plumb_bob` without a
/// change (issue 2458).
fn distortion(opened: &Opened) -> Result<Option<Distortion>, RealsenseSourceError> {
    let settings::Intrinsics { model, coefficients, .. } = opened.intrinsics;
    let modification = match model {
        DistortionModel::BrownConrady => Some(0.0),
        DistortionModel::ModifiedBrownConrady | DistortionModel::InverseBrownConrady => {
            Some(opened.intrinsics.largest_modification(opened.mode))
        }
        _ => None,
    };
    if modification.is_some_and(|pixels| pixels <= NEGLIGIBLE_ERROR) {
        return Ok(Distortion::new(DistortionCoefficients::from_array(coefficients)));
    }
    match opened.intrinsics.largest_distortion(opened.mode) {
        Some(pixels) if pixels <= NEGLIGIBLE_ERROR => Ok(None),
        pixels => Err(RealsenseSourceError::Distortion { id: opened.id.clone(), model, pixels }),
    }
}

#[cfg(test)]
mod tests {
    use crate::settings::Mode;

    use super::*;

    fn opened(model: DistortionModel, coefficients: [f64; 5]) -> Opened {
        let (fx, fy, cx, cy) = (605.0, 606.0, 322.0, 241.0);
        Opened {
            id: "0815".to_owned(),
            name: "a camera".to_owned(),
            mode: Mode { width: 640, height: 480, rate: 30 },
            depth_unit: 0.0001,
            intrinsics: settings::Intrinsics { fx, fy, cx, cy, model, coefficients },
        }
    }

    /// Returns a device whose lens has the distortion `k1`, by a model that is not known.
    fn unknown(k1: f64) -> Opened {
        opened(DistortionModel::Other(3), [k1, 0.0, 0.0, 0.0, 0.0])
    }

    #[test]
    fn the_devices_intrinsics_are_taken() {
        let got = intrinsics(&unknown(0.0), None).unwrap();
        let (fx, fy, cx, cy) = (605.0, 606.0, 322.0, 241.0);
        let expected = Intrinsics { fx, fy, cx, cy, depth_scale: 10_000.0, distortion: None };
        assert_eq!(got, expected);
    }

    #[test]
    fn a_distortion_of_brown_and_conrady_is_taken() {
        use DistortionModel::{BrownConrady, InverseBrownConrady, ModifiedBrownConrady};

        let coefficients = [-0.2, 0.05, 0.001, 0.0005, 0.0];
        for model in [BrownConrady, ModifiedBrownConrady, InverseBrownConrady] {
            let got = intrinsics(&opened(model, coefficients), None).unwrap();
            let known = got.distortion.map(|lens| lens.coefficients().to_array());
            assert_eq!(known, Some(coefficients), "{model}");
        }
        // The corners have no ray.
        let folded = opened(BrownConrady, [-0.9, 0.0, 0.0, 0.0, 0.0]);
        let error = intrinsics(&folded, None).unwrap_err();
        assert!(matches!(error, RealsenseSourceError::UnfitIntrinsics(_)), "{error:?}");
    }

    #[test]
    fn a_distortion_of_another_model_is_refused_by_name() {
        let text = intrinsics(&unknown(0.1), None).unwrap_err().to_string();
        assert!(text.contains("0815") && text.contains("F-Theta"), "{text}");
        assert!(text.contains("unknown amount"), "{text}");
        let strong = opened(DistortionModel::InverseBrownConrady, [-0.4, 0.0, 0.05, 0.05, 0.0]);
        let text = intrinsics(&strong, None).unwrap_err().to_string();
        assert!(text.contains("Inverse Brown Conrady"), "{text}");
    }

    #[test]
    fn a_d455_is_taken_with_its_distortion() {
        // librealsense issue 9551, at 1280x720.
        let coefficients = [-0.0565, 0.0682, 0.0004, 0.0007, -0.0218];
        let (fx, fy, cx, cy) = (640.0, 640.0, 639.5, 359.5);
        let model = DistortionModel::InverseBrownConrady;
        let mut camera = opened(model, coefficients);
        camera.mode = Mode { width: 1280, height: 720, rate: 30 };
        camera.intrinsics = settings::Intrinsics { fx, fy, cx, cy, ..camera.intrinsics };
        let lens = intrinsics(&camera, None).unwrap().distortion.unwrap();
        assert_eq!(lens.coefficients().to_array(), coefficients);
    }

    #[test]
    fn calibrated_intrinsics_take_the_devices_depth_scale() {
        let (fx, fy, cx, cy) = (600.0, 601.0, 318.0, 242.0);
        let known = Intrinsics { fx, fy, cx, cy, depth_scale: 1000.0, distortion: None };
        let got = intrinsics(&unknown(0.1), Some(known.into())).unwrap();
        assert_eq!(got, Intrinsics { depth_scale: 10_000.0, ..known });
        let other = Intrinsics { cx: 959.5, ..known };
        let text = intrinsics(&unknown(0.0), Some(other.into())).unwrap_err().to_string();
        assert!(text.contains("640x480") && text.contains("959.5"), "{text}");
    }
}
