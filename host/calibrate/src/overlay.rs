//! The picture of a calibration with its result drawn in: axes, outline, samples.

use nalgebra::{Isometry3, Point2, Point3};
use opencv::core::{Mat, Point, Scalar, Vec3b};
use opencv::imgproc::{FONT_HERSHEY_SIMPLEX, LINE_AA, circle, line, put_text};
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::{Bgr, ColourImage};

use crate::calibration::Calibration;
use crate::corners::ProcessingError;

/// Length of the drawn axes, metres.
const AXIS_M: f64 = 0.1;
/// Fraction bits of the coordinates.
const SHIFT: i32 = 4;
/// Nearest depth that is drawn, metres.
const NEAREST_M: f64 = 0.05;
/// Parts of a line; each is projected, so that a line may leave the field of view.
const PARTS: i32 = 40;

const RED: Bgr = [60, 60, 255];
const GREEN: Bgr = [60, 230, 60];
const BLUE: Bgr = [255, 120, 40];
const YELLOW: Bgr = [0, 230, 255];

/// Draws a calibration into a picture: the rig's axes at its origin (x red, y green, z blue, 0.1 m
/// each), `outline` (a closed line, rig frame, metres; yellow), a dot where the pose puts each
/// known point, and a circle where the camera sees it (green, outliers red).
///
/// # Errors
/// If an image operation fails.
pub fn draw(
    image: &ColourImage,
    intrinsics: &Intrinsics,
    calibration: &Calibration,
    outline: &[Point3<f64>],
) -> Result<ColourImage, ProcessingError> {
    let mut drawn = image.clone();
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    let mat = Mat::new_rows_cols_with_bytes_mut::<Vec3b>(rows, columns, drawn.channels_mut())?;
    let mut drawing = Drawing { mat, intrinsics, to_camera: calibration.pose.inverse() };
    drawing.outline(outline)?;
    drawing.axes()?;
    drawing.samples(calibration)?;
    drop(drawing);
    Ok(drawn)
}

/// Draws the corners of a board into a picture: a circle where each is seen (green), a dot where it
/// is expected (yellow), pixels.
///
/// # Errors
/// If an image operation fails.
pub fn draw_corners(
    image: &ColourImage,
    corners: impl Iterator<Item = (Point2<f64>, Option<Point2<f64>>)>,
) -> Result<ColourImage, ProcessingError> {
    let mut drawn = image.clone();
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    let mut mat = Mat::new_rows_cols_with_bytes_mut::<Vec3b>(rows, columns, drawn.channels_mut())?;
    for (seen, expected) in corners {
        let at = fixed(seen.x, seen.y);
        circle(&mut mat, at, 6 << SHIFT, scalar(GREEN), 1, LINE_AA, SHIFT)?;
        if let Some(expected) = expected {
            let at = fixed(expected.x, expected.y);
            circle(&mut mat, at, 2 << SHIFT, scalar(YELLOW), -1, LINE_AA, SHIFT)?;
        }
    }
    drop(mat);
    Ok(drawn)
}

/// Returns a pixel with its fraction bits.
fn fixed(u: f64, v: f64) -> Point {
    let [u, v] = [u, v].map(|k| (k * f64::from(1 << SHIFT)).round().clamp(-1e7, 1e7) as i32);
    Point::new(u, v)
}

/// A picture that is drawn on in the rig frame.
struct Drawing<'a, M> {
    mat: M,
    intrinsics: &'a Intrinsics,
    to_camera: Isometry3<f64>,
}

impl<M: opencv::core::ToInputOutputArray> Drawing<'_, M> {
    /// Returns the pixel of a point in camera axes, with its fraction bits.
    fn pixel(&self, p: &Point3<f64>) -> Option<Point> {
        let (u, v) = self.intrinsics.project(p).filter(|_| p.z > NEAREST_M)?;
        Some(fixed(u, v))
    }

    fn segment(&mut self, from: &Point3<f64>, to: &Point3<f64>, colour: Bgr) -> opencv::Result<()> {
        let place = |k: i32| {
            let share = f64::from(k) / f64::from(PARTS);
            self.pixel(&(self.to_camera * (from + (to - from) * share)))
        };
        let parts: Vec<_> = (0..PARTS).filter_map(|k| place(k).zip(place(k + 1))).collect();
        for (start, end) in parts {
            line(&mut self.mat, start, end, scalar(colour), 2, LINE_AA, SHIFT)?;
        }
        Ok(())
    }

    fn outline(&mut self, outline: &[Point3<f64>]) -> opencv::Result<()> {
        let next = outline.iter().cycle().skip(1);
        for (from, to) in outline.iter().zip(next) {
            self.segment(from, to, YELLOW)?;
        }
        Ok(())
    }

    fn axes(&mut self) -> opencv::Result<()> {
        let axes = [("x", [AXIS_M, 0.0, 0.0], RED), ("y", [0.0, AXIS_M, 0.0], GREEN)];
        for (name, end, colour) in axes.into_iter().chain([("z", [0.0, 0.0, AXIS_M], BLUE)]) {
            let end = Point3::from(end);
            self.segment(&Point3::origin(), &end, colour)?;
            self.label(&(self.to_camera * end), name, colour)?;
        }
        Ok(())
    }

    fn samples(&mut self, calibration: &Calibration) -> opencv::Result<()> {
        for sample in &calibration.samples {
            let colour = if sample.is_outlier { RED } else { GREEN };
            if let Some(centre) = self.pixel(&sample.seen) {
                circle(&mut self.mat, centre, 6 << SHIFT, scalar(colour), 1, LINE_AA, SHIFT)?;
            }
            if let Some(centre) = self.pixel(&(self.to_camera * sample.known)) {
                circle(&mut self.mat, centre, 2 << SHIFT, scalar(YELLOW), -1, LINE_AA, SHIFT)?;
            }
            // The corners of a board are too many for labels.
            if calibration.samples.len() < 12 {
                self.label(&sample.seen, &sample.name, colour)?;
            }
        }
        Ok(())
    }

    /// Writes a text beside a point in camera axes.
    fn label(&mut self, p: &Point3<f64>, text: &str, colour: Bgr) -> opencv::Result<()> {
        let Some(at) = self.pixel(p) else { return Ok(()) };
        let at = Point::new((at.x >> SHIFT) + 9, (at.y >> SHIFT) - 4);
        for (colour, width) in [([0; 3], 3), (colour, 1)] {
            let (font, colour) = (FONT_HERSHEY_SIMPLEX, scalar(colour));
            put_text(&mut self.mat, text, at, font, 0.45, colour, width, LINE_AA, false)?;
        }
        Ok(())
    }
}

fn scalar([b, g, r]: Bgr) -> Scalar {
    Scalar::new(f64::from(b), f64::from(g), f64::from(r), 0.0)
}
