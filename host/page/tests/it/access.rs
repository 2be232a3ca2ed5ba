//! Who may open the page, over real sockets.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::PathBuf;
use std::time::{Duration, Instant};
use std::{fs, thread};

use plumb_page::Limits;

use crate::common::{Client, get, page};

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

/// Returns an empty folder for a test.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("plumb-page-{name}-{}", std::process::id()));
    let _none = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

#[test]
fn at_the_end_a_page_gets_the_files_of_the_run_and_no_other() {
    let folder = folder("files");
    for (name, text) in [("run.csv", "frame,t\n"), ("summary.json", "{}"), ("secret.txt", "no")] {
        fs::write(folder.join(name), text).unwrap();
    }
    let (page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    let host = format!("Host: {address}");
    assert_eq!(get(address, "/files/run.csv", &[&host]).0, 404, "before the end");
    let mut client = Client::open(address, "", None).unwrap();
    let update = client.wait_for("update");
    assert_eq!(update["files"], serde_json::json!([]));
    let offered = folder.clone();
    let finish = thread::spawn(move || page.finish(&offered));
    let list = std::iter::repeat_with(|| client.wait_for("update")["files"].clone());
    let list = list.take(5).find(|files| files != &serde_json::json!([])).unwrap();
    let expected = [("summary.json", 2), ("run.csv", 8)]
        .map(|(name, bytes)| serde_json::json!({ "name": name, "bytes": bytes }));
    assert_eq!(list, serde_json::Value::from(expected.to_vec()));

    let (status, reply) = get(address, "/files/run.csv", &[&host]);
    assert_eq!(status, 200);
    assert!(reply.ends_with("\r\n\r\nframe,t\n"), "{reply}");
    assert!(reply.contains("Content-Disposition: attachment; filename=\"run.csv\""), "{reply}");
    assert!(reply.contains("default-src 'none'") && reply.contains("nosniff"), "{reply}");
    for path in [
        "/files/",
        "/files/secret.txt",
        "/files/../secret.txt",
        "/files/../files/run.csv",
        "/files/%2e%2e/secret.txt",
        "/files/..%2fsecret.txt",
        "/files//run.csv",
        "/files/./run.csv",
        "/files/run.csv/",
        "/files/run.csv%00",
        "/files/RUN.CSV",
        "/files//etc/passwd",
        "/files/..\\secret.txt",
        "/run.csv",
    ] {
        assert_eq!(get(address, path, &[&host]).0, 404, "{path}");
    }
    assert_eq!(get(address, "/files/run.csv", &["Host: evil.example"]).0, 403);
    let evil = ["Origin: http://evil.example", host.as_str()];
    assert_eq!(get(address, "/files/run.csv", &evil).0, 403);
    // The page has them: the server ends at once.
    let begin = Instant::now();
    client.send(r#"{"type":"taken"}"#);
    finish.join().unwrap();
    assert!(begin.elapsed() < Duration::from_secs(2), "{:?}", begin.elapsed());
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_files_need_the_token_and_wait_for_nobody_for_long() {
    let folder = folder("token");
    fs::write(folder.join("run.csv"), "frame,t\n").unwrap();
    let (page, address) = page("0.0.0.0", Limits::DEFAULT, None);
    let token = page.address().split_once("?token=").unwrap().1.to_owned();
    let mut client = Client::open(address, &format!("?token={token}"), None).unwrap();
    client.wait_for("update");
    let (offered, begin) = (folder.clone(), Instant::now());
    let finish = thread::spawn(move || page.finish(&offered));
    while client.wait_for("update")["files"] == serde_json::json!([]) {}
    let host = format!("Host: {address}");
    assert_eq!(get(address, "/files/run.csv", &[&host]).0, 401);
    assert_eq!(get(address, &format!("/files/run.csv?token={token}"), &[&host]).0, 200);
    // This page never says that it has them.
    finish.join().unwrap();
    let waited = begin.elapsed();
    assert!((3.0..6.0).contains(&waited.as_secs_f64()), "{waited:?}");
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn without_an_open_page_the_end_waits_for_nothing() {
    let folder = folder("nobody");
    fs::write(folder.join("run.csv"), "frame,t\n").unwrap();
    let (page, _) = page("127.0.0.1", Limits::DEFAULT, None);
    let begin = Instant::now();
    page.finish(&folder);
    assert!(begin.elapsed() < Duration::from_secs(1), "{:?}", begin.elapsed());
    fs::remove_dir_all(&folder).unwrap();
}
