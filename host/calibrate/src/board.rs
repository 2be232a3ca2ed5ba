//! The printed board: a ChArUco board of 7 by 5 squares with the markers 0 to 16 of OpenCV's
//! dictionary `DICT_4X4_50`. OpenCV and other programs find the same board.
//!
//! Board axes: the origin is the lower left corner of the chessboard as printed, x points right, y
//! up along the edges, and z out of the paper.

use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};

use crate::dictionary::{CODES, SIDE_CELLS, is_white_cell};

/// Squares along x.
pub const COLUMNS: usize = 7;
/// Squares along y. It is odd: OpenCV 4.6 and later versions then draw the same board.
pub const ROWS: usize = 5;
/// Side of a square on a sheet of A4 or Letter, metres.
pub const SHEET_SQUARE_M: f64 = 0.036;
/// Side of a marker, in sides of a square: 28 mm on 36 mm.
const MARKER_SIDE: f64 = 28.0 / 36.0;

/// A board, described by the side of its squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharucoSheet {
    square: f64,
}

impl CharucoSheet {
    /// The board of a sheet that was printed at its true scale.
    pub const SHEET: Self = Self { square: SHEET_SQUARE_M };

    /// Returns the board whose squares measure `square` metres; `None` unless that is finite and
    /// above 0.
    pub fn with_square(square: f64) -> Option<Self> {
        (square.is_finite() && square > 0.0).then_some(Self { square })
    }

    /// Returns the side of a square, metres.
    pub fn square(&self) -> f64 {
        self.square
    }

    /// Returns the width and the height of the chessboard, metres.
    pub fn size(&self) -> [f64; 2] {
        [COLUMNS as f64 * self.square, ROWS as f64 * self.square]
    }

    /// Returns the corners of the chessboard's outline in order, board axes, metres.
    pub fn outline(&self) -> [Point3<f64>; 4] {
        let [w, h] = self.size();
        [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(|[x, y]| Point3::new(x, y, 0.0))
    }

    /// Returns the inner corners of the chessboard, row by row from the top left (OpenCV's
    /// numbers), board axes, metres.
    pub fn corners(&self) -> Vec<Point2<f64>> {
        let place = |column: usize, row: usize| {
            Point2::new(column as f64 * self.square, (ROWS - row) as f64 * self.square)
        };
        let rows = (1..ROWS).flat_map(|row| (1..COLUMNS).map(move |column| (column, row)));
        rows.map(|(column, row)| place(column, row)).collect()
    }

    /// Returns the corners of marker `id` as printed: top left, top right, bottom right, bottom
    /// left; board axes, metres. `None` if the board has no such marker.
    pub fn marker(&self, id: usize) -> Option<[Point2<f64>; 4]> {
        let whites = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (column, row)));
        let (column, row) = whites.filter(|&(column, row)| is_white(column, row)).nth(id)?;
        let margin = (1.0 - MARKER_SIDE) / 2.0;
        let (left, right) = (column as f64 + margin, (column + 1) as f64 - margin);
        let (top, bottom) = ((ROWS - row) as f64 - margin, (ROWS - row - 1) as f64 + margin);
        Some(
            [[left, top], [right, top], [right, bottom], [left, bottom]]
                .map(|[x, y]| Point2::new(x * self.square, y * self.square)),
        )
    }

    /// Returns the gap between a marker and its square's edge, metres.
    pub(crate) fn gap(&self) -> f64 {
        (1.0 - MARKER_SIDE) / 2.0 * self.square
    }

    /// Returns whether the chessboard is black at a point (board axes, metres); `None` outside it.
    pub fn is_black(&self, x: f64, y: f64) -> Option<bool> {
        let (across, down) = (x / self.square, ROWS as f64 - y / self.square);
        let is_inside =
            (0.0..COLUMNS as f64).contains(&across) && (0.0..ROWS as f64).contains(&down);
        if !is_inside {
            return None;
        }
        let (column, row) = (across as usize, down as usize);
        if !is_white(column, row) {
            return Some(true);
        }
        // Place in the marker, in its cells.
        let margin = (1.0 - MARKER_SIDE) / 2.0;
        let cell = |k: f64| ((k.fract() - margin) / MARKER_SIDE * SIDE_CELLS as f64).floor();
        let (u, v) = (cell(across), cell(down));
        let is_marker =
            (0.0..SIDE_CELLS as f64).contains(&u) && (0.0..SIDE_CELLS as f64).contains(&v);
        Some(is_marker && !is_white_cell(CODES[number(column, row)], u as usize, v as usize))
    }
}

