//! Cameras and recordings through OpenNI2 as sources of frames.

use plumb_frame::camera::Intrinsics;
use plumb_frame::clock::DeviceClock;
use plumb_frame::file_intrinsics::{FileIntrinsics, UnfitIntrinsics};
use plumb_frame::pairing::Sensor;
use plumb_frame::source::SourceError;
use plumb_pictures::pair::PairSource;
use thiserror::Error;

use crate::camera::Camera;
use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::settings::{Opened, Settings, Target};

/// Source of the intrinsics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IntrinsicsSource {
    /// These calibrated intrinsics, with the depth scale of the device.
    Calibrated(FileIntrinsics),
    /// The field of view that the device's colour camera was designed for.
    FieldOfView,
}

/// Failure to open a camera or a recording through OpenNI2, or to read it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenniSourceError {
    /// OpenNI2, the camera or the recording fails.
    #[error(transparent)]
    Openni(#[from] OpenniError),
    /// The device's own intrinsics are to be used, but it does not state its field of view.
    #[error(
        "{uri}: it does not state its field of view: write the intrinsics into the camera file, \
         and leave out `intrinsics = \"device\"`"
    )]
    NoIntrinsics {
        /// URI of the camera.
        uri: String,
    },
    /// The intrinsics do not fit the images.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
}

/// Opens `target` and starts it. `settings` apply to a camera only.
///
/// # Errors
/// As [`Camera::open`]; where the device does not state its field of view, or calibrated
/// intrinsics do not fit its images.
pub fn open_source(
    openni: &OpenNi,
    target: &Target,
    settings: Settings,
    source: IntrinsicsSource,
) -> Result<PairSource<Camera>, OpenniSourceError> {
    let camera = Camera::open(openni, target, settings)?;
    let intrinsics = intrinsics(camera.opened(), source)?;
    let clock = match target {
        Target::First | Target::Uri(_) => DeviceClock::since(camera.start()),
        Target::Recording(_) => DeviceClock::recording(),
    };
    let opened = camera.opened();
    let (name, size) = (opened.uri.clone(), opened.mode.size());
    let next_pair = |camera: &mut Camera| camera.next_pair().map_err(lost);
    Ok(PairSource { camera, next_pair, name, size, intrinsics, clock })
}

impl From<OpenniSourceError> for SourceError {
    fn from(error: OpenniSourceError) -> Self {
        match error {
            OpenniSourceError::Openni(error) => lost(error),
            _ => Self::new(error),
        }
    }
}

/// Converts an error of the camera. The time stamp of a lost colour picture is
/// that of the lost frame.
fn lost(error: OpenniError) -> SourceError {
    let stamp = match error {
        OpenniError::Unpaired { sensor: Sensor::Colour, time, .. }
        | OpenniError::OutOfStep { time, .. } => Some(time),
        _ => None,
    };
    let is_transient = error.is_transient();
    SourceError::lost(OpenniSourceError::from(error), is_transient).with_stamp(stamp)
}

/// Returns the intrinsics of the device's images.
fn intrinsics(opened: &Opened, source: IntrinsicsSource) -> Result<Intrinsics, OpenniSourceError> {
    let (width, height) = (f64::from(opened.mode.width), f64::from(opened.mode.height));
    let depth_scale = opened.unit.per_metre();
    match source {
        IntrinsicsSource::Calibrated(known) => {
            let known = known.of_pictures(opened.mode.size(), &opened.uri)?;
            Ok(Intrinsics { depth_scale, ..known })
        }
        IntrinsicsSource::FieldOfView => {
            let (horizontal, vertical) = opened
                .field_of_view
                .ok_or_else(|| OpenniSourceError::NoIntrinsics { uri: opened.uri.clone() })?;
            // The field of view spans the whole image, from half a pixel before the first one to
            // half a pixel behind the last one.
            Ok(Intrinsics {
                fx: width / 2.0 / (horizontal / 2.0).tan(),
                fy: height / 2.0 / (vertical / 2.0).tan(),
                cx: (width - 1.0) / 2.0,
                cy: (height - 1.0) / 2.0,
                depth_scale,
                distortion: None,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::settings::{DepthUnit, Mode};

    use super::*;

    fn opened(field_of_view: Option<(f64, f64)>) -> Opened {
        Opened {
            uri: "camera".to_owned(),
            name: "a camera".to_owned(),
            mode: Mode { width: 640, height: 480, rate: 30, format: 200 },
            unit: DepthUnit::Tenth,
            field_of_view,
            notes: Vec::new(),
        }
    }

    #[test]
    fn calibrated_intrinsics_take_the_devices_depth_scale() {
        let known = Intrinsics {
            fx: 530.0,
            fy: 531.0,
            cx: 318.0,
            cy: 242.0,
            depth_scale: 5000.0,
            distortion: None,
        };
        let got = intrinsics(&opened(None), IntrinsicsSource::Calibrated(known.into())).unwrap();
        assert_eq!(got, Intrinsics { depth_scale: 10_000.0, ..known });
        let other = Intrinsics { cx: 959.5, ..known };
        let other = IntrinsicsSource::Calibrated(other.into());
        let error = intrinsics(&opened(None), other).unwrap_err().to_string();
        assert!(error.contains("640x480") && error.contains("959.5"), "{error}");
    }

    #[test]
    fn a_field_of_view_is_a_pinhole_camera() {
        let angles = (2.0 * (320.0_f64 / 525.0).atan(), 2.0 * (240.0_f64 / 520.0).atan());
        let got = intrinsics(&opened(Some(angles)), IntrinsicsSource::FieldOfView).unwrap();
        assert!((got.fx - 525.0).abs() < 1e-9 && (got.fy - 520.0).abs() < 1e-9, "{got:?}");
        assert_eq!((got.cx, got.cy), (319.5, 239.5));
        let error =
            intrinsics(&opened(None), IntrinsicsSource::FieldOfView).unwrap_err().to_string();
        assert!(error.contains("field of view") && error.contains("camera file"), "{error}");
    }
}
