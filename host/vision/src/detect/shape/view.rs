//! A frame as the stages read it, and how a ball's disc is stretched off the optical axis.

use std::ops::Range;

use multiversion::multiversion;
use nalgebra::{Matrix2, Point3};

use super::ball_colour::BallColour;
use super::parameters::{SearchParameters, ShapeParameters};
use super::pyramid::{Level, QUARTER, QUARTER_LEVEL};
use crate::camera::Intrinsics;
use crate::depth_view::DepthView;
use crate::frame::RgbdFrame;
use crate::image::{Bgr, ColourImage};

/// A ball's disc in the image.
///
/// Off the optical axis a ball is seen as an ellipse. The radius is that of the disc of a ball at
/// the same depth on the optical axis, f R / z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Column of the centre, pixels.
    pub u: f64,
    /// Row of the centre, pixels.
    pub v: f64,
    /// Radius, pixels.
    pub radius: f64,
}

impl Disc {
    /// Returns the distance between the centres, pixels.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        (self.u - other.u).hypot(self.v - other.v)
    }
}

/// A frame, the ball that is looked for in it, and the parameters of the search.
pub(super) struct FrameView<'a> {
    pub(super) colour: ColourView<'a>,
    /// The colour image, and the window that is searched at half the size, at a quarter, and so on.
    pub(super) levels: Vec<Level<'a>>,
    pub(super) depth: DepthView<'a>,
    /// The raw depth in the middle of each pixel at a quarter of the size, row by row; 0 where it
    /// is unknown.
    pub(super) small_depth: Vec<u16>,
    /// Whether any of these depths is known.
    pub(super) has_depth: bool,
    /// Radius of the ball, metres.
    pub(super) ball_radius: f64,
    pub(super) parameters: &'a ShapeParameters,
}

impl<'a> FrameView<'a> {
    /// Borrows `frame` and its `levels`, in which a ball of `ball_radius` metres and of colour
    /// `ball` is looked for.
    pub(super) fn new(
        frame: &'a RgbdFrame,
        levels: Vec<Level<'a>>,
        ball: BallColour,
        ball_radius: f64,
        parameters: &'a ShapeParameters,
    ) -> Self {
        let colour = ColourView::new(frame.colour(), frame.intrinsics(), ball);
        let depth = DepthView::new(frame);
        let small_depth = small_depth(&depth, &levels[QUARTER_LEVEL]);
        // One loop without an exit, which the processor runs over many depths at once.
        let has_depth = small_depth.iter().fold(0, |all, raw| all | raw) != 0;
        Self { colour, levels, depth, small_depth, has_depth, ball_radius, parameters }
    }

    /// Returns the window at a quarter of the size.
    pub(super) fn quarter(&self) -> &Level<'a> {
        &self.levels[QUARTER_LEVEL]
    }

    /// Returns the intrinsics of the frame.
    #[inline]
    pub(super) fn intrinsics(&self) -> &Intrinsics {
        self.colour.intrinsics
    }

    /// Returns the radius (pixels, on the optical axis) of the ball at depth `z`, metres.
    pub(super) fn radius_at(&self, z: f64) -> f64 {
        self.intrinsics().radius_at(self.ball_radius, z)
    }

    /// Returns the radii (pixels, on the optical axis) that the refined circle of a ball can have.
    pub(super) fn possible_radii(&self) -> Range<f64> {
        self.radii_up_to(1.0 + self.parameters.search.radius_margin)
    }

    /// Returns the radii (pixels, on the optical axis) that the ball can have, up to the factor
    /// `margin`.
    pub(super) fn radii_up_to(&self, margin: f64) -> Range<f64> {
        let SearchParameters { min_distance, max_distance, .. } = self.parameters.search;
        self.radius_at(max_distance) / margin..margin * self.radius_at(min_distance)
    }

    /// Returns the depth, metres, at which the ball is as large as `disc`.
    pub(super) fn depth_of(&self, disc: &Disc) -> f64 {
        self.intrinsics().depth_of(self.ball_radius, disc.radius)
    }

    /// Returns how `disc` is stretched.
    pub(super) fn stretch(&self, disc: &Disc) -> Stretch {
        Stretch::new(self.intrinsics(), disc.u, disc.v)
    }

    /// Returns the disc of a ball at `centre` (camera axes, metres); `None` behind the camera.
    pub(super) fn disc_of(&self, centre: &Point3<f64>) -> Option<Disc> {
        let (u, v) = self.intrinsics().project(centre)?;
        Some(Disc { u, v, radius: self.radius_at(centre.z) })
    }
}