/// Returns whether a square is white and has a marker. The top left one is black.
fn is_white(column: usize, row: usize) -> bool {
    (column + row) % 2 == 1
}

/// Returns the number of the marker of a white square: row by row from the top left.
fn number(column: usize, row: usize) -> usize {
    // Two rows have as many white squares as a row has squares.
    row / 2 * COLUMNS + row % 2 * (COLUMNS / 2) + column / 2
}

/// Place of the board in the rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The board's origin in the rig frame, metres.
    pub origin: Point3<f64>,
    /// Turn about the rig's z axis, radians, counter-clockwise from above.
    pub turn: f64,
    /// Whether the board stands on its lower edge: its y axis points up, along the rig's z axis.
    /// Otherwise it lies: its z axis points up.
    pub is_upright: bool,
}

impl Placement {
    /// The board lies at the rig's origin, its axes along the rig's.
    pub const AT_ORIGIN: Self =
        Self { origin: Point3::new(0.0, 0.0, 0.0), turn: 0.0, is_upright: false };

    /// Returns the transformation from board axes into the rig frame.
    pub fn pose(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.turn);
        let raise = if self.is_upright { std::f64::consts::FRAC_PI_2 } else { 0.0 };
        let raise = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), raise);
        Isometry3::from_parts(Translation3::from(self.origin), turn * raise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_are_where_opencv_draws_them() {
        // OpenCV's CharucoBoard((7, 5), 0.036, 0.028): y down from the top left corner.
        let opencv = |x: f64, y: f64| Point2::new(x, 0.180 - y);
        let first = CharucoSheet::SHEET.marker(0).unwrap();
        assert!((first[0] - opencv(0.040, 0.004)).norm() < 1e-12, "{first:?}");
        assert!((first[2] - opencv(0.068, 0.032)).norm() < 1e-12, "{first:?}");
        let last = CharucoSheet::SHEET.marker(16).unwrap();
        assert!((last[0] - opencv(0.184, 0.148)).norm() < 1e-12, "{last:?}");
        assert_eq!(CharucoSheet::SHEET.marker(17), None);
        let corners = CharucoSheet::SHEET.corners();
        assert_eq!(corners.len(), 24);
        assert!((corners[6] - opencv(0.036, 0.072)).norm() < 1e-12);
    }

    #[test]
    fn each_marker_has_its_code() {
        for (id, &code) in CODES.iter().enumerate() {
            let [top_left, _, bottom_right, _] = CharucoSheet::SHEET.marker(id).unwrap();
            for (row, column) in (0..6).flat_map(|row| (0..6).map(move |column| (row, column))) {
                let at = |k: usize, from: f64, to: f64| from + (k as f64 + 0.5) / 6.0 * (to - from);
                let x = at(column, top_left.x, bottom_right.x);
                let y = at(row, top_left.y, bottom_right.y);
                let white = is_white_cell(code, column, row);
                assert_eq!(CharucoSheet::SHEET.is_black(x, y), Some(!white), "{id} {row} {column}");
            }
        }
        assert_eq!(CharucoSheet::SHEET.is_black(-0.001, 0.1), None);
        assert_eq!(CharucoSheet::SHEET.is_black(0.001, 0.001), Some(true));
    }

    #[test]
    fn an_upright_board_faces_the_paper_camera() {
        let turn = std::f64::consts::FRAC_PI_2;
        let pose = Placement { turn, is_upright: true, ..Placement::AT_ORIGIN }.pose();
        let images = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| pose * axis);
        for (image, axis) in images.iter().zip([Vector3::y(), Vector3::z(), Vector3::x()]) {
            assert!((image - axis).norm() < 1e-12, "{image} {axis}");
        }
    }
}
