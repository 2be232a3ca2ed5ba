//! Search for the board's inner corners, to a fraction of a pixel.
//!
//! The markers say where the board is; the corners of its squares are then refined. Only
//! OpenCV's module `imgproc` is used, so that the program needs no further module and builds with
//! every version from 4.6 on.

use nalgebra::{Matrix3, Point2};
use opencv::core::{
    Mat, MatTraitConst, Point2f, Size, TermCriteria, TermCriteria_COUNT, TermCriteria_EPS, Vec3b,
    Vector,
};
use opencv::imgproc::{COLOR_BGR2GRAY, INTER_CUBIC, corner_sub_pix, cvt_color_def, resize};
use plumb_frame::image::ColourImage;
use thiserror::Error;

use crate::board::CharucoSheet;
use crate::homography;
use crate::marker::{self, Marker, MarkerSearch};

/// Least number of markers that agree on the board's place.
const MIN_MARKERS: usize = 3;
/// Least number of markers of another board.
const MIN_FOREIGN: usize = 4;
/// Markers below which the enlarged image is searched too.
const FEW_MARKERS: usize = 10;
/// Enlargement of the image for small markers.
const ENLARGEMENT: i32 = 2;
/// Largest distance of a marker's corner from its place on the board, in sides of the marker.
const MARKER_TOLERANCE: f64 = 0.15;
/// Distance within which a marker is near its place, in sides of the marker.
const NEAR_MARKER: f64 = 1.0;
/// Markers whose homography gives the place of a corner where the lens bends the board.
const LOCAL_MARKERS: usize = 4;
/// Distance that a corner may move when it is refined, in gaps between marker and square.
const CORNER_TOLERANCE: f64 = 0.75;
/// Least and largest half side of the window in which a corner is refined, pixels.
const WINDOW: [f64; 2] = [2.0, 8.0];
/// Iterations of the refinement of a corner.
const MAX_ITERATIONS: i32 = 40;
/// Step at which the refinement of a corner ends, pixels.
const LAST_STEP: f64 = 0.005;

/// An inner corner of the board in one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardCorner {
    /// Number of the corner: row by row from the top left, as [`CharucoSheet::corners`].
    pub id: usize,
    /// The corner in the image, pixels.
    pub image: Point2<f64>,
}

/// Reasons why no board is found in an image.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SheetError {
    /// Too few of the board's markers can be read.
    #[error(
        "the board is not seen ({markers} of its 17 markers can be read, 3 are needed): put all of \
         it into the picture, nearer, in even light without reflections, and more face on"
    )]
    NotSeen {
        /// Markers that can be read and agree with each other.
        markers: usize,
    },
    /// The picture shows another board: its markers are of another dictionary, or at other places.
    #[error(
        "the picture shows another board: {unknown} of its markers are none of the dictionary \
         DICT_4X4_50's first 17, and {misplaced} are at other places. Use the one of 7 x 5 squares \
         that `plumb calibrate --print-board board.pdf` writes"
    )]
    Other {
        /// Markers with a code that the board does not have.
        unknown: usize,
        /// Markers of the board that are not at their places.
        misplaced: usize,
    },
    /// The board is seen in a mirror.
    #[error(
        "the picture shows the board mirrored: turn the camera's mirroring off (a mirrored picture \
         gives mirrored positions), or print the board again unmirrored"
    )]
    Mirrored,
    /// An image operation failed, for example for lack of memory.
    #[error("image processing failed")]
    Processing(#[from] ProcessingError),
}

/// Failed image operation, without the types of the image library.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct ProcessingError(Box<dyn std::error::Error + Send + Sync>);

impl ProcessingError {
    /// Wraps the error of the image library.
    pub(crate) fn new(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self(error.into())
    }
}

impl From<opencv::Error> for ProcessingError {
    fn from(error: opencv::Error) -> Self {
        Self::new(error)
    }
}

/// Finds the board's inner corners in an image.
///
/// # Errors
/// If the board is not seen or mirrored or another one, or an image operation fails.
pub fn find_corners(
    image: &ColourImage,
    board: &CharucoSheet,
) -> Result<Vec<BoardCorner>, SheetError> {
    let grey = grey(image).map_err(ProcessingError::from)?;
    let search = markers(&grey).map_err(ProcessingError::from)?;
    if search.mirrored > search.markers.len() {
        return Err(SheetError::Mirrored);
    }
    let map = agreed_map(&search.markers, board);
    check_kind(&search, board, map.as_ref())?;
    let Some(map) = map else {
        return Err(SheetError::NotSeen { markers: search.markers.len().min(MIN_MARKERS - 1) });
    };
    let map = BoardMap::new(&search.markers, board, map);
    Ok(refined(&grey, board, &map).map_err(ProcessingError::from)?)
}