/// Returns the raw depth in the middle of each pixel of `level`, the one at a quarter of the size.
fn small_depth(depth: &DepthView, level: &Level) -> Vec<u16> {
    let mut middles = vec![0; level.width * level.height];
    for (middles, raw) in middles.chunks_exact_mut(level.width).zip(middle_rows(depth, level)) {
        read_middles(raw, middles);
    }
    middles
}

/// Returns the raw depths of the middle row of pixels of each row of `level`, the one at a
/// quarter of the size, from its first column on.
pub(super) fn middle_rows<'a>(
    depth: &DepthView<'a>,
    level: &Level,
) -> impl Iterator<Item = &'a [u16]> {
    let (left, top) = (level.origin.0 as usize, level.origin.1 as usize);
    let rows = (0..level.height).map(move |y| depth.row(top + QUARTER * y + QUARTER / 2));
    rows.map(move |row| row.get(left..).unwrap_or_default())
}

/// Writes the number in the middle of each [`QUARTER`] numbers.
#[multiversion(targets("x86_64+avx512f+avx512bw", "x86_64+avx2"))]
fn read_middles(numbers: &[u16], middles: &mut [u16]) {
    for (middle, numbers) in middles.iter_mut().zip(numbers.as_chunks::<QUARTER>().0) {
        *middle = numbers[QUARTER / 2];
    }
}

/// The colour image of a frame.
pub(super) struct ColourView<'a> {
    pixels: &'a [Bgr],
    width: usize,
    height: usize,
    intrinsics: &'a Intrinsics,
    ball: BallColour,
    /// How a flat disc is seen: its places, in the radius, to those across the direction to it.
    /// `None` for a ball, which is a circle there.
    pub(super) flattening: Option<Matrix2<f64>>,
}

impl<'a> ColourView<'a> {
    /// Borrows an image.
    pub(super) fn new(
        colour: &'a ColourImage,
        intrinsics: &'a Intrinsics,
        ball: BallColour,
    ) -> Self {
        let (width, height) = (colour.width(), colour.height());
        Self { pixels: colour.pixels(), width, height, intrinsics, ball, flattening: None }
    }

    /// Returns the intrinsics of the image.
    pub(super) fn intrinsics(&self) -> &Intrinsics {
        self.intrinsics
    }

    /// Returns the colour that is looked for.
    #[inline]
    pub(super) fn ball(&self) -> BallColour {
        self.ball
    }

    /// Returns columns and rows.
    #[inline]
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Returns all pixels, row by row.
    #[inline]
    pub(super) fn pixels(&self) -> &[Bgr] {
        self.pixels
    }

    /// Returns the colour (blue, green, red, 0 to 255) of the pixel nearest to (`u`, `v`); `None`
    /// outside the image.
    #[inline]
    pub(super) fn at(&self, u: f64, v: f64) -> Option<[f32; 3]> {
        let (x, y) = (u + 0.5, v + 0.5);
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then(|| {
            let index = y as u32 as usize * self.width + x as u32 as usize;
            self.pixels[index].map(f32::from)
        })
    }

    /// Returns the likeness of the pixel nearest to (`u`, `v`) to the ball's colour, 0 to 1; 0
    /// outside the image.
    #[inline]
    pub(super) fn likeness(&self, u: f64, v: f64) -> f32 {
        self.at(u, v).map_or(0.0, |colour| self.ball.likeness(colour))
    }
}

