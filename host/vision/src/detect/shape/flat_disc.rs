//! Flat discs: ellipses of the ball's colour, found by threshold and fitted to their edges.
//!
//! The networks take a disc without shading for a print and reject it, so none is asked here.
//! Connected pixels of the colour propose ellipses by their moments. Each ellipse is fitted to its
//! edges by the radial scan of a ball, in a picture that is stretched until the disc is round: the
//! rays are those of the disc itself, and a circle's three unknowns get two more, the second
//! harmonics of its radius, which change the stretch. The outline and the evenness of the colour
//! decide.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{Matrix2, Matrix3, Matrix5, SVector, SymmetricEigen, Vector2, Vector5};
use opencv::core::{Mat, MatTraitConstManual};
use opencv::imgproc::connected_components_def;

use super::ball_colour::BallColour;
use super::parameters::{EdgeBand, EdgeParameters, SearchParameters, Tolerance};
use super::radial_scan::{Direction, RadialScan, directions};
use super::ray_colours::RAYS;
use super::refine::read_edges;
use super::robust_fit::{Solution, TukeyStep};
use super::view::{ColourView, Disc};
use crate::camera::{Camera, Intrinsics};
use crate::frame::RgbdFrame;

/// Least likenesses of connected pixels: the larger one parts a disc from a background of its hue,
/// the smaller one finds a dim or pale disc.
const LIKENESSES: [f32; 3] = [0.15, 0.3, 0.45];
/// Largest number of ellipses that are fitted for each likeness, the largest first.
const MAX_FITTED: usize = 12;
/// Pixels from one that is read to the next one, to the right and down: enough for the moments.
const STEP: usize = 2;
/// Least number of read pixels: an ellipse of 6 and 3.5 pixels.
const MIN_PIXELS: f64 = 15.0;
/// Least ratio of the half axes: of a slant of 55 degrees.
const MIN_RATIO: f64 = 0.57;
/// The same before the fit: connected pixels may leave a part of the disc out.
const MIN_ROUGH_RATIO: f64 = 0.4;
/// Least part of the ellipse of their moments that connected pixels cover.
const MIN_FILL: f64 = 0.8;
/// Band of each pass of the fit.
const BANDS: [EdgeBand; 5] = [
    EdgeBand { relative: 0.3, min_pixels: 3.5 },
    EdgeBand { relative: 0.25, min_pixels: 3.0 },
    EdgeBand { relative: 0.15, min_pixels: 2.0 },
    EdgeBand { relative: 0.1, min_pixels: 1.8 },
    EdgeBand { relative: 0.08, min_pixels: 1.8 },
];
/// Usual rms residual of the edges.
const USUAL_RMS: Tolerance = Tolerance { relative: 0.008, pixels: 0.15 };
/// Part of the score that a rms residual of the usual size costs.
const RMS_COST: f64 = 0.4;
/// Standard deviation of the error that all edges share in the radius, pixels: a camera's gamma
/// moves the edge between light and dark.
const RADIUS_ERROR: f64 = 0.15;
/// Score of a perfect outline: as of a ball without depth.
const PERFECT: f64 = 0.9;
/// Largest standard deviation of the brightness on the disc, in its mean. Of 845 fitted discs
/// (`plumb-lab vision --suite disc`, seeds 3 and 4) the largest is 0.047; nine in ten of the other
/// round things have more than 0.076.
const MAX_UNEVEN: f64 = 0.08;
/// Distances from the centre at which the brightness is read, in the radius.
const BRIGHTNESS_PLACES: [f64; 4] = [0.25, 0.45, 0.65, 0.8];

/// An ellipse that may be a flat disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::detect) struct FlatDisc {
    /// Centre of the ellipse and larger half axis, pixels.
    pub(in crate::detect) disc: Disc,
    /// Covariance of the disc's centre and of the larger half axis, pixels².
    pub(in crate::detect) covariance: Matrix3<f64>,
    /// 0 to 1; 0.52 and more is a disc.
    pub(in crate::detect) score: f64,
}

