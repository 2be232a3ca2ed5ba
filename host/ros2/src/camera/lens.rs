//! Intrinsics from the description of a camera.

use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_frame::camera::{
    CoefficientsError, Distortion, DistortionCoefficients, Intrinsics, is_of_angles,
};
use plumb_frame::file_intrinsics;
use plumb_frame::image::ImageSize;

use super::error::Ros2CameraError;
use super::intake::{check_size, is_one_frame};
use crate::message::sensor::CameraInfo;

/// Name of the distortion model with the coefficients k1, k2, p1, p2, k3. The last one may be left
/// out, as in OpenCV.
const PLUMB_BOB: &str = "plumb_bob";

/// Name of the distortion model that has three more coefficients, k4, k5, k6.
const RATIONAL: &str = "rational_polynomial";

/// Names, within their namespace, of the topics of rectified pictures that image_proc publishes.
const RECTIFIED: [&str; 2] = ["image_rect", "image_rect_color"];

/// Returns the intrinsics of pictures of `size`, which `info` of a camera with these `settings`
/// describes.
///
/// # Errors
/// Where the camera is not calibrated, describes pictures of another size, or has a distortion that
/// Plumb has no model for, or that has no inverse; where the pictures are rectified by their name
/// and not by the settings.
pub(crate) fn intrinsics(
    info: &CameraInfo,
    size: ImageSize,
    depth_scale: f64,
    settings: &Ros2CameraSettings,
) -> Result<Intrinsics, Ros2CameraError> {
    let topic = settings.info.as_str();
    let window = Window::of(info, topic)?;
    check_size(topic, window.size, size)?;
    let [fx, cx, fy, cy] = window.matrix(matrix(info, settings.rectified));
    let is_calibrated = [fx, fy].iter().all(|focal| focal.is_finite() && *focal > 0.0);
    if !is_calibrated {
        return Err(Ros2CameraError::NotCalibrated { topic: topic.to_owned(), fx, fy });
    }
    let distortion = if settings.rectified || !has_distortion(info) {
        None
    } else if is_rectified(&settings.colour) {
        return Err(Ros2CameraError::Rectified { topic: settings.colour.clone() });
    } else {
        distortion(info, topic)?
    };
    let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale, distortion };
    file_intrinsics::check(&intrinsics, size, topic)?;
    Ok(intrinsics)
}

/// Window of the sensor that the pictures show, and its binning (REP 104). The matrices of a
/// description are those of the whole sensor.
struct Window {
    /// First column and row.
    offset: [u32; 2],
    /// Columns and rows of the sensor in one of the picture.
    binning: [u32; 2],
    /// Size of the pictures.
    size: ImageSize,
}

impl Window {
    /// Returns the window that `info`, which came on `topic`, describes: the whole sensor where its
    /// width and height are 0.
    ///
    /// # Errors
    /// [`Ros2CameraError::Window`] where it is not on the sensor.
    fn of(info: &CameraInfo, topic: &str) -> Result<Self, Ros2CameraError> {
        let roi = &info.roi;
        let of_axis = |name, offset: u32, length: u32, whole: u32, binning: u32| {
            let shown = if length == 0 { whole } else { length };
            if u64::from(offset) + u64::from(shown) > u64::from(whole) {
                let topic = topic.to_owned();
                return Err(Ros2CameraError::Window { topic, name, offset, length: shown, whole });
            }
            let binning = binning.max(1);
            Ok((binning, (shown / binning) as usize))
        };
        let (bx, width) =
            of_axis("roi.x_offset", roi.x_offset, roi.width, info.width, info.binning_x)?;
        let (by, height) =
            of_axis("roi.y_offset", roi.y_offset, roi.height, info.height, info.binning_y)?;
        let (offset, binning) = ([roi.x_offset, roi.y_offset], [bx, by]);
        Ok(Self { offset, binning, size: ImageSize { width, height } })
    }

    /// Returns fx, cx, fy and cy of the pictures from those of the whole sensor, pixels.
    fn matrix(&self, [fx, cx, fy, cy]: [f64; 4]) -> [f64; 4] {
        let ([x, y], [bx, by]) = (self.offset.map(f64::from), self.binning.map(f64::from));
        [fx / bx, (cx - x) / bx, fy / by, (cy - y) / by]
    }
}

/// Returns the size of the pictures that `info` describes; `None` where its window is not on the
/// sensor.
pub(crate) fn picture_size(info: &CameraInfo) -> Option<ImageSize> {
    Window::of(info, "").ok().map(|window| window.size)
}

