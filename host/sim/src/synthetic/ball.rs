//! Drawing of a ball: shading, anti-aliased edge, depth, and the projector's shadow in the depth
//! behind it.

use nalgebra::{Point3, Vector3};
use opencv::core::{Mat, MatTraitConstManual, Size, Vec4f};
use opencv::imgproc::gaussian_blur_def;
use plumb_frame::camera::Intrinsics;
use rand::{Rng, RngExt};

use super::canvas::Canvas;
use super::light::{CameraLight, Material, encode, specular};
use super::sensor::Disparity;

/// A ball to be drawn, in camera axes, metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct CameraBall {
    pub(super) centre: Point3<f64>,
    pub(super) radius: f64,
    pub(super) material: Material,
}

/// Parameters of drawing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Style<'a> {
    pub(super) intrinsics: &'a Intrinsics,
    pub(super) light: &'a CameraLight,
    /// Exposure, 1 = as the light is.
    pub(super) gain: f64,
    /// Standard deviation of the blur, pixels.
    pub(super) blur: f64,
    /// Whether the depth has holes.
    pub(super) holes: bool,
}

/// Highlights brighter than this blind the depth sensor.
const BLINDING: f64 = 0.35;
/// Where the depth sensor's projector is, in camera axes, metres (a Kinect's and a Carmine's
/// baseline).
const PROJECTOR: Vector3<f64> = Vector3::new(0.075, 0.0, 0.0);

/// Intersection of a pixel's line of sight with the ball.
struct Fragment {
    /// Share of the pixel that the ball covers, 0 to 1.
    coverage: f64,
    normal: Vector3<f64>,
    to_eye: Vector3<f64>,
    /// Along the optical axis, metres.
    z: f64,
}

impl CameraBall {
    /// Returns the intersection with the line of sight along `direction` (camera axes, z = 1), for
    /// a camera with a focal length of `focal` pixels.
    fn intersect(&self, direction: &Vector3<f64>, focal: f64) -> Option<Fragment> {
        let length = direction.norm();
        let ray = direction / length;
        let centre = self.centre.coords;
        let nearest = ray.dot(&centre);
        let aside_squared = (centre.norm_squared() - nearest * nearest).max(0.0);
        // From metres beside the edge to pixels: the edge is seen under a smaller angle the farther
        // off the axis.
        let pixels = focal * length.powf(1.5) / centre.norm();
        let coverage = (0.5 + (self.radius - aside_squared.sqrt()) * pixels).clamp(0.0, 1.0);
        if coverage <= 0.0 || nearest <= 0.0 {
            return None;
        }
        let depth = (self.radius * self.radius - aside_squared).max(0.0).sqrt();
        let hit = ray * (nearest - depth);
        let normal = (hit - centre).try_normalize(1e-12).unwrap_or(-ray);
        Some(Fragment { coverage, normal, to_eye: -ray, z: hit.z })
    }

    /// Draws the ball. A ball that reaches the camera is not drawn.
    ///
    /// # Errors
    /// If OpenCV fails to blur the layer.
    pub(super) fn draw(
        &self,
        canvas: &mut Canvas<'_>,
        style: &Style<'_>,
        random: &mut impl Rng,
    ) -> opencv::Result<()> {
        let lens = style.intrinsics;
        let (Some((u, v)), true) = (lens.project(&self.centre), self.centre.z > 1.2 * self.radius)
        else {
            return Ok(());
        };
        let obliquity = self.centre.coords.norm_squared() / (self.centre.z * self.centre.z);
        let focal = lens.fx.max(lens.fy) * lens.stretch(&self.centre);
        let seen = focal * self.radius / (self.centre.z - self.radius) * obliquity;
        let Some([left, right, top, bottom]) = canvas.window(u, v, seen + 2.0 + 3.0 * style.blur)
        else {
            return Ok(());
        };
        let mut layer = Vec::with_capacity((right - left) * (bottom - top));
        for row in top..bottom {
            let mut span: Option<(usize, usize)> = None;
            for column in left..right {
                let direction = lens.deproject(column as f64, row as f64, 1.0).coords;
                let fragment = self.intersect(&direction, lens.fx);
                layer.push(
                    fragment
                        .as_ref()
                        .map_or_else(Vec4f::default, |fragment| self.colour(fragment, style)),
                );
                let Some(fragment) = fragment.filter(|fragment| fragment.coverage > 0.5) else {
                    continue;
                };
                let i = row * canvas.width + column;
                if canvas.in_front(i, fragment.z) {
                    span = Some((span.map_or(column, |(first, _)| first), column));
                    let lost = style.holes && self.is_lost(&fragment, style, random.random());
                    canvas.set_depth(i, (!lost).then_some(fragment.z));
                }
            }
            if let (Some(span), true) = (span, style.holes) {
                let near = canvas.sensor.at_metres(self.centre.z);
                throw_shadow(canvas, row, span, near, random.random_range(-1.0..1.0));
            }
        }
        self.lay(canvas, [left, right, top, bottom], layer, style.blur)
    }

