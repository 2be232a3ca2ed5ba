//! `plumb-lab stream`: pictures that another program sends, in real time.

use std::path::PathBuf;

use clap::{Parser, value_parser};
use plumb_bench::stream::{StreamOptions, measure};
use plumb_cameras::camera_file;
use plumb_vision::image::ImageSize;

use crate::output::{self, Failure, bad_input, failed};

/// Frames that another program sends (camera.source = "stream"), in real time
///
/// A thread sends rendered JPEG pictures of a moving ball through a Unix socket at the given rate.
/// The rest is as in a run: newest frame, detector `ball`. Prints the frames that were dropped, the
/// ages when the position is known, and the positions in a second. Results depend on the computer.
#[derive(Parser)]
#[command(after_help = "Examples:
  plumb-lab stream --depth
  plumb-lab stream --rate 500 --json")]
pub(crate) struct Args {
    /// Frames that are sent in a second, 1 to 1000 1/s
    #[arg(long, default_value_t = 60, value_parser = value_parser!(u32).range(1..=1000))]
    rate: u32,
    /// Duration, 1 to 3600 s
    #[arg(long, default_value_t = 10, value_parser = value_parser!(u32).range(1..=3600))]
    seconds: u32,
    /// Columns, 64 to 4096 pixels
    #[arg(long, default_value_t = 1280, value_parser = value_parser!(u16).range(64..=4096))]
    width: u16,
    /// Rows, 64 to 4096 pixels
    #[arg(long, default_value_t = 720, value_parser = value_parser!(u16).range(64..=4096))]
    height: u16,
    /// Send depth too, 16 bits for each pixel
    #[arg(long)]
    depth: bool,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn main(args: &Args) -> Result<(), Failure> {
    let options = StreamOptions {
        rate: args.rate.into(),
        seconds: args.seconds.into(),
        size: ImageSize { width: args.width.into(), height: args.height.into() },
        has_depth: args.depth,
    };
    let folder = SocketFolder::create().map_err(failed)?;
    let camera = camera_file::paper().map_err(bad_input)?;
    let report = measure(&camera, &folder.0, &options).map_err(failed)?;
    tell!("{report}");
    if args.json {
        output::print(&report)?;
    }
    Ok(())
}

/// Folder of the socket; removed when dropped.
struct SocketFolder(PathBuf);

impl SocketFolder {
    fn create() -> std::io::Result<Self> {
        let path = std::env::temp_dir().join(format!("plumb-stream-{}", std::process::id()));
        std::fs::create_dir(&path)?;
        Ok(Self(path))
    }
}

impl Drop for SocketFolder {
    fn drop(&mut self) {
        let _remains = std::fs::remove_dir_all(&self.0);
    }
}