/// Checks whether two descriptions have the same frame, size, window, lens and projection.
pub(crate) fn is_same(a: &CameraInfo, b: &CameraInfo) -> bool {
    // By their bits: a number that is none is the same as itself.
    let numbers = |info: &CameraInfo| {
        let numbers = info.d.iter().chain(&info.k).chain(&info.p);
        numbers.map(|number| number.to_bits()).collect::<Vec<_>>()
    };
    let sizes = |it: &CameraInfo| (it.width, it.height, it.binning_x, it.binning_y, it.roi.clone());
    is_one_frame(&a.header.frame_id, &b.header.frame_id)
        && sizes(a) == sizes(b)
        && a.distortion_model == b.distortion_model
        && numbers(a) == numbers(b)
}

/// Returns fx, cx, fy and cy of the pictures as the lens shows them (`k`), or of `rectified` ones
/// (`p`), pixels.
fn matrix(info: &CameraInfo, rectified: bool) -> [f64; 4] {
    if rectified {
        let [fx, _, cx, _, _, fy, cy, ..] = info.p;
        [fx, cx, fy, cy]
    } else {
        let [fx, _, cx, _, fy, cy, ..] = info.k;
        [fx, cx, fy, cy]
    }
}

/// Checks whether the lens has a distortion: a fisheye lens always has.
fn has_distortion(info: &CameraInfo) -> bool {
    is_of_angles(&info.distortion_model) || info.d.iter().any(|coefficient| *coefficient != 0.0)
}

/// Checks whether a topic of pictures has the name of one with rectified pictures.
fn is_rectified(topic: &str) -> bool {
    let raw = topic.strip_suffix("/compressed").unwrap_or(topic);
    raw.rsplit('/').next().is_some_and(|name| RECTIFIED.contains(&name))
}

