//! The picture of a calibration with its result drawn in: axes, outline, samples.

use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use opencv::core::{Mat, Point, Scalar, Vec3b};
use opencv::imgproc::{FONT_HERSHEY_SIMPLEX, LINE_AA, circle, line, put_text};
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::{Bgr, ColourImage};

use crate::calibration::{Calibration, Sample};
use crate::corners::ProcessingError;

/// Length of the drawn axes, metres.
const AXIS_M: f64 = 0.2;
/// Part of an axis that its arrowhead takes, and its half width over its length.
const HEAD_PART: f64 = 0.25;
const HEAD_WIDTH: f64 = 0.4;
/// Shortest arrowhead, pixels for each [`THIN_PX`] of the picture.
const SHORTEST_HEAD: f64 = 8.0;
/// Height of a picture in which the thinnest lines are one pixel wide.
const THIN_PX: i32 = 480;
/// Width of the lines, and of the dark edge on each of their sides, in widths of a thin line.
const LINE: i32 = 2;
const AXIS: i32 = 4;
const EDGE: i32 = 2;
/// Distance of the middle of an axis's name from its tip, and half of the name's height, in widths
/// of a thin line.
const NAME_DISTANCE: f64 = 18.0;
const NAME_HALF: f64 = 7.0;
/// Scale of the font of the axes and of the samples.
const AXIS_FONT: f64 = 0.9;
const SAMPLE_FONT: f64 = 0.45;
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
const BLACK: Bgr = [0; 3];

/// Draws a calibration into a picture: the rig's axes at its origin (x red, y green, z blue, 0.2 m
/// each, with a dark edge; at the middle of the samples if the origin is not in the picture),
/// `outline` (a closed line, rig frame, metres; yellow), a dot where the pose puts each
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
    let to_camera = calibration.pose.inverse();
    let thin = (rows / THIN_PX).max(1);
    let mut drawing = Drawing { mat, size: [columns, rows], thin, intrinsics, to_camera };
    drawing.outline(outline)?;
    drawing.samples(calibration)?;
    drawing.axes(&calibration.samples)?;
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
    /// Width and height, pixels.
    size: [i32; 2],
    /// Width of a thin line, pixels.
    thin: i32,
    intrinsics: &'a Intrinsics,
    to_camera: Isometry3<f64>,
}

impl<M: opencv::core::ToInputOutputArray> Drawing<'_, M> {
    /// Returns the pixel of a point in camera axes, with its fraction bits.
    fn pixel(&self, p: &Point3<f64>) -> Option<Point> {
        let (u, v) = self.intrinsics.project(p).filter(|_| p.z > NEAREST_M)?;
        Some(fixed(u, v))
    }

    /// Returns whether a point of the rig frame is in the picture.
    fn is_seen(&self, p: &Point3<f64>) -> bool {
        let inside = |k: i32, size: i32| (0..size << SHIFT).contains(&k);
        let pixel = self.pixel(&(self.to_camera * p));
        pixel.is_some_and(|at| inside(at.x, self.size[0]) && inside(at.y, self.size[1]))
    }

    /// Returns the parts of a line in the rig frame that are in front of the camera.
    fn parts(&self, from: &Point3<f64>, to: &Point3<f64>) -> Vec<(Point, Point)> {
        let place = |k: i32| {
            let share = f64::from(k) / f64::from(PARTS);
            self.pixel(&(self.to_camera * (from + (to - from) * share)))
        };
        (0..PARTS).filter_map(|k| place(k).zip(place(k + 1))).collect()
    }

    /// Draws lines, `width` thin lines wide.
    fn lines(&mut self, parts: &[(Point, Point)], colour: Bgr, width: i32) -> opencv::Result<()> {
        for (start, end) in parts {
            let width = width * self.thin;
            line(&mut self.mat, *start, *end, scalar(colour), width, LINE_AA, SHIFT)?;
        }
        Ok(())
    }

    fn outline(&mut self, outline: &[Point3<f64>]) -> opencv::Result<()> {
        let next = outline.iter().cycle().skip(1);
        for (from, to) in outline.iter().zip(next) {
            let parts = self.parts(from, to);
            self.lines(&parts, YELLOW, LINE)?;
        }
        Ok(())
    }

    /// Draws the axes as arrows with a dark edge, which are seen on bright and on dark ground.
    fn axes(&mut self, samples: &[Sample]) -> opencv::Result<()> {
        let origin = Point3::origin();
        let count = samples.len() as f64;
        let middle: Vector3<f64> = samples.iter().map(|s| s.known.coords / count).sum();
        let from = if self.is_seen(&origin) { origin } else { Point3::from(middle) };
        let axes =
            [("x", Vector3::x(), RED), ("y", Vector3::y(), GREEN), ("z", Vector3::z(), BLUE)];
        let arrows = axes.map(|(_, axis, colour)| {
            let mut parts = self.parts(&from, &(from + axis * AXIS_M));
            if let (Some((start, _)), Some((_, tip))) = (parts.first(), parts.last()) {
                parts.extend(self.head(*start, *tip));
            }
            (parts, colour)
        });
        for (parts, _) in &arrows {
            self.lines(parts, BLACK, AXIS + 2 * EDGE)?;
        }
        for (parts, colour) in &arrows {
            self.lines(parts, *colour, AXIS)?;
        }
        for ((name, ..), (parts, colour)) in axes.into_iter().zip(&arrows) {
            let ends = parts.first().zip(parts.iter().rev().nth(2));
            let Some(((start, _), (_, tip))) = ends else { continue };
            self.text(self.beyond(*start, *tip), name, *colour, AXIS_FONT)?;
        }
        Ok(())
    }

    /// Returns the pixel, without fraction bits, where the name of an axis begins: its middle is
    /// beyond the tip.
    fn beyond(&self, start: Point, tip: Point) -> Point {
        let along = Vector2::new(f64::from(tip.x - start.x), f64::from(tip.y - start.y));
        let along = along.try_normalize(1.0).unwrap_or_else(Vector2::x) * NAME_DISTANCE;
        let shift = |at: i32, by: f64| (at >> SHIFT) + (by * f64::from(self.thin)).round() as i32;
        Point::new(shift(tip.x, along.x - NAME_HALF), shift(tip.y, along.y + NAME_HALF))
    }

    /// Returns the two lines of an arrowhead at `tip`.
    fn head(&self, start: Point, tip: Point) -> [(Point, Point); 2] {
        let along = Vector2::new(f64::from(start.x - tip.x), f64::from(start.y - tip.y));
        let shortest = SHORTEST_HEAD * f64::from(self.thin << SHIFT);
        let length = (HEAD_PART * along.norm()).max(shortest);
        let back = along.try_normalize(1.0).unwrap_or_else(Vector2::y) * length;
        let side = Vector2::new(-back.y, back.x) * HEAD_WIDTH;
        [back + side, back - side].map(|wing| {
            (Point::new(tip.x + wing.x.round() as i32, tip.y + wing.y.round() as i32), tip)
        })
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
        let at = Point::new((at.x >> SHIFT) + 9 * self.thin, (at.y >> SHIFT) - 4 * self.thin);
        self.text(at, text, colour, SAMPLE_FONT)
    }

    /// Writes a text with a dark edge; `at` is its lower left corner, pixels.
    fn text(&mut self, at: Point, text: &str, colour: Bgr, font: f64) -> opencv::Result<()> {
        let thin = self.thin;
        let width = if font > SAMPLE_FONT { 2 * thin } else { thin };
        let font = font * f64::from(thin);
        for (colour, width) in [(BLACK, width + 2 * thin), (colour, width)] {
            let (face, colour) = (FONT_HERSHEY_SIMPLEX, scalar(colour));
            put_text(&mut self.mat, text, at, face, font, colour, width, LINE_AA, false)?;
        }
        Ok(())
    }
}