/// How perspective and lens stretch a ball's disc.
///
/// Places on the disc are to the right of its centre and down, in pixels of its radius. Off the
/// optical axis the disc is an ellipse; a row of places is a row of pixels all the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    /// Columns for each pixel to the right.
    right: f64,
    /// Columns for each pixel down.
    shear: f64,
    /// Rows for each pixel down.
    down: f64,
}

impl Stretch {
    /// A disc on the optical axis.
    const NONE: Self = Self { right: 1.0, shear: 0.0, down: 1.0 };

    /// Returns the stretch of a small ball that `intrinsics` show at column `u`, row `v`. Where a
    /// distortion folds there is none.
    ///
    /// In focal lengths from the principal point, a ball of radius R at depth z in the direction
    /// (x, y, 1) is the ellipse p' S⁻¹ p < (R/z)², S = 1 + (x, y)' (x, y). Pixels turn S into
    /// D S D' with their derivatives D.
    pub(super) fn new(intrinsics: &Intrinsics, u: f64, v: f64) -> Self {
        let ray = intrinsics.deproject(u, v, 1.0).coords.xy();
        let derivatives = intrinsics.deproject_derivatives(u, v, 1.0);
        let Some(to_pixels) = derivatives.and_then(|inverse| inverse.try_inverse()) else {
            return Self::NONE;
        };
        let to_pixels = to_pixels / intrinsics.focal();
        let squared =
            to_pixels * (Matrix2::identity() + ray * ray.transpose()) * to_pixels.transpose();
        let down = squared.m22.sqrt();
        let shear = squared.m12 / down;
        Self { right: (squared.m11 - shear * shear).sqrt(), shear, down }
    }

    /// Returns column and row of the place `right` and `down` pixels from the centre of `disc`.
    pub(super) fn at(&self, disc: &Disc, right: f64, down: f64) -> (f64, f64) {
        (disc.u + self.right * right + self.shear * down, disc.v + self.down * down)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Distortion, DistortionCoefficients};
    use std::f64::consts::TAU;

    #[test]
    fn the_third_of_four_numbers_is_the_middle_one() {
        // The numbers end before the middles do: the rest stays.
        let numbers: Vec<u16> = (0..4 * 35 + 3).collect();
        let mut middles = [9; 36];
        read_middles(&numbers, &mut middles);
        assert_eq!(middles[..35], std::array::from_fn::<u16, 35, _>(|k| 4 * k as u16 + 2));
        assert_eq!(middles[35], 9);
    }

    #[test]
    fn the_border_of_a_stretched_disc_is_the_ball_s_cone() {
        let barrel = DistortionCoefficients { k1: -0.2, k2: 0.03, p1: 0.001, p2: -0.002, k3: 0.0 };
        for distortion in [None, Distortion::new(barrel)] {
            let intrinsics = Intrinsics {
                fx: 400.0,
                fy: 420.0,
                cx: 310.0,
                cy: 250.0,
                depth_scale: 1000.0,
                distortion,
            };
            for (u, v) in [(310.0, 250.0), (20.0, 250.0), (320.0, 10.0), (600.0, 450.0)] {
                let disc = Disc { u, v, radius: 2.0 };
                let stretch = Stretch::new(&intrinsics, u, v);
                let centre = intrinsics.deproject(u, v, 1.0).coords;
                // The sine of the cone's half angle is the ball's radius over its distance.
                let expected = disc.radius / (intrinsics.focal() * centre.norm());
                for angle in (0..12).map(|k| TAU * f64::from(k) / 12.0) {
                    let (right, down) = (disc.radius * angle.cos(), disc.radius * angle.sin());
                    let (u, v) = stretch.at(&disc, right, down);
                    let sine = centre.angle(&intrinsics.deproject(u, v, 1.0).coords).sin();
                    assert!((sine / expected - 1.0).abs() < 0.01, "{disc:?} {angle}: {sine}");
                }
            }
        }
    }
}
