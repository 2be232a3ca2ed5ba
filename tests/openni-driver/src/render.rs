//! Rendering: a red ball in front of a wall.

use crate::control::Control;

/// Focal length at 640 columns, pixels; both axes.
pub const FOCAL_LENGTH: f64 = 525.0;

/// Principal point, as a part of width and height; half a pixel is subtracted.
pub const INTRINSICS_CENTRE: f64 = 0.5;

/// Distance of the wall, m.
const WALL: f64 = 2.2;
/// Points a pixel is looked at, along each side.
const FINE: usize = 4;
/// Where the light comes from, camera axes: from above, the left and the camera's side.
const LIGHT: [f64; 3] = [-0.45, -0.72, -0.53];
/// Columns that unregistered depth is off by, at 640: a camera's sensors are apart.
const UNREGISTERED: f64 = 22.0;

/// How a stream is to be rendered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct View {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Whether left and right are exchanged.
    pub mirrored: bool,
    /// Depth only: as the colour sensor would see it.
    pub registered: bool,
}

/// The ball in a picture's pixels.
struct Disc {
    centre: [f64; 3],
    radius: f64,
    focal: f64,
    middle: (f64, f64),
}

impl Disc {
    fn of(control: &Control, view: &View) -> Option<Self> {
        let focal = FOCAL_LENGTH * view.width as f64 / 640.0;
        let middle = |length: usize| length as f64 * INTRINSICS_CENTRE - 0.5;
        let centre = control.ball.filter(|ball| ball[2] > control.diameter)?;
        let middle = (middle(view.width), middle(view.height));
        Some(Self { centre, radius: control.diameter / 2.0, focal, middle })
    }

    /// Where a ray through (`u`, `v`) meets the ball: distance along the axis and the light there,
    /// 0 to 1.
    fn hit(&self, u: f64, v: f64) -> Option<(f64, f64)> {
        let ray = [(u - self.middle.0) / self.focal, (v - self.middle.1) / self.focal, 1.0];
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (a, b) = (dot(&ray, &ray), dot(&ray, &self.centre));
        let under = b * b - a * (dot(&self.centre, &self.centre) - self.radius * self.radius);
        let z = (under >= 0.0).then(|| (b - under.sqrt()) / a)?;
        let normal = [0, 1, 2].map(|i| (z * ray[i] - self.centre[i]) / self.radius);
        Some((z, 0.35 + 0.65 * dot(&normal, &LIGHT).max(0.0)))
    }

    /// Columns and rows that the ball may be seen in.
    fn bounds(&self, view: &View) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let reach = 1.1 * self.radius * self.focal / (self.centre[2] - self.radius) + 2.0;
        let range = |middle: f64, at: f64, length: usize| {
            let pixel = middle + self.focal * at / self.centre[2];
            let bound = |x: f64| x.clamp(0.0, length as f64) as usize;
            bound(pixel - reach)..bound(pixel + reach + 1.0)
        };
        (
            range(self.middle.0, self.centre[0], view.width),
            range(self.middle.1, self.centre[1], view.height),
        )
    }
}

/// Renders red, green, blue, row by row.
pub fn colour(control: &Control, view: &View, pixels: &mut [u8]) {
    for (i, pixel) in pixels.chunks_exact_mut(3).enumerate() {
        pixel.copy_from_slice(&wall(i % view.width, i / view.width, view.width));
    }
    let Some(disc) = Disc::of(control, view) else { return mirror::<3>(view, pixels) };
    let (columns, rows) = disc.bounds(view);
    for y in rows {
        for x in columns.clone() {
            let (mut light, mut hits) = (0.0, 0.0);
            for fine in 0..FINE * FINE {
                let part = |k: usize| (k as f64 + 0.5) / FINE as f64 - 0.5;
                if let Some((_, l)) =
                    disc.hit(x as f64 + part(fine % FINE), y as f64 + part(fine / FINE))
                {
                    (light, hits) = (light + l, hits + 1.0);
                }
            }
            let all = (FINE * FINE) as f64;
            let at = 3 * (y * view.width + x);
            for (value, red) in pixels[at..at + 3].iter_mut().zip([205.0, 24.0, 30.0]) {
                *value = ((f64::from(*value) * (all - hits) + red * light) / all).round() as u8;
            }
        }
    }
    mirror::<3>(view, pixels);
}

