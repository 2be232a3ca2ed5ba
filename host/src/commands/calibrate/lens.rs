//! `plumb calibrate --lens`: intrinsics and distortion from pictures of the printed board.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use plumb_calibrate::board::Board;
use plumb_calibrate::board_view::SeenCorner;
use plumb_calibrate::calibration::Grade;
use plumb_calibrate::camera_text::with_lens;
use plumb_calibrate::corners::{BoardError, find_corners};
use plumb_calibrate::lens::{LensCalibration, LensView, calibrate_lens};
use plumb_calibrate::overlay::draw_corners;
use plumb_cameras::bounded_read;
use plumb_cameras::source::tum::MAX_BYTES;
use plumb_cameras::{camera_file, decode, png};
use plumb_runtime::rig::Rig;
use plumb_vision::camera::{Camera, DistortionCoefficients};
use plumb_vision::image::ColourImage;
use serde::Serialize;

use super::output::CameraFile;
use super::view::{Stage, View};
use crate::commands::old_file::OldFile;
use crate::commands::print::tell;
use crate::commands::{FAILED, Failure, bad_input, failed, print};

/// Ways that exclude the options.
const NOT_LENS: [&str; 4] = ["board", "motors", "ball", "print_board"];
/// Least mean movement of the board's corners from every picture that is kept, in widths of the
/// picture.
const MIN_MOVEMENT: f64 = 0.06;
/// Largest mean movement of the corners between two pictures of a board that is held still, in
/// widths of the picture: 1.5 pixels of 640.
const MAX_SHAKE: f64 = 0.0025;
/// Pictures in a row that show nothing new, after which the collection ends: 40 s at 30 Hz.
const MAX_IDLE: u32 = 1200;

/// Pictures of the board for the lens.
#[derive(Args)]
#[command(next_help_heading = "With --lens")]
pub(super) struct LensOptions {
    /// Folder with the pictures, PNG or JPEG, of one size; without it the rig's camera takes them
    #[arg(long, value_name = "FOLDER", conflicts_with_all = NOT_LENS)]
    pictures: Option<PathBuf>,
    /// Number of pictures that the rig's camera takes [default: 20]
    #[arg(long, value_parser = clap::value_parser!(u8).range(5..=60))]
    #[arg(conflicts_with_all = NOT_LENS, conflicts_with = "pictures")]
    views: Option<u8>,
}

/// A picture with the board's corners.
struct Shown {
    picture: ColourImage,
    view: LensView,
}

/// Result as a line of JSON.
#[derive(Serialize)]
struct Report {
    grade: String,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    /// k1, k2, p1, p2, k3.
    distortion: [f64; 5],
    focal_sd_px: f64,
    centre_sd_px: f64,
    rms_px: f64,
    held_out_px: f64,
    coverage: f64,
    views: usize,
    outliers: usize,
    findings: Vec<String>,
    /// Folder of the pictures with the corners drawn in.
    pictures: PathBuf,
    written: bool,
}

