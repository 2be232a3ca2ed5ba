//! An enlarged part of a frame that is drawn on.

use opencv::core::{
    BORDER_CONSTANT, CV_8UC3, Mat, MatTraitConst, MatTraitConstManual, Point, Rect, Scalar, Size,
    Vec3b, copy_make_border,
};
use opencv::imgproc::{
    FILLED, FONT_HERSHEY_SIMPLEX, INTER_NEAREST, LINE_AA, circle, put_text, rectangle, resize,
};

use crate::detect::shape::Disc;
use crate::image::{Bgr, ColourImage, Image};
use crate::mat::borrow_colour;

/// Size of the letters, in the font's own.
const FONT_SCALE: f64 = 0.5;
/// Height of a line of text, pixels.
const LINE: i32 = 19;
/// Fraction bits of the drawing functions' coordinates.
const SHIFT: i32 = 4;

/// An enlarged part of a frame that is drawn on, in the frame's coordinates.
pub(super) struct Canvas {
    mat: Mat,
    /// Pixels of the canvas in a pixel of the frame.
    scale: f64,
    /// Column and row in the frame of the first pixel beside the panel.
    origin: (f64, f64),
    /// Columns of the panel for text at the left, pixels.
    panel: i32,
}

impl Canvas {
    /// Makes a canvas of a whole image, `scale` times as large.
    pub(super) fn new(colour: &ColourImage, scale: usize) -> opencv::Result<Self> {
        let mut mat = Mat::default();
        let scale = scale as f64;
        resize(&borrow_colour(colour)?, &mut mat, Size::default(), scale, scale, INTER_NEAREST)?;
        Ok(Self { mat, scale, origin: (0.0, 0.0), panel: 0 })
    }

    /// Makes a canvas of `side` pixels from the square around `disc` of half size `reach`, pixels,
    /// with a panel of `panel` columns for text to the left of it. Outside the image it is black.
    pub(super) fn around(
        colour: &ColourImage,
        disc: &Disc,
        reach: f64,
        side: usize,
        panel: usize,
    ) -> opencv::Result<Self> {
        let half = reach.ceil().clamp(2.0, 4096.0) as i32;
        // The square may be partly or wholly outside the image.
        let (left, top) = (disc.u.round() as i32 - half, disc.v.round() as i32 - half);
        let part = Image::from_fn(2 * half as usize, 2 * half as usize, |x, y| {
            let at = |first: i32, k: usize| usize::try_from(first.saturating_add(k as i32)).ok();
            let pixel = at(left, x).zip(at(top, y)).and_then(|(x, y)| colour.get(x, y));
            pixel.unwrap_or([0; 3])
        });
        let mut mat = Mat::default();
        let size = Size::new(side as i32, side as i32);
        resize(&borrow_colour(&part)?, &mut mat, size, 0.0, 0.0, INTER_NEAREST)?;
        let scale = side as f64 / f64::from(2 * half);
        let (mut with_panel, panel) = (Mat::default(), panel as i32);
        let black = Scalar::default();
        copy_make_border(&mat, &mut with_panel, 0, 0, panel, 0, BORDER_CONSTANT, black)?;
        Ok(Self { mat: with_panel, scale, origin: (f64::from(left), f64::from(top)), panel })
    }

    /// Returns the drawn image.
    pub(super) fn into_image(self) -> opencv::Result<ColourImage> {
        debug_assert_eq!(self.mat.typ(), CV_8UC3);
        let pixels: Vec<Bgr> = self.mat.data_typed::<Vec3b>()?.iter().map(|p| p.0).collect();
        let (width, height) = (self.mat.cols() as usize, self.mat.rows() as usize);
        Image::new(width, height, pixels)
            .map_err(|error| opencv::Error::new(opencv::core::StsBadSize, error.to_string()))
    }

    /// Returns a place of the frame on the canvas, with `SHIFT` fraction bits.
    fn point(&self, u: f64, v: f64) -> Point {
        // The centre of the first pixel is at half a pixel's width.
        let at = |k: f64, origin: f64| {
            let place = (k - origin + 0.5) * self.scale - 0.5;
            (place * f64::from(1 << SHIFT)).round() as i32
        };
        Point::new(at(u, self.origin.0) + (self.panel << SHIFT), at(v, self.origin.1))
    }

    /// Draws the circle of `disc`.
    pub(super) fn disc(&mut self, disc: &Disc, colour: Bgr, width: i32) -> opencv::Result<()> {
        let radius = (disc.radius * self.scale * f64::from(1 << SHIFT)).clamp(0.0, 1e6) as i32;
        let centre = self.point(disc.u, disc.v);
        circle(&mut self.mat, centre, radius, scalar(colour), width, LINE_AA, SHIFT)
    }

    /// Draws a dot.
    pub(super) fn dot(&mut self, u: f64, v: f64, colour: Bgr) -> opencv::Result<()> {
        let (centre, radius) = (self.point(u, v), 3 << SHIFT);
        circle(&mut self.mat, centre, radius, scalar(colour), FILLED, LINE_AA, SHIFT)
    }

    /// Draws a rectangle: column, row, width and height in the frame, pixels.
    pub(super) fn rectangle(&mut self, area: [usize; 4], colour: Bgr) -> opencv::Result<()> {
        let [x, y, width, height] = area.map(|k| (k as f64 * self.scale) as i32);
        let area = Rect::new(x, y, width, height);
        rectangle(&mut self.mat, area, scalar(colour), 1, LINE_AA, 0)
    }

    /// Writes `text` to the right of `disc`.
    pub(super) fn label(&mut self, disc: &Disc, text: &str, colour: Bgr) -> opencv::Result<()> {
        let at = self.point(disc.u + disc.radius, disc.v);
        self.write(text, Point::new((at.x >> SHIFT) + 4, at.y >> SHIFT), colour)
    }

    /// Writes `text` into the upper left corner.
    pub(super) fn title(&mut self, text: &str) -> opencv::Result<()> {
        self.write(text, Point::new(6, LINE), [255; 3])
    }

    /// Writes lines of text below the title.
    pub(super) fn text(&mut self, lines: &[(String, Bgr)]) -> opencv::Result<()> {
        for ((text, colour), row) in lines.iter().zip(2..) {
            self.write(text, Point::new(6, row * LINE), *colour)?;
        }
        Ok(())
    }

    /// Writes `text` with a dark border, so that it is legible on any background.
    fn write(&mut self, text: &str, at: Point, colour: Bgr) -> opencv::Result<()> {
        for (colour, width) in [([0; 3], 3), (colour, 1)] {
            let (font, colour) = (FONT_HERSHEY_SIMPLEX, scalar(colour));
            put_text(&mut self.mat, text, at, font, FONT_SCALE, colour, width, LINE_AA, false)?;
        }
        Ok(())
    }
}

fn scalar([b, g, r]: Bgr) -> Scalar {
    Scalar::new(f64::from(b), f64::from(g), f64::from(r), 0.0)
}