/// Renders depths in millimetres, row by row, as bytes of the machine's order.
pub fn depth(control: &Control, view: &View, pixels: &mut [u8]) {
    for pixel in pixels.chunks_exact_mut(2) {
        pixel.copy_from_slice(&millimetres(WALL).to_ne_bytes());
    }
    let Some(disc) = Disc::of(control, view) else { return };
    let off = if view.registered { 0.0 } else { UNREGISTERED * view.width as f64 / 640.0 };
    let (columns, rows) = disc.bounds(view);
    for y in rows {
        for x in columns.clone() {
            let column = x as f64 + off;
            if let Some((z, _)) = disc.hit(x as f64, y as f64)
                && column < view.width as f64
            {
                let at = 2 * (y * view.width + column as usize);
                pixels[at..at + 2].copy_from_slice(&millimetres(z).to_ne_bytes());
            }
        }
    }
    mirror::<2>(view, pixels);
}

fn millimetres(metres: f64) -> u16 {
    (metres * 1e3).round() as u16
}

/// Grey, lighter to the right, with some structure.
fn wall(x: usize, y: usize, width: usize) -> [u8; 3] {
    let tile = if (x / 40 + y / 40).is_multiple_of(2) { 6 } else { 0 };
    let grey = (90 + 60 * x / width) as u8 + tile;
    [grey, grey + 3, grey + 6]
}

/// Exchanges left and right where the view is mirrored, pixels of `N` bytes.
fn mirror<const N: usize>(view: &View, pixels: &mut [u8]) {
    if view.mirrored {
        for row in pixels.chunks_exact_mut(N * view.width) {
            row.as_chunks_mut::<N>().0.reverse();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: View = View { width: 640, height: 480, mirrored: false, registered: true };

    /// Mean column and row of the pixels that `is` holds for.
    fn middle(is: impl Fn(usize) -> bool) -> (f64, f64) {
        let hits: Vec<usize> = (0..640 * 480).filter(|&i| is(i)).collect();
        let mean = |f: &dyn Fn(usize) -> usize| {
            hits.iter().map(|&i| f(i) as f64).sum::<f64>() / hits.len() as f64
        };
        (mean(&|i| i % 640), mean(&|i| i / 640))
    }

    #[test]
    fn both_frames_show_the_ball_at_its_pinhole_projection() {
        let control = Control { ball: Some([0.2, -0.1, 1.0]), ..Control::default() };
        let (mut rgb, mut mm) = (vec![0; 640 * 480 * 3], vec![0; 640 * 480 * 2]);
        let ranges = |mm: &[u8]| -> Vec<u16> {
            mm.as_chunks::<2>().0.iter().map(|&b| u16::from_ne_bytes(b)).collect()
        };
        for (view, u) in [
            (VIEW, 319.5 + 105.0),
            (View { mirrored: true, ..VIEW }, 319.5 - 105.0),
            (View { registered: false, ..VIEW }, 319.5 + 105.0 + UNREGISTERED),
        ] {
            colour(&control, &view, &mut rgb);
            depth(&control, &view, &mut mm);
            let ranges = ranges(&mm);
            let (x, y) = middle(|i| ranges[i] < 1500);
            assert!((x - u).abs() < 0.5 && (y - (239.5 - 52.5)).abs() < 0.5, "{view:?}: {x}, {y}");
            assert_eq!(ranges.iter().min(), Some(&960));
            let (x, _) = middle(|i| rgb[3 * i] > rgb[3 * i + 1] + 40);
            let u = if view.registered { u } else { u - UNREGISTERED };
            assert!((x - u).abs() < 0.5, "{view:?}: {x}");
        }
    }
}
