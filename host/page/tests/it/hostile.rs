//! Clients that break the rules, over real sockets: they end, and others are served.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::io::{Read, Write};
use std::net::SocketAddr;
use std::time::Duration;

use crate::common::{Client, connect, exchange, get, page};
use plumb_page::Limits;
use plumb_runtime::operator::operator;
use tungstenite::Message;
use tungstenite::protocol::frame::coding::CloseCode;

#[test]
fn huge_and_malformed_requests_are_refused() {
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    let huge = format!("GET / HTTP/1.1\r\nHost: {address}\r\nX: {}\r\n\r\n", "x".repeat(100_000));
    let reply = exchange(address, huge.as_bytes());
    // The reply may be lost where the client is still sending.
    assert!(reply.is_empty() || reply.starts_with("HTTP/1.1 431 "), "{reply}");
    assert!(exchange(address, b"\x16\x03\x01\x02\x00\r\n\r\n").starts_with("HTTP/1.1 400 "));
    let post = format!("POST / HTTP/1.1\r\nHost: {address}\r\nContent-Length: 2\r\n\r\nhi");
    assert!(exchange(address, post.as_bytes()).starts_with("HTTP/1.1 405 "));
    assert_eq!(get(address, "/", &[&format!("Host: {address}")]).0, 200);
}

/// Sends a request whose head has `length` bytes, at once or in parts. Returns the status.
fn status_of_head(address: SocketAddr, length: usize, part: usize) -> String {
    let begin = format!("GET / HTTP/1.1\r\nHost: {address}\r\nX: ");
    let head = format!("{begin}{}\r\n\r\n", "x".repeat(length - begin.len() - 4));
    assert_eq!(head.len(), length);
    let mut stream = connect(address);
    stream.set_nodelay(true).unwrap();
    for bytes in head.as_bytes().chunks(part) {
        // The server may have refused it.
        let _refused = stream.write_all(bytes);
    }
    let mut reply = Vec::new();
    let _reset = stream.read_to_end(&mut reply);
    String::from_utf8_lossy(&reply[..reply.len().min(12)]).into_owned()
}

#[test]
fn a_request_has_as_many_bytes_as_the_limit_says() {
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    assert_eq!(Limits::DEFAULT.request_bytes, 8 << 10);
    for part in [8192, 100_000, 1000, 2048, 2047] {
        assert_eq!(status_of_head(address, 8192, part), "HTTP/1.1 200", "parts of {part} bytes");
        for length in [8193, 9000, 10_239, 10_240] {
            let status = status_of_head(address, length, part);
            // The reply may be lost where the client is still sending.
            assert!(["", "HTTP/1.1 431"].contains(&&*status), "{length}: {status}");
        }
    }
}

#[test]
fn requests_that_arrive_too_slowly_are_ended() {
    let limits = Limits { request_time: Duration::from_millis(300), ..Limits::DEFAULT };
    let (_page, address) = page("127.0.0.1", limits, None);
    let mut silent = connect(address);
    let mut slow = connect(address);
    slow.write_all(b"GET / HTTP/1.1\r\nHost:").unwrap();
    assert_eq!(get(address, "/", &[&format!("Host: {address}")]).0, 200, "others are served");
    let mut reply = String::new();
    assert_eq!(silent.read_to_string(&mut reply).unwrap(), 0);
    slow.read_to_string(&mut reply).unwrap();
    assert!(reply.starts_with("HTTP/1.1 408 "), "{reply}");
}

#[test]
fn idle_connections_make_room_and_open_pages_stay() {
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    let mut client = Client::open(address, "", None).unwrap();
    client.wait_for("update");
    let idle: Vec<_> = (0..100).map(|_| connect(address)).collect();
    assert_eq!(get(address, "/", &[&format!("Host: {address}")]).0, 200);
    client.wait_for("update");
    drop(idle);
}

#[test]
fn pages_beyond_the_limit_are_told_to_try_later() {
    let (_page, address) = page("127.0.0.1", Limits { clients: 2, ..Limits::DEFAULT }, None);
    let mut clients = [(); 2].map(|()| Client::open(address, "", None).unwrap());
    clients.iter_mut().for_each(|client| drop(client.wait_for("update")));
    let mut third = Client::open(address, "", None).unwrap();
    match third.0.read() {
        Ok(Message::Close(Some(frame))) => assert_eq!(frame.code, CloseCode::Again),
        other => panic!("{other:?}"),
    }
    drop(clients);
    // Their places are free once the server has noticed.
    let found = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        let mut again = Client::open(address, "", None).unwrap();
        again.next().is_some()
    });
    assert!(found);
}

#[test]
fn malformed_messages_are_answered() {
    let (sender, _receiver) = operator();
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, Some(sender));
    let mut client = Client::open(address, "", None).unwrap();
    assert_eq!(client.wait_for("hello")["commands"], true);
    for text in ["", "stop", "{\"type\":\"fly\"}", "{\"type\":\"target\",\"x\":1}", "[[[[["] {
        client.send(text);
        let problem = client.wait_for("problem");
        assert!(problem["text"].as_str().unwrap().contains("does not understand"), "{problem}");
    }
    client.0.send(Message::binary(vec![1, 2, 3])).unwrap();
    client.wait_for("problem");
}

#[test]
fn a_page_that_only_shows_refuses_commands() {
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    let mut client = Client::open(address, "", None).unwrap();
    assert_eq!(client.wait_for("hello")["commands"], false);
    client.send(r#"{"type":"stop"}"#);
    assert_eq!(client.wait_for("problem")["text"], "this page only shows the run");
}

#[test]
fn huge_messages_and_floods_end_a_client_and_no_other() {
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    let mut other = Client::open(address, "", None).unwrap();
    let mut huge = Client::open(address, "", None).unwrap();
    let _ = huge.0.send(Message::text("x".repeat(2000)));
    while huge.next().is_some() {}
    let mut flood = Client::open(address, "", None).unwrap();
    for _ in 0..5000 {
        if flood.0.write(Message::text("{}")).is_err() {
            break;
        }
    }
    let _ = flood.0.flush();
    while flood.next().is_some() {}
    let mut pings = Client::open(address, "", None).unwrap();
    for _ in 0..5000 {
        if pings.0.write(Message::Ping(Vec::new().into())).is_err() {
            break;
        }
    }
    let _ = pings.0.flush();
    while pings.next().is_some() {}
    other.wait_for("update");
    other.wait_for("update");
}
