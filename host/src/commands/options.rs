//! What `demo`, `run` and `goto` can all be told.

use std::path::PathBuf;

use clap::Args;
use plumb_runtime::session::Place;

use super::{DetectorName, Physics, numbers};

#[derive(Args)]
pub(super) struct RunOptions {
    /// Detector
    #[arg(long, value_enum, default_value = "ball")]
    pub(super) detector: DetectorName,
    /// How a simulated rig behaves
    #[arg(long, value_enum, default_value = "quasi-static")]
    pub(super) physics: Physics,
    /// Seconds until a target is given up
    #[arg(long, default_value_t = 120.0, allow_negative_numbers = true, value_parser = numbers::seconds)]
    pub(super) timeout: f64,
    /// Folder for the run, new or empty [default: the next number under runs/]
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: Option<PathBuf>,
    /// Record the pictures to this folder, new or empty (TUM RGB-D, for `plumb replay`; a camera's
    /// also as .oni)
    #[arg(long, value_name = "FOLDER")]
    pub(super) record: Option<PathBuf>,
    /// End with a line of JSON on standard output (the demo always does)
    #[arg(long)]
    pub(super) json: bool,
}

impl RunOptions {
    /// Where the run's folder goes; numbered ones are called `prefix`.
    pub(super) fn place(&self, prefix: &'static str) -> Place {
        self.out.clone().map_or(Place::Numbered(prefix), Place::Folder)
    }
}
