//! A camera or a recording through OpenNI2 (the crate `plumb-openni`) as a source.

use plumb_openni::{Camera, Opened, OpenniError, Pair};
use plumb_vision::camera::Intrinsics;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::Image;

use super::{Live, Source, SourceError};

pub use plumb_openni::{LIBRARY_VARIABLE, OpenNi, Settings, Target};

/// Where the intrinsics are from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Measured: these, but for the scale of depth, which the device tells.
    Calibrated(Intrinsics),
    /// The field of view of the device's colour camera; no better than it is built.
    FieldOfView,
}

/// Colour and registered depth through OpenNI2.
///
/// Time stamps are seconds: of a camera on the host's clock since it was opened, of a recording on
/// its own from 0. After an error that is not [`SourceError::is_final`] the next call goes on with
/// the next frame.
#[derive(Debug)]
pub struct OpenniSource {
    camera: Camera,
    intrinsics: Intrinsics,
}

impl OpenniSource {
    /// Opens `target` as `settings` say, which only hold for a camera, and starts it.
    ///
    /// # Errors
    /// As [`Camera::open`]; where `lens` is not known of the device, or belongs to pictures of
    /// another size.
    pub fn open(
        openni: &OpenNi,
        target: &Target,
        settings: Settings,
        lens: Lens,
    ) -> Result<Self, SourceError> {
        let camera = Camera::open(openni, target, settings)?;
        let intrinsics = intrinsics(camera.opened(), lens)?;
        Ok(Self { camera, intrinsics })
    }

    /// What was opened.
    pub fn opened(&self) -> &Opened {
        self.camera.opened()
    }

    /// The intrinsics of its frames.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    fn frame(&self, pair: &Pair) -> Result<RgbdFrame, SourceError> {
        let mode = self.camera.opened().mode;
        let size = [mode.width, mode.height].map(usize::from);
        let bgr = |rgb: &[u8; 3]| [rgb[2], rgb[1], rgb[0]];
        let colour = pair.colour.as_chunks().0.iter().map(bgr).collect();
        let colour = Image::new(size[0], size[1], colour)?;
        let depth = Image::new(size[0], size[1], pair.depth.clone())?;
        RgbdFrame::new(pair.time, colour, depth, self.intrinsics)
            .map_err(|error| SourceError::Frame { what: self.camera.opened().uri.clone(), error })
    }
}

impl Source for OpenniSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        match self.camera.next_pair() {
            Ok(Some(pair)) => self.frame(&pair).map(Some),
            Ok(None) => Ok(None),
            Err(error) => Err(lost(error)),
        }
    }
}

impl Live for OpenniSource {
    fn now(&self) -> f64 {
        self.camera.now()
    }
}

/// A colour picture that is lost is a frame that is lost: its time is known.
fn lost(error: OpenniError) -> SourceError {
    match error {
        OpenniError::Alone { sensor: plumb_openni::Sensor::Colour, time, .. }
        | OpenniError::OutOfStep { time, .. } => {
            SourceError::At { time, error: Box::new(error.into()) }
        }
        _ => error.into(),
    }
}

/// How the device's pixels become points.
fn intrinsics(opened: &Opened, lens: Lens) -> Result<Intrinsics, SourceError> {
    let (width, height) = (f64::from(opened.mode.width), f64::from(opened.mode.height));
    let depth_scale = opened.unit.per_metre();
    match lens {
        Lens::Calibrated(known) => {
            let Intrinsics { cx, cy, .. } = known;
            // No lens is so far out of its sensor's middle; another resolution is.
            if (0.25..0.75).contains(&(cx / width)) && (0.25..0.75).contains(&(cy / height)) {
                return Ok(Intrinsics { depth_scale, ..known });
            }
            let (uri, mode) = (opened.uri.clone(), opened.mode);
            Err(SourceError::OtherIntrinsics {
                uri,
                width: mode.width,
                height: mode.height,
                cx,
                cy,
            })
        }
        Lens::FieldOfView => {
            let (horizontal, vertical) = opened
                .field_of_view
                .ok_or_else(|| SourceError::NoIntrinsics { uri: opened.uri.clone() })?;
            // The field of view is that of the whole picture, from half a pixel before the first to
            // half a pixel behind the last.
            Ok(Intrinsics {
                fx: width / 2.0 / (horizontal / 2.0).tan(),
                fy: height / 2.0 / (vertical / 2.0).tan(),
                cx: (width - 1.0) / 2.0,
                cy: (height - 1.0) / 2.0,
                depth_scale,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use plumb_openni::{DepthUnit, Mode};

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
    fn a_calibrated_lens_keeps_its_numbers_and_takes_the_devices_scale() {
        let known = Intrinsics { fx: 530.0, fy: 531.0, cx: 318.0, cy: 242.0, depth_scale: 5000.0 };
        let got = intrinsics(&opened(None), Lens::Calibrated(known)).unwrap();
        assert_eq!(got, Intrinsics { depth_scale: 10_000.0, ..known });
        let other = Intrinsics { cx: 959.5, ..known };
        let error = intrinsics(&opened(None), Lens::Calibrated(other)).unwrap_err().to_string();
        assert!(error.contains("640x480") && error.contains("959.5"), "{error}");
    }

    #[test]
    fn a_field_of_view_is_a_pinhole_camera() {
        let angles = (2.0 * (320.0_f64 / 525.0).atan(), 2.0 * (240.0_f64 / 520.0).atan());
        let got = intrinsics(&opened(Some(angles)), Lens::FieldOfView).unwrap();
        assert!((got.fx - 525.0).abs() < 1e-9 && (got.fy - 520.0).abs() < 1e-9, "{got:?}");
        assert_eq!((got.cx, got.cy), (319.5, 239.5));
        let error = intrinsics(&opened(None), Lens::FieldOfView).unwrap_err().to_string();
        assert!(error.contains("field of view") && error.contains("camera file"), "{error}");
    }
}
