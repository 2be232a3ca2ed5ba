//! Search for the board's markers in a grey image: threshold, outlines of four corners, codes.

use nalgebra::Point2;
use opencv::core::{
    BORDER_CONSTANT, Mat, MatTraitConst, MatTraitConstManual, Point, Point2f, Scalar, Size, Vector,
};
use opencv::imgproc::{
    ADAPTIVE_THRESH_MEAN_C, CHAIN_APPROX_NONE, INTER_LINEAR, RETR_LIST, THRESH_BINARY_INV,
    adaptive_threshold, approx_poly_dp, contour_area_def, find_contours_def,
    get_perspective_transform_def, is_contour_convex, warp_perspective,
};

use crate::dictionary::{CODE_CELLS, SIDE_CELLS, identify, mirrored};

/// Parameters of the search. The values are those of OpenCV's `DetectorParameters` where it has
/// the same parameter.
struct SearchParameters {
    /// Windows of the threshold, pixels, odd.
    windows: [i32; 3],
    /// Grey levels by which a marker is darker than the mean of its window.
    darker: f64,
    /// Least length of an outline, pixels.
    min_outline: usize,
    /// Largest distance of an outline from its polygon, in lengths of the outline.
    polygon_error: f64,
    /// Least area of a marker, pixels².
    min_area: f64,
    /// Side of a cell in the rectified marker, pixels.
    cell: i32,
    /// Pixels of a cell at each side that are not read.
    cell_margin: i32,
    /// Least difference between the brightest and the darkest cell, grey levels.
    min_contrast: f64,
    /// Most white cells in the black border, of 20.
    max_border_errors: usize,
    /// Least side of a marker whose code is sure, pixels: 5 for each cell.
    sure_side: f64,
}

const PARAMETERS: SearchParameters = SearchParameters {
    windows: [7, 17, 41],
    darker: 7.0,
    min_outline: 20,
    polygon_error: 0.04,
    min_area: 25.0,
    cell: 8,
    cell_margin: 2,
    min_contrast: 20.0,
    max_border_errors: 2,
    sure_side: 30.0,
};

/// A marker in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Marker {
    /// Number of the marker on the board.
    pub(crate) id: usize,
    /// Top left, top right, bottom right and bottom left corner as printed, pixels.
    pub(crate) corners: [Point2<f64>; 4],
}

/// Result of a search.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct MarkerSearch {
    /// The markers, each once.
    pub(crate) markers: Vec<Marker>,
    /// Number of markers that are seen in a mirror.
    pub(crate) mirrored: usize,
    /// Number of large markers whose code is none of the board's: those of another dictionary, or
    /// of a board with more markers.
    pub(crate) unknown: usize,
}

/// Contents of an outline of four corners.
enum Content {
    Marker(Marker),
    Mirrored(usize),
    /// A code that is none of the board's.
    Unknown,
    Nothing,
}

/// Searches an 8-bit grey image for markers.
pub(crate) fn search(grey: &Mat) -> opencv::Result<MarkerSearch> {
    let (mut markers, mut mirrored) = (Vec::<Marker>::new(), Vec::new());
    let mut unknown = Vec::<[Point2<f64>; 4]>::new();
    for window in PARAMETERS.windows {
        for corners in quadrangles(grey, window)? {
            match read(grey, corners)? {
                Content::Marker(marker) => add(&mut markers, marker),
                Content::Mirrored(id) if !mirrored.contains(&id) => mirrored.push(id),
                Content::Unknown if is_new(&unknown, &corners) => unknown.push(corners),
                Content::Mirrored(_) | Content::Unknown | Content::Nothing => {}
            }
        }
    }
    markers.sort_by_key(|marker| marker.id);
    // One that is read by another threshold is known.
    unknown.retain(|corners| markers.iter().all(|marker| !is_within(corners, &marker.corners)));
    Ok(MarkerSearch { markers, mirrored: mirrored.len(), unknown: unknown.len() })
}

/// Returns whether a quadrangle is large enough for its code to be sure, and is none of `known`.
fn is_new(known: &[[Point2<f64>; 4]], corners: &[Point2<f64>; 4]) -> bool {
    side(corners) >= PARAMETERS.sure_side && known.iter().all(|other| !is_within(corners, other))
}

/// Returns whether the middle of a quadrangle is within half a side of that of another one.
fn is_within(corners: &[Point2<f64>; 4], other: &[Point2<f64>; 4]) -> bool {
    let middle = |corners: &[Point2<f64>; 4]| nalgebra::center(&corners[0], &corners[2]);
    (middle(corners) - middle(other)).norm() < side(other) / 2.0
}

/// Returns the side of a quadrangle, pixels: that of a square with the same area.
fn side(corners: &[Point2<f64>; 4]) -> f64 {
    (area(corners) / 2.0).max(0.0).sqrt()
}

/// Adds a marker. Of several with one number the largest is the marker's outer edge.
fn add(markers: &mut Vec<Marker>, marker: Marker) {
    match markers.iter_mut().find(|known| known.id == marker.id) {
        Some(known) if area(&known.corners) < area(&marker.corners) => *known = marker,
        Some(_) => {}
        None => markers.push(marker),
    }
}

/// Returns twice the area of a quadrangle, pixels²; above 0 if its corners are clockwise in the
/// image.
fn area(corners: &[Point2<f64>; 4]) -> f64 {
    (corners[2] - corners[0]).perp(&(corners[3] - corners[1]))
}

