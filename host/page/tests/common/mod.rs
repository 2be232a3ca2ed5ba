//! A page on a loopback socket, and clients of it.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use plumb_page::{Limits, Page, PageSettings, RigView};
use plumb_runtime::operator::OperatorSender;
use plumb_runtime::rig::Rig;
use serde_json::Value;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// Longest wait of a client for something that must come.
const PATIENCE: Duration = Duration::from_secs(60);

/// Starts a page at a free port of `ip`.
pub(crate) fn page(
    ip: &str,
    limits: Limits,
    operator: Option<OperatorSender>,
) -> (Page, SocketAddr) {
    let rig = RigView::of(&Rig::paper().unwrap());
    let address = format!("{ip}:0").parse().unwrap();
    let page = Page::start(PageSettings { address, rig, operator, limits }).unwrap();
    let port = page.address().rsplit_once(':').unwrap().1;
    let port = port.split('/').next().unwrap().parse().unwrap();
    (page, SocketAddr::from(([127, 0, 0, 1], port)))
}

/// Opens a connection.
pub(crate) fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// Sends a request's text and returns the whole reply.
pub(crate) fn exchange(address: SocketAddr, text: &[u8]) -> String {
    let mut stream = connect(address);
    // A server that refuses may close before it has read everything.
    let _ = stream.write_all(text);
    let mut reply = Vec::new();
    let _ = stream.read_to_end(&mut reply);
    String::from_utf8_lossy(&reply).into_owned()
}

/// Sends a GET with these header lines. Returns the status and the whole reply.
pub(crate) fn get(address: SocketAddr, target: &str, headers: &[&str]) -> (u16, String) {
    let lines: String = headers.iter().map(|line| format!("{line}\r\n")).collect();
    let reply = exchange(address, format!("GET {target} HTTP/1.1\r\n{lines}\r\n").as_bytes());
    let status = reply.split(' ').nth(1).unwrap_or_default().parse().unwrap_or(0);
    (status, reply)
}

/// An open page.
pub(crate) struct Client(pub(crate) WebSocket<TcpStream>);

impl Client {
    /// Opens the page's WebSocket with this query and origin. Returns the refusal's status.
    pub(crate) fn open(
        address: SocketAddr,
        query: &str,
        origin: Option<&str>,
    ) -> Result<Self, u16> {
        let mut request = format!("ws://{address}/socket{query}").into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        match tungstenite::client(request, connect(address)) {
            Ok((socket, _)) => Ok(Self(socket)),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(reply))) => {
                Err(reply.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }

    /// Sends a JSON message.
    pub(crate) fn send(&mut self, text: &str) {
        self.0.send(Message::text(text)).unwrap();
    }

    /// Returns the next JSON message and acknowledges an update; `None` once the page has closed
    /// the connection.
    pub(crate) fn next(&mut self) -> Option<Value> {
        loop {
            match self.0.read() {
                Ok(Message::Text(text)) => {
                    let message: Value = serde_json::from_str(&text).unwrap();
                    if message["type"] == "update" {
                        let seen = format!(r#"{{"type":"seen","update":{}}}"#, message["number"]);
                        let _closed = self.0.send(Message::text(seen));
                    }
                    return Some(message);
                }
                Ok(Message::Close(_)) | Err(_) => return None,
                Ok(_) => {}
            }
        }
    }

    /// Returns the first message of this type, and skips the others.
    pub(crate) fn wait_for(&mut self, kind: &str) -> Value {
        let end = Instant::now() + PATIENCE;
        // An update comes each second.
        let messages = std::iter::from_fn(|| self.next()).take_while(|_| Instant::now() < end);
        let mut found = messages.filter(|message| message["type"] == kind);
        found.next().unwrap_or_else(|| panic!("no {kind}"))
    }
}
