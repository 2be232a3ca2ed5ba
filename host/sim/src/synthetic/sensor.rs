//! Noise models of a structured-light depth sensor and of a low-cost colour sensor.
//!
//! A Kinect or Carmine measures disparity, `d = f b / z`, in steps of an eighth of a pixel. Noise
//! and steps of one size in disparity are noise and steps that grow with z² in depth. A surface
//! in the projector's shadow has no depth: a strip to the left of every foreground object.

use opencv::core::{Mat, MatTraitConstManual, Scalar, Size, mean_std_dev_def};
use opencv::imgproc::gaussian_blur_def;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// Fine units of disparity in one step of the sensor.
const FINE: f64 = 32.0;
/// Steps of disparity in a pixel.
const STEPS_IN_PIXEL: f64 = 8.0;
/// Value of a pixel without depth in a plane of noise.
const HOLE: i8 = i8::MIN;
/// Additional columns of a plane of noise beyond the frame's.
const EXTRA_COLUMNS: usize = 160;
/// Additional rows of a plane of noise beyond the frame's.
const EXTRA_ROWS: usize = 96;

/// Noise model of the sensors. The defaults are those of a Kinect or Carmine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorOptions {
    /// Standard deviation of the colour noise, of 255.
    pub colour_noise: f64,
    /// Standard deviation of the depth at 1 m, metres; at z metres z² of it.
    pub depth_noise: f64,
    /// Step of the depth at 1 m, metres; at z metres z² of it. 0.0005 to 0.1.
    pub depth_step: f64,
    /// Share of the pixels that lack depth at random, 0 to 0.5.
    pub speckle: f64,
    /// Least distance with depth, metres; at least 0.1.
    pub nearest: f64,
    /// Greatest distance with depth, metres.
    pub farthest: f64,
    /// Whether depth has holes at objects: the projector's shadow, edges, highlights.
    pub holes: bool,
}

impl Default for SensorOptions {
    fn default() -> Self {
        Self {
            colour_noise: 2.0,
            depth_noise: 0.001_4,
            depth_step: 0.002_85,
            speckle: 0.002,
            nearest: 0.4,
            farthest: 8.0,
            holes: true,
        }
    }
}

/// Depth in the sensor's terms: disparity in fine units (1/32 of its step), 0 = no depth.
#[derive(Debug, Clone)]
pub(super) struct Disparity {
    /// Fine units times metres.
    constant: f64,
    nearest: f64,
    farthest: f64,
    /// Raw depth of each step of disparity.
    depths: Vec<u16>,
}

impl Disparity {
    /// Creates the conversion for raw depth of `scale` units a metre.
    pub(super) fn new(options: &SensorOptions, scale: f64) -> Self {
        let steps_metres = 1.0 / options.depth_step;
        let depths = (0..=u16::MAX / FINE as u16 + 8)
            .map(|step| steps_metres / f64::from(step))
            .map(|z| (z, (z * scale).round()))
            .map(|(z, raw)| {
                let in_range =
                    z >= options.nearest && z <= options.farthest && raw <= f64::from(u16::MAX);
                if in_range { raw as u16 } else { 0 }
            })
            .collect();
        let constant = steps_metres * FINE;
        // Nearer than this the fine units overflow.
        let nearest = options.nearest.max(constant / f64::from(u16::MAX - 512));
        Self { constant, nearest, farthest: options.farthest, depths }
    }

    /// Returns the fine disparity of `z` metres; 0 outside the sensor's range.
    pub(super) fn at_metres(&self, z: f64) -> u16 {
        if z >= self.nearest && z <= self.farthest { (self.constant / z).round() as u16 } else { 0 }
    }

    /// Returns the width (pixels) of the projector's shadow to the left of an object at disparity
    /// `near` on a surface at `far`.
    pub(super) fn shadow(near: u16, far: u16) -> f64 {
        (f64::from(near) - f64::from(far)) / (FINE * STEPS_IN_PIXEL)
    }

    /// The raw depth image of `disparity` with `noise` (row by row, of `noise_width` columns from
    /// `start`).
    fn finish(
        &self,
        disparity: &[u16],
        width: usize,
        noise: &NoisePlane,
        start: usize,
        depth: &mut [u16],
    ) {
        let rows = disparity.chunks_exact(width).zip(depth.chunks_exact_mut(width));
        for (row, (disparity, depth)) in rows.enumerate() {
            let from = start + row * noise.width;
            for ((out, &fine), &noise) in
                depth.iter_mut().zip(disparity).zip(&noise.values[from..from + width])
            {
                let step = (i32::from(fine) + i32::from(noise) + FINE as i32 / 2) >> 5;
                let known = fine != 0 && noise != HOLE;
                *out = if known {
                    self.depths.get(step.max(0) as usize).copied().unwrap_or(0)
                } else {
                    0
                };
            }
        }
    }
}

