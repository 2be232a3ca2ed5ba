//! Composites rendered objects into a recorded frame: shading, depth, blur, motion.

mod appearance;
mod blur;
mod depth;
mod repaint;

use nalgebra::{Point3, Vector3};
use opencv::core::Vec4f;
use plumb_frame::camera::{Camera, Intrinsics};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

pub use appearance::Appearance;
pub use repaint::Paint;

use blur::{blurred, defocused};

use super::error::SyntheticError;
use super::light::{CameraLight, Light, decode, encode};
use super::room::Object;

/// Number of rays a pixel along each axis.
const RAYS: usize = 4;

/// A recorded frame that objects are added to.
pub struct Compositor {
    camera: Camera,
    light: CameraLight,
    width: usize,
    height: usize,
    /// Linear, order blue, green, red.
    colour: Vec<[f32; 3]>,
    /// Metres; 0 = none.
    depth: Vec<f32>,
    /// Whether an object covers the pixel.
    covered: Vec<bool>,
}

/// Shear of a moving object whose rows are read out one after the other.
#[derive(Debug, Clone, Copy)]
struct Shear {
    /// Row at which the object is where it is said to be, pixels.
    row: f64,
    /// Motion from row to row: columns, rows.
    by_row: (f64, f64),
}

impl Shear {
    /// Returns where a point seen at (`u`, `v`) is when the row of the object's centre is read.
    fn undo(&self, (u, v): (f64, f64)) -> (f64, f64) {
        let rows = v - self.row;
        (u - self.by_row.0 * rows, v - self.by_row.1 * rows)
    }
}

/// Parameters of the readout.
#[derive(Debug, Clone, Copy)]
pub struct Exposure {
    /// Factor of all light; 1 = unchanged.
    pub gain: f64,
    /// Factor of each colour (blue, green, red), as of a wrong white balance; 1 = unchanged.
    pub cast: [f64; 3],
    /// Standard deviation of the blur of the whole frame, pixels; 0 = sharp.
    pub defocus: f64,
    /// Standard deviation of the colours' noise, of 255.
    pub noise: f64,
    /// Shift of depth against colour, pixels: columns, rows.
    pub shift: (i32, i32),
}

impl Compositor {
    /// Creates a compositor for `frame`, taken by `camera`. `mirrored` swaps left and right.
    pub fn new(frame: &RgbdFrame, camera: &Camera, light: &Light, mirrored: bool) -> Self {
        let (width, height) = (frame.colour().width(), frame.colour().height());
        let table: Vec<f32> = (0..=255_u8).map(|value| decode(value) as f32).collect();
        let (mut colour, mut depth) = (Vec::new(), Vec::new());
        let scale = frame.intrinsics().depth_scale;
        for (pixels, depths) in frame.colour().rows().zip(frame.depth().rows()) {
            let linear = pixels.iter().map(|pixel| pixel.map(|value| table[usize::from(value)]));
            let metres = depths.iter().map(|&raw| (f64::from(raw) / scale) as f32);
            if mirrored {
                colour.extend(linear.rev());
                depth.extend(metres.rev());
            } else {
                colour.extend(linear);
                depth.extend(metres);
            }
        }
        let light = CameraLight::new(light, &camera.pose.rotation.inverse());
        let covered = vec![false; colour.len()];
        Self { camera: camera.clone(), light, width, height, colour, depth, covered }
    }

    /// Multiplies each colour (blue, green, red).
    pub fn tint(&mut self, gains: [f64; 3]) {
        for pixel in &mut self.colour {
            *pixel = std::array::from_fn(|c| pixel[c] * gains[c] as f32);
        }
    }

    /// Returns the least depth within `reach` pixels of (`u`, `v`), metres; infinity if there is
    /// none.
    pub fn nearest(&self, (u, v): (f64, f64), reach: f64) -> f64 {
        let span = |x: f64, size: usize| {
            ((x - reach).max(0.0) as usize).min(size)
                ..((x + reach + 1.0).max(0.0) as usize).min(size)
        };
        let rows = span(v, self.height).step_by(2);
        let depths = rows.flat_map(|row| &self.depth[row * self.width..][span(u, self.width)]);
        depths.copied().filter(|&z| z > 0.0).fold(f64::INFINITY, |least, z| least.min(f64::from(z)))
    }

    /// Adds `object` in front of everything in the frame.
    ///
    /// # Errors
    /// If OpenCV fails to blur the object.
    pub fn add(
        &mut self,
        object: &Object,
        appearance: &Appearance,
        random: &mut impl Rng,
    ) -> Result<(), SyntheticError> {
        let (middle, radius) = object.bounding_sphere();
        let centre = self.camera.pose.inverse() * middle;
        let Some((u, v)) = self.lens().project(&centre).filter(|_| centre.z > 1.2 * radius) else {
            return Ok(());
        };
        let rows = appearance.rolling / self.height as f64;
        let shear =
            Shear { row: v, by_row: (appearance.motion.0 * rows, appearance.motion.1 * rows) };
        let reach = 1.2 * self.lens().fx * radius / (centre.z - radius)
            + 3.0
            + 3.0 * appearance.blur
            + appearance.motion.0.abs().max(appearance.motion.1.abs());
        // The window extends beyond the frame, because blur mixes pixels across the border.
        let [left, right] =
            [u - reach, u + reach].map(|x| x.clamp(-400.0, self.width as f64 + 400.0) as i32);
        let [top, bottom] =
            [v - reach, v + reach].map(|x| x.clamp(-400.0, self.height as f64 + 400.0) as i32);
        if left >= right || top >= bottom {
            return Ok(());
        }
        let layer: Vec<Vec4f> = (top..bottom)
            .flat_map(|row| (left..right).map(move |column| (column, row)))
            .map(|at| self.pixel(object, at, &shear, appearance.linear))
            .collect();
        let layer = blurred(&layer, (right - left, bottom - top), appearance)?;
        for (line, row) in layer.chunks_exact((right - left) as usize).zip(top..bottom) {
            for (value, column) in line.iter().zip(left..right) {
                if let Some(i) = self.index(column, row) {
                    self.blend(i, value, appearance.linear);
                }
            }
            self.set_depths(object, row, left..right, (appearance, &shear), random);
        }
        Ok(())
    }

