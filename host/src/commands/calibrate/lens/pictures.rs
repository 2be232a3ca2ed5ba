//! Pictures of the board for the calibration of a lens: of a folder, or taken by the camera.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use plumb_calibrate::board::CharucoSheet;
use plumb_calibrate::board_pose::SeenCorner;
use plumb_calibrate::corners::{SheetError, find_corners};
use plumb_calibrate::lens::LensView;
use plumb_cameras::png;
use plumb_cameras::tum::MAX_BYTES;
use plumb_config::bounded_read;
use plumb_log::OutputDir;
use plumb_pictures::decode;
use plumb_vision::image::{ColourImage, ImageSize};

use crate::cli::exit::{Failure, failed};
use crate::cli::print::{ProgressLine, is_shown};
use crate::commands::calibrate::view::{Stage, View};

/// Least mean movement of the board's corners from every picture that is kept, in widths of the
/// picture.
const MIN_MOVEMENT: f64 = 0.06;
/// Largest mean movement of the corners between two pictures of a board that is held still, in
/// widths of the picture: 1.5 pixels of 640.
const MAX_SHAKE: f64 = 0.0025;
/// Pictures in a row without the board, after which the reason is told: 3 s at 30 Hz.
const TOLD_AFTER: u32 = 90;
/// Pictures in a row that show nothing new, after which the collection ends: 40 s at 30 Hz.
const MAX_IDLE: u32 = 1200;

/// Files that a message names for one reason.
const MOST_NAMED: usize = 5;

/// A picture with the board's corners.
pub(super) struct Shown {
    pub(super) picture: ColourImage,
    pub(super) view: LensView,
}

/// Searches the board in a picture. Where it is not seen, or another one is, the reason.
fn shown(picture: ColourImage, name: String) -> Result<Result<Shown, String>, Failure> {
    let corners = match find_corners(&picture, &CharucoSheet::SHEET) {
        Ok(corners) => corners,
        Err(SheetError::NotSeen { .. }) => return Ok(Err("the board is not seen".to_owned())),
        Err(error @ SheetError::Other { .. }) => return Ok(Err(error.to_string())),
        Err(error) => return Err(error.into()),
    };
    let places = CharucoSheet::SHEET.corners();
    let seen = |id: usize, image| SeenCorner { id, board: places[id], image, depth: None };
    let corners = corners.iter().map(|corner| seen(corner.id, corner.image)).collect();
    Ok(Ok(Shown { picture, view: LensView { name, corners } }))
}

/// Reads the pictures of a folder in the order of their names. A file that is no picture, a picture
/// of another size than most, and one that does not show the board are left out, and named.
pub(super) fn from_folder(folder: &Path) -> Result<Vec<Shown>, Failure> {
    let unreadable = |error| failed(format!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(unreadable)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()
        .map_err(unreadable)?;
    paths.retain(|path| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        ["png", "jpg", "jpeg", "pgm", "ppm"].contains(&ending.as_str())
    });
    paths.sort();
    if paths.is_empty() {
        return Err(failed(format!(
            "{}: has no picture (.png, .jpg, .pgm or .ppm)",
            folder.display()
        )));
    }
    let usual = usual_size(&paths);
    let (mut all, mut left_out) = (Vec::new(), LeftOut::default());
    let mut line = ProgressLine::shown_if(is_shown());
    for (number, path) in (1..).zip(&paths) {
        line.show(format_args!("picture {number} of {}", paths.len()), Instant::now());
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let read = bounded_read::read(path, MAX_BYTES).map_err(|error| error.to_string());
        let seen = match read.and_then(|bytes| picture(&bytes, usual)) {
            Ok(picture) => shown(picture, name.clone())?,
            Err(why) => Err(why),
        };
        match seen {
            Ok(shown) => all.push(shown),
            Err(why) => left_out.add(name, why),
        }
    }
    line.clear();
    tell!("the board is seen in {} of {} pictures{left_out}", all.len(), paths.len());
    Ok(all)
}

/// Files that are left out, by reason.
#[derive(Default)]
struct LeftOut(BTreeMap<String, Vec<String>>);

impl LeftOut {
    fn add(&mut self, name: String, why: String) {
        self.0.entry(why).or_default().push(name);
    }
}

impl fmt::Display for LeftOut {
    /// Writes the end of a sentence: the number of files of each reason, with the first of them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (why, names) in &self.0 {
            let first = names[..names.len().min(MOST_NAMED)].join(", ");
            let more = names.len().saturating_sub(MOST_NAMED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            write!(f, "; {} left out: {why} ({first}{more})", names.len())?;
        }
        Ok(())
    }
}