/// Estimates the lens, and writes it into the camera file.
pub(super) fn calibrate(
    options: &LensOptions,
    (file, rig, camera): (&Path, &Rig, Camera),
    camera_file: &CameraFile<'_>,
    (is_agreed, is_json): (bool, bool),
) -> Result<ExitCode, Failure> {
    let shown = match &options.pictures {
        Some(folder) => from_folder(folder)?,
        None => from_camera(View::open(file, rig, camera, 1)?, options.views.unwrap_or(20))?,
    };
    let Some(first) = shown.first() else {
        return Err(failed(
            "no picture shows the board: `plumb calibrate --print-board board.pdf`",
        ));
    };
    let size = first.picture.size();
    let views: Vec<LensView> = shown.iter().map(|shown| shown.view.clone()).collect();
    let found = calibrate_lens(&views, size)?;
    let pictures = keep_pictures(&shown, &found, camera_file.path)?;
    let mut report = Report::new(&found, pictures);
    report.tell();
    if found.grade() != Grade::Poor {
        let text = with_lens(camera_file.text, &found.intrinsics, "plumb calibrate --lens")?;
        camera_file::parse(camera_file.path, &text)?;
        let old = OldFile { path: camera_file.path, text: camera_file.text };
        report.written = old.offer(&text, "the intrinsics", is_agreed)?;
    }
    if is_json {
        print::result(serde_json::to_string(&report)?)?;
    }
    Ok(if report.written { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}

/// Searches the board in a picture; `None` where it is not seen.
fn shown(picture: ColourImage, name: String) -> Result<Option<Shown>, Failure> {
    let corners = match find_corners(&picture, &Board::SHEET) {
        Ok(corners) => corners,
        Err(BoardError::NotSeen { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let places = Board::SHEET.corners();
    let seen = |id: usize, image| SeenCorner { id, board: places[id], image, depth: None };
    let corners = corners.iter().map(|corner| seen(corner.id, corner.image)).collect();
    Ok(Some(Shown { picture, view: LensView { name, corners } }))
}

/// Reads the pictures of a folder in the order of their names.
fn from_folder(folder: &Path) -> Result<Vec<Shown>, Failure> {
    let unreadable = |error| bad_input(format!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(unreadable)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()
        .map_err(unreadable)?;
    paths.retain(|path| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        ["png", "jpg", "jpeg"].contains(&ending.as_str())
    });
    paths.sort();
    if paths.is_empty() {
        return Err(bad_input(format!("{}: has no .png or .jpg picture", folder.display())));
    }
    let (mut all, mut size) = (Vec::new(), None);
    for path in &paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let bytes = bounded_read::read(path, MAX_BYTES)?;
        let picture = decode::colour(&bytes)
            .map_err(|error| bad_input(format!("{}: {error}", path.display())))?;
        let first = *size.get_or_insert(picture.size());
        if picture.size() != first {
            let found = picture.size();
            return Err(bad_input(format!(
                "{}: {found}, but the first picture is {first}: all must be of one size",
                path.display()
            )));
        }
        match shown(picture, name.clone())? {
            Some(shown) => all.push(shown),
            None => tell!("{name}: the board is not seen; left out"),
        }
    }
    tell!("the board is seen in {} of {} pictures", all.len(), paths.len());
    Ok(all)
}

/// Takes `wanted` pictures of the board at different places, held still.
fn from_camera(mut view: View, wanted: u8) -> Result<Vec<Shown>, Failure> {
    if view.needs_person() {
        tell!(
            "Show the board to the camera: near and far, in the middle, at the edges and in the \
             corners of the picture, tilted to all sides. Hold it still at each place."
        );
    }
    let (mut kept, mut last): (Vec<Shown>, Option<Shown>) = (Vec::new(), None);
    let (mut idle, mut number) = (0, 0);
    while kept.len() < usize::from(wanted) {
        let Some(frame) = view.next_picture(&Stage::Lens { number: number / 2 })? else { break };
        number += 1;
        let name = format!("picture {}", kept.len() + 1);
        let Some(seen) = shown(frame.colour().clone(), name)? else {
            (idle, last) = (idle + 1, None);
            check_idle(idle, kept.len())?;
            continue;
        };
        let width = seen.picture.width() as f64;
        let moved = |other: &Shown| movement(&seen.view, &other.view) / width;
        let is_still = last.as_ref().is_some_and(|last| moved(last) <= MAX_SHAKE);
        let is_new = kept.iter().all(|kept| moved(kept) >= MIN_MOVEMENT);
        if is_still && is_new {
            tell!("{} of {wanted}: taken", kept.len() + 1);
            idle = 0;
            kept.push(seen);
            last = None;
        } else {
            (idle, last) = (idle + 1, Some(seen));
            check_idle(idle, kept.len())?;
        }
    }
    Ok(kept)
}

/// Returns an error where the pictures show nothing new for too long.
fn check_idle(idle: u32, kept: usize) -> Result<(), Failure> {
    if idle < MAX_IDLE {
        return Ok(());
    }
    Err(failed(format!(
        "{MAX_IDLE} pictures showed no new view of the board, held still ({kept} are taken): show \
         it at other places, with all of it in the picture and in even light"
    )))
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

/// Writes the pictures with the corners drawn in into a folder beside the camera file. Returns the
/// folder.
fn keep_pictures(
    shown: &[Shown],
    found: &LensCalibration,
    camera_file: &Path,
) -> Result<PathBuf, Failure> {
    let folder = camera_file.with_extension("lens");
    let unwritable = |error| failed(format!("{}: {error}", folder.display()));
    fs::create_dir_all(&folder).map_err(unwritable)?;
    for (number, fit) in found.views.iter().enumerate() {
        let Some(shown) = shown.iter().find(|shown| shown.view.name == fit.name) else { continue };
        let expected = fit.expected(&found.intrinsics);
        let seen = fit.corners.iter().map(|corner| corner.image);
        let drawn = draw_corners(&shown.picture, seen.zip(expected))?;
        png::save(&folder.join(format!("{:02}.png", number + 1)), &drawn)?;
    }
    Ok(folder)
}

impl Report {
    fn new(found: &LensCalibration, pictures: PathBuf) -> Self {
        let lens = &found.intrinsics;
        let coefficients = lens.distortion.map(|it| it.coefficients()).unwrap_or_default();
        Self {
            grade: found.grade().to_string(),
            fx: lens.fx,
            fy: lens.fy,
            cx: lens.cx,
            cy: lens.cy,
            distortion: DistortionCoefficients::to_array(coefficients),
            focal_sd_px: found.focal_sd,
            centre_sd_px: found.centre_sd,
            rms_px: found.rms,
            held_out_px: found.held_out,
            coverage: found.coverage,
            views: found.views.len(),
            outliers: found.outliers,
            findings: found.findings.clone(),
            pictures,
            written: false,
        }
    }

    /// Prints the report for a person.
    fn tell(&self) {
        let [k1, k2, p1, p2, k3] = self.distortion;
        tell!("lens: {} ({} pictures, {} corners left out)", self.grade, self.views, self.outliers);
        tell!(
            "  fx {:.2}, fy {:.2} (± {:.2}), cx {:.2}, cy {:.2} (± {:.2}) px",
            self.fx,
            self.fy,
            self.focal_sd_px,
            self.cx,
            self.cy,
            self.centre_sd_px
        );
        tell!("  k1 {k1:.5}, k2 {k2:.5}, p1 {p1:.5}, p2 {p2:.5}, k3 {k3:.5}");
        tell!(
            "  residual {:.2} px, in held-out pictures {:.2} px; corners in {:.0} % of the picture",
            self.rms_px,
            self.held_out_px,
            100.0 * self.coverage
        );
        for finding in &self.findings {
            tell!("  note: {finding}");
        }
        if self.grade == Grade::Poor.to_string() {
            tell!("  this lens is not written, for it is too uncertain");
        }
        tell!("  pictures: {} (green seen, yellow expected)", self.pictures.display());
        tell!("  a pose that was found with other intrinsics is wrong: calibrate it again");
    }
}
