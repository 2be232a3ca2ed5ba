//! Address of a camera in the network: key `url` of the table `[camera.http]`.

use std::fmt::{self, Write};
use std::str::FromStr;

use data_encoding::BASE64;
use serde::Deserialize;
use thiserror::Error;

/// Address of a camera that sends its pictures over HTTP.
///
/// ```
/// use plumb_cameras::http::HttpUrl;
///
/// let url: HttpUrl = "http://user:secret@phone:8080/video".parse()?;
/// assert_eq!(url.to_string(), "http://phone:8080/video");
/// assert!("https://phone:8080/video".parse::<HttpUrl>().is_err());
/// # Ok::<(), plumb_cameras::http::UrlError>(())
/// ```
#[derive(Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct HttpUrl {
    /// Name or address, without the brackets of an IPv6 address.
    pub(super) host: String,
    pub(super) port: u16,
    /// Host and port as written.
    authority: String,
    /// Path and query, from the first slash on.
    path: String,
    /// User and password, `user:password`.
    user: Option<String>,
}

/// Text that is no address of a camera.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{0:?} is no address of a camera: http://HOST:PORT/PATH, or \
     http://USER:PASSWORD@HOST:PORT/PATH; no other protocol is read (https, rtsp)"
)]
pub struct UrlError(String);

impl FromStr for HttpUrl {
    type Err = UrlError;

    fn from_str(text: &str) -> Result<Self, UrlError> {
        let parsed = text.strip_prefix("http://").and_then(|rest| {
            let place = rest.find('/').unwrap_or(rest.len());
            let (authority, path) = rest.split_at(place);
            let path = if path.is_empty() { "/" } else { path };
            let (user, authority) = match authority.rsplit_once('@') {
                Some((user, authority)) => (Some(user.to_owned()), authority),
                None => (None, authority),
            };
            let (host, port) = match authority.rsplit_once(':') {
                Some((host, port)) if !authority.ends_with(']') => (host, port.parse().ok()?),
                _ => (authority, 80),
            };
            let host = host.trim_matches(['[', ']']).to_owned();
            let (authority, path) = (authority.to_owned(), path.to_owned());
            Some(Self { host, port, authority, path, user })
        });
        // Whatever has no place in the head of a request.
        let is_plain = text.bytes().all(|byte| byte.is_ascii_graphic());
        let parsed = parsed.filter(|url| is_plain && !url.host.is_empty() && url.port > 0);
        parsed.ok_or_else(|| UrlError(text.to_owned()))
    }
}

impl TryFrom<String> for HttpUrl {
    type Error = UrlError;

    fn try_from(text: String) -> Result<Self, UrlError> {
        text.parse()
    }
}

impl fmt::Display for HttpUrl {
    /// Writes the address without user and password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "http://{}{}", self.authority, self.path)
    }
}

impl fmt::Debug for HttpUrl {
    /// Writes the address without user and password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl HttpUrl {
    /// Returns the request for the pictures.
    pub(super) fn request(&self) -> String {
        let Self { path, authority, .. } = self;
        let mut head = format!("GET {path} HTTP/1.1\r\nHost: {authority}\r\nUser-Agent: plumb\r\n");
        if let Some(user) = &self.user {
            // A text in memory takes every line.
            let _written =
                write!(head, "Authorization: Basic {}\r\n", BASE64.encode(user.as_bytes()));
        }
        head + "Accept: multipart/x-mixed-replace\r\nConnection: close\r\n\r\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_cameras_are_read() {
        for (text, host, port, path) in [
            ("http://phone:8080/video?a=1", "phone", 8080, "/video?a=1"),
            ("http://192.168.1.7", "192.168.1.7", 80, "/"),
            ("http://[::1]:81/a", "::1", 81, "/a"),
            ("http://[fe80::1]/a", "fe80::1", 80, "/a"),
        ] {
            let url: HttpUrl = text.parse().unwrap();
            assert_eq!((&*url.host, url.port, &*url.path), (host, port, path));
        }
        for text in ["", "phone:8080", "http://", "http://a:b/", "http://a:0/", "rtsp://a/b"] {
            assert_eq!(text.parse::<HttpUrl>(), Err(UrlError(text.to_owned())));
        }
        assert!("http://a/b HTTP/1.1\r\nX: y".parse::<HttpUrl>().is_err());
    }

    #[test]
    fn the_password_is_sent_and_not_shown() {
        let url: HttpUrl = "http://Aladdin:open@sesame@cave:1/".parse().unwrap();
        assert_eq!(format!("{url} {url:?}"), "http://cave:1/ http://cave:1/");
        assert!(
            !url.request().contains("sesame") && url.request().contains("\r\nHost: cave:1\r\n")
        );
    }
}
