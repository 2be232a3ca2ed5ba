//! `plumb calibrate --lens`: intrinsics and distortion from pictures of the printed board.

mod pictures;

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use plumb_calibrate::calibration::Grade;
use plumb_calibrate::camera_text::with_lens;
use plumb_calibrate::lens::{LensCalibration, LensView, calibrate_lens};
use plumb_calibrate::overlay::draw_corners;
use plumb_cameras::{camera_file, png};
use plumb_runtime::rig::Rig;
use plumb_vision::camera::{CalibratedFor, Camera, Intrinsics};
use serde_json::{Value, json};

use super::output::{self, CameraFile};
use super::view::View;
use crate::cli::exit::{Exit, Failure, Unwritten, Work, failed};
use crate::cli::numbers;
use pictures::{Shown, from_camera, from_folder};

/// Ways that exclude the options.
const NOT_LENS: [&str; 5] = ["board", "motors", "ball", "import", "print_board"];
/// Pictures of the board for the lens.
#[derive(Args)]
#[command(next_help_heading = "With --lens")]
pub(super) struct LensOptions {
    /// Folder with the pictures, of one size; without it the rig's camera takes them
    #[arg(long, value_name = "FOLDER", conflicts_with_all = NOT_LENS)]
    pictures: Option<PathBuf>,
    /// Number of pictures that the rig's camera takes, 5 to 60 pictures [default: 20]
    #[arg(long, value_parser = numbers::whole::<u8>(5.0, 60.0, "pictures"))]
    #[arg(conflicts_with_all = NOT_LENS, conflicts_with = "pictures")]
    views: Option<u8>,
}

/// Reads the pictures of the options, or opens the camera.
pub(super) fn prepare(
    options: &LensOptions,
    (file, rig, camera): (&Path, &Rig, Camera),
    camera_file: CameraFile,
    answers: (bool, bool),
) -> Result<Work, Failure> {
    let ignored = output::without_effect(file, rig);
    if let Some(folder) = &options.pictures {
        let shown = from_folder(folder)?;
        return Ok(Box::new(move || calibrate(&shown, ignored, &camera_file, answers)));
    }
    // The file's intrinsics may be a guess for pictures of another size.
    let camera = Camera { calibrated_for: CalibratedFor::Nothing, ..camera };
    let (view, count) = (View::open_whole(file, rig, camera)?, options.views.unwrap_or(20));
    Ok(Box::new(move || {
        let shown = from_camera(view, count, &lens_folder(&camera_file.path))?;
        calibrate(&shown, ignored, &camera_file, answers)
    }))
}

/// Estimates the lens, and writes it into the camera file. `ignored` says that a run ignores it.
fn calibrate(
    shown: &[Shown],
    ignored: Option<String>,
    camera_file: &CameraFile,
    (is_agreed, is_json): (bool, bool),
) -> Result<Exit, Failure> {
    let Some(first) = shown.first() else {
        return Err(failed(
            "no picture shows the board: `plumb calibrate --print-board board.pdf`",
        ));
    };
    let size = first.picture.size();
    let views: Vec<LensView> = shown.iter().map(|shown| shown.view.clone()).collect();
    let found = calibrate_lens(&views, size)?;
    let pictures = keep_pictures(shown, &found, &camera_file.path)?;
    let is_poor = found.grade() == Grade::Poor;
    let mut findings = found.findings.clone();
    findings.extend(ignored.filter(|_| !is_poor));
    tell(&found, &findings, &pictures);
    let mut written = Ok(false);
    if !is_poor {
        let lens = (&found.intrinsics, size);
        let text = with_lens(&camera_file.text, lens, "plumb calibrate --lens")?;
        camera_file::parse(&camera_file.path, &text)?;
        written = camera_file.replace(&text, "the intrinsics", is_agreed);
    }
    output::conclude(written, is_json, |is_written| line(&found, &findings, &pictures, is_written))
}

/// Returns the folder beside the camera file that holds pictures of the board.
fn lens_folder(camera_file: &Path) -> PathBuf {
    camera_file.with_extension("lens")
}

/// Writes the pictures with the corners drawn in into the [`lens_folder`]. Returns it.
fn keep_pictures(
    shown: &[Shown],
    found: &LensCalibration,
    camera_file: &Path,
) -> Result<PathBuf, Failure> {
    let folder = lens_folder(camera_file);
    fs::create_dir_all(&folder).map_err(Unwritten::at(&folder))?;
    for (number, fit) in found.views.iter().enumerate() {
        let Some(shown) = shown.iter().find(|shown| shown.view.name == fit.name) else { continue };
        let expected = fit.expected(&found.intrinsics);
        let seen = fit.corners.iter().map(|corner| corner.image);
        let drawn = draw_corners(&shown.picture, seen.zip(expected))?;
        png::save(&folder.join(format!("{:02}.png", number + 1)), &drawn)?;
    }
    Ok(folder)
}

/// Prints the result for a person. A poor lens is not written.
fn tell(found: &LensCalibration, findings: &[String], pictures: &Path) {
    let LensCalibration { intrinsics, focal_sd, centre_sd, rms, held_out, coverage, .. } = found;
    let Intrinsics { fx, fy, cx, cy, .. } = intrinsics;
    let [k1, k2, p1, p2, k3] = coefficients(found);
    let (views, outliers) = (found.views.len(), found.outliers);
    tell!("lens: {} ({views} pictures, {outliers} corners left out)", found.grade());
    tell!(
        "  fx {fx:.2}, fy {fy:.2} (± {focal_sd:.2}), cx {cx:.2}, cy {cy:.2} (± {centre_sd:.2}) px"
    );
    tell!("  k1 {k1:.5}, k2 {k2:.5}, p1 {p1:.5}, p2 {p2:.5}, k3 {k3:.5}");
    tell!(
        "  residual {rms:.2} px, in held-out pictures {held_out:.2} px; corners in {:.0} % of the \
         picture",
        100.0 * coverage
    );
    for finding in findings {
        tell!("  note: {finding}");
    }
    tell!("  pictures: {} (green seen, yellow expected)", pictures.display());
    match found.grade() {
        Grade::Poor => tell!("  this lens is not written, for it is too uncertain"),
        _ => tell!("  a pose that was found with other intrinsics is wrong: calibrate it again"),
    }
}

/// Returns k1, k2, p1, p2, k3.
fn coefficients(found: &LensCalibration) -> [f64; 5] {
    let coefficients = found.intrinsics.distortion.map(|it| it.coefficients());
    coefficients.unwrap_or_default().to_array()
}

/// Returns the result in JSON.
fn line(found: &LensCalibration, findings: &[String], pictures: &Path, is_written: bool) -> Value {
    let Intrinsics { fx, fy, cx, cy, .. } = found.intrinsics;
    json!({
        "grade": found.grade().to_string(),
        "fx": fx,
        "fy": fy,
        "cx": cx,
        "cy": cy,
        "distortion": coefficients(found),
        "focal_sd_px": found.focal_sd,
        "centre_sd_px": found.centre_sd,
        "rms_px": found.rms,
        "held_out_px": found.held_out,
        "coverage": found.coverage,
        "views": found.views.len(),
        "outliers": found.outliers,
        "findings": findings,
        "pictures": pictures,
        "written": is_written,
    })
}
