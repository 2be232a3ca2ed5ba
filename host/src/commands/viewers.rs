//! Outputs for the viewers Foxglove and Lichtblick: their options.

#[cfg_attr(feature = "foxglove", path = "viewers/present.rs")]
#[cfg_attr(not(feature = "foxglove"), path = "viewers/absent.rs")]
mod output;

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;

pub(super) use output::{Viewers, close};

#[derive(Args)]
pub(super) struct ViewerOptions {
    /// Write the run to this MCAP file, which must not exist, for Foxglove, Lichtblick or Rerun
    #[arg(long, value_name = "FILE", value_parser = output::file)]
    pub(super) mcap: Option<PathBuf>,
    /// Show the run live in Foxglove or Lichtblick. Whoever reaches the address sees the run, also
    /// a web page in a browser on this computer [default without ADDRESS: 127.0.0.1:8765]
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = DEFAULT_ADDRESS,
        value_parser = output::address
    )]
    pub(super) foxglove: Option<SocketAddr>,
}

/// Address of the live server if none is given: the one that the viewers offer.
const DEFAULT_ADDRESS: &str = "127.0.0.1:8765";
