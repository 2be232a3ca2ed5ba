//! Who may open the page, over real sockets.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use crate::common::{Client, get, page};
use plumb_page::Limits;

#[test]
fn the_page_and_its_files_are_served_with_headers_that_keep_it_to_itself() {
    let (page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    assert_eq!(page.address(), format!("http://{address}/"));
    let host = format!("Host: {address}");
    let (status, index) = get(address, "/", &[&host]);
    assert_eq!(status, 200);
    let wanted = ["script-src 'self'", "frame-ancestors 'none'", "nosniff", "<!doctype html>"];
    for text in wanted {
        assert!(index.contains(text), "{text}: {index}");
    }
    // Everything that the page names is there; nothing is inline or from elsewhere.
    let names =
        index.split(['"', '\'']).filter(|text| text.ends_with(".js") || text.ends_with(".css"));
    let names: Vec<&str> = names.collect();
    assert!(names.len() >= 2, "{names:?}");
    for name in names {
        let (status, reply) = get(address, &format!("/{}", name.trim_start_matches('/')), &[&host]);
        assert_eq!(status, 200, "{name}");
        assert!(!reply.contains("https://"), "{name} is complete in itself");
    }
    assert!(!index.contains("style=") && !index.contains("onclick"), "no inline code");
    assert_eq!(get(address, "/../Cargo.toml", &[&host]).0, 404);
    assert_eq!(get(address, "/socket", &[&host]).0, 400, "no WebSocket");
}

#[test]
fn foreign_hosts_and_origins_are_refused() {
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    for host in ["Host: evil.example", "Host: 192.168.1.5", "X: y"] {
        assert_eq!(get(address, "/", &[host]).0, 403, "{host}");
    }
    let own = format!("http://{address}");
    assert!(Client::open(address, "", Some(&own)).is_ok());
    assert!(Client::open(address, "", None).is_ok(), "a program");
    for origin in ["http://evil.example", "null", "http://127.0.0.1", "file://"] {
        assert_eq!(Client::open(address, "", Some(origin)).err(), Some(403), "{origin}");
    }
}

#[test]
fn a_page_for_other_computers_needs_its_token() {
    let (page, address) = page("0.0.0.0", Limits::DEFAULT, None);
    let (_, token) = page.address().split_once("?token=").unwrap();
    let host = format!("Host: {address}");
    assert_eq!(get(address, "/", &[&host]).0, 401);
    assert_eq!(get(address, "/page.js", &[&host]).0, 401);
    assert_eq!(get(address, "/?token=00000000000000000000000000000000", &[&host]).0, 401);
    assert_eq!(Client::open(address, "", None).err(), Some(401));
    assert_eq!(Client::open(address, "?token=", None).err(), Some(401));
    assert!(Client::open(address, &format!("?token={token}"), None).is_ok());

    let (status, reply) = get(address, &format!("/?token={token}"), &[&host]);
    assert_eq!(status, 200);
    let cookie = reply.split("Set-Cookie: ").nth(1).and_then(|rest| rest.split(';').next());
    let cookie = format!("Cookie: {}", cookie.unwrap());
    assert!(reply.contains("HttpOnly; SameSite=Strict"), "{reply}");
    assert_eq!(get(address, "/page.js", &[&host, &cookie]).0, 200);
    let other = format!("{cookie}0");
    assert_eq!(get(address, "/page.js", &[&host, &other]).0, 401);
}