/// Returns the distortion of a lens that has one. A model with more coefficients, those after the
/// fifth 0, is `plumb_bob`.
fn distortion(info: &CameraInfo, topic: &str) -> Result<Option<Distortion>, Ros2CameraError> {
    let topic = || topic.to_owned();
    let coefficients = DistortionCoefficients::from_slice(&info.d);
    let is_higher = matches!(coefficients, Err(CoefficientsError::Higher { .. }));
    let is_plumb_bob =
        info.distortion_model == PLUMB_BOB || info.distortion_model == RATIONAL && !is_higher;
    if !is_plumb_bob {
        let model = info.distortion_model.clone();
        return Err(Ros2CameraError::DistortionModel { topic: topic(), model });
    }
    coefficients.map(Distortion::new).map_err(|error| match error {
        CoefficientsError::Number(value) => {
            Ros2CameraError::DistortionNumber { topic: topic(), value }
        }
        CoefficientsError::Count(_) | CoefficientsError::Higher { .. } => {
            Ros2CameraError::DistortionCount { topic: topic(), count: info.d.len() }
        }
    })
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

    fn settings() -> Ros2CameraSettings {
        Ros2CameraSettings { info: "/info".to_owned(), ..Ros2CameraSettings::default() }
    }

    fn raw(info: &CameraInfo) -> Result<Intrinsics, Ros2CameraError> {
        intrinsics(info, SIZE, 1000.0, &settings())
    }

    fn refusal(info: &CameraInfo) -> String {
        plumb_config::error_chain::ErrorChain(&raw(info).unwrap_err()).to_string()
    }

    #[test]
    fn the_matrix_and_the_distortion_are_taken() {
        let plain = raw(&info(PLUMB_BOB, &[0.0; 5])).unwrap();
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
        let bent = raw(&info(PLUMB_BOB, &d)).unwrap();
        let coefficients = bent.distortion.map(|it| it.coefficients().to_array());
        assert_eq!(coefficients, Some(d));
        // A camera without distortion names any model of a pinhole camera.
        assert!(raw(&info("inverse_brown_conrady", &[0.0; 4])).is_ok());
    }

    #[test]
    fn rectified_pictures_have_the_projection_and_no_distortion() {
        let mut bent = info("rational_polynomial", &[0.1; 8]);
        bent.p = [590.0, 0.0, 318.0, 0.0, 0.0, 592.0, 239.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let rectified = Ros2CameraSettings { rectified: true, ..settings() };
        let found = intrinsics(&bent, SIZE, 1000.0, &rectified).unwrap();
        let (fx, fy, cx, cy) = (590.0, 592.0, 318.0, 239.0);
        let depth_scale = 1000.0;
        assert_eq!(found, Intrinsics { fx, fy, cx, cy, depth_scale, distortion: None });
        bent.p = [0.0; 12];
        let uncalibrated = intrinsics(&bent, SIZE, 1000.0, &rectified).unwrap_err().to_string();
        assert!(uncalibrated.contains("not calibrated"), "{uncalibrated}");
    }

    #[test]
    fn a_topic_of_rectified_pictures_is_not_taken_for_the_raw_one() {
        let bent = info(PLUMB_BOB, &[0.05, -0.1, 0.001, -0.002, 0.03]);
        for name in ["image_rect", "image_rect_color", "image_rect/compressed"] {
            let named = Ros2CameraSettings { colour: format!("/camera/{name}"), ..settings() };
            let text = intrinsics(&bent, SIZE, 1000.0, &named).unwrap_err().to_string();
            assert!(text.contains(name) && text.contains("rectified = true"), "{text}");
            let straight = info(PLUMB_BOB, &[0.0; 5]);
            assert!(intrinsics(&straight, SIZE, 1000.0, &named).is_ok());
        }
        // realsense-ros gives the D405's raw pictures this name.
        let colour = "/camera/camera/color/image_rect_raw".to_owned();
        let raw = Ros2CameraSettings { colour, ..settings() };
        assert!(intrinsics(&bent, SIZE, 1000.0, &raw).is_ok());
    }

    #[test]
    fn a_window_of_the_sensor_shifts_and_scales_the_matrix() {
        let mut part = info(PLUMB_BOB, &[]);
        part.roi = RegionOfInterest {
            x_offset: 40,
            y_offset: 30,
            height: 400,
            width: 500,
            do_rectify: false,
        };
        let of = |info: &CameraInfo, width, height| {
            intrinsics(info, ImageSize { width, height }, 1000.0, &settings())
        };
        let found = of(&part, 500, 400).unwrap();
        assert_eq!([found.fx, found.cx, found.fy, found.cy], [605.0, 282.0, 606.0, 211.0]);
        (part.binning_x, part.binning_y) = (2, 4);
        let found = of(&part, 250, 100).unwrap();
        assert_eq!([found.fx, found.cx, found.fy, found.cy], [302.5, 141.0, 151.5, 52.75]);
        // A driver that gives the window's size as that of the sensor.
        (part.binning_x, part.binning_y) = (0, 1);
        (part.width, part.height) = (500, 400);
        let error = of(&part, 500, 400).unwrap_err().to_string();
        assert!(error.contains("/info") && error.contains("roi.x_offset = 40"), "{error}");
    }

    #[test]
    fn descriptions_are_the_same_whatever_their_time() {
        let mut first = info(PLUMB_BOB, &[0.05, -0.1, 0.001, -0.002]);
        first.header.frame_id = "color_optical".to_owned();
        let mut later = first.clone();
        later.header.stamp = Time::from_nanoseconds(1);
        assert!(is_same(&first, &later));
        later.p[0] = f64::NAN;
        assert!(is_same(&later, &later.clone()));
        let changes: [fn(&mut CameraInfo); 7] = [
            |it| it.header.frame_id = "infra1_optical".to_owned(),
            |it| it.width = 1280,
            |it| it.d[0] = 0.06,
            |it| it.k[0] = 606.0,
            |it| it.p[0] = 1.0,
            |it| it.binning_y = 2,
            |it| it.roi.x_offset = 1,
        ];
        for change in changes {
            let mut other = first.clone();
            change(&mut other);
            assert!(!is_same(&first, &other));
        }
    }

    #[test]
    fn four_coefficients_of_plumb_bob_are_those_without_k3() {
        let four = [0.05, -0.1, 0.001, -0.002];
        let bent = raw(&info(PLUMB_BOB, &four)).unwrap();
        let coefficients = bent.distortion.map(|it| it.coefficients().to_array());
        assert_eq!(coefficients, Some([0.05, -0.1, 0.001, -0.002, 0.0]));
        for (model, zeros) in [(PLUMB_BOB, 3), (RATIONAL, 3), (RATIONAL, 9), (PLUMB_BOB, 0)] {
            let d = [&four[..], &[0.03], &vec![0.0; zeros]].concat();
            let bent = raw(&info(model, &d)).unwrap();
            let coefficients = bent.distortion.map(|it| it.coefficients().to_array());
            assert_eq!(coefficients, Some([0.05, -0.1, 0.001, -0.002, 0.03]), "{model}");
        }
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
        for (model, d) in [
            ("equidistant", &[0.1; 4][..]),
            ("equidistant", &[0.0; 4]),
            ("rational_polynomial", &[0.1; 8]),
        ] {
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
