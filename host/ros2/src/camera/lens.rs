//! Intrinsics from the description of a camera.

use plumb_cameras::source::resolution;
use plumb_frame::camera::{Distortion, DistortionCoefficients, Intrinsics};
use plumb_frame::image::ImageSize;

use super::error::Ros2CameraError;
use super::intake::check_size;
use crate::message::sensor::CameraInfo;

/// Name of the distortion model with the coefficients k1, k2, p1, p2, k3. The last one may be left
/// out, as in OpenCV.
const PLUMB_BOB: &str = "plumb_bob";

/// Returns the intrinsics of pictures of `size`, which `info` of the topic `topic` describes.
///
/// # Errors
/// Where the camera is not calibrated, describes pictures of another size, or has a distortion that
/// Plumb has no model for, or that has no inverse.
pub(crate) fn intrinsics(
    info: &CameraInfo,
    size: ImageSize,
    depth_scale: f64,
    topic: &str,
) -> Result<Intrinsics, Ros2CameraError> {
    check_size(topic, stated_size(info), size)?;
    let [fx, _, cx, _, fy, cy, ..] = info.k;
    let is_calibrated = [fx, fy].iter().all(|focal| focal.is_finite() && *focal > 0.0);
    if !is_calibrated {
        return Err(Ros2CameraError::NotCalibrated { topic: topic.to_owned(), fx, fy });
    }
    let distortion = distortion(info, topic)?;
    let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale, distortion };
    resolution::check(&intrinsics, size, topic)?;
    Ok(intrinsics)
}

/// Returns the size of the pictures that `info` describes.
pub(crate) fn stated_size(info: &CameraInfo) -> ImageSize {
    ImageSize { width: info.width as usize, height: info.height as usize }
}

/// Returns the distortion of the lens; `None` without one, whatever its model.
fn distortion(info: &CameraInfo, topic: &str) -> Result<Option<Distortion>, Ros2CameraError> {
    if info.d.iter().all(|coefficient| *coefficient == 0.0) {
        return Ok(None);
    }
    let topic = || topic.to_owned();
    if info.distortion_model != PLUMB_BOB {
        let model = info.distortion_model.clone();
        return Err(Ros2CameraError::DistortionModel { topic: topic(), model });
    }
    if let Some(&value) = info.d.iter().find(|coefficient| !coefficient.is_finite()) {
        return Err(Ros2CameraError::DistortionNumber { topic: topic(), value });
    }
    let coefficients = match *info.d.as_slice() {
        [k1, k2, p1, p2] => [k1, k2, p1, p2, 0.0],
        [k1, k2, p1, p2, k3] => [k1, k2, p1, p2, k3],
        _ => {
            let count = info.d.len();
            return Err(Ros2CameraError::DistortionCount { topic: topic(), count });
        }
    };
    Ok(Distortion::new(DistortionCoefficients::from_array(coefficients)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::sensor::RegionOfInterest;
    use crate::message::{Header, Time};

    const SIZE: ImageSize = ImageSize { width: 640, height: 480 };

    fn info(model: &str, d: &[f64]) -> CameraInfo {
        let header = Header { stamp: Time::from_nanoseconds(0), frame_id: String::new() };
        let roi =
            RegionOfInterest { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false };
        CameraInfo {
            header,
            height: 480,
            width: 640,
            distortion_model: model.to_owned(),
            d: d.to_vec(),
            k: [605.0, 0.0, 322.0, 0.0, 606.0, 241.0, 0.0, 0.0, 1.0],
            r: [0.0; 9],
            p: [0.0; 12],
            binning_x: 0,
            binning_y: 0,
            roi,
        }
    }

    fn refusal(info: &CameraInfo) -> String {
        let error = intrinsics(info, SIZE, 1000.0, "/info").unwrap_err();
        plumb_cameras::error_chain::ErrorChain(&error).to_string()
    }

    #[test]
    fn the_matrix_and_the_distortion_are_taken() {
        let plain = intrinsics(&info(PLUMB_BOB, &[0.0; 5]), SIZE, 1000.0, "/info").unwrap();
        let expected = Intrinsics {
            fx: 605.0,
            fy: 606.0,
            cx: 322.0,
            cy: 241.0,
            depth_scale: 1000.0,
            distortion: None,
        };
        assert_eq!(plain, expected);
        let d = [0.05, -0.1, 0.001, -0.002, 0.03];
        let bent = intrinsics(&info(PLUMB_BOB, &d), SIZE, 1000.0, "/info").unwrap();
        let coefficients = bent.distortion.map(|it| it.coefficients().to_array());
        assert_eq!(coefficients, Some(d));
        // A camera that rectifies its pictures names any model.
        assert!(intrinsics(&info("equidistant", &[0.0; 4]), SIZE, 0.0, "/info").is_ok());
    }

    #[test]
    fn four_coefficients_of_plumb_bob_are_those_without_k3() {
        let four = [0.05, -0.1, 0.001, -0.002];
        let bent = intrinsics(&info(PLUMB_BOB, &four), SIZE, 1000.0, "/info").unwrap();
        let coefficients = bent.distortion.map(|it| it.coefficients().to_array());
        assert_eq!(coefficients, Some([0.05, -0.1, 0.001, -0.002, 0.0]));
        for count in [1, 3, 6, 8] {
            let text = refusal(&info(PLUMB_BOB, &vec![0.01; count]));
            assert!(text.contains(&format!("{count} coefficients")), "{text}");
            assert!(text.contains("/info") && text.contains("4 or 5"), "{text}");
        }
    }

    #[test]
    fn coefficients_that_are_no_finite_numbers_are_named() {
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let text = refusal(&info(PLUMB_BOB, &[0.05, wrong, 0.0, 0.0, 0.0]));
            assert!(text.contains(&wrong.to_string()) && text.contains("finite"), "{text}");
            assert!(text.contains("/info"), "{text}");
        }
    }

    #[test]
    fn what_the_camera_model_cannot_do_is_refused_with_the_topic() {
        for (model, d) in [("equidistant", &[0.1; 4][..]), ("rational_polynomial", &[0.1; 8])] {
            let text = refusal(&info(model, d));
            assert!(text.contains(model) && text.contains("/info"), "{text}");
        }
        let folded = refusal(&info(PLUMB_BOB, &[-3.0, 0.0, 0.0, 0.0, 0.0]));
        assert!(folded.contains("/info"), "{folded}");
        let uncalibrated = refusal(&CameraInfo { k: [0.0; 9], ..info(PLUMB_BOB, &[]) });
        assert!(uncalibrated.contains("not calibrated"), "{uncalibrated}");
        let other = refusal(&CameraInfo { width: 1280, ..info(PLUMB_BOB, &[]) });
        assert!(other.contains("1280x480"), "{other}");
    }
}