/// Returns the ellipses of the ball's colour in a frame, the one with the highest score first.
pub(in crate::detect) fn find_discs(
    frame: &RgbdFrame,
    camera: &Camera,
) -> opencv::Result<Vec<FlatDisc>> {
    let colour = BallColour::new(camera.ball_hue);
    let mut image = ColourView::new(frame.colour(), frame.intrinsics(), colour);
    let (columns, rows) = image.size();
    let size = (columns.div_ceil(STEP), rows.div_ceil(STEP));
    let rows = image.pixels().chunks(columns).step_by(STEP);
    let pixels = rows.flat_map(|row| row.iter().step_by(STEP));
    let likenesses = pixels.map(|pixel| colour.likeness(pixel.map(f32::from)));
    let likenesses: Vec<f32> = likenesses.collect();
    let radii = possible_radii(camera, frame.intrinsics());
    let mut found: Vec<FlatDisc> = Vec::new();
    for least in LIKENESSES {
        let starts = connected(&likenesses, least, size)?;
        found.extend(starts.iter().filter_map(|start| fit(&mut image, start)));
    }
    found.retain(|found| radii.contains(&found.disc.radius));
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    Ok(found)
}

/// Returns the radii, pixels, that the disc of `camera` can have.
fn possible_radii(camera: &Camera, intrinsics: &Intrinsics) -> Range<f64> {
    let SearchParameters { min_distance, max_distance, radius_margin, .. } =
        SearchParameters::DEFAULT;
    let radius_at = |z| intrinsics.radius_at(camera.ball_diameter / 2.0, z);
    let margin = 1.0 + radius_margin;
    radius_at(max_distance) / margin..radius_at(min_distance) * margin
}

/// An ellipse in the picture.
#[derive(Debug, Clone, Copy)]
struct Ellipse {
    /// Its centre and larger half axis.
    disc: Disc,
    /// From the places of a circle of that radius to those of the ellipse.
    flattening: Matrix2<f64>,
    /// The smaller half axis over the larger one.
    ratio: f64,
}

impl Ellipse {
    /// Makes the ellipse at (`u`, `v`) whose half axes, pixels, are the roots of the eigenvalues of
    /// `squares`.
    fn new((u, v): (f64, f64), squares: Matrix2<f64>) -> Self {
        let eigen = SymmetricEigen::new(squares);
        let radius = eigen.eigenvalues.max().max(0.0).sqrt();
        let half_axes = eigen.eigenvalues.map(|square| square.max(0.0).sqrt() / radius);
        let axes = eigen.eigenvectors;
        let flattening = axes * Matrix2::from_diagonal(&half_axes) * axes.transpose();
        Self { disc: Disc { u, v, radius }, flattening, ratio: half_axes.min() }
    }

    /// Returns the pixels that a pixel of the radius is across the outline, on each ray.
    fn widths(&self) -> Option<[f64; RAYS]> {
        let inverse = self.flattening.try_inverse()?.transpose();
        Some(
            directions()
                .map(|Direction { cos, sin }| 1.0 / (inverse * Vector2::new(cos, sin)).norm()),
        )
    }

    /// Returns the offset of the disc's centre from that of the ellipse, towards its farther side
    /// or its nearer one, pixels: perspective shortens the farther half. `focal` is in pixels.
    fn perspective(&self, focal: f64) -> Vector2<f64> {
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(self.flattening);
        let slant = self.ratio * (1.0 - self.ratio * self.ratio).max(0.0).sqrt();
        eigenvectors.column(eigenvalues.imin()) * (self.disc.radius.powi(2) / focal * slant)
    }
}

