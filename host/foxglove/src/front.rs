//! The address that viewers connect to, in front of the server of the crate `foxglove`.
//!
//! The crate knows the subprotocol by its newer names only. Older viewers ask for
//! `foxglove.websocket.v1`, which has the same messages. The front renames it in the handshake, and
//! back in the answer. It changes nothing else.

use std::io;
use std::net::{self, SocketAddr};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt, copy_bidirectional};
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::Builder;
use tokio::sync::oneshot;
use tokio::task::JoinSet;
use tokio::time::timeout;

/// Header of the handshake that lists subprotocols (RFC 6455, section 11.3.4).
const HEADER: &str = "sec-websocket-protocol";

/// Name of the subprotocol in older viewers.
const OLDER: &str = "foxglove.websocket.v1";

/// Name of the same subprotocol in the server.
const NEWER: &str = "foxglove.sdk.v1";

/// Most bytes of a handshake. Browsers send less than 2 kB.
const MAX_HEAD: usize = 16 * 1024;

/// Longest time that a handshake takes.
const HANDSHAKE: Duration = Duration::from_secs(10);

/// A thread that copies between viewers and the server.
pub(crate) struct Front {
    port: u16,
    /// Ends the thread when it is dropped.
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Front {
    /// Starts to accept viewers of the server at the loopback port `server`. At its end it waits
    /// for its viewers no longer than `closing`.
    pub(crate) fn start(
        listener: net::TcpListener,
        server: u16,
        closing: Duration,
    ) -> io::Result<Self> {
        let port = listener.local_addr()?.port();
        listener.set_nonblocking(true)?;
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let (stop, stopped) = oneshot::channel();
        let thread = thread::Builder::new().name("viewers".into()).spawn(move || {
            runtime.block_on(async {
                // Fails only outside of a runtime.
                let Ok(listener) = TcpListener::from_std(listener) else { return };
                accept(listener, server, stopped, closing).await;
            });
        })?;
        Ok(Self { port, stop: Some(stop), thread: Some(thread) })
    }

    /// Returns the port that viewers connect to.
    pub(crate) fn port(&self) -> u16 {
        self.port
    }
}

impl Drop for Front {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

/// Serves viewers until `stopped`. Then the server's last bytes have the time `closing`.
async fn accept(
    listener: TcpListener,
    server: u16,
    mut stopped: oneshot::Receiver<()>,
    closing: Duration,
) {
    let mut viewers = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((viewer, _)) => {
                    viewers.spawn(serve(viewer, server));
                }
                // Too many open files, for example: others may close some.
                Err(_) => tokio::time::sleep(Duration::from_millis(100)).await,
            },
            Some(_) = viewers.join_next() => {}
            _ = &mut stopped => break,
        }
    }
    drop(listener);
    let _late = timeout(closing, async { while viewers.join_next().await.is_some() {} }).await;
}

/// Serves one viewer until either side closes.
async fn serve(mut viewer: TcpStream, server: u16) -> io::Result<()> {
    let head = timeout(HANDSHAKE, read_head(&mut viewer)).await??;
    let mut server = TcpStream::connect(SocketAddr::from(([127, 0, 0, 1], server))).await?;
    viewer.set_nodelay(true)?;
    server.set_nodelay(true)?;
    match asks_for_older(&head) {
        false => server.write_all(&head).await?,
        true => {
            server.write_all(&with_subprotocol(&head, NEWER)).await?;
            let answer = timeout(HANDSHAKE, read_head(&mut server)).await??;
            viewer.write_all(&with_subprotocol(&answer, OLDER)).await?;
        }
    }
    copy_bidirectional(&mut viewer, &mut server).await?;
    Ok(())
}

/// Reads a request or an answer up to its empty line, or to [`MAX_HEAD`].
async fn read_head(stream: &mut TcpStream) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") && head.len() < MAX_HEAD {
        // A byte at a time, so that no message behind the head is taken.
        head.push(stream.read_u8().await?);
    }
    Ok(head)
}

/// Returns the subprotocols in a line of a head; `None` in another line.
fn subprotocols(line: &[u8]) -> Option<impl Iterator<Item = &str>> {
    let (name, value) = str::from_utf8(line).ok()?.split_once(':')?;
    let names = value.split(',').map(str::trim);
    name.trim().eq_ignore_ascii_case(HEADER).then_some(names)
}

/// Returns whether a viewer knows the older name, and none that the server knows.
fn asks_for_older(head: &[u8]) -> bool {
    let lines = head.split(|byte| *byte == b'\n').filter_map(subprotocols);
    let names: Vec<_> = lines.flatten().collect();
    names.contains(&OLDER) && !names.iter().any(|name| name.starts_with(NEWER))
}

/// Returns the head with this subprotocol in place of its own, where it has one.
fn with_subprotocol(head: &[u8], name: &str) -> Vec<u8> {
    let lines = head.split_inclusive(|byte| *byte == b'\n');
    let renamed = lines.map(|line| match subprotocols(line) {
        Some(_) => format!("{HEADER}: {name}\r\n").into_bytes(),
        None => line.to_vec(),
    });
    renamed.collect::<Vec<_>>().concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(protocols: &str) -> Vec<u8> {
        format!("GET / HTTP/1.1\r\nHost: x\r\n{protocols}\r\n").into_bytes()
    }

    #[test]
    fn only_the_older_name_is_replaced() {
        for (line, is_older) in [
            ("Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n", true),
            ("sec-websocket-protocol:other, foxglove.websocket.v1\r\n", true),
            ("Sec-WebSocket-Protocol: foxglove.websocket.v1, foxglove.sdk.v1\r\n", false),
            (
                "Sec-WebSocket-Protocol: foxglove.sdk.v1.1\r\nSec-WebSocket-Protocol: \
                 foxglove.websocket.v1\r\n",
                false,
            ),
            ("Sec-WebSocket-Protocol: foxglove.websocket.v10\r\n", false),
            ("X: foxglove.websocket.v1\r\n", false),
            ("", false),
        ] {
            assert_eq!(asks_for_older(&head(line)), is_older, "{line}");
        }
    }

    #[test]
    fn a_head_keeps_its_other_lines() {
        let asked = head("Sec-WebSocket-Protocol: foxglove.websocket.v1\r\nOrigin: http://a\r\n");
        let expected = head("sec-websocket-protocol: foxglove.sdk.v1\r\nOrigin: http://a\r\n");
        assert_eq!(with_subprotocol(&asked, NEWER), expected);
        assert_eq!(with_subprotocol(&head(""), NEWER), head(""));
        let bytes = b"GET / HTTP/1.1\r\nA: \xff\r\n\r\n";
        assert_eq!(with_subprotocol(bytes, NEWER), bytes);
    }
}