/// Returns the convex quadrangles of dark areas, clockwise.
fn quadrangles(grey: &Mat, window: i32) -> opencv::Result<Vec<[Point2<f64>; 4]>> {
    let (mode, kind, darker) = (ADAPTIVE_THRESH_MEAN_C, THRESH_BINARY_INV, PARAMETERS.darker);
    let mut dark = Mat::default();
    adaptive_threshold(grey, &mut dark, 255.0, mode, kind, window, darker)?;
    let mut outlines = Vector::<Vector<Point>>::new();
    find_contours_def(&dark, &mut outlines, RETR_LIST, CHAIN_APPROX_NONE)?;
    let mut found = Vec::new();
    for outline in outlines.iter().filter(|outline| outline.len() >= PARAMETERS.min_outline) {
        let mut polygon = Vector::<Point>::new();
        let error = PARAMETERS.polygon_error * outline.len() as f64;
        approx_poly_dp(&outline, &mut polygon, error, true)?;
        let is_quadrangle = polygon.len() == 4
            && is_contour_convex(&polygon)?
            && contour_area_def(&polygon)? >= PARAMETERS.min_area;
        if is_quadrangle {
            let mut corners = [Point2::origin(); 4];
            for (corner, p) in corners.iter_mut().zip(&polygon) {
                *corner = Point2::new(f64::from(p.x), f64::from(p.y));
            }
            if area(&corners) < 0.0 {
                corners.reverse();
            }
            found.push(corners);
        }
    }
    Ok(found)
}

/// Reads the code in a quadrangle.
fn read(grey: &Mat, corners: [Point2<f64>; 4]) -> opencv::Result<Content> {
    let Some(code) = code(&rectified(grey, &corners)?)? else { return Ok(Content::Nothing) };
    if let Some(reading) = identify(code) {
        let mut corners = corners;
        // The printed top left corner is `quarter_turns` corners further, clockwise.
        corners.rotate_left(reading.quarter_turns);
        return Ok(Content::Marker(Marker { id: reading.id, corners }));
    }
    let mirrored = identify(mirrored(code));
    Ok(mirrored.map_or(Content::Unknown, |reading| Content::Mirrored(reading.id)))
}

/// Returns the quadrangle as a square image.
fn rectified(grey: &Mat, corners: &[Point2<f64>; 4]) -> opencv::Result<Mat> {
    let side = SIDE_CELLS as i32 * PARAMETERS.cell;
    // Corners are at the centres of pixels on the outline.
    let last = (side - 1) as f32;
    let square = [[0.0, 0.0], [last, 0.0], [last, last], [0.0, last]];
    let to = Vector::<Point2f>::from_iter(square.map(|[x, y]| Point2f::new(x, y)));
    let from = corners.iter().map(|p| Point2f::new(p.x as f32, p.y as f32));
    let from = Vector::<Point2f>::from_iter(from);
    let map = get_perspective_transform_def(&from, &to)?;
    let mut square = Mat::default();
    let (size, border) = (Size::new(side, side), Scalar::default());
    warp_perspective(grey, &mut square, &map, size, INTER_LINEAR, BORDER_CONSTANT, border)?;
    Ok(square)
}

/// Returns the code of a rectified marker; `None` if there is no contrast or no black border.
fn code(square: &Mat) -> opencv::Result<Option<u16>> {
    let means = cell_means(square)?;
    let (low, high) = means
        .iter()
        .flatten()
        .fold((f64::MAX, f64::MIN), |(low, high), &mean| (low.min(mean), high.max(mean)));
    if high - low < PARAMETERS.min_contrast {
        return Ok(None);
    }
    let is_white = |row: usize, column: usize| means[row][column] > (low + high) / 2.0;
    let (mut bits, mut border_errors) = (0, 0);
    for (row, column) in (0..SIDE_CELLS).flat_map(|row| (0..SIDE_CELLS).map(move |c| (row, c))) {
        let is_inner = |k: usize| (1..=CODE_CELLS).contains(&k);
        if is_inner(row) && is_inner(column) {
            bits = bits << 1 | u16::from(is_white(row, column));
        } else {
            border_errors += usize::from(is_white(row, column));
        }
    }
    Ok((border_errors <= PARAMETERS.max_border_errors).then_some(bits))
}

/// Returns the mean grey level of the middle of each cell, by row and column.
fn cell_means(square: &Mat) -> opencv::Result<[[f64; SIDE_CELLS]; SIDE_CELLS]> {
    let pixels = square.data_typed::<u8>()?;
    let width = square.cols() as usize;
    let (cell, margin) = (PARAMETERS.cell as usize, PARAMETERS.cell_margin as usize);
    let mut means = [[0.0; SIDE_CELLS]; SIDE_CELLS];
    for (row, means) in means.iter_mut().enumerate() {
        for (column, mean) in means.iter_mut().enumerate() {
            let side = cell - 2 * margin;
            let (left, top) = (column * cell + margin, row * cell + margin);
            let sum: f64 = (top..top + side)
                .flat_map(|y| &pixels[y * width + left..y * width + left + side])
                .map(|&grey| f64::from(grey))
                .sum();
            *mean = sum / (side * side) as f64;
        }
    }
    Ok(means)
}
