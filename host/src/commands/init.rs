//! `plumb init`: a new rig file and camera file, by questions or from options.

mod advice;
mod colour;
mod dialogue;
mod options;
mod questions;

use std::fs;
use std::io;
use std::path::Path;

use nix::unistd::{AccessFlags, access};
use plumb_cameras::recording::own_camera_file;
use plumb_cameras::stream::StreamAddress;
use plumb_config::book::page;
use plumb_config::whole_writes::write_new;
use plumb_setup::new_rig::{NewCamera, NewFiles, NewPlanarRig, NewRig};
use serde_json::json;

use self::advice::{next_step, notes};
use self::dialogue::Dialogue;

pub(crate) use self::options::Args;
use crate::cli::exit::{Exit, Failure, Unwritten, Work, failed};
use crate::cli::print::{self, Questions};
use crate::cli::rig_path::rig_option;

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    let [rig_path, camera_path] = ["rig.toml", "camera.toml"].map(|name| args.folder.join(name));
    // Before the questions, so that no answer is lost.
    for path in [&rig_path, &camera_path] {
        if path.symlink_metadata().is_ok() {
            return Err(failed(format!(
                "{}: exists; nothing was written. Remove it, or give another folder",
                path.display()
            )));
        }
    }
    check_writable(&args.folder, &rig_path)?;
    if args.planar {
        let files = planar(&args).files()?;
        return Ok(Box::new(move || write_planar(&args, &files, [&rig_path, &camera_path])));
    }
    let mut dialogue = Dialogue::new(io::stdin().lock(), Questions, !args.yes);
    let rig = questions::rig(&args, &mut dialogue)?;
    let files = rig.files()?;
    Ok(Box::new(move || write(&args, &rig, &files, [&rig_path, &camera_path])))
}

/// Returns the rig of two motors of the options.
fn planar(args: &Args) -> NewPlanarRig {
    let new = NewPlanarRig::default();
    NewPlanarRig {
        port: args.port.clone().unwrap_or(new.port),
        board: args.board.unwrap_or(new.board),
        driver: args.driver.unwrap_or(new.driver),
        microsteps: args.microsteps.unwrap_or(new.microsteps),
        ball_hue: args.colour.unwrap_or(new.ball_hue),
        is_simulated: args.simulated,
    }
}

/// Writes the files of a rig of two motors, and says what comes next.
fn write_planar(
    args: &Args,
    files: &NewFiles,
    [rig_path, camera_path]: [&Path; 2],
) -> Result<Exit, Failure> {
    write_files(&args.folder, rig_path, camera_path, files)?;
    note!("written: {} and {}", rig_path.display(), camera_path.display());
    if let Some(straps) = &files.straps {
        note!("straps of each driver: {straps}");
    }
    let rig = rig_option(rig_path.strip_prefix(".").unwrap_or(rig_path));
    match args.simulated {
        true => {
            note!("next: `plumb emulate --link board &`, then `plumb run{rig} --port board --page`")
        }
        false => note!("next: `plumb run{rig} --page`: two jogs, and a click into the picture"),
    }
    print::json(args.json, json!({ "rig": rig_path, "camera": camera_path }))?;
    Ok(Exit::Done)
}

/// Writes the files of a rig, and says what a person must know of them.
fn write(
    args: &Args,
    rig: &NewRig,
    files: &NewFiles,
    [rig_path, camera_path]: [&Path; 2],
) -> Result<Exit, Failure> {
    write_files(&args.folder, rig_path, camera_path, files)?;
    note!("written: {} and {}", rig_path.display(), camera_path.display());
    if let Some(sender) = sender(&rig.camera, &args.folder) {
        note!("pictures: {sender} (`camera.stream` in the rig file; {})", page("stream"));
    }
    if let (NewCamera::Recording(recording), Some(own)) = (&rig.camera, &rig.recorded) {
        let ball = (rig.ball_diameter, rig.ball_hue);
        let is_same_ball = ball == (own.ball_diameter, own.ball_hue);
        let taken = if is_same_ball { "intrinsics, pose and ball" } else { "intrinsics and pose" };
        note!("camera: {taken} are those of {}", own_camera_file(recording).display());
    }
    if let Some(straps) = &files.straps {
        let end = if rig.microsteps == 1 { "" } else { "s" };
        note!("straps of each driver for {} microstep{end}: {straps}", rig.microsteps);
    }
    for text in notes(rig) {
        note!("note: {text}");
    }
    note!("next: {}", next_step(rig, rig_path));
    let straps = files.straps.as_ref().map(|straps| straps.to_string());
    print::json(args.json, json!({ "rig": rig_path, "camera": camera_path, "straps": straps }))?;
    Ok(Exit::Done)
}

/// Checks that `file` can be written into `folder`, or into the folder that it will be created in.
fn check_writable(folder: &Path, file: &Path) -> Result<(), Failure> {
    let mut folders = folder.ancestors().map(|it| match it.as_os_str().is_empty() {
        true => Path::new("."),
        false => it,
    });
    let Some(existing) = folders.find(|it| it.exists()) else { return Ok(()) };
    let access = access(existing, AccessFlags::W_OK).map_err(io::Error::from);
    Ok(access.map_err(Unwritten::at(file))?)
}

/// Returns where the pictures of another program are expected, for a person; `None` for other
/// cameras. A socket is beside the rig file in `folder`.
fn sender(camera: &NewCamera, folder: &Path) -> Option<String> {
    let NewCamera::Stream(address) = camera else { return None };
    let mut address = address.clone();
    address.relative_to(folder);
    Some(match address {
        StreamAddress::StandardInput => "another program writes them to standard input".to_owned(),
        _ => format!("another program sends them to {address}, where a run listens"),
    })
}

/// Writes both files, or none.
fn write_files(
    folder: &Path,
    rig_path: &Path,
    camera_path: &Path,
    files: &NewFiles,
) -> Result<(), Unwritten> {
    fs::create_dir_all(folder).map_err(Unwritten::at(folder))?;
    write_new(rig_path, files.rig.as_bytes()).map_err(Unwritten::at(rig_path))?;
    write_new(camera_path, files.camera.as_bytes()).map_err(|error| {
        // The rig file is of no use without it.
        let _ = fs::remove_file(rig_path);
        Unwritten::at(camera_path)(error)
    })
}
