//! Likeness of a pixel to the ball's colour.

/// Degrees in a sixth of the hue circle. Hues are counted in sixths here: 0 red, 1 yellow, 2 green
/// and so on.
const SIXTH: f64 = 60.0;
/// Added to a pixel's brightness, grey levels, so that the noise of dark pixels has no chroma.
const DARK: f32 = 40.0;

/// Loss of likeness for a distance in hue, in the chroma, for each sixth of the hue circle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct HueSlopes {
    /// Towards larger hues.
    up: f32,
    /// Towards smaller hues.
    down: f32,
}

/// For red. Larger hues are orange, as skin and wood are; smaller ones are magenta, as an
/// overexposed red ball is, and cost less.
const RED_SLOPES: HueSlopes = HueSlopes { up: 1.8, down: 1.2 };
/// For all other hues.
const OTHER_SLOPES: HueSlopes = HueSlopes { up: 1.5, down: 1.5 };
/// Distance from hue 0 within which a hue is red, sixths.
const RED_RANGE: f32 = 0.25;

/// The colour of a ball: its hue. Brightness and paleness depend on light and camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BallColour {
    /// 0 to 6, in sixths of the hue circle.
    hue: f32,
    slopes: HueSlopes,
}

impl BallColour {
    /// Makes the colour of hue `degrees`: 0 red, 60 yellow, 120 green, 180 cyan, 240 blue, 300
    /// magenta.
    pub(super) fn new(degrees: f64) -> Self {
        let hue = (degrees / SIXTH).rem_euclid(6.0) as f32;
        let is_other = (RED_RANGE..6.0 - RED_RANGE).contains(&hue);
        Self { hue, slopes: if is_other { OTHER_SLOPES } else { RED_SLOPES } }
    }

    /// Returns the turn of hues that makes this colour red.
    pub(super) fn turn_to_red(&self) -> HueTurn {
        HueTurn::new(-f64::from(self.hue) * SIXTH)
    }

    /// Returns the likeness of a colour (blue, green, red, 0 to 255), 0 to 1.
    ///
    /// It is the chroma (largest less smallest channel), less the loss for the distance in hue,
    /// over the brightness (largest channel); dark pixels are damped.
    #[inline]
    pub(super) fn likeness(&self, colour: [f32; 3]) -> f32 {
        self.damped_likeness(colour, DARK)
    }

    /// Returns the likeness with `dark` grey levels added to the brightness. Free of branches, so
    /// that the compiler computes several pixels at once.
    #[inline]
    pub(super) fn damped_likeness(&self, [b, g, r]: [f32; 3], dark: f32) -> f32 {
        let (most, least) = (larger(larger(r, g), b), smaller(smaller(r, g), b));
        let chroma = most - least;
        let (offset, sixths) = if most == r {
            (g - b, 0.0)
        } else if most == g {
            (b - r, 2.0)
        } else {
            (r - g, 4.0)
        };
        // The distance in hue times the chroma: this saves the division by the chroma.
        let (distance, half) = (offset + (sixths - self.hue) * chroma, 3.0 * chroma);
        let distance = if distance > half {
            distance - 2.0 * half
        } else if distance < -half {
            distance + 2.0 * half
        } else {
            distance
        };
        let lost = larger(distance * self.slopes.up, -distance * self.slopes.down);
        larger(chroma - lost, 0.0) / (most + dark)
    }
}

/// A turn of colours about the grey axis: changes the hue and keeps the brightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HueTurn {
    /// Part of each channel that stays.
    same: f32,
    /// Part that goes from red to green, green to blue and blue to red.
    forward: f32,
    /// Part that goes the other way.
    backward: f32,
}

impl HueTurn {
    /// Makes the turn by `degrees`.
    fn new(degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (third, across) = ((1.0 - cos) / 3.0, sin / 3.0_f64.sqrt());
        Self {
            same: (cos + third) as f32,
            forward: (third + across) as f32,
            backward: (third - across) as f32,
        }
    }

    /// Returns red, green and blue of a colour (blue, green, red) after the turn.
    #[inline]
    pub(super) fn apply(&self, [b, g, r]: [f32; 3]) -> [f32; 3] {
        let turned =
            |own, before, after| self.same * own + self.forward * before + self.backward * after;
        [turned(r, b, g), turned(g, r, b), turned(b, g, r)]
    }
}

/// Returns the larger of two numbers, neither of which is NaN (faster than `f32::max`).
#[inline]
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Returns the smaller of two numbers, neither of which is NaN.
#[inline]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(degrees: f64, [r, g, b]: [u8; 3]) -> f32 {
        BallColour::new(degrees).likeness([b, g, r].map(f32::from))
    }

    #[test]
    fn only_the_ball_s_hue_counts() {
        for (degrees, own) in [
            (0.0, [200, 30, 32]),
            (-358.0, [200, 32, 30]),
            (60.0, [210, 205, 30]),
            (120.0, [30, 180, 40]),
            (220.0, [30, 80, 200]),
            (300.0, [200, 30, 200]),
            (360.0, [200, 30, 45]),
        ] {
            assert!(of(degrees, own) > 0.55, "{degrees}: {}", of(degrees, own));
            assert_eq!(of(degrees + 180.0, own), 0.0, "{degrees}");
            assert_eq!(of(degrees, [128, 128, 128]), 0.0);
        }
        // Skin and an orange ball are hardly red.
        assert!(of(0.0, [228, 178, 148]) < 0.12 && of(0.0, [240, 132, 30]) < 0.12);
    }

    #[test]
    fn exposure_hardly_changes_the_likeness_until_it_is_dark() {
        let bright = of(0.0, [240, 36, 39]);
        let dim = of(0.0, [120, 18, 20]);
        assert!((dim / bright - 1.0).abs() < 0.15, "{dim} {bright}");
        assert!(of(0.0, [6, 1, 1]) < 0.12);
    }
}
