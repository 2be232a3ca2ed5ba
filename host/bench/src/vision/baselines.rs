//! Baselines: two common OpenCV methods for a coloured ball.

use opencv::boxed_ref::BoxedRef;
use opencv::core::{
    BORDER_CONSTANT, Mat, Point, Scalar, Size, Vec3b, Vec3f, Vector, bitwise_or_def, in_range,
};
use opencv::imgproc::{
    CHAIN_APPROX_SIMPLE, COLOR_BGR2GRAY, COLOR_BGR2HSV, HOUGH_GRADIENT, MORPH_ELLIPSE, MORPH_OPEN,
    RETR_EXTERNAL, contour_area_def, cvt_color_def, find_contours_def, gaussian_blur_def,
    get_structuring_element_def, hough_circles, moments_def, morphology_ex,
};
use plumb_vision::camera::Camera;
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::ColourImage;
use plumb_vision::localise::observe;
use plumb_vision::observation::{BallObservation, Circle};

/// Least radius of circles to search, pixels.
const MIN_RADIUS: i32 = 6;
/// Greatest radius of circles to search, pixels.
const MAX_RADIUS: i32 = 65;
/// Least area of a red contour, pixels.
const MIN_AREA: f64 = 60.0;

/// Borrows a colour image as an OpenCV matrix of type `CV_8UC3`.
pub(super) fn borrow_colour(image: &ColourImage) -> opencv::Result<BoxedRef<'_, Mat>> {
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    Mat::new_rows_cols_with_bytes::<Vec3b>(rows, columns, image.channels())
}

/// Detector by the strongest circle of `HoughCircles` in the blurred grey image.
#[derive(Debug)]
pub(super) struct Hough(pub(super) Camera);

impl BallDetector for Hough {
    fn name(&self) -> &'static str {
        "HoughCircles"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let circle = strongest_circle(frame.colour()).map_err(DetectError::processing)?;
        Ok(circle.map(|circle| observe(circle, 1.0, frame, &self.0)))
    }
}

/// Returns the circle with the most votes.
fn strongest_circle(colour: &ColourImage) -> opencv::Result<Option<Circle>> {
    let (mut grey, mut smooth) = (Mat::default(), Mat::default());
    cvt_color_def(&borrow_colour(colour)?, &mut grey, COLOR_BGR2GRAY)?;
    gaussian_blur_def(&grey, &mut smooth, Size::new(9, 9), 2.0)?;
    let mut circles: Vector<Vec3f> = Vector::new();
    hough_circles(
        &smooth,
        &mut circles,
        HOUGH_GRADIENT,
        1.0,
        60.0,
        100.0,
        30.0,
        MIN_RADIUS,
        MAX_RADIUS,
    )?;
    // The strongest circle comes first.
    Ok(circles.iter().next().map(|circle| {
        let [u, v, radius] = circle.0.map(f64::from);
        Circle::rough(u, v, radius)
    }))
}

/// Detector by `inRange` in HSV, an opening, and the moments of the largest contour.
#[derive(Debug)]
pub(super) struct HsvMoments(pub(super) Camera);

impl BallDetector for HsvMoments {
    fn name(&self) -> &'static str {
        "inRange + moments"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let contour = largest_red_contour(frame.colour()).map_err(DetectError::processing)?;
        Ok(contour.map(|(circle, area)| observe(circle, area, frame, &self.0)))
    }
}

/// Returns the disc of the same area and centroid as the largest contour of a red hue, and that
/// area, pixels².
fn largest_red_contour(colour: &ColourImage) -> opencv::Result<Option<(Circle, f64)>> {
    let mut hsv = Mat::default();
    cvt_color_def(&borrow_colour(colour)?, &mut hsv, COLOR_BGR2HSV)?;
    let within = |low: f64, high: f64| -> opencv::Result<Mat> {
        let (low, high) =
            (Scalar::new(low, 120.0, 70.0, 0.0), Scalar::new(high, 255.0, 255.0, 0.0));
        let mut mask = Mat::default();
        in_range(&hsv, &low, &high, &mut mask)?;
        Ok(mask)
    };
    let (mut mask, mut open) = (Mat::default(), Mat::default());
    bitwise_or_def(&within(0.0, 10.0)?, &within(170.0, 180.0)?, &mut mask)?;
    let kernel = get_structuring_element_def(MORPH_ELLIPSE, Size::new(5, 5))?;
    let (middle, border) = (Point::new(-1, -1), Scalar::default());
    morphology_ex(&mask, &mut open, MORPH_OPEN, &kernel, middle, 1, BORDER_CONSTANT, border)?;
    let mut contours: Vector<Vector<Point>> = Vector::new();
    find_contours_def(&open, &mut contours, RETR_EXTERNAL, CHAIN_APPROX_SIMPLE)?;
    let mut largest: Option<(Circle, f64)> = None;
    for contour in &contours {
        let area = contour_area_def(&contour)?;
        if area > largest.map_or(MIN_AREA, |(_, area)| area) {
            let moments = moments_def(&contour)?;
            let (u, v) = (moments.m10 / moments.m00, moments.m01 / moments.m00);
            largest = Some((Circle::rough(u, v, (area / std::f64::consts::PI).sqrt()), area));
        }
    }
    Ok(largest)
}