/// A plane of noise, larger than the frame. Each frame uses a random part of it.
#[derive(Debug, Clone)]
struct NoisePlane {
    values: Vec<i8>,
    /// Values in a row.
    width: usize,
}

/// Noise models of both sensors.
#[derive(Debug, Clone)]
pub(super) struct Sensor {
    pub(super) disparity: Disparity,
    pub(super) options: SensorOptions,
    colour: NoisePlane,
    depth: NoisePlane,
}

impl Sensor {
    /// Sensors for frames of `width` x `height`, whose noise is drawn from `random`.
    pub(super) fn new(
        options: SensorOptions,
        scale: f64,
        (width, height): (usize, usize),
        random: &mut impl Rng,
    ) -> opencv::Result<Self> {
        let (width, height) = (width + EXTRA_COLUMNS, height + EXTRA_ROWS);
        let fine = options.depth_noise / options.depth_step * FINE;
        let colour = gaussian_noise(3 * width, height, options.colour_noise, None, random)?;
        let mut depth = gaussian_noise(width, height, fine, Some(1.1), random)?;
        speckle(&mut depth, options.speckle, random);
        Ok(Self { disparity: Disparity::new(&options, scale), options, colour, depth })
    }

    /// Adds this frame's noise to `colour` and makes raw `depth` of `disparity`.
    pub(super) fn finish(
        &self,
        width: usize,
        colour: &mut [u8],
        disparity: &[u16],
        depth: &mut [u16],
        random: &mut impl Rng,
    ) {
        let start = random.random_range(0..EXTRA_ROWS) * self.colour.width
            + 3 * random.random_range(0..EXTRA_COLUMNS);
        for (row, pixels) in colour.chunks_exact_mut(3 * width).enumerate() {
            let from = start + row * self.colour.width;
            for (value, &noise) in
                pixels.iter_mut().zip(&self.colour.values[from..from + 3 * width])
            {
                *value = value.saturating_add_signed(noise);
            }
        }
        let start = random.random_range(0..EXTRA_ROWS) * self.depth.width
            + random.random_range(0..EXTRA_COLUMNS);
        self.disparity.finish(disparity, width, &self.depth, start, depth);
    }
}

/// Returns normal noise of standard deviation `sd`, smoothed over `correlation` pixels if given.
fn gaussian_noise(
    width: usize,
    height: usize,
    sd: f64,
    correlation: Option<f64>,
    random: &mut impl Rng,
) -> opencv::Result<NoisePlane> {
    let mut values: Vec<f32> = (0..width * height).map(|_| random.sample(StandardNormal)).collect();
    if let Some(sigma) = correlation {
        let white = Mat::new_rows_cols_with_data(height as i32, width as i32, &values)?;
        let mut smooth = Mat::default();
        gaussian_blur_def(&white, &mut smooth, Size::default(), sigma)?;
        let (mut mean, mut deviation) = (Scalar::default(), Scalar::default());
        mean_std_dev_def(&smooth, &mut mean, &mut deviation)?;
        let gain = 1.0 / deviation[0].max(1e-9) as f32;
        values = smooth.data_typed::<f32>()?.iter().map(|x| x * gain).collect();
    }
    let values =
        values.iter().map(|x| (f64::from(*x) * sd).round().clamp(-127.0, 127.0) as i8).collect();
    Ok(NoisePlane { values, width })
}

/// Removes a `share` of the depth in specks of one to six pixels.
fn speckle(plane: &mut NoisePlane, share: f64, random: &mut impl Rng) {
    let specks = (share / 2.5 * plane.values.len() as f64) as usize;
    let reach = plane.values.len().saturating_sub(plane.width + 3).max(1);
    for _ in 0..specks {
        let at = random.random_range(0..reach);
        let (columns, rows) = (random.random_range(1..=3), random.random_range(1..=2));
        for row in 0..rows {
            for value in plane.values.iter_mut().skip(at + row * plane.width).take(columns) {
                *value = HOLE;
            }
        }
    }
}