/// Checks that the markers are not those of another board, of which `map` may fit a few.
///
/// # Errors
/// [`SheetError::Other`] where more markers have codes that the board does not have, or are at
/// other places, than are at theirs.
fn check_kind(
    search: &MarkerSearch,
    board: &CharucoSheet,
    map: Option<&Matrix3<f64>>,
) -> Result<(), SheetError> {
    let is_near =
        |marker: &&Marker| map.is_some_and(|map| distance(marker, board, map) < NEAR_MARKER);
    let near = search.markers.iter().filter(is_near).count();
    let (unknown, misplaced) = (search.unknown, search.markers.len() - near);
    let foreign = unknown + misplaced;
    if foreign >= MIN_FOREIGN && foreign > near {
        return Err(SheetError::Other { unknown, misplaced });
    }
    Ok(())
}

/// Returns the image in grey.
fn grey(image: &ColourImage) -> opencv::Result<Mat> {
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    let colour = Mat::new_rows_cols_with_bytes::<Vec3b>(rows, columns, image.channels())?;
    let mut grey = Mat::default();
    cvt_color_def(&colour, &mut grey, COLOR_BGR2GRAY)?;
    Ok(grey)
}

/// Searches for markers, also in the enlarged image if there are few.
fn markers(grey: &Mat) -> opencv::Result<MarkerSearch> {
    let search = marker::search(grey)?;
    if search.markers.len() >= FEW_MARKERS {
        return Ok(search);
    }
    let mut large = Mat::default();
    let scale = f64::from(ENLARGEMENT);
    resize(grey, &mut large, Size::default(), scale, scale, INTER_CUBIC)?;
    let mut search_large = marker::search(&large)?;
    if search_large.markers.len() <= search.markers.len() {
        return Ok(search);
    }
    for marker in &mut search_large.markers {
        // The centre of the first pixel is at half a pixel's width.
        marker.corners =
            marker.corners.map(|p| ((p.coords.add_scalar(0.5)) / scale).add_scalar(-0.5).into());
    }
    Ok(search_large)
}

/// Returns the homography from the board to the image on which most markers agree.
fn agreed_map(markers: &[Marker], board: &CharucoSheet) -> Option<Matrix3<f64>> {
    let pairs = |markers: &[&Marker]| -> Vec<(Point2<f64>, Point2<f64>)> {
        let corners = markers.iter().filter_map(|it| Some((board.marker(it.id)?, it.corners)));
        corners.flat_map(|(from, to)| from.into_iter().zip(to)).collect()
    };
    let agreeing = |map: &Matrix3<f64>| -> Vec<&Marker> {
        markers.iter().filter(|marker| agrees(marker, board, map)).collect()
    };
    let candidates = markers.iter().filter_map(|marker| homography::fit(&pairs(&[marker])));
    let mut best = candidates
        .map(|map| neighbours_refit(markers, board, &map).unwrap_or(map))
        .map(|map| agreeing(&map))
        .max_by_key(Vec::len)?;
    // The map of all of them reaches the ones at the other end of the board too.
    for _ in 0..3 {
        best = agreeing(&homography::fit(&pairs(&best))?);
        if best.len() < MIN_MARKERS {
            return None;
        }
    }
    homography::fit(&pairs(&best))
}

/// Returns the homography of the markers that agree loosely with `map`, which comes from one marker
/// and is extrapolated.
fn neighbours_refit(
    markers: &[Marker],
    board: &CharucoSheet,
    map: &Matrix3<f64>,
) -> Option<Matrix3<f64>> {
    let near = markers.iter().filter(|marker| distance(marker, board, map) < NEAR_MARKER);
    let pairs: Vec<_> = near
        .filter_map(|it| Some((board.marker(it.id)?, it.corners)))
        .flat_map(|(from, to)| from.into_iter().zip(to))
        .collect();
    homography::fit(&pairs)
}

/// Returns whether the corners of a marker are where `map` puts them.
fn agrees(marker: &Marker, board: &CharucoSheet, map: &Matrix3<f64>) -> bool {
    let side = (marker.corners[2] - marker.corners[0]).norm() / std::f64::consts::SQRT_2;
    // An outline's corners are whole pixels.
    distance(marker, board, map) < MARKER_TOLERANCE.max(1.5 / side)
}

