//! Drawing of cables: straight, thin, anti-aliased, with perspective.

use nalgebra::Point3;

use super::ball::Style;
use super::canvas::Canvas;
use super::light::{Material, encode};

/// Least distance of drawn strands from the camera, metres.
const NEAR_PLANE: f64 = 0.05;
/// Parts of a strand that the distortion of the lens bends; each is drawn straight.
const BENT_PARTS: u32 = 48;
/// Least width that the depth sensor resolves, pixels.
const MIN_DEPTH_WIDTH: f64 = 3.0;

/// A straight round thin object to be drawn, in camera axes, metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct CameraStrand {
    pub(super) from: Point3<f64>,
    pub(super) to: Point3<f64>,
    pub(super) diameter: f64,
    pub(super) material: Material,
}

/// A projected strand along its major axis (the axis with more pixels) and its minor axis.
struct Line {
    /// Major and minor coordinate and 1/z of the end with the smaller major coordinate.
    start: [f64; 3],
    /// How minor coordinate and 1/z change by pixel of the major one.
    slope: [f64; 2],
    /// Major coordinate of the other end.
    end: f64,
    /// Whether the major axis is the rows (the strand is rather upright).
    upright: bool,
}

impl CameraStrand {
    /// The part in front of the camera, as seen.
    fn project(&self, style: &Style<'_>) -> Option<Line> {
        let (mut a, mut b) = (self.from, self.to);
        if a.z > b.z {
            std::mem::swap(&mut a, &mut b);
        }
        if b.z <= NEAR_PLANE {
            return None;
        }
        if a.z < NEAR_PLANE {
            a = b + (a - b) * ((b.z - NEAR_PLANE) / (b.z - a.z));
        }
        let seen = |p: &Point3<f64>| style.intrinsics.project(p).map(|(u, v)| [u, v, 1.0 / p.z]);
        let (a, b) = (seen(&a)?, seen(&b)?);
        let upright = (a[1] - b[1]).abs() > (a[0] - b[0]).abs();
        let along = |p: [f64; 3]| if upright { [p[1], p[0], p[2]] } else { p };
        let (mut a, mut b) = (along(a), along(b));
        if a[0] > b[0] {
            std::mem::swap(&mut a, &mut b);
        }
        let length = (b[0] - a[0]).max(1e-6);
        let slope = [(b[1] - a[1]) / length, (b[2] - a[2]) / length];
        Some(Line { start: a, slope, end: b[0], upright })
    }

    /// Draws the strand.
    pub(super) fn draw(&self, canvas: &mut Canvas<'_>, style: &Style<'_>) {
        if style.intrinsics.distortion.is_none() {
            return self.draw_straight(canvas, style);
        }
        let place =
            |k: u32| self.from + (self.to - self.from) * (f64::from(k) / f64::from(BENT_PARTS));
        for k in 0..BENT_PARTS {
            Self { from: place(k), to: place(k + 1), ..*self }.draw_straight(canvas, style);
        }
    }

    /// Draws the strand as a straight line of the picture.
    fn draw_straight(&self, canvas: &mut Canvas<'_>, style: &Style<'_>) {
        let Some(line) = self.project(style) else { return };
        let axis = (self.to - self.from).try_normalize(1e-12).unwrap_or_else(nalgebra::Vector3::x);
        let arriving = style.light.on_rod(&axis);
        let lit = std::array::from_fn(|k| self.material.colour[k] * arriving[k] * style.gain);
        let (across, along) = if line.upright {
            (canvas.width, canvas.height)
        } else {
            (canvas.height, canvas.width)
        };
        let first = line.start[0].ceil().max(0.0) as usize;
        let last = (line.end.floor().min(along as f64 - 1.0) + 1.0).max(0.0) as usize;
        let middle = Point3::from((self.from.coords + self.to.coords) / 2.0);
        let focal = style.intrinsics.fx * style.intrinsics.stretch(&middle);
        let squeeze = 1.0 / (1.0 + line.slope[0] * line.slope[0]).sqrt();
        for major in first..last {
            let step = major as f64 - line.start[0];
            let middle = line.start[1] + line.slope[0] * step;
            let inverse = line.start[2] + line.slope[1] * step;
            let width = focal * self.diameter * inverse;
            let soft = (0.5 + 6.0 * style.blur * style.blur).sqrt();
            let reach = (width / 2.0 + soft) / squeeze;
            let from = (middle - reach).ceil().max(0.0) as usize;
            let to = ((middle + reach).floor() + 1.0).clamp(0.0, across as f64) as usize;
            for minor in from..to {
                let aside = ((minor as f64 - middle) * squeeze).abs();
                let i = if line.upright {
                    major * canvas.width + minor
                } else {
                    minor * canvas.width + major
                };
                dot(canvas, i, Dot { aside, width, soft, z: 1.0 / inverse }, lit);
            }
        }
    }
}

/// One pixel of a strand.
struct Dot {
    /// From the strand's middle, pixels.
    aside: f64,
    /// Of the strand, pixels.
    width: f64,
    /// How far to each side a sharp edge is smeared, pixels: pixels and blur as a triangle of the
    /// same variance.
    soft: f64,
    /// Metres along the optical axis.
    z: f64,
}

/// Draws one pixel of a strand.
fn dot(canvas: &mut Canvas<'_>, i: usize, at: Dot, lit: [f64; 3]) {
    let half = at.width / 2.0;
    let coverage = smeared((at.aside + half) / at.soft) - smeared((at.aside - half) / at.soft);
    if coverage <= 0.0 || !canvas.in_front(i, at.z) {
        return;
    }
    // The sides of a round strand are darker. A thin strand has its mean brightness.
    let turned = if at.width > MIN_DEPTH_WIDTH { (at.aside / half).min(1.0) } else { 0.5 };
    let round = 1.2 - 0.65 * turned * turned;
    canvas.blend(i, lit.map(|x| encode(x * round)), coverage);
    if at.width >= MIN_DEPTH_WIDTH && coverage > 0.5 {
        canvas.set_depth(i, Some(at.z));
    }
}

/// How much of a triangular bump, from -1 to 1 and of area 1, is left of `x`.
fn smeared(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    0.5 + x - 0.5 * x * x.abs()
}
