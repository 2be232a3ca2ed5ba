//! Addresses at which a server of the program listens, for people.

use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};

/// Returns which address to choose in place of one that cannot be listened at.
pub fn other_address(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::AddrNotAvailable => {
            "it is none of this computer: choose 127.0.0.1, 0.0.0.0 (all of its own), or one that \
             `ip address` shows"
        }
        _ => "choose another port, or 0 for a free one",
    }
}

/// Returns the address for a client of a server that listens at `bound`. One that stands for all of
/// this computer's addresses is replaced by the one that reaches other computers.
pub fn address_to_open(bound: SocketAddr) -> SocketAddr {
    match outward_address(bound).filter(|_| bound.ip().is_unspecified()) {
        Some(ip) => SocketAddr::new(ip, bound.port()),
        None => bound,
    }
}

/// Returns the address of this computer on the way to others; `None` without a network. Nothing is
/// sent.
fn outward_address(bound: SocketAddr) -> Option<IpAddr> {
    // Addresses for documentation (RFC 5737, RFC 3849): every route but the local ones leads there.
    let far = if bound.is_ipv4() { "192.0.2.1:9" } else { "[2001:db8::1]:9" };
    let socket = UdpSocket::bind((bound.ip(), 0)).ok()?;
    socket.connect(far).ok()?;
    socket.local_addr().ok().map(|address| address.ip())
}