    /// Returns the colour (0 to 255) times coverage, and coverage.
    fn colour(&self, fragment: &Fragment, style: &Style<'_>) -> Vec4f {
        let highlight = style.light.highlight(&self.material, &fragment.normal, &fragment.to_eye);
        let linear =
            style.light.shade(&self.material, &fragment.normal, &fragment.to_eye, highlight);
        let [b, g, r] = linear.map(|x| (encode(x * style.gain) * fragment.coverage) as f32);
        Vec4f::from([b, g, r, fragment.coverage as f32])
    }

    /// Returns whether the depth sensor gets no depth here. `hash_noise` is uniform in 0 to 1.
    fn is_lost(&self, fragment: &Fragment, style: &Style<'_>, hash_noise: f64) -> bool {
        let facing = fragment.normal.dot(&fragment.to_eye);
        let to_projector = (PROJECTOR + fragment.to_eye * fragment.z)
            .try_normalize(1e-12)
            .unwrap_or(fragment.to_eye);
        let glare = style
            .light
            .highlight(&self.material, &fragment.normal, &fragment.to_eye)
            .max(0.9 * specular(&self.material, &fragment.normal, &fragment.to_eye, &to_projector));
        glare > BLINDING + 0.15 * (hash_noise - 0.5) || facing < 0.12 + 0.3 * hash_noise
    }

    /// Lays the finished `layer` of `window` over the frame.
    fn lay(
        &self,
        canvas: &mut Canvas<'_>,
        [left, right, top, bottom]: [usize; 4],
        layer: Vec<Vec4f>,
        blur: f64,
    ) -> opencv::Result<()> {
        let mut blurred = Mat::default();
        let layer: &[Vec4f] = if blur > 0.0 {
            let sharp =
                Mat::new_rows_cols_with_data((bottom - top) as i32, (right - left) as i32, &layer)?;
            gaussian_blur_def(&sharp, &mut blurred, Size::default(), blur)?;
            blurred.data_typed()?
        } else {
            &layer
        };
        for (row, line) in (top..bottom).zip(layer.chunks_exact(right - left)) {
            for (column, &value) in (left..right).zip(line) {
                let i = row * canvas.width + column;
                let [b, g, r, alpha] = value.0.map(f64::from);
                if alpha > 1e-3 && canvas.in_front(i, self.centre.z - self.radius) {
                    canvas.blend(i, [b, g, r].map(|x| (x / alpha).min(255.0)), alpha.min(1.0));
                }
            }
        }
        Ok(())
    }
}

/// Removes the depth in the projector's shadow of an object that covers columns `span` of `row` at
/// disparity `near`. `ragged` shifts the shadow's edge (pixels), as rows of a real shadow differ.
fn throw_shadow(canvas: &mut Canvas<'_>, row: usize, span: (usize, usize), near: u16, ragged: f64) {
    let longest = Disparity::shadow(near, 0).ceil() as usize + 2;
    for column in span.0.saturating_sub(longest)..span.0 {
        let far = &mut canvas.disparity[row * canvas.width + column];
        if *far == 0 {
            continue;
        }
        let shifted = column as f64 + Disparity::shadow(near, *far) + ragged;
        if shifted >= span.0 as f64 && shifted <= span.1 as f64 {
            *far = 0;
        }
    }
}
