//! Options of the commands that run: `demo`, `run`, `goto`, `follow` and `hold`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use plumb_log::OutputDir;
use plumb_page::{DEFAULT_ADDRESS, Limits, Page, PageSettings, RigView};
use plumb_runtime::operator::OperatorSender;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::DEFAULT_TIMEOUT;
use plumb_vision::camera::Camera;
use plumb_vision::detect::DetectorKind;

use crate::cli::exit::{Failure, failed};
use crate::cli::numbers::{self, with_port};
use crate::session::ros2::Ros2Options;
use crate::session::viewers::ViewerOptions;

/// Heading of the options of outputs.
const OUTPUT: &str = "Output";

#[derive(Args)]
pub(crate) struct RunOptions {
    /// Detector
    #[arg(long, value_enum, default_value = "ball")]
    pub(crate) detector: DetectorKind,
    /// Longest time for each target, above 0, to 1e9 s; if it passes, the run ends without the
    /// other targets (with --page or --ros2, the ball is stopped and the run goes on). `plumb hold`
    /// has targets only with one of these two
    #[arg(long, default_value_t = DEFAULT_TIMEOUT, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::TIME))]
    pub(crate) timeout: f64,
    /// Folder for the run, new or empty [default: the next number under runs/]
    #[arg(long, value_name = "FOLDER", help_heading = OUTPUT)]
    pub(crate) out: Option<PathBuf>,
    /// Record the frames to this folder, new or empty (TUM RGB-D, for `plumb replay`; that of a
    /// camera through OpenNI2 also as .oni)
    #[arg(long, value_name = "FOLDER", help_heading = OUTPUT)]
    pub(crate) record: Option<PathBuf>,
    /// End with a line of JSON on standard output (the demo always does)
    #[arg(long, help_heading = OUTPUT)]
    pub(crate) json: bool,
    #[command(flatten, next_help_heading = "Other people and programs")]
    pub(crate) page: PageOptions,
    #[command(flatten, next_help_heading = "Other people and programs")]
    pub(crate) ros2: Ros2Options,
    #[command(flatten, next_help_heading = OUTPUT)]
    pub(crate) viewers: ViewerOptions,
}

impl RunOptions {
    /// Checks that a hold has no timeout where nobody can set a target.
    pub(crate) fn check_hold(&self) -> Result<(), Failure> {
        let is_steered = self.page.page || self.ros2.ros2;
        if is_steered || self.timeout == DEFAULT_TIMEOUT {
            return Ok(());
        }
        Err(failed(format!(
            "--timeout has no effect on a hold without --page or --ros2: it goes on until Ctrl-C. \
             Leave the option out; `timeout -s INT {} plumb hold` ends it by itself",
            self.timeout
        )))
    }

    /// Returns the folder of the run. Numbered folders begin with `prefix`.
    pub(crate) fn output_dir(&self, prefix: &'static str) -> OutputDir {
        let numbered = || OutputDir::Numbered { parent: "runs".into(), prefix };
        self.out.clone().map_or_else(numbered, OutputDir::Path)
    }
}

#[derive(Args)]
pub(crate) struct PageOptions {
    /// Show the run in a browser, with controls; the run goes on until it is ended there or by
    /// Ctrl-C
    #[arg(long)]
    pub(crate) page: bool,
    #[command(flatten)]
    address: PageAddress,
}

/// Address of a page.
#[derive(Args)]
pub(crate) struct PageAddress {
    /// Address, port or both of the page. One that other computers reach gets a token
    #[arg(
        long,
        value_name = "ADDRESS",
        requires = "page",
        default_value = DEFAULT_ADDRESS,
        value_parser = |text: &str| with_port(text, DEFAULT_ADDRESS)
    )]
    pub(crate) page_address: SocketAddr,
}

impl PageOptions {
    /// Starts the page of a run of `rig` that `camera` sees, if there is to be one, and prints its
    /// address. The page sends its commands to `operator`.
    pub(crate) fn start(
        &self,
        rig: &Rig,
        camera: &Camera,
        operator: &OperatorSender,
    ) -> Result<Option<Page>, Failure> {
        if !self.page {
            return Ok(None);
        }
        let address = self.address.page_address;
        let (rig, limits) = (RigView::of(rig).seen_by(camera), Limits::DEFAULT);
        let operator = Some(operator.clone());
        let page = Page::start(PageSettings { address, rig, operator, limits })?;
        tell!("page: {} (the run goes on until you end it there, or Ctrl-C)", page.address());
        Ok(Some(page))
    }
}
