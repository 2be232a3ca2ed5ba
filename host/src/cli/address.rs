//! Addresses to listen at, as options.

use std::net::{IpAddr, SocketAddr};

/// Reads an address with a port, or a part of it, which gets the other part of `default`.
///
/// # Errors
/// An explanation where the text is no address.
pub(crate) fn with_port(text: &str, default: &str) -> Result<SocketAddr, String> {
    let default: SocketAddr = default.parse().map_err(|_| format!("{default} is no address"))?;
    let address = text.parse().ok();
    let of_ip = || text.parse().ok().map(|ip: IpAddr| SocketAddr::new(ip, default.port()));
    let of_port = || text.parse().ok().map(|port: u16| SocketAddr::new(default.ip(), port));
    address.or_else(of_ip).or_else(of_port).ok_or_else(|| {
        let port = default.port();
        format!("give an IP address, a port or both, such as 0.0.0.0, {port} or {default}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_and_its_port_may_be_left_out() {
        let read = |text| with_port(text, "127.0.0.1:7586").map(|address| address.to_string());
        assert_eq!(read("0.0.0.0"), Ok("0.0.0.0:7586".to_owned()));
        assert_eq!(read("::1"), Ok("[::1]:7586".to_owned()));
        assert_eq!(read("127.0.0.1:0"), Ok("127.0.0.1:0".to_owned()));
        assert_eq!(read("7811"), Ok("127.0.0.1:7811".to_owned()));
        assert!(read("localhost").is_err() && read("70000").is_err());
    }
}