    /// Draws a line of `width` pixels from `from` to `to` (pixels), grey (0 to 1, linear), without
    /// depth of its own.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), width: f64, grey: f64) {
        let (along, length) =
            ((to.0 - from.0, to.1 - from.1), (to.0 - from.0).hypot(to.1 - from.1).max(1e-9));
        for i in 0..self.colour.len() {
            let (x, y) = ((i % self.width) as f64 - from.0, (i / self.width) as f64 - from.1);
            let way = (x * along.0 + y * along.1) / length;
            let off = (x * along.1 - y * along.0).abs() / length;
            let share = (width / 2.0 + 0.5 - off).clamp(0.0, 1.0).min(width);
            if share > 0.0 && (0.0..=length).contains(&way) {
                let grey = (grey * share) as f32;
                self.colour[i] = self.colour[i].map(|c| c * (1.0 - share as f32) + grey);
            }
        }
    }

    /// Returns the frame read out at `time`.
    ///
    /// # Errors
    /// Where OpenCV refused.
    pub fn finish(
        &self,
        time: f64,
        exposure: &Exposure,
        random: &mut impl Rng,
    ) -> Result<RgbdFrame, SyntheticError> {
        let gains = exposure.cast.map(|cast| cast * exposure.gain);
        let mut noisy = |linear: f64| {
            let noise: f64 = random.sample(StandardNormal);
            (encode(linear) + exposure.noise * noise + 0.5) as u8
        };
        let mut read_out =
            |pixel: &[f32; 3]| std::array::from_fn(|k| noisy(f64::from(pixel[k]) * gains[k]));
        let size = (self.width as i32, self.height as i32);
        let colour = defocused(&self.colour, size, exposure.defocus)?;
        let colour = colour.iter().map(&mut read_out).collect();
        let lens = *self.lens();
        let depth = (0..self.depth.len())
            .map(|i| {
                let (column, row) = ((i % self.width) as i32, (i / self.width) as i32);
                let from = self.index(column - exposure.shift.0, row - exposure.shift.1);
                from.map_or(0, |i| (f64::from(self.depth[i]) * lens.depth_scale).round() as u16)
            })
            .collect();
        let colour = Image::new(self.width, self.height, colour)?;
        let depth = Image::new(self.width, self.height, depth)?;
        Ok(RgbdFrame::new(time, colour, depth, lens)?)
    }

    fn lens(&self) -> &Intrinsics {
        &self.camera.intrinsics
    }

    fn index(&self, column: i32, row: i32) -> Option<usize> {
        let inside =
            (0..self.width as i32).contains(&column) && (0..self.height as i32).contains(&row);
        inside.then(|| row as usize * self.width + column as usize)
    }

    /// Returns depth (metres) and colour (linear) of the intersection of `object` with the ray
    /// through a point of the frame.
    fn intersect(&self, object: &Object, (u, v): (f64, f64)) -> Option<(f64, [f64; 3])> {
        let pose = &self.camera.pose;
        let ray = self.lens().deproject(u, v, 1.0).coords;
        let (depth, normal, surface) =
            object.intersect(Point3::from(pose.translation.vector), pose * ray)?;
        let normal: Vector3<f64> = pose.rotation.inverse() * normal;
        let to_eye = -ray.normalize();
        let highlight = self.light.highlight(&surface, &normal, &to_eye);
        let shaded = self.light.shade(&surface, &normal, &to_eye, highlight);
        Some((depth, std::array::from_fn(|k| shaded[k] + surface.colour[k] * object.glow)))
    }

    /// Returns colour times coverage, and coverage, of `object` in a pixel.
    fn pixel(
        &self,
        object: &Object,
        (column, row): (i32, i32),
        shear: &Shear,
        linear: bool,
    ) -> Vec4f {
        let mut sum = [0.0; 4];
        for i in 0..RAYS * RAYS {
            let off = |k: usize| (k as f64 + 0.5) / RAYS as f64 - 0.5;
            let at = (f64::from(column) + off(i % RAYS), f64::from(row) + off(i / RAYS));
            let Some((_, colour)) = self.intersect(object, shear.undo(at)) else { continue };
            for (sum, value) in sum.iter_mut().zip(colour) {
                *sum += if linear { value } else { encode(value) / 255.0 };
            }
            sum[3] += 1.0;
        }
        Vec4f::from(sum.map(|x| (x / (RAYS * RAYS) as f64) as f32))
    }

    fn blend(&mut self, i: usize, value: &Vec4f, linear: bool) {
        let [b, g, r, share] = value.0;
        if share < 1e-4 {
            return;
        }
        self.covered[i] = true;
        let under = self.colour[i];
        self.colour[i] = std::array::from_fn(|c| {
            let over = [b, g, r][c];
            if linear {
                return under[c] * (1.0 - share) + over;
            }
            let mixed =
                encode(f64::from(under[c])) / 255.0 * f64::from(1.0 - share) + f64::from(over);
            decode_share(mixed)
        });
    }
}

/// Returns the linear light of an sRGB value of 0 to 1.
fn decode_share(value: f64) -> f32 {
    let x = value.clamp(0.0, 1.0);
    (if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }) as f32
}
