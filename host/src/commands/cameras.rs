//! `plumb cameras`: what is there, and what is missing.

use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use plumb_cameras::survey::{Library, Reach, Survey, survey};

use super::print::tell;
use super::{FAILED, Failure, OrFail, print};

/// The depth cameras that are there, and what is missing to use them
///
/// Exit code 1 where none can be opened.
#[derive(Parser)]
pub(crate) struct Args {
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Failure> {
    let survey = survey(Path::new("/"));
    tell(&survey);
    if args.json {
        print::result(serde_json::to_string(&survey).or_failed()?)?;
    }
    Ok(if survey.cameras.is_empty() { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

fn tell(survey: &Survey) {
    match &survey.openni {
        Library::Loaded { version, drivers } => {
            tell!("OpenNI2 {version}, drivers: {}", drivers.join(", "))
        }
        Library::Absent { .. } => tell!("OpenNI2: not there"),
    }
    for camera in &survey.cameras {
        tell!("camera: {} (uri = {:?})", camera.name, camera.uri);
    }
    for camera in &survey.usb {
        let reach = match camera.reach {
            Reach::Open => "can be opened",
            Reach::Forbidden => "may not be opened by this user",
            Reach::Absent => "cannot be opened",
        };
        tell!("USB: {} {}, {reach}, through {}", camera.id, camera.name, camera.through);
    }
    for text in &survey.missing {
        tell!("missing: {text}");
    }
}
