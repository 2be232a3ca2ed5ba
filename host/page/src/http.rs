//! The part of HTTP/1.1 that the page needs: a request's head, and a reply after which the
//! connection ends.

use std::fmt::Write;

/// Highest number of header lines of a request.
const MAX_HEADERS: usize = 64;

/// Header lines that decide about access. A request with two of one kind is refused.
const UNIQUE: &[&str] = &["host", "origin", "cookie", "upgrade", "sec-websocket-key"];

/// Head of a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) method: String,
    /// Path without the query.
    pub(crate) path: String,
    /// Text after the question mark.
    pub(crate) query: String,
    /// Header lines; the names in lower case.
    headers: Vec<(String, String)>,
}

/// Result of reading the bytes that have arrived so far.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Parsed {
    /// The head is not complete.
    Partial,
    /// The head, and its length in bytes.
    Complete(Request, usize),
    /// The bytes are no request.
    Malformed,
}

impl Request {
    /// Reads the head of a request.
    pub(crate) fn parse(bytes: &[u8]) -> Parsed {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        match request.parse(bytes) {
            Ok(httparse::Status::Partial) => Parsed::Partial,
            Ok(httparse::Status::Complete(length)) => match Self::checked(&request) {
                Some(request) => Parsed::Complete(request, length),
                None => Parsed::Malformed,
            },
            Err(_) => Parsed::Malformed,
        }
    }

    /// Returns the request; `None` if a header line is no text or has a second of its kind.
    fn checked(request: &httparse::Request<'_, '_>) -> Option<Self> {
        let (path, query) = match request.path?.split_once('?') {
            Some((path, query)) => (path, query),
            None => (request.path?, ""),
        };
        let mut headers: Vec<(String, String)> = Vec::new();
        for header in request.headers.iter() {
            let name = header.name.to_ascii_lowercase();
            let value = std::str::from_utf8(header.value).ok()?;
            let repeated = headers.iter().any(|(other, _)| *other == name);
            if repeated && UNIQUE.contains(&name.as_str()) {
                return None;
            }
            headers.push((name, value.to_owned()));
        }
        let (method, path, query) = (request.method?.to_owned(), path.to_owned(), query.to_owned());
        Some(Self { method, path, query, headers })
    }

    /// Returns the value of a header line; `name` is in lower case.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(other, _)| other == name).map(|(_, value)| value.as_str())
    }

    /// Returns a cookie of this name.
    pub(crate) fn cookie(&self, name: &str) -> Option<&str> {
        let cookies = self.header("cookie")?.split(';');
        cookies
            .filter_map(|cookie| cookie.trim().split_once('='))
            .find(|c| c.0 == name)
            .map(|c| c.1)
    }

    /// Returns a parameter of the query.
    pub(crate) fn parameter(&self, name: &str) -> Option<&str> {
        let parameters = self.query.split('&');
        parameters.filter_map(|part| part.split_once('=')).find(|p| p.0 == name).map(|p| p.1)
    }
}

/// Status of a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    Ok,
    BadRequest,
    Unauthorized,
    Forbidden,
    NotFound,
    MethodNotAllowed,
    TooLarge,
    TimedOut,
}

impl Status {
    fn line(self) -> &'static str {
        match self {
            Self::Ok => "200 OK",
            Self::BadRequest => "400 Bad Request",
            Self::Unauthorized => "401 Unauthorized",
            Self::Forbidden => "403 Forbidden",
            Self::NotFound => "404 Not Found",
            Self::MethodNotAllowed => "405 Method Not Allowed",
            Self::TooLarge => "431 Request Header Fields Too Large",
            Self::TimedOut => "408 Request Timeout",
        }
    }
}

