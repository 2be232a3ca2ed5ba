//! Codes of the board's markers: the first 17 of OpenCV's dictionary `DICT_4X4_50`.

/// Cells along a marker's side: four with the code and a black one at either end.
pub(crate) const SIDE_CELLS: usize = 6;
/// Cells of the code along a side.
pub(crate) const CODE_CELLS: usize = 4;

/// Codes of the markers, row by row from the top left, most significant bit first; 1 is white.
/// Source: `cv::aruco::generateImageMarker` of OpenCV 5.0.0.
pub(crate) const CODES: [u16; 17] = [
    0xb532, 0x0f9a, 0x332d, 0x9946, 0x549e, 0x79cd, 0x9e2e, 0xc4f2, 0xfeda, 0xcf56, 0xf991, 0x11a7,
    0x0eb7, 0x2a0f, 0x24b1, 0x263e, 0x4665,
];

/// Most wrong bits of a code that is accepted. The dictionary's codes differ in 4 bits or more, in
/// every rotation.
const MAX_WRONG_BITS: u32 = 1;

/// Returns whether a cell of a marker is white. The border is black.
pub(crate) fn is_white_cell(code: u16, column: usize, row: usize) -> bool {
    let inner = 1..=CODE_CELLS;
    let bit = || CODE_CELLS * CODE_CELLS - 1 - ((row - 1) * CODE_CELLS + column - 1);
    inner.contains(&column) && inner.contains(&row) && code >> bit() & 1 == 1
}

/// A code that was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reading {
    /// Number of the marker.
    pub(crate) id: usize,
    /// Quarter turns, clockwise, by which the read square is turned against the printed one.
    pub(crate) quarter_turns: usize,
}

/// Returns the marker that has the code `read`, in any of its four rotations.
pub(crate) fn identify(read: u16) -> Option<Reading> {
    let mut code = read;
    for quarter_turns in 0..4 {
        let id = CODES.iter().position(|known| (known ^ code).count_ones() <= MAX_WRONG_BITS);
        if let Some(id) = id {
            return Some(Reading { id, quarter_turns });
        }
        code = turned_back(code);
    }
    None
}

/// Returns the code after a quarter turn counter-clockwise.
fn turned_back(code: u16) -> u16 {
    remapped(code, |column, row| (CODE_CELLS - 1 - row, column))
}

/// Returns the code as a mirror shows it: columns in reverse order.
pub(crate) fn mirrored(code: u16) -> u16 {
    remapped(code, |column, row| (CODE_CELLS - 1 - column, row))
}

/// Returns the code whose cell (column, row) is the cell `source(column, row)` of `code`.
fn remapped(code: u16, source: impl Fn(usize, usize) -> (usize, usize)) -> u16 {
    (0..CODE_CELLS * CODE_CELLS).fold(0, |bits, k| {
        let (column, row) = source(k % CODE_CELLS, k / CODE_CELLS);
        bits << 1 | u16::from(is_white_cell(code, column + 1, row + 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_identified_in_every_rotation_and_with_a_wrong_bit() {
        for (id, &code) in CODES.iter().enumerate() {
            let mut turned = code;
            for turns in 0..4 {
                // A code that is turned back n times is read as one turned by 4 - n.
                let expected = Reading { id, quarter_turns: (4 - turns) % 4 };
                assert_eq!(identify(turned), Some(expected));
                for bit in 0..16 {
                    assert_eq!(identify(turned ^ 1 << bit), Some(expected), "{id} {turns} {bit}");
                }
                turned = turned_back(turned);
            }
        }
    }

    #[test]
    fn few_mirrored_codes_are_codes() {
        let is_code = |code: &u16| identify(mirrored(*code)).is_some();
        assert!(CODES.iter().all(|&code| mirrored(mirrored(code)) == code));
        // Code 8 has an axis of symmetry, and 9 but for a bit.
        assert_eq!(CODES.into_iter().filter(is_code).collect::<Vec<_>>(), CODES[8..10]);
    }
}
