//! The page of a run: its option.

use std::net::{IpAddr, SocketAddr};

use clap::Args;
use plumb_page::{DEFAULT_ADDRESS, Limits, Page, PageSettings, RigView};
use plumb_runtime::operator::{OperatorReceiver, operator};
use plumb_runtime::rig::Rig;

use super::Failure;
use super::print::tell;

#[derive(Args)]
pub(super) struct PageOptions {
    /// Show the run in a browser, with controls; the run goes on until it is ended there or by
    /// Ctrl-C. An address that other computers reach gets a token [default without ADDRESS:
    /// 127.0.0.1:7586]
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = DEFAULT_ADDRESS,
        value_parser = address
    )]
    page: Option<SocketAddr>,
}

impl PageOptions {
    /// Starts the page of a run of `rig`, if there is to be one, and prints its address.
    pub(super) fn start(&self, rig: &Rig) -> Result<OperatedPage, Failure> {
        let Some(address) = self.page else { return Ok(OperatedPage::default()) };
        let (sender, receiver) = operator();
        let (rig, limits) = (RigView::of(rig), Limits::DEFAULT);
        let page = Page::start(PageSettings { address, rig, operator: Some(sender), limits })?;
        tell!("page: {} (the run goes on until you end it there, or Ctrl-C)", page.address());
        Ok(OperatedPage { page: Some(page), operator: Some(receiver) })
    }
}

/// The page of a run and its commands; both `None` without a page.
#[derive(Default)]
pub(super) struct OperatedPage {
    pub(super) page: Option<Page>,
    pub(super) operator: Option<OperatorReceiver>,
}

/// Reads an address with a port, or one without, which gets the page's own port.
fn address(text: &str) -> Result<SocketAddr, String> {
    let port = DEFAULT_ADDRESS.parse().map_or(0, |address: SocketAddr| address.port());
    let with_port = text.parse().ok();
    with_port
        .or_else(|| text.parse().ok().map(|ip: IpAddr| SocketAddr::new(ip, port)))
        .ok_or_else(|| "give an IP address, such as 0.0.0.0 or 127.0.0.1:8080".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_port_of_an_address_may_be_left_out() {
        let read = |text| address(text).map(|address| address.to_string());
        assert_eq!(read("0.0.0.0"), Ok("0.0.0.0:7586".to_owned()));
        assert_eq!(read("::1"), Ok("[::1]:7586".to_owned()));
        assert_eq!(read("127.0.0.1:0"), Ok("127.0.0.1:0".to_owned()));
        assert!(read("localhost").is_err() && read("7586").is_err());
    }
}
