//! Options of `plumb check`.

use clap::Parser;

use plumb_vision::detect::DetectorKind;

use crate::cli::choices::Physics;
use crate::cli::port_args::PortArgs;
use crate::cli::rig_path::RigArg;

/// Check a rig: its files, then its wiring, cables and camera with small jogs
///
/// The files come first: every mistake at once. Then each motor turns a little, one after the other
/// and back, and the camera watches the ball. The command names swapped and reversed motors, a
/// motor that does not turn, slack and slipping cables, and a camera's pose that is turned or
/// mirrored, and offers the corrected rig file. Nothing moves before a yes.
///
/// Exit code 0 where nothing is wrong, 1 where the rig has a fault, 2 where a file has an error.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb check --file-only",
    "plumb check",
    "plumb check --rig trial/rig.toml --yes --json",
])]
pub(crate) struct Args {
    #[command(flatten)]
    pub(super) rig: RigArg,
    /// Check the files only: no board, no camera, nothing moves
    #[arg(long)]
    pub(super) file_only: bool,
    #[command(flatten)]
    pub(super) port: PortArgs,
    /// Detector of the ball
    #[arg(long, value_enum, default_value = "ball")]
    pub(super) detector: DetectorKind,
    /// Physics of the simulated rig, where the camera is simulated
    #[arg(long, value_enum, default_value = "quasi-static")]
    pub(super) physics: Physics,
    /// Turn the motors and write the corrected rig file without asking
    #[arg(long)]
    pub(super) yes: bool,
    /// End with a line of JSON on standard output
    #[arg(long)]
    pub(super) json: bool,
}