/// Returns the size that most of the pictures have; of several such sizes that of the first
/// picture. `None` where no file is a picture.
fn usual_size(paths: &[PathBuf]) -> Option<ImageSize> {
    let size = |path: &PathBuf| decode::size(&bounded_read::read(path, MAX_BYTES).ok()?);
    let sizes: Vec<ImageSize> = paths.iter().filter_map(size).collect();
    let count = |size: &ImageSize| sizes.iter().filter(|other| *other == size).count();
    // The last of several maxima is taken: the first in reverse.
    sizes.iter().rev().max_by_key(|size| count(size)).copied()
}

/// Decodes a picture, which must have the `usual` size. Returns why not in words.
fn picture(bytes: &[u8], usual: Option<ImageSize>) -> Result<ColourImage, String> {
    let picture = decode::colour(bytes).map_err(|error| error.to_string())?;
    match usual {
        Some(usual) if picture.size() != usual => {
            Err(format!("{}, but the other pictures are {usual}", picture.size()))
        }
        _ => Ok(picture),
    }
}

/// Takes `wanted` pictures of the board at different places, held still. Each of them is kept in a
/// new folder in `parent`, also where the collection ends early.
pub(super) fn from_camera(
    mut view: View,
    wanted: u8,
    parent: &Path,
) -> Result<Vec<Shown>, Failure> {
    if view.needs_person() {
        tell!(
            "Show the board to the camera: near and far, in the middle, at the edges and in the \
             corners of the picture, tilted to all sides. Hold it still at each place."
        );
    }
    let (mut kept, mut last): (Vec<Shown>, Option<Shown>) = (Vec::new(), None);
    let mut folder = None;
    let mut line = ProgressLine::shown_if(is_shown());
    let (mut idle, mut number) = (0, 0);
    while kept.len() < usize::from(wanted) && idle < MAX_IDLE {
        let Some(frame) = view.next_picture(&Stage::Lens { number: number / 2 })? else { break };
        number += 1;
        let name = format!("picture {}", kept.len() + 1);
        let seen = match shown(frame.colour().clone(), name)? {
            Ok(seen) => seen,
            Err(why) => {
                // Once, while nothing is taken yet: another board in the hand.
                if idle == TOLD_AFTER && kept.is_empty() {
                    tell!("{why}");
                }
                (idle, last) = (idle + 1, None);
                continue;
            }
        };
        let width = seen.picture.width() as f64;
        let moved = |other: &Shown| movement(&seen.view, &other.view) / width;
        let is_still = last.as_ref().is_some_and(|last| moved(last) <= MAX_SHAKE);
        let is_new = kept.iter().all(|kept| moved(kept) >= MIN_MOVEMENT);
        if is_still && is_new {
            let folder = match &folder {
                Some(folder) => folder,
                None => folder.insert(new_folder(parent)?),
            };
            png::save(&folder.join(format!("{:02}.png", kept.len() + 1)), &seen.picture)?;
            idle = 0;
            kept.push(seen);
            line.clear();
            line.show(
                format_args!("{} of {wanted} pictures are taken", kept.len()),
                Instant::now(),
            );
            last = None;
        } else {
            (idle, last) = (idle + 1, Some(seen));
        }
    }
    line.clear();
    tell!("{} of {wanted} pictures are taken", kept.len());
    if idle >= MAX_IDLE {
        tell_idle(kept.len());
    }
    Ok(kept)
}

/// Creates a folder for the pictures that are taken, and says how they are used again.
fn new_folder(parent: &Path) -> Result<PathBuf, Failure> {
    let numbered = OutputDir::Numbered { parent: parent.to_owned(), prefix: "taken" };
    let folder = numbered.create()?;
    tell!(
        "The pictures are kept in {0}; to use them again, also after an early end: \
         --pictures {0}",
        folder.display()
    );
    Ok(folder)
}

/// Says that the pictures showed nothing new for too long. Those that are taken may suffice.
fn tell_idle(kept: usize) {
    tell!(
        "{MAX_IDLE} pictures showed no new view of the board, held still: the calibration goes on \
         with the {kept} that are taken. Show it at other places, with all of it in the picture \
         and in even light"
    );
}

/// Returns the mean distance between the corners that both views have, pixels; infinity if they
/// have none in common.
fn movement(a: &LensView, b: &LensView) -> f64 {
    let other = |id: usize| b.corners.iter().find(|corner| corner.id == id);
    let distances: Vec<f64> = a
        .corners
        .iter()
        .filter_map(|corner| Some((corner.image - other(corner.id)?.image).norm()))
        .collect();
    if distances.is_empty() {
        return f64::INFINITY;
    }
    distances.iter().sum::<f64>() / distances.len() as f64
}