/// Reply to a request. The connection ends after it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Reply<'a> {
    pub(crate) status: Status,
    pub(crate) content_type: &'static str,
    pub(crate) body: &'a [u8],
    /// `Host` of the request, checked: the page may connect to it.
    pub(crate) host: Option<&'a str>,
    /// Cookie to set.
    pub(crate) cookie: Option<String>,
    /// Name of a file that the browser is to keep, and not to show.
    pub(crate) download: Option<&'static str>,
}

impl<'a> Reply<'a> {
    /// Returns a reply of plain text.
    pub(crate) fn text(status: Status, text: &'a str) -> Self {
        let content_type = "text/plain; charset=utf-8";
        let body = text.as_bytes();
        Self { status, content_type, body, host: None, cookie: None, download: None }
    }

    /// Returns a reply with a file to keep.
    pub(crate) fn file(body: &'a [u8], content_type: &'static str, name: &'static str) -> Self {
        let status = Status::Ok;
        Self { status, content_type, body, host: None, cookie: None, download: Some(name) }
    }

    /// Returns the bytes to send; without the body if the method was `HEAD`.
    ///
    /// The headers keep the page to itself: it loads nothing from elsewhere, runs no inline script,
    /// and no other page may frame or read it.
    pub(crate) fn bytes(&self, is_head: bool) -> Vec<u8> {
        let socket = self.host.map(|host| format!(" ws://{host}")).unwrap_or_default();
        let mut head = format!(
            "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\
             Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
             X-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\n\
             Cross-Origin-Resource-Policy: same-origin\r\n\
             Cross-Origin-Opener-Policy: same-origin\r\n\
             Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; \
             img-src 'self' blob:; connect-src 'self'{socket}; base-uri 'none'; \
             form-action 'none'; frame-ancestors 'none'\r\n",
            self.status.line(),
            self.content_type,
            self.body.len(),
        );
        if let Some(cookie) = &self.cookie {
            // Writing to a string cannot fail.
            let _ = write!(head, "Set-Cookie: {cookie}\r\n");
        }
        if let Some(name) = self.download {
            let _ = write!(head, "Content-Disposition: attachment; filename=\"{name}\"\r\n");
        }
        head.push_str("\r\n");
        let mut bytes = head.into_bytes();
        if !is_head {
            bytes.extend_from_slice(self.body);
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(text: &str) -> Request {
        match Request::parse(text.as_bytes()) {
            Parsed::Complete(request, length) => {
                assert_eq!(length, text.len());
                request
            }
            other => panic!("{text:?}: {other:?}"),
        }
    }

    #[test]
    fn a_request_is_read_once_it_is_complete() {
        let text =
            "GET /socket?token=ab&x=1 HTTP/1.1\r\nHOST: a:1\r\nCookie: u=2; plumb=cd\r\n\r\n";
        for length in 0..text.len() {
            assert_eq!(Request::parse(&text.as_bytes()[..length]), Parsed::Partial, "{length}");
        }
        let request = request(text);
        assert_eq!((request.path.as_str(), request.header("host")), ("/socket", Some("a:1")));
        assert_eq!((request.parameter("token"), request.cookie("plumb")), (Some("ab"), Some("cd")));
        assert_eq!((request.parameter("t"), request.cookie("lumb")), (None, None));
    }

    #[test]
    fn malformed_and_ambiguous_requests_are_refused() {
        let texts = [
            "GET\r\n\r\n",
            "\u{16}\u{3}\u{1}\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n\r\n",
            "GET / HTTP/1.1\r\nOrigin: http://a\r\nOrigin: http://b\r\n\r\n",
        ];
        for text in texts {
            assert_eq!(Request::parse(text.as_bytes()), Parsed::Malformed, "{text:?}");
        }
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "a: b\r\n".repeat(MAX_HEADERS + 1));
        assert_eq!(Request::parse(many.as_bytes()), Parsed::Malformed);
        let binary = b"GET / HTTP/1.1\r\nHost: \xff\xfe\r\n\r\n";
        assert_eq!(Request::parse(binary), Parsed::Malformed);
    }
}
