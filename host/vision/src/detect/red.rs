//! The detector `red`, the paper's: a difference of Gaussians of the ball's size on the red
//! channel.
//!
//! It serves for comparison. Anything bright of that size (a lamp, a white ball, a window) gives as
//! strong a response as the ball, and it cannot tell that there is no ball. The default detector is
//! [`ShapeDetector`](super::ball::ShapeDetector).

use opencv::core::{
    CV_32F, Mat, MatTraitConst, Point, Size, extract_channel, min_max_loc, subtract_def,
};
use opencv::imgproc::gaussian_blur_def;

use super::shape::DetectionTrace;
use super::{BallDetector, DetectError, StageImage};
use crate::camera::Camera;
use crate::debug::draw_stages;
use crate::frame::RgbdFrame;
use crate::image::ColourImage;
use crate::localise::localise;
use crate::mat::borrow_colour;
use crate::observation::{BallObservation, Circle};

/// The red channel of a BGR image.
const RED_CHANNEL: i32 = 2;

/// Parameters of the difference of Gaussians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RedParameters {
    /// Standard deviation of the narrow Gaussian, in radii of the ball in the image: 12 pixels for
    /// a radius of 20 pixels. The Laplacian of Gaussian with the same zero crossings then has a
    /// standard deviation of 0.745 radii, near 1/√2, where the response of a disc is the largest.
    pub narrow_sigma: f64,
    /// Standard deviation of the wide Gaussian, in radii of the ball in the image: 1.6 times the
    /// narrow one (19.2 pixels for a radius of 20 pixels), the usual ratio to approximate a
    /// Laplacian of Gaussian.
    pub wide_sigma: f64,
    /// Least difference, grey levels. A ball with a contrast of c grey levels gives about 0.36 c.
    pub min_difference: f64,
}

impl RedParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self { narrow_sigma: 0.6, wide_sigma: 0.96, min_difference: 10.0 };
}

impl Default for RedParameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Difference of Gaussians on the red channel, in f32 and at full size (8 bits make plateaus).
///
/// The largest local maximum is the ball if it is high enough. Its place is a whole pixel and its
/// radius the expected one.
#[derive(Debug)]
pub struct RedDetector {
    camera: Camera,
    parameters: RedParameters,
    /// Expected radius of the ball, pixels.
    radius: f64,
    red: Mat,
    narrow: Mat,
    wide: Mat,
    difference: Mat,
}

impl RedDetector {
    /// Makes a detector for balls of about `radius` pixels (at least 1).
    pub fn new(camera: &Camera, radius: f64) -> Self {
        Self {
            camera: camera.clone(),
            parameters: RedParameters::DEFAULT,
            radius: radius.max(1.0),
            red: Mat::default(),
            narrow: Mat::default(),
            wide: Mat::default(),
            difference: Mat::default(),
        }
    }

    /// Makes a detector for the camera's ball at about `distance` metres.
    pub fn at_distance(camera: &Camera, distance: f64) -> Self {
        Self::new(camera, camera.intrinsics.fx * camera.ball_diameter / 2.0 / distance)
    }

    /// Returns the largest difference of Gaussians and its pixel: the best local maximum is the
    /// global one.
    fn peak(&mut self, colour: &ColourImage) -> opencv::Result<(Point, f64)> {
        let mut channel = Mat::default();
        extract_channel(&borrow_colour(colour)?, &mut channel, RED_CHANNEL)?;
        channel.convert_to_def(&mut self.red, CV_32F)?;
        let RedParameters { narrow_sigma, wide_sigma, .. } = self.parameters;
        let (narrow, wide) = (narrow_sigma * self.radius, wide_sigma * self.radius);
        gaussian_blur_def(&self.red, &mut self.narrow, Size::default(), narrow)?;
        gaussian_blur_def(&self.red, &mut self.wide, Size::default(), wide)?;
        subtract_def(&self.narrow, &self.wide, &mut self.difference)?;
        let (mut largest, mut at) = (0.0, Point::default());
        let mask = Mat::default();
        min_max_loc(&self.difference, None, Some(&mut largest), None, Some(&mut at), &mask)?;
        Ok((at, largest))
    }
}

impl BallDetector for RedDetector {
    fn name(&self) -> &'static str {
        "red"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let (at, score) = self.peak(frame.colour()).map_err(DetectError::processing)?;
        let circle = Circle::rough(f64::from(at.x), f64::from(at.y), self.radius);
        // The radius is the expected one, so that it gives no position without depth.
        let observation = || {
            let position = localise(&circle, frame, &self.camera);
            BallObservation { stamp: frame.time(), circle, score, position, depths: None }
        };
        Ok((score >= self.parameters.min_difference).then(observation))
    }

    /// Returns one image: the result.
    fn detect_with_stages(
        &mut self,
        frame: &RgbdFrame,
    ) -> Result<(Option<BallObservation>, Vec<StageImage>), DetectError> {
        let observation = self.detect(frame)?;
        let images = draw_stages(frame, &DetectionTrace::default(), observation.as_ref())?;
        Ok((observation, images))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::camera::Intrinsics;
    use crate::image::{Bgr, Image};

    const INTRINSICS: Intrinsics = Intrinsics {
        fx: 500.0,
        fy: 500.0,
        cx: 159.5,
        cy: 119.5,
        depth_scale: 1000.0,
        distortion: None,
    };

    fn detect(discs: &[Disc]) -> Option<BallObservation> {
        let pose = Isometry3::identity();
        let camera = Camera::new(INTRINSICS, pose, 0.06);
        RedDetector::new(&camera, 20.0).detect(&frame(discs)).unwrap()
    }

    /// A disc of one colour.
    struct Disc {
        at: (i32, i32),
        radius: i32,
        colour: Bgr,
    }

    fn frame(discs: &[Disc]) -> RgbdFrame {
        let colour = Image::from_fn(320, 240, |u, v| {
            let covers = |disc: &&Disc| {
                let (x, y) = (u as i32 - disc.at.0, v as i32 - disc.at.1);
                x * x + y * y <= disc.radius * disc.radius
            };
            discs.iter().find(covers).map_or([60; 3], |disc| disc.colour)
        });
        RgbdFrame::new(0.0, colour, Image::filled(320, 240, 0), INTRINSICS).unwrap()
    }

    #[test]
    fn the_disc_of_the_right_size_is_found_and_an_empty_image_has_none() {
        let colour = [20, 20, 200];
        let discs =
            [Disc { at: (200, 90), radius: 20, colour }, Disc { at: (60, 150), radius: 5, colour }];
        let ball = detect(&discs).unwrap();
        assert!(
            (ball.circle.u - 200.0).abs() <= 1.0 && (ball.circle.v - 90.0).abs() <= 1.0,
            "{ball:?}"
        );
        assert_eq!(ball.circle.radius, 20.0);
        // 140 grey levels of contrast.
        assert!((ball.score - 0.36 * 140.0).abs() < 5.0, "{ball:?}");
        assert_eq!(detect(&[]), None);
    }

    #[test]
    fn a_white_disc_is_taken_for_the_ball_as_by_the_paper_s() {
        let discs = [
            Disc { at: (200, 90), radius: 20, colour: [20, 20, 200] },
            Disc { at: (80, 150), radius: 20, colour: [255; 3] },
        ];
        let ball = detect(&discs).unwrap();
        assert!((ball.circle.u - 80.0).abs() <= 1.0, "{ball:?}");
    }
}
