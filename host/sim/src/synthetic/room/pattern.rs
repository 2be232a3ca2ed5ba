//! Surface patterns.

use nalgebra::Vector3;

/// Variation of a surface's colour. Second colours are linear, order blue, green, red.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// It does not.
    Plain,
    /// A little, as paint and paper do.
    Mottled,
    /// Grain along its own y.
    Wood,
    /// Floor boards, 0.14 m wide, along its own x.
    Boards,
    /// Backs of books side by side, along its own y.
    Books,
    /// A band of another colour around the middle, as the print on a can has.
    Label([f64; 3]),
    /// Lines of print on its faces, as on a form or a notice.
    Print([f64; 3]),
    /// Brighter at the top, as the sky in a window.
    Sky,
    /// Woven cloth with soft folds along its own z.
    Cloth,
    /// Carpet: tufts, and patches of wear.
    Carpet,
    /// Paint under uneven light, brighter in one place than half a metre further.
    Uneven,
    /// Doors of a cupboard, 0.4 m wide, with gaps and handles, along its own y.
    Doors,
    /// Patches of a second colour, as an apple has.
    Blush([f64; 3]),
}

impl Pattern {
    /// Returns whether the pattern has edges, which need anti-aliasing.
    pub(super) fn has_edges(self) -> bool {
        matches!(self, Self::Books | Self::Label(_) | Self::Print(_) | Self::Boards | Self::Doors)
    }

    /// Returns the colour at `p` (metres along the solid's own axes) of a surface whose own colour
    /// is `base`.
    pub(in crate::synthetic) fn colour(self, base: [f64; 3], p: Vector3<f64>) -> [f64; 3] {
        let scaled = |by: f64| base.map(|x| x * by);
        match self {
            Self::Plain => base,
            Self::Mottled => scaled(0.92 + 0.16 * value_noise(p * 6.0)),
            Self::Wood => {
                let rings = value_noise(Vector3::new(p.x * 9.0, p.y * 1.3, p.z * 9.0)) * 9.0;
                let fine = value_noise(Vector3::new(p.x * 160.0, p.y * 9.0, p.z * 160.0));
                scaled(0.78 + 0.20 * (rings - rings.floor()).powi(2) + 0.14 * fine)
            }
            Self::Boards => boards(base, &p),
            Self::Books => books(&p),
            Self::Label(second) => {
                let wave = 0.02 * (p.x * 90.0).sin();
                let letters =
                    hash_noise((p.y * 170.0).floor() as i64, (p.z * 60.0).floor() as i64, 5) > 0.62;
                if (p.z + wave).abs() < 0.018 || (letters && p.z.abs() < 0.03) {
                    second
                } else {
                    base
                }
            }
            Self::Print(ink) => print(base, ink, &p),
            Self::Sky => scaled(0.75 + 0.35 * (p.z + 0.5).clamp(0.0, 1.0)),
            Self::Cloth => {
                let folds = value_noise(Vector3::new(p.x * 11.0, p.y * 11.0, p.z * 1.5));
                scaled((0.55 + 0.6 * folds) * (0.9 + 0.2 * value_noise(p * 300.0)))
            }
            Self::Carpet => {
                let (tufts, wear) = (value_noise(p * 160.0), value_noise(p * 3.0));
                scaled((0.6 + 0.8 * tufts) * (0.75 + 0.5 * wear))
            }
            Self::Uneven => scaled(0.6 + 0.55 * value_noise(p * 1.4)),
            Self::Doors => doors(base, &p),
            Self::Blush(second) => {
                let share = ((value_noise(p * 30.0) - 0.4) * 3.0).clamp(0.0, 1.0);
                std::array::from_fn(|k| base[k] * (1.0 - share) + second[k] * share)
            }
        }
    }
}

