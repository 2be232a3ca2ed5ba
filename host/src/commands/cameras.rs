//! `plumb cameras`: what is there, and what is missing.

use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use plumb_cameras::discovery::{Access, Discovery, Library, discover};

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
    let found = discover(Path::new("/"));
    tell(&found);
    if args.json {
        print::result(serde_json::to_string(&found).or_failed()?)?;
    }
    Ok(if found.cameras.is_empty() { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

fn tell(found: &Discovery) {
    match &found.openni {
        Library::Loaded { version, drivers } => {
            tell!("OpenNI2 {version}, drivers: {}", drivers.join(", "))
        }
        Library::Absent { .. } => tell!("OpenNI2: not there"),
    }
    for camera in &found.cameras {
        tell!("camera: {} (uri = {:?})", camera.name, camera.uri);
    }
    for camera in &found.usb {
        let access = match camera.access {
            Access::Open => "can be opened",
            Access::Forbidden => "may not be opened by this user",
            Access::Absent => "cannot be opened",
        };
        tell!("USB: {} {}, {access}, through {}", camera.id, camera.name, camera.through);
    }
    for text in &found.missing {
        tell!("missing: {text}");
    }
}
