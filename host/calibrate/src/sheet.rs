//! The sheet with the board, for the printer: axes, a ruler to check the scale, and instructions.

mod pdf;

use crate::board::{COLUMNS, CharucoSheet, ROWS, SHEET_SQUARE_M};

/// Size of a sheet, landscape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Paper {
    /// ISO A4, 297 x 210 mm.
    A4,
    /// US Letter, 11 x 8.5 inches.
    Letter,
}

impl Paper {
    /// Returns width and height, millimetres.
    pub fn size_mm(self) -> [f64; 2] {
        match self {
            Self::A4 => [297.0, 210.0],
            Self::Letter => [279.4, 215.9],
        }
    }
}

/// Returns the sheet as a PDF document of one page at its true scale.
pub fn pdf(paper: Paper) -> Vec<u8> {
    pdf::document(paper.size_mm(), &marks(paper))
}

/// Mark on the sheet. Lengths in millimetres from the sheet's lower left corner, y up.
#[derive(Debug, Clone, PartialEq)]
enum Mark {
    /// Black rectangle.
    Rectangle {
        /// Lower left corner.
        corner: [f64; 2],
        /// Width and height.
        size: [f64; 2],
    },
    /// Line of text; its letters are `height` high.
    Text {
        /// Left end of the base line.
        corner: [f64; 2],
        /// Height of the capital letters.
        height: f64,
        /// Text, ASCII.
        text: String,
    },
}

/// Distance of the chessboard from the sheet's lower edge, millimetres.
const BOTTOM_MM: f64 = 22.0;
/// Width of lines, millimetres.
const LINE_MM: f64 = 0.4;
/// Distance of the axes from the chessboard, millimetres: a white margin that the search needs.
const AXIS_GAP_MM: f64 = 4.0;
/// Length of the axes, millimetres.
const AXIS_MM: f64 = 30.0;
/// Length of the ruler, millimetres.
const RULER_MM: usize = 100;

/// Returns everything on the sheet.
fn marks(paper: Paper) -> Vec<Mark> {
    let [width, _] = paper.size_mm();
    let square = SHEET_SQUARE_M * 1e3;
    let left = ((width - COLUMNS as f64 * square) / 2.0 * 10.0).round() / 10.0;
    let origin = [left, BOTTOM_MM];
    let mut marks = chessboard(origin);
    marks.extend(axes(origin));
    marks.extend(ruler([left + 50.0, 12.0]));
    let text = |x: f64, y: f64, text: &str| Mark::Text {
        corner: [x, y],
        height: 2.2,
        text: text.to_owned(),
    };
    let size = format!("{COLUMNS} x {ROWS} squares of {square} mm.");
    marks.push(text(left + 164.0, 14.6, &format!("Plumb calibration board: {size}")));
    marks.push(text(left + 164.0, 10.8, "Print at 100 % (actual size, no fitting)."));
    marks.push(text(left + 164.0, 7.0, "The ruler must measure 100 mm."));
    marks
}

/// Returns the black areas of the chessboard and its markers, row by row of their cells.
fn chessboard(origin: [f64; 2]) -> Vec<Mark> {
    // All edges are at multiples of this: squares of 36 mm, margins of 4 mm, cells of 28/6 mm.
    let board = CharucoSheet::SHEET;
    let mut edges: Vec<f64> = (0..COLUMNS).flat_map(edges_of_square).collect();
    edges.push(COLUMNS as f64 * SHEET_SQUARE_M * 1e3);
    let rows = edges.iter().take_while(|&&y| y < ROWS as f64 * SHEET_SQUARE_M * 1e3 - 1e-9).count();
    let mut marks = Vec::new();
    for y in edges[..=rows].windows(2) {
        let is_black = |x: &[f64]| {
            let middle = |k: &[f64]| (k[0] + k[1]) / 2.0 * 1e-3;
            board.is_black(middle(x), middle(y)) == Some(true)
        };
        // One rectangle for each run of black, so that no seam is printed.
        for run in edges.windows(2).collect::<Vec<_>>().chunk_by(|a, b| is_black(a) == is_black(b))
        {
            let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
            if is_black(first) {
                let corner = [origin[0] + first[0], origin[1] + y[0]];
                marks.push(Mark::Rectangle { corner, size: [last[1] - first[0], y[1] - y[0]] });
            }
        }
    }
    marks
}

/// Returns the edges of a square, its marker and the marker's cells, millimetres.
fn edges_of_square(number: usize) -> Vec<f64> {
    let square = SHEET_SQUARE_M * 1e3;
    let gap = CharucoSheet::SHEET.gap() * 1e3;
    let cell = (square - 2.0 * gap) / 6.0;
    let start = number as f64 * square;
    [0.0].into_iter().chain((0..=6).map(|k| gap + f64::from(k) * cell)).map(|x| start + x).collect()
}

