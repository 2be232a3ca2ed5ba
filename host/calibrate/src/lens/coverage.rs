//! Part of the picture in which corners of the board were seen.

use nalgebra::Point2;
use plumb_frame::image::ImageSize;

/// Columns and rows of the cells that are counted.
const CELLS: [usize; 2] = [8, 6];
/// Names of the regions of a picture, row by row.
const REGIONS: [&str; 9] = [
    "upper left corner",
    "upper edge",
    "upper right corner",
    "left edge",
    "middle",
    "right edge",
    "lower left corner",
    "lower edge",
    "lower right corner",
];

/// Part of the picture in which corners were seen.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coverage {
    /// Part of the cells with a corner, 0 to 1.
    pub(super) part: f64,
    /// Names of the regions without a corner.
    pub(super) empty: Vec<&'static str>,
}

impl Coverage {
    /// Counts the cells and the regions of a picture of `size` with `points`, pixels.
    pub(super) fn of(points: impl Iterator<Item = Point2<f64>>, size: ImageSize) -> Self {
        let mut cells = [[false; CELLS[0]]; CELLS[1]];
        let mut regions = [false; REGIONS.len()];
        for point in points {
            let place = |k: f64, pixels: usize, parts: usize| {
                ((k + 0.5) / pixels as f64 * parts as f64).clamp(0.0, parts as f64 - 1.0) as usize
            };
            let row = place(point.y, size.height, CELLS[1]);
            cells[row][place(point.x, size.width, CELLS[0])] = true;
            regions[3 * place(point.y, size.height, 3) + place(point.x, size.width, 3)] = true;
        }
        let seen = cells.as_flattened().iter().filter(|&&is_seen| is_seen).count();
        let empty = REGIONS.into_iter().zip(regions).filter(|(_, is_seen)| !is_seen);
        Self {
            part: seen as f64 / (CELLS[0] * CELLS[1]) as f64,
            empty: empty.map(|(name, _)| name).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_regions_have_names() {
        let size = ImageSize { width: 640, height: 480 };
        let points = [(10.0, 10.0), (320.0, 240.0), (639.4, 479.4)];
        let coverage = Coverage::of(points.into_iter().map(|(u, v)| Point2::new(u, v)), size);
        assert_eq!(coverage.part, 3.0 / 48.0);
        assert_eq!(coverage.empty.len(), 6);
        assert!(coverage.empty.contains(&"lower left corner"), "{coverage:?}");
        assert!(!coverage.empty.contains(&"lower right corner"), "{coverage:?}");
    }
}