/// Returns the ellipses with the moments of the connected pixels of at least the likeness `least`,
/// the largest first. `size` is the number of columns and rows.
fn connected(
    likenesses: &[f32],
    least: f32,
    (width, height): (usize, usize),
) -> opencv::Result<Vec<Ellipse>> {
    let mask: Vec<u8> = likenesses.iter().map(|&likeness| u8::from(likeness >= least)).collect();
    let mask = Mat::new_rows_cols_with_data(height as i32, width as i32, &mask)?;
    let mut labels = Mat::default();
    let count = connected_components_def(&mask, &mut labels)?;
    // Number of pixels, and sums of u, v, u², v² and u v.
    let mut sums = vec![SVector::<f64, 6>::zeros(); count.max(0) as usize];
    for (i, &label) in labels.data_typed::<i32>()?.iter().enumerate() {
        // The background has label 0.
        if let Some(sum) = usize::try_from(label)
            .ok()
            .filter(|&label| label > 0)
            .and_then(|label| sums.get_mut(label))
        {
            let (u, v) = ((i % width * STEP) as f64, (i / width * STEP) as f64);
            *sum += SVector::from([1.0, u, v, u * u, v * v, u * v]);
        }
    }
    sums.retain(|sum| sum[0] >= MIN_PIXELS);
    sums.sort_by(|a, b| b[0].total_cmp(&a[0]));
    let ellipses = sums.iter().filter_map(|sum| {
        let [_, u, v, uu, vv, uv] = (sum / sum[0]).into();
        // An ellipse has a quarter of the square of each half axis as variance along it.
        let shared = uv - u * v;
        let squares = Matrix2::new(uu - u * u, shared, shared, vv - v * v) * 4.0;
        let ellipse = Ellipse::new((u, v), squares);
        let area = PI * ellipse.disc.radius.powi(2) * ellipse.ratio;
        (ellipse.ratio >= MIN_ROUGH_RATIO && (STEP * STEP) as f64 * sum[0] >= MIN_FILL * area)
            .then_some(ellipse)
    });
    Ok(ellipses.take(MAX_FITTED).collect())
}

/// Fits the ellipse near `start` to its edges; `None` if it has too few, or is no disc's.
fn fit(image: &mut ColourView, start: &Ellipse) -> Option<FlatDisc> {
    let mut ellipse = *start;
    let mut last = None;
    for band in BANDS {
        let (moved, outline) = fit_pass(image, &ellipse, band)?;
        ellipse = moved;
        last = Some(outline);
    }
    let is_disc = ellipse.ratio >= MIN_RATIO && unevenness(image, &ellipse) <= MAX_UNEVEN;
    let Outline { covariance, edges, rms } = last.filter(|_| is_disc)?;
    let mut to_pixels = Matrix3::identity();
    to_pixels.fixed_view_mut::<2, 2>(0, 0).copy_from(&ellipse.flattening);
    let mut covariance = to_pixels * covariance * to_pixels.transpose();
    let focal = image.intrinsics().focal();
    let perspective = ellipse.perspective(focal);
    let mut centre = covariance.fixed_view_mut::<2, 2>(0, 0);
    centre += perspective * perspective.transpose();
    // Perspective makes the outline larger than that of a disc across the line of sight.
    let radius = ellipse.disc.radius;
    let larger = 0.5 * radius * (radius / focal).powi(2);
    covariance[(2, 2)] += larger.powi(2) + RADIUS_ERROR.powi(2);
    let relative = rms / USUAL_RMS.at(radius);
    let score = PERFECT * edges * (1.0 - RMS_COST * relative * relative).max(0.0);
    Some(FlatDisc { disc: ellipse.disc, covariance, score })
}

/// How well an outline fits its edges.
struct Outline {
    /// Covariance of the centre, to the right and down in pixels of the radius, and of the radius.
    covariance: Matrix3<f64>,
    /// Part of the rays with a clear edge.
    edges: f64,
    /// Root of the mean squared residual, pixels.
    rms: f64,
}

