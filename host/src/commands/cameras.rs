//! `plumb cameras`: depth cameras, and what is missing to use them.

use std::path::Path;

use clap::Parser;
use plumb_cameras::discovery::{Access, Discovery, discover};
use plumb_frame::driver::LibraryState;

use crate::cli::exit::{Exit, Work};
use crate::cli::print;

/// The cameras that are there, and what is missing to use them
///
/// Exit code 1 where none can be opened.
#[derive(Parser)]
#[command(after_help = examples!["plumb cameras", "plumb cameras --json"])]
pub(crate) struct Args {
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn prepare(args: Args) -> Work {
    Box::new(move || {
        let found = discover(Path::new("/"));
        tell(&found);
        print::json(args.json, &found)?;
        Ok(Exit::done_if(!found.cameras.is_empty()))
    })
}

/// Prints what was found and what is missing for a person.
fn tell(found: &Discovery) {
    for library in found.libraries.values() {
        match &library.state {
            LibraryState::Loaded { version, drivers } if drivers.is_empty() => {
                tell!("{} {version}", library.name)
            }
            LibraryState::Loaded { version, drivers } => {
                tell!("{} {version}, drivers: {}", library.name, drivers.join(", "))
            }
            LibraryState::Absent { .. } => tell!("{}: cannot be loaded", library.name),
        }
    }
    for camera in &found.cameras {
        tell!("camera: {} (uri, serial or device = {:?})", camera.name, camera.uri);
    }
    for camera in &found.usb {
        let access = match camera.access {
            Access::Open => "can be opened",
            Access::Forbidden => "may not be opened by this user",
            Access::Absent => "cannot be opened",
        };
        tell!("USB: {} {}, {access}, through {}", camera.id, camera.name, camera.support);
    }
    for text in &found.missing {
        tell!("missing: {text}");
    }
    tell!(
        "not searched for: cameras in ROS 2 (source = \"ros2\"; `ros2 topic list` has the topics) \
         and other programs (source = \"stream\")"
    );
    if found.cameras.is_empty() {
        tell!("no camera was found: plug it in, with its library (a camera needs only its own)");
    }
}
