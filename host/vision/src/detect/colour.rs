//! How much a pixel has the ball's colour.

/// Hues around the circle of colours are counted in sixths of it here: 0 red, 1 yellow, 2 green and
/// so on.
const SIXTH: f64 = 60.0;
/// Added to a pixel's brightness, grey levels, so that the noise of dark pixels is no colour.
const DARK: f32 = 40.0;

/// The colour of a ball: its hue. How bright and how pale it is is the light's and the camera's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BallColour {
    /// 0 to 6.
    hue: f32,
    /// What is lost for a sixth of the circle towards larger hues and towards smaller ones.
    slopes: [f32; 2],
}

impl BallColour {
    /// Of the hue `degrees`: 0 red, 60 yellow, 120 green, 180 cyan, 240 blue, 300 magenta.
    pub(super) fn new(degrees: f64) -> Self {
        let hue = (degrees / SIXTH).rem_euclid(6.0) as f32;
        // Red is told more strictly from orange, as skin and wood are, than from magenta: an
        // overexposed red ball is pink.
        let slopes = if (0.25..5.75).contains(&hue) { [1.5, 1.5] } else { [1.8, 1.2] };
        Self { hue, slopes }
    }

    /// How much a colour (blue, green, red, 0 to 255) has of it, 0 to 1: its chroma (the largest of
    /// its channels less the smallest), less for another hue, over its brightness (the largest
    /// channel), dark pixels damped.
    #[inline]
    pub(super) fn of(&self, colour: [f32; 3]) -> f32 {
        self.damped(colour, DARK)
    }

    /// The same of a colour (blue, green, red, 0 to 255), damped by `dark` grey levels. Without
    /// branches, so that it is computed of several pixels at once.
    #[inline]
    pub(super) fn damped(&self, [b, g, r]: [f32; 3], dark: f32) -> f32 {
        let (most, least) = (larger(larger(r, g), b), smaller(smaller(r, g), b));
        let chroma = most - least;
        let (way, sixths) = if most == r {
            (g - b, 0.0)
        } else if most == g {
            (b - r, 2.0)
        } else {
            (r - g, 4.0)
        };
        // All hues times chroma, which then need not be divided by.
        let (off, half) = (way + (sixths - self.hue) * chroma, 3.0 * chroma);
        let off = if off > half {
            off - 2.0 * half
        } else if off < -half {
            off + 2.0 * half
        } else {
            off
        };
        let lost = larger(off * self.slopes[0], -off * self.slopes[1]);
        larger(chroma - lost, 0.0) / (most + dark)
    }
}

/// The larger of two numbers (neither is NaN, and that need not be looked at).
#[inline]
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers, likewise.
#[inline]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(degrees: f64, [r, g, b]: [u8; 3]) -> f32 {
        BallColour::new(degrees).of([b, g, r].map(f32::from))
    }

    #[test]
    fn a_ball_s_own_hue_counts_and_others_do_not() {
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
    fn exposure_changes_it_little_until_it_is_dark() {
        let bright = of(0.0, [240, 36, 39]);
        let dim = of(0.0, [120, 18, 20]);
        assert!((dim / bright - 1.0).abs() < 0.15, "{dim} {bright}");
        assert!(of(0.0, [6, 1, 1]) < 0.12);
    }
}
