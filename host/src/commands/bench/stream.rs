//! `plumb bench stream`: pictures that another program sends, in real time.

use std::process::ExitCode;

use clap::Parser;
use plumb_bench::stream::{StreamOptions, measure};
use plumb_cameras::camera_file;
use plumb_vision::image::ImageSize;

use crate::commands::print::{self, tell};
use crate::commands::{Failure, failed_because, numbers};

/// Frames that another program sends (camera.source = "stream"), in real time
///
/// A thread sends rendered JPEG pictures of a moving ball through a Unix socket at the given rate.
/// The rest is as in a run: newest frame, detector `ball`. Prints the frames that were dropped, the
/// ages when the position is known, and the positions in a second. Results depend on the computer.
#[derive(Parser)]
#[command(
    after_help = examples!["plumb bench stream --depth", "plumb bench stream --rate 500 --json"]
)]
pub(crate) struct StreamArgs {
    /// Frames that are sent in a second, 1 to 1000 1/s
    #[arg(long, default_value_t = 60, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u32>(1.0, 1000.0, "1/s"))]
    rate: u32,
    /// Duration, 1 to 3600 s
    #[arg(long, default_value_t = 10, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u32>(1.0, 3600.0, "s"))]
    seconds: u32,
    /// Columns, 64 to 4096 pixels
    #[arg(long, default_value_t = 1280, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u16>(64.0, 4096.0, "pixels"))]
    width: u16,
    /// Rows, 64 to 4096 pixels
    #[arg(long, default_value_t = 720, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u16>(64.0, 4096.0, "pixels"))]
    height: u16,
    /// Send depth too, 16 bits for each pixel
    #[arg(long)]
    depth: bool,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Returns the options of the measurement.
pub(super) fn options(args: &StreamArgs) -> StreamOptions {
    let [width, height] = [args.width, args.height].map(usize::from);
    StreamOptions {
        rate: args.rate.into(),
        seconds: args.seconds.into(),
        size: ImageSize { width, height },
        has_depth: args.depth,
    }
}

pub(super) fn main(args: &StreamArgs) -> Result<ExitCode, Failure> {
    let options = options(args);
    let folder = SocketFolder::create()?;
    let report = measure(&camera_file::paper()?, &folder.0, &options).map_err(failed_because)?;
    tell!("{report}");
    if args.json {
        print::result(serde_json::to_string(&report)?)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Folder of the socket; removed when dropped.
struct SocketFolder(std::path::PathBuf);

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
