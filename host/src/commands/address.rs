//! Addresses to listen at, as options.

use std::net::{IpAddr, SocketAddr};

/// Reads an address with a port, or one without, which gets the port of `default`.
///
/// # Errors
/// An explanation where the text is no address.
pub(super) fn with_port(text: &str, default: &str) -> Result<SocketAddr, String> {
    let port = default.parse().map_or(0, |address: SocketAddr| address.port());
    let with_port = text.parse().ok();
    with_port
        .or_else(|| text.parse().ok().map(|ip: IpAddr| SocketAddr::new(ip, port)))
        .ok_or_else(|| format!("give an IP address, such as 0.0.0.0 or {default}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_port_of_an_address_may_be_left_out() {
        let read = |text| with_port(text, "127.0.0.1:7586").map(|address| address.to_string());
        assert_eq!(read("0.0.0.0"), Ok("0.0.0.0:7586".to_owned()));
        assert_eq!(read("::1"), Ok("[::1]:7586".to_owned()));
        assert_eq!(read("127.0.0.1:0"), Ok("127.0.0.1:0".to_owned()));
        assert!(read("localhost").is_err() && read("7586").is_err());
    }
}