/// Returns the axes x and y beside the board's lower left corner.
fn axes([x, y]: [f64; 2]) -> Vec<Mark> {
    let (left, below) = (x - AXIS_GAP_MM, y - AXIS_GAP_MM);
    let text = |corner: [f64; 2], text: &str| Mark::Text { corner, height: 3.0, text: text.into() };
    let mut marks = vec![
        Mark::Rectangle { corner: [x, below], size: [AXIS_MM, LINE_MM] },
        Mark::Rectangle { corner: [left, y], size: [LINE_MM, AXIS_MM] },
        text([x + AXIS_MM + 2.0, below - 1.3], "x"),
        text([left - 0.8, y + AXIS_MM + 2.0], "y"),
        Mark::Text {
            corner: [left - 3.0, below - 5.0],
            height: 2.2,
            text: "origin at this corner".into(),
        },
    ];
    // Heads of the arrows, as stairs.
    for k in 0..4 {
        let (back, half) = (0.5 * f64::from(k), 0.25 * f64::from(k) + LINE_MM / 2.0);
        let middle = LINE_MM / 2.0;
        let along = AXIS_MM - back - 0.5;
        marks.push(Mark::Rectangle {
            corner: [x + along, below + middle - half],
            size: [0.5, 2.0 * half],
        });
        marks.push(Mark::Rectangle {
            corner: [left + middle - half, y + along],
            size: [2.0 * half, 0.5],
        });
    }
    marks
}

/// Returns a ruler with a line for each millimetre.
fn ruler([x, y]: [f64; 2]) -> Vec<Mark> {
    let line = RULER_MM as f64 + LINE_MM;
    let mut marks = vec![Mark::Rectangle { corner: [x - LINE_MM / 2.0, y], size: [line, LINE_MM] }];
    for mm in 0..=RULER_MM {
        let length = if mm % 10 == 0 { 4.0 } else { 2.0 };
        let width = if mm % 10 == 0 { LINE_MM } else { LINE_MM / 2.0 };
        let at = x + mm as f64;
        marks.push(Mark::Rectangle { corner: [at - width / 2.0, y], size: [width, length] });
    }
    for mm in [0, RULER_MM / 2, RULER_MM] {
        let text = if mm == 0 { "0".to_owned() } else { format!("{mm} mm") };
        marks.push(Mark::Text { corner: [x + mm as f64 - 1.0, y - 3.4], height: 2.2, text });
    }
    marks
}

#[cfg(test)]
mod tests {
    use plumb_frame::image::{ColourImage, DepthImage, Image};

    use super::*;
    use crate::corners::find_corners;

    #[test]
    fn everything_is_on_the_sheet() {
        for paper in [Paper::A4, Paper::Letter] {
            let [width, height] = paper.size_mm();
            for mark in marks(paper) {
                let (corner, size) = match &mark {
                    Mark::Rectangle { corner, size } => (*corner, *size),
                    // Letters are at most as wide as high.
                    Mark::Text { corner, height, text } => {
                        (*corner, [0.75 * height * text.len() as f64, *height])
                    }
                };
                // Printers leave 5 mm white.
                assert!(corner[0] >= 5.0 && corner[0] + size[0] <= width - 5.0, "{mark:?}");
                assert!(corner[1] >= 5.0 && corner[1] + size[1] <= height - 5.0, "{mark:?}");
            }
        }
    }

    /// Draws the rectangles of an A4 sheet at 300 dots per inch. Returns it at 50 dots per inch.
    fn drawn() -> ColourImage {
        let [width, height] = Paper::A4.size_mm();
        let pixel = |mm: f64| (mm * 300.0 / 25.4).round() as usize;
        let mut sheet = DepthImage::filled(pixel(width), pixel(height), 255);
        for mark in marks(Paper::A4) {
            let Mark::Rectangle { corner: [x, y], size: [w, h] } = mark else { continue };
            for row in pixel(height - y - h)..pixel(height - y) {
                let row = &mut sheet.pixels_mut()[row * pixel(width)..];
                row[pixel(x)..pixel(x + w)].fill(0);
            }
        }
        Image::from_fn(sheet.width() / 6, sheet.height() / 6, |u, v| {
            let block = (0..36).map(|k| sheet.get(6 * u + k % 6, 6 * v + k / 6).unwrap());
            [(block.map(u32::from).sum::<u32>() / 36) as u8; 3]
        })
    }

    #[test]
    fn the_board_is_found_on_the_sheet_at_its_true_scale() {
        let corners = find_corners(&drawn(), &CharucoSheet::SHEET).unwrap();
        assert_eq!(corners.len(), 24);
        let side = (corners[5].image - corners[0].image).norm() / 5.0;
        let expected = 36.0 / 25.4 * 50.0;
        assert!((side - expected).abs() < 0.05, "{side} {expected}");
    }

    #[test]
    fn the_black_area_is_that_of_the_board() {
        let area: f64 = chessboard([0.0, 0.0])
            .iter()
            .map(|mark| match mark {
                Mark::Rectangle { size: [w, h], .. } => w * h,
                Mark::Text { .. } => 0.0,
            })
            .sum();
        // 18 black squares, and the black cells of 17 markers.
        let white_bits: u32 = crate::dictionary::CODES.iter().map(|code| code.count_ones()).sum();
        let cell = 28.0_f64 / 6.0;
        let expected = 18.0 * 36.0 * 36.0 + f64::from(17 * 36 - white_bits) * cell * cell;
        assert!((area - expected).abs() < 1e-6, "{area} {expected}");
    }
}