fn scalar([b, g, r]: Bgr) -> Scalar {
    Scalar::new(f64::from(b), f64::from(g), f64::from(r), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (640, 480);
    const BRIGHT: Bgr = [250; 3];
    const DARK: Bgr = [5; 3];

    /// Returns the picture of axes whose origin is at `x` metres beside the optical axis and 1 m
    /// in front of the camera, on a ground of one colour. x and y are in the picture's plane.
    fn picture(ground: Bgr, x: f64) -> ColourImage {
        let intrinsics = Intrinsics {
            fx: 500.0,
            fy: 500.0,
            cx: 320.0,
            cy: 240.0,
            depth_scale: 0.0,
            distortion: None,
        };
        let sample = |at: f64| Sample {
            name: String::new(),
            known: Point3::new(at, 0.0, 0.0),
            seen: Point3::new(at + x, 0.0, -1.0),
            residual: 0.0,
            held_out: None,
            is_outlier: false,
        };
        let calibration = Calibration {
            pose: Isometry3::translation(-x, 0.0, -1.0),
            position_sd: 0.0,
            rotation_sd: 0.0,
            samples: vec![sample(-x - 0.1), sample(-x + 0.1)],
            findings: Vec::new(),
        };
        draw(&ColourImage::filled(SIZE.0, SIZE.1, ground), &intrinsics, &calibration, &[]).unwrap()
    }

    /// Returns the number of pixels in a column that differ clearly from the ground.
    fn seen(
        picture: &ColourImage,
        ground: Bgr,
        column: usize,
        rows: std::ops::Range<usize>,
    ) -> usize {
        let differs = |pixel: Bgr| pixel.iter().zip(ground).any(|(a, b)| a.abs_diff(b) > 100);
        rows.filter(|row| picture.get(column, *row).is_some_and(differs)).count()
    }

    #[test]
    fn an_axis_is_thick_and_differs_from_bright_and_from_dark_ground() {
        for ground in [BRIGHT, DARK] {
            let picture = picture(ground, 0.0);
            let across = seen(&picture, ground, 370, 220..260);
            assert!(across >= 4, "{ground:?}: {across} pixels");
        }
        let bright = picture(BRIGHT, 0.0);
        let dark = (220..260).filter_map(|row| bright.get(370, row));
        assert!(dark.filter(|pixel| pixel.iter().all(|c| *c < 60)).count() >= 2, "no dark edge");
    }

    #[test]
    fn axes_whose_origin_is_not_in_the_picture_are_at_the_samples() {
        let picture = picture(BRIGHT, 3.0);
        assert!(seen(&picture, BRIGHT, 370, 220..260) >= 4, "the axes are not in the picture");
    }
}