/// Moves `ellipse` to its edges in `band`.
fn fit_pass(
    image: &mut ColourView,
    ellipse: &Ellipse,
    band: EdgeBand,
) -> Option<(Ellipse, Outline)> {
    let parameters = EdgeParameters::DEFAULT;
    let disc = &ellipse.disc;
    image.flattening = Some(ellipse.flattening);
    let limit = (band.relative * disc.radius).max(band.min_pixels / ellipse.ratio);
    let bands = [limit.min(0.6 * disc.radius); RAYS];
    let edges = read_edges((image, parameters.faint_contrast), disc, &bands, &[true; RAYS]);
    let widths = ellipse.widths()?;
    let mut fit = TukeyStep::<5>::new(parameters.cutoff * bands[0], parameters.damping);
    for (ray, edge) in edges.iter().enumerate() {
        let Some(edge) = edge else { continue };
        fit.add(row(directions()[ray]), edge.residual, edge.weight * widths[ray].powi(2));
    }
    if fit.inliers() < RAYS / 2 || fit.weights() < parameters.min_weight {
        return None;
    }
    let solution = fit.solve()?;
    let near = parameters.touching.at(disc.radius);
    let clear = edges.iter().enumerate().filter(|&(ray, edge)| {
        edge.is_some_and(|edge| {
            let residual = edge.residual - row(directions()[ray]).dot(&solution.step);
            edge.weight > parameters.clear_weight && (residual * widths[ray]).abs() < near
        })
    });
    let edges = clear.count() as f64 / RAYS as f64;
    let outline = Outline {
        covariance: covariance(&solution, &parameters),
        edges,
        rms: solution.mean_square.sqrt(),
    };
    Some((moved(image, ellipse, &solution.step), outline))
}

/// Returns the derivatives of the outline's distance on a ray by the unknowns: the centre to the
/// right and down, the radius, and its second harmonics.
fn row(Direction { cos, sin }: Direction) -> Vector5<f64> {
    Vector5::new(cos, sin, 1.0, cos * cos - sin * sin, 2.0 * cos * sin)
}

/// Returns the covariance of centre and radius of a fit.
fn covariance(solution: &Solution<5>, parameters: &EdgeParameters) -> Matrix3<f64> {
    let variance = solution.mean_square.max(parameters.edge_error.powi(2));
    let all: Matrix5<f64> = solution.inverse * variance;
    let shared = Matrix3::identity() * parameters.systematic_error.powi(2);
    all.fixed_view::<3, 3>(0, 0).into_owned() + shared
}

/// Returns `ellipse` after a step of its unknowns.
fn moved(image: &ColourView, ellipse: &Ellipse, step: &Vector5<f64>) -> Ellipse {
    let radius = ellipse.disc.radius;
    let disc = RadialScan::new(image, &ellipse.disc).moved(radius, &step.fixed_rows::<3>(0).into());
    let (c, s) = (step[3] / radius, step[4] / radius);
    let half_axes = ellipse.flattening * (Matrix2::identity() + Matrix2::new(c, s, s, -c));
    let half_axes = half_axes * disc.radius;
    Ellipse::new((disc.u, disc.v), half_axes * half_axes.transpose())
}

/// Returns the standard deviation of the brightness (the largest channel) on `ellipse`, in its
/// mean. A disc is lit evenly, a ball is not.
fn unevenness(image: &mut ColourView, ellipse: &Ellipse) -> f64 {
    image.flattening = Some(ellipse.flattening);
    let scan = RadialScan::new(image, &ellipse.disc);
    let places = BRIGHTNESS_PLACES.iter().flat_map(|part| (0..RAYS).map(move |ray| (ray, part)));
    let colours = places.filter_map(|(ray, part)| {
        let (u, v) = scan.at(ray, part * ellipse.disc.radius)?;
        image.at(u, v)
    });
    let values: Vec<f64> =
        colours.map(|colour| f64::from(colour.into_iter().fold(0.0, f32::max))).collect();
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    variance.sqrt() / mean.max(1.0)
}
