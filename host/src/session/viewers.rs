//! Outputs for the viewers Foxglove and Lichtblick: their options.

#[cfg_attr(feature = "foxglove", path = "viewers/present.rs")]
#[cfg_attr(not(feature = "foxglove"), path = "viewers/absent.rs")]
mod output;

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;

use crate::cli::numbers::with_port;

#[derive(Args)]
pub(crate) struct ViewerOptions {
    /// Write the run to this MCAP file, which must not exist, for Foxglove, Lichtblick or Rerun
    #[arg(long, value_name = "FILE", value_parser = output::file)]
    pub(crate) mcap: Option<PathBuf>,
    /// Show the run live in Foxglove or Lichtblick
    #[arg(long, value_parser = output::flag)]
    pub(crate) foxglove: bool,
    /// Address, port or both for them. Whoever reaches it sees the run, also a web page in a
    /// browser on this computer
    #[arg(
        long,
        value_name = "ADDRESS",
        requires = "foxglove",
        default_value = DEFAULT_ADDRESS,
        value_parser = |text: &str| with_port(text, DEFAULT_ADDRESS)
    )]
    pub(crate) foxglove_address: SocketAddr,
}

/// Address of the live server if none is given: the one that the viewers offer.
const DEFAULT_ADDRESS: &str = "127.0.0.1:8765";
