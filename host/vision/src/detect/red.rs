//! The paper's detector: a difference of Gaussians of the size of the ball, on the red channel.
//!
//! Kept to compare with: anything bright of that size (a lamp, a white ball, a window) answers as
//! strongly as the ball does, and it cannot tell that there is no ball. [`ShapeDetector`](super::shape::ShapeDetector)
//! is the default.

use opencv::core::{
    CV_32F, Mat, MatTraitConst, Point, Size, extract_channel, min_max_loc, subtract_def,
};
use opencv::imgproc::gaussian_blur_def;

use super::detector::{BallDetector, DetectError};
use crate::camera::Camera;
use crate::frame::RgbdFrame;
use crate::image::ColourImage;
use crate::mat::borrow_colour;
use crate::observation::{BallObservation, Circle};

/// Inner and outer standard deviation as parts of the ball's radius: 12 and 19.2 pixels at 20, a
/// ratio of 1.6.
const SIGMAS: [f64; 2] = [0.6, 0.96];
/// Grey levels that the difference must reach. A ball of contrast c gives about 0.36 c.
const THRESHOLD: f64 = 10.0;
/// Red is the third channel of BGR.
const RED: i32 = 2;

/// Difference of Gaussians on the red channel, in f32 and at full size (8 bits make plateaus); the
/// largest of its local maxima is the ball if it is above a threshold. Its place is a whole pixel,
/// its radius the expected one.
#[derive(Debug)]
pub struct RedDetector {
    camera: Camera,
    radius: f64,
    red: Mat,
    wide: [Mat; 2],
    difference: Mat,
}

impl RedDetector {
    /// Makes a detector for balls of about `radius` pixels (at least 1).
    pub fn new(camera: &Camera, radius: f64) -> Self {
        Self {
            camera: camera.clone(),
            radius: radius.max(1.0),
            red: Mat::default(),
            wide: [Mat::default(), Mat::default()],
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
        extract_channel(&borrow_colour(colour)?, &mut channel, RED)?;
        channel.convert_to_def(&mut self.red, CV_32F)?;
        for (wide, part) in self.wide.iter_mut().zip(SIGMAS) {
            gaussian_blur_def(&self.red, wide, Size::default(), part * self.radius)?;
        }
        subtract_def(&self.wide[0], &self.wide[1], &mut self.difference)?;
        let (mut score, mut at) = (0.0, Point::default());
        let none = Mat::default();
        min_max_loc(&self.difference, None, Some(&mut score), None, Some(&mut at), &none)?;
        Ok((at, score))
    }
}

impl BallDetector for RedDetector {
    fn name(&self) -> &'static str {
        "red"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let (at, score) = self.peak(frame.colour()).map_err(DetectError::processing)?;
        let circle = Circle::rough(f64::from(at.x), f64::from(at.y), self.radius);
        let observation = || BallObservation::new(circle, score, frame, &self.camera);
        Ok((score >= THRESHOLD).then(observation))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::camera::Intrinsics;
    use crate::image::{Bgr, Image};

    const INTRINSICS: Intrinsics =
        Intrinsics { fx: 500.0, fy: 500.0, cx: 159.5, cy: 119.5, depth_scale: 1000.0 };

    fn detect(discs: &[Disc]) -> Option<BallObservation> {
        let pose = Isometry3::identity();
        let camera = Camera { intrinsics: INTRINSICS, pose, ball_diameter: 0.06, ball_hue: 0.0 };
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
    fn the_disc_of_the_right_size_is_found_and_an_empty_picture_has_none() {
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
    fn as_the_paper_s_it_takes_a_white_disc_for_the_ball() {
        let discs = [
            Disc { at: (200, 90), radius: 20, colour: [20, 20, 200] },
            Disc { at: (80, 150), radius: 20, colour: [255; 3] },
        ];
        let ball = detect(&discs).unwrap();
        assert!((ball.circle.u - 80.0).abs() <= 1.0, "{ball:?}");
    }
}
