//! Reads the calibration of another program, and writes it into the camera file.

use std::path::{Path, PathBuf};

use plumb_calibrate::camera_text::{with_lens, with_pose};
use plumb_cameras::camera_file;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::MAX_BYTES;
use plumb_import::{Choice, Content, Imported, ImportedLens, ImportedPose, read};
use plumb_runtime::rig::Rig;
use plumb_runtime::rig::check::implausible;
use plumb_vision::camera::{Camera, Intrinsics};
use plumb_vision::image::ImageSize;
use serde_json::json;

use super::ImportOptions;
use crate::cli::exit::{Failure, Work, failed};
use crate::commands::calibrate::output::{self, CameraFile};

/// Reads the path of the calibration file.
pub(super) fn file(text: &str) -> Result<PathBuf, String> {
    Ok(text.into())
}

/// Takes the lens or the pose of the calibration file. The work writes it into the camera file of
/// `rig`, if the user agrees. `file` is the rig file. `is_agreed` answers for him; `is_json` ends
/// with a line of JSON.
///
/// # Errors
/// Where the file cannot be read, is of no known program, or has a lens or a pose that a camera
/// file cannot have.
pub(in super::super) fn prepare(
    (path, options): (&Path, &ImportOptions),
    (file, rig, camera): (&Path, &Rig, &Camera),
    camera_file: CameraFile,
    (is_agreed, is_json): (bool, bool),
) -> Result<Work, Failure> {
    let choice = options.import_camera.as_deref().map_or(Choice::Only, Choice::Named);
    let in_file = |error| failed(format!("{}: {error}", path.display()));
    let model = options.import_model.as_deref();
    let imported = read(&read_text(path, MAX_BYTES)?, choice, model).map_err(in_file)?;
    let comment = format!("plumb calibrate --import: {}", imported.program);
    let old = &camera_file.text;
    let (content, text) = match &imported.content {
        Content::Lens(lens) => {
            let size = lens.size.or(options.import_size).ok_or_else(|| without_size(path))?;
            ("lens", with_lens(old, (&intrinsics(lens, camera), size), &comment)?)
        }
        Content::Pose(pose) => ("pose", with_pose(old, &pose.pose, &comment)?),
    };
    let new = camera_file::parse(&camera_file.path, &text)?;
    let mut findings: Vec<String> =
        implausible(rig, &text, &new).iter().map(ToString::to_string).collect();
    if let Content::Lens(_) = imported.content {
        findings.extend(output::without_effect(file, rig));
    }
    tell(&imported, &findings, options.import_size);
    Ok(Box::new(move || {
        let written = camera_file.replace(&text, &format!("the {content}"), is_agreed);
        output::conclude(written, is_json, |is_written| {
            json!({
                "program": imported.program.to_string(),
                "content": content,
                "notes": imported.notes,
                "findings": findings,
                "written": is_written,
            })
        })
    }))
}

/// Returns the failure of a lens for pictures of an unknown size.
fn without_size(path: &Path) -> Failure {
    failed(format!(
        "{}: the size of the pictures is not in the file, and a lens is wrong for another one: say \
         it with --import-size, such as 1280x720",
        path.display()
    ))
}

/// Returns the intrinsics of a lens with the depth scale of the camera file.
fn intrinsics(lens: &ImportedLens, camera: &Camera) -> Intrinsics {
    let ImportedLens { fx, fy, cx, cy, distortion, .. } = *lens;
    Intrinsics { fx, fy, cx, cy, depth_scale: camera.intrinsics.depth_scale, distortion }
}

/// Prints the result for a person. `stated` is the size of the pictures by the command line.
fn tell(imported: &Imported, findings: &[String], stated: Option<ImageSize>) {
    let program = imported.program.to_string();
    match &imported.content {
        Content::Lens(lens) => tell_lens(&program, lens, stated),
        Content::Pose(pose) => tell_pose(&program, pose),
    }
    for note in &imported.notes {
        tell!("  note: {note}");
    }
    for finding in findings {
        tell!("  {finding}");
    }
}

fn tell_lens(program: &str, lens: &ImportedLens, stated: Option<ImageSize>) {
    tell!("lens, by {program}");
    let ImportedLens { fx, fy, cx, cy, .. } = lens;
    tell!("  fx {fx:.2}, fy {fy:.2}, cx {cx:.2}, cy {cy:.2} px");
    let [k1, k2, p1, p2, k3] =
        lens.distortion.map(|it| it.coefficients()).unwrap_or_default().to_array();
    tell!("  k1 {k1:.5}, k2 {k2:.5}, p1 {p1:.5}, p2 {p2:.5}, k3 {k3:.5}");
    if let Some(ImageSize { width, height }) = lens.size.or(stated) {
        tell!("  for pictures of {width}x{height}");
    }
    tell!("  a pose that was found with other intrinsics is wrong: calibrate it again");
}

fn tell_pose(program: &str, found: &ImportedPose) {
    tell!("pose of `{}` in `{}`, by {program}", found.camera, found.base);
    let (t, q) = (found.pose.translation.vector, found.pose.rotation.coords);
    tell!("  translation [{:.4}, {:.4}, {:.4}] m", t.x, t.y, t.z);
    tell!("  quaternion  [{:.5}, {:.5}, {:.5}, {:.5}] (x, y, z, w)", q.x, q.y, q.z, q.w);
}