fn boards(base: [f64; 3], p: &Vector3<f64>) -> [f64; 3] {
    const WIDTH: f64 = 0.14;
    let board = (p.y / WIDTH).floor();
    let across = p.y / WIDTH - board;
    let tone = 0.8 + 0.35 * hash_noise(board as i64, 0, 1);
    let gaussian_noise = value_noise(Vector3::new(p.x * 2.0, p.y * 60.0, board));
    let gap = if across < 0.03 { 0.35 } else { 1.0 };
    base.map(|x| x * gap * tone * (0.85 + 0.3 * gaussian_noise))
}

fn doors(base: [f64; 3], p: &Vector3<f64>) -> [f64; 3] {
    const WIDTH: f64 = 0.4;
    const HANDLE: [f64; 3] = [0.45, 0.47, 0.5];
    let door = (p.y / WIDTH).floor();
    let across = p.y - door * WIDTH;
    if across < 0.006 {
        return base.map(|x| 0.15 * x);
    }
    if (0.35..0.37).contains(&across) && p.z.abs() < 0.06 {
        return HANDLE;
    }
    let tone = 0.92 + 0.12 * hash_noise(door as i64, 2, 11);
    base.map(|x| x * tone * (0.95 + 0.1 * value_noise(p * 4.0)))
}

fn books(p: &Vector3<f64>) -> [f64; 3] {
    /// Covers, linear, order blue, green, red.
    const COVERS: [[f64; 3]; 9] = [
        [0.25, 0.10, 0.04],
        [0.05, 0.06, 0.36],
        [0.10, 0.25, 0.08],
        [0.55, 0.62, 0.66],
        [0.04, 0.30, 0.55],
        [0.03, 0.03, 0.04],
        [0.30, 0.22, 0.10],
        [0.06, 0.12, 0.30],
        [0.35, 0.40, 0.42],
    ];
    let slot = (p.y / 0.034).floor();
    let across = p.y / 0.034 - slot;
    let slot = slot as i64;
    let height = 0.02 + 0.09 * hash_noise(slot, 3, 2);
    if p.z > 0.125 - height || across < 0.06 {
        return [0.015; 3];
    }
    let cover = COVERS[(hash_noise(slot, 7, 3) * 8.999) as usize];
    let title =
        (p.z - 0.01).abs() < 0.03 && (0.3..0.75).contains(&across) && hash_noise(slot, 9, 4) > 0.4;
    if title {
        [0.5, 0.6, 0.6]
    } else {
        cover.map(|x| x * (0.7 + 0.5 * (1.0 - (2.0 * across - 1.0).powi(2))))
    }
}

fn print(base: [f64; 3], ink: [f64; 3], p: &Vector3<f64>) -> [f64; 3] {
    let line = (p.z / 0.025).floor();
    let within = p.z / 0.025 - line;
    let (line, letter) = (line as i64, (p.y / 0.012).floor() as i64);
    let word = hash_noise(line, letter.div_euclid(5), 6) > 0.25;
    let inked = (0.3..0.72).contains(&within) && word && hash_noise(line, letter, 8) > 0.35;
    if inked { ink } else { base }
}

/// A number in 0 to 1 that looks random but is always the same for the same arguments.
pub(super) fn hash_noise(a: i64, b: i64, c: i64) -> f64 {
    let mut x = (a as u64)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add((b as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f))
        .wrapping_add((c as u64).wrapping_mul(0x1656_67b1_9e37_79f9));
    for _ in 0..2 {
        x = (x ^ (x >> 31)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    }
    ((x >> 11) as f64) / ((1_u64 << 53) as f64)
}

/// Smooth noise, 0 to 1, that changes over a unit of length.
fn value_noise(p: Vector3<f64>) -> f64 {
    let cell = p.map(f64::floor);
    let within = (p - cell).map(|x| x * x * (3.0 - 2.0 * x));
    let mut sum = 0.0;
    for corner in 0..8_u8 {
        let offset = [0, 1, 2].map(|k| f64::from((corner >> k) & 1));
        let weight: f64 =
            (0..3).map(|k| if offset[k] > 0.5 { within[k] } else { 1.0 - within[k] }).product();
        let at = [0, 1, 2].map(|k| (cell[k] + offset[k]) as i64);
        sum += weight * hash_noise(at[0], at[1], at[2]);
    }
    sum
}
