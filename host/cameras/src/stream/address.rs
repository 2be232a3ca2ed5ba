//! Address of a stream: key `stream` of the table `[camera]`.

use std::fmt;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Deserialize;
use thiserror::Error;

/// Address at which a program delivers frames.
///
/// ```
/// use plumb_cameras::stream::StreamAddress;
///
/// let address: StreamAddress = "tcp:127.0.0.1:5600".parse()?;
/// assert_eq!(address.to_string(), "tcp:127.0.0.1:5600");
/// assert!("tcp:192.168.1.5:5600".parse::<StreamAddress>().is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub enum StreamAddress {
    /// `unix:PATH`: Unix domain socket on which Plumb listens.
    Unix(PathBuf),
    /// `tcp:127.0.0.1:PORT`: TCP port of this computer on which Plumb listens.
    Tcp(SocketAddr),
    /// `-`: standard input.
    StandardInput,
}

/// Text that is no address of a stream.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AddressError {
    /// The text has none of the three forms.
    #[error("{0:?} is no address of a stream: unix:PATH, tcp:127.0.0.1:PORT or - (standard input)")]
    Form(String),
    /// The TCP port is 0.
    #[error("{0:?} has no port: give one from 1 to 65535, such as tcp:127.0.0.1:5600")]
    NoPort(String),
    /// The TCP address is reachable from other computers.
    #[error(
        "{0:?} can be reached from other computers, and whoever sends to it moves the rig: \
         listen on 127.0.0.1, and forward the port from the other computer with \
         `ssh -L {port}:127.0.0.1:{port} THIS-COMPUTER`", port = port(.0)
    )]
    NotLocal(String),
}

/// Returns the port of a TCP address.
fn port(address: &str) -> &str {
    address.rsplit(':').next().unwrap_or_default()
}

impl StreamAddress {
    /// Makes the path of a Unix socket relative to `folder`.
    pub fn relative_to(&mut self, folder: &Path) {
        if let Self::Unix(path) = self {
            *path = folder.join(&*path);
        }
    }
}

impl FromStr for StreamAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let wrong = || AddressError::Form(text.to_owned());
        if text == "-" {
            return Ok(Self::StandardInput);
        }
        if let Some(path) = text.strip_prefix("unix:").filter(|path| !path.is_empty()) {
            return Ok(Self::Unix(path.into()));
        }
        let tcp = text.strip_prefix("tcp:").ok_or_else(wrong)?;
        let address = match tcp.strip_prefix("localhost:") {
            Some(port) => {
                SocketAddr::new(IpAddr::from([127, 0, 0, 1]), port.parse().map_err(|_| wrong())?)
            }
            None => tcp.parse().map_err(|_| wrong())?,
        };
        if !address.ip().is_loopback() {
            return Err(AddressError::NotLocal(text.to_owned()));
        }
        if address.port() == 0 {
            return Err(AddressError::NoPort(text.to_owned()));
        }
        Ok(Self::Tcp(address))
    }
}

impl TryFrom<String> for StreamAddress {
    type Error = AddressError;

    fn try_from(text: String) -> Result<Self, AddressError> {
        text.parse()
    }
}

impl fmt::Display for StreamAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::StandardInput => f.write_str("-"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_three_forms_are_read() {
        for text in ["unix:camera.sock", "tcp:127.0.0.1:5600", "tcp:[::1]:5600", "-"] {
            assert_eq!(text.parse::<StreamAddress>().unwrap().to_string(), text);
        }
        let local: StreamAddress = "tcp:localhost:5600".parse().unwrap();
        assert_eq!(local.to_string(), "tcp:127.0.0.1:5600");
        let mut socket: StreamAddress = "unix:camera.sock".parse().unwrap();
        socket.relative_to(Path::new("rigs"));
        assert_eq!(socket, StreamAddress::Unix("rigs/camera.sock".into()));
    }

    #[test]
    fn other_computers_and_other_texts_are_refused() {
        for text in ["", "camera.sock", "unix:", "tcp:5600", "tcp:127.0.0.1", "tcp:lab:5600"] {
            let error = text.parse::<StreamAddress>();
            assert_eq!(error, Err(AddressError::Form(text.to_owned())));
        }
        for text in ["tcp:0.0.0.0:5600", "tcp:192.168.1.5:5600", "tcp:[::]:5600"] {
            let error = text.parse::<StreamAddress>();
            assert_eq!(error, Err(AddressError::NotLocal(text.to_owned())));
        }
        assert!(matches!("tcp:127.0.0.1:0".parse::<StreamAddress>(), Err(AddressError::NoPort(_))));
    }
}