/// Returns the largest distance of a marker's corners from where `map` puts them, in sides of the
/// marker.
fn distance(marker: &Marker, board: &CharucoSheet, map: &Matrix3<f64>) -> f64 {
    let side = (marker.corners[2] - marker.corners[0]).norm() / std::f64::consts::SQRT_2;
    let Some(corners) = board.marker(marker.id) else { return f64::INFINITY };
    corners
        .iter()
        .zip(&marker.corners)
        .map(|(p, seen)| homography::apply(map, p).map_or(f64::INFINITY, |q| (q - seen).norm()))
        .fold(0.0, f64::max)
        / side
}

/// Map of the board onto the image.
struct BoardMap<'a> {
    board: &'a CharucoSheet,
    /// Homography on which most markers agree.
    whole: Matrix3<f64>,
    /// The markers near their places by that homography, if the lens bends the board so that some
    /// of them do not agree with it; else empty.
    bent: Vec<&'a Marker>,
}

impl<'a> BoardMap<'a> {
    fn new(markers: &'a [Marker], board: &'a CharucoSheet, whole: Matrix3<f64>) -> Self {
        let near = |marker: &&Marker| distance(marker, board, &whole) < NEAR_MARKER;
        let mut bent: Vec<_> = markers.iter().filter(near).collect();
        if bent.iter().all(|marker| agrees(marker, board, &whole)) {
            bent.clear();
        }
        Self { board, whole, bent }
    }

    /// Returns the homography about a point of the board: that of the nearest markers where the
    /// lens bends the board.
    fn about(&self, point: &Point2<f64>) -> Matrix3<f64> {
        let mut nearest: Vec<_> = self
            .bent
            .iter()
            .filter_map(|marker| Some((self.board.marker(marker.id)?, marker.corners)))
            .collect();
        let away =
            |corners: &[Point2<f64>; 4]| ((corners[0] + corners[2].coords) / 2.0 - point).norm();
        nearest.sort_by(|a, b| away(&a.0).total_cmp(&away(&b.0)));
        let pairs: Vec<_> = nearest
            .into_iter()
            .take(LOCAL_MARKERS)
            .flat_map(|(from, to)| from.into_iter().zip(to))
            .collect();
        homography::fit(&pairs).unwrap_or(self.whole)
    }
}

/// Returns the corners near their places by `map`, refined.
fn refined(
    grey: &Mat,
    board: &CharucoSheet,
    map: &BoardMap<'_>,
) -> opencv::Result<Vec<BoardCorner>> {
    let mut found = Vec::new();
    let size = [f64::from(grey.cols()), f64::from(grey.rows())];
    for (id, corner) in board.corners().into_iter().enumerate() {
        let map = map.about(&corner);
        let Some(expected) = homography::apply(&map, &corner) else { continue };
        let gap = gap(board, &map, &corner, &expected);
        let half = gap.clamp(WINDOW[0], WINDOW[1]).round();
        let margin = half + 2.0;
        let is_inside = |k: f64, size: f64| (margin..size - margin).contains(&k);
        if !(is_inside(expected.x, size[0]) && is_inside(expected.y, size[1])) {
            continue;
        }
        let image = sub_pixel(grey, &expected, half as i32)?;
        if (image - expected).norm() <= (CORNER_TOLERANCE * gap).max(1.0) {
            found.push(BoardCorner { id, image });
        }
    }
    Ok(found)
}

/// Returns the least distance in the image, pixels, between a corner and the markers beside it.
fn gap(board: &CharucoSheet, map: &Matrix3<f64>, corner: &Point2<f64>, image: &Point2<f64>) -> f64 {
    let gap = board.gap();
    [[gap, 0.0], [-gap, 0.0], [0.0, gap], [0.0, -gap]]
        .into_iter()
        .filter_map(|[x, y]| homography::apply(map, &Point2::new(corner.x + x, corner.y + y)))
        .map(|p| (p - image).norm())
        .fold(f64::INFINITY, f64::min)
}

/// Returns the corner near `start`: the point that is orthogonal to the gradients around it.
fn sub_pixel(grey: &Mat, start: &Point2<f64>, half: i32) -> opencv::Result<Point2<f64>> {
    let mut corners = Vector::<Point2f>::new();
    corners.push(Point2f::new(start.x as f32, start.y as f32));
    let kind = TermCriteria_COUNT + TermCriteria_EPS;
    let end = TermCriteria::new(kind, MAX_ITERATIONS, LAST_STEP)?;
    corner_sub_pix(grey, &mut corners, Size::new(half, half), Size::new(-1, -1), end)?;
    let corner = corners.get(0)?;
    Ok(Point2::new(f64::from(corner.x), f64::from(corner.y)))
}
