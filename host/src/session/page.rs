//! The page of a run: its option.

use std::net::SocketAddr;

use clap::Args;
use plumb_page::{DEFAULT_ADDRESS, Limits, Page, PageSettings, RigView};
use plumb_runtime::operator::OperatorSender;
use plumb_runtime::rig::Rig;
use plumb_vision::camera::Camera;

use crate::cli::address::with_port;
use crate::cli::exit::Failure;

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
