//! The page of a calibration: what clients see, what reaches the program, what is refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::net::SocketAddr;
use std::time::Duration;

use crate::common::{Client, get};
use nalgebra::Point2;
use plumb_frame::image::Image;
use plumb_page::{
    CalibrationCommand, CalibrationPage, CalibrationPageSettings, CalibrationState, Limits,
    MarkView, ResultView,
};
use serde_json::{Value, json};

/// Longest wait for a command that must come.
const PATIENCE: Duration = Duration::from_secs(60);

/// Starts a page at a free port of `ip`. Returns its address for clients too.
fn start(ip: &str) -> (CalibrationPage, SocketAddr) {
    let page = CalibrationPage::start(CalibrationPageSettings {
        address: format!("{ip}:0").parse().unwrap(),
        names: ["A", "B", "C"].map(str::to_owned).to_vec(),
        file: "camera.toml".to_owned(),
        limits: Limits::DEFAULT,
    });
    let page = page.unwrap();
    let port = page.address().rsplit_once(':').unwrap().1.split('/').next().unwrap().to_owned();
    (page, format!("127.0.0.1:{port}").parse().unwrap())
}

/// Shows a picture of 64x48 pixels.
fn show(page: &CalibrationPage, state: CalibrationState) {
    page.show(0.5, Image::filled(64, 48, [90; 3]), state);
}

/// Returns the first update that fulfils a condition.
fn update(client: &mut Client, is_it: impl Fn(&Value) -> bool) -> Value {
    loop {
        let update = client.wait_for("update");
        if is_it(&update) {
            return update;
        }
    }
}

#[test]
fn a_client_sees_the_state_and_its_commands_arrive_in_order() {
    let (page, address) = start("127.0.0.1");
    let mut client = Client::open(address, "", None).unwrap();
    let hello = client.wait_for("hello");
    assert_eq!(hello["subject"], "calibration");
    assert_eq!((&hello["names"], &hello["file"]), (&json!(["A", "B", "C"]), &json!("camera.toml")));
    client.send(r#"{"type":"click","u":3,"v":4}"#);
    assert_eq!(client.wait_for("problem")["text"], "no picture yet");

    show(&page, CalibrationState::default());
    let shown = update(&mut client, |update| !update["picture"].is_null());
    assert_eq!((&shown["marks"], &shown["result"]), (&json!([]), &Value::Null));
    for text in [r#"{"type":"click","u":3.5,"v":47}"#, r#"{"type":"undo"}"#, r#"{"type":"accept"}"#]
    {
        client.send(text);
    }
    let commands = [(); 3].map(|()| page.command(PATIENCE).unwrap());
    let click = CalibrationCommand::Click(Point2::new(3.5, 47.0));
    assert_eq!(commands, [click, CalibrationCommand::Undo, CalibrationCommand::Accept]);

    let mark = MarkView { name: "A".to_owned(), pixel: [3.5, 47.0], depth: Some(0.9) };
    let result = ResultView { lines: vec!["pose: good".to_owned()], acceptable: true };
    let (marks, result, problem) = (vec![mark], Some(result), Some("why".to_owned()));
    show(&page, CalibrationState { marks, result, problem });
    let shown = update(&mut client, |update| update["problem"] == "why");
    assert_eq!(shown["marks"], json!([{ "name": "A", "pixel": [3.5, 47.0], "depth": 0.9 }]));
    assert_eq!(shown["result"], json!({ "lines": ["pose: good"], "acceptable": true }));
    page.end("The pose is written.");
    update(&mut client, |update| update["ended"] == "The pose is written.");
    while let Some(last) = client.next() {
        assert_eq!(last["ended"], "The pose is written.", "the connection ends");
    }
}

#[test]
fn messages_out_of_range_and_of_another_page_are_refused_in_few_words() {
    let (page, address) = start("127.0.0.1");
    show(&page, CalibrationState::default());
    let mut client = Client::open(address, "", None).unwrap();
    for (text, expected) in [
        (r#"{"type":"click","u":1e300,"v":4}"#, "outside the picture of 64x48 pixels"),
        (r#"{"type":"click","u":-0.6,"v":4}"#, "outside the picture"),
        (r#"{"type":"click","u":4,"v":47.5}"#, "outside the picture"),
        (r#"{"type":"click","u":4}"#, "does not understand"),
        (r#"{"type":"stop"}"#, "does not understand"),
        (r#"{"type":"accept","pose":1}"#, "does not understand"),
    ] {
        client.send(text);
        let problem = client.wait_for("problem")["text"].as_str().unwrap().to_owned();
        assert!(problem.contains(expected) && problem.len() < 200, "{text}: {problem}");
    }
    assert_eq!(page.command(Duration::ZERO), None, "none of them is a command");
    // Commands that nobody takes do not fill the memory.
    for _ in 0..30 {
        client.send(r#"{"type":"undo"}"#);
    }
    let problem = client.wait_for("problem");
    assert!(problem["text"].as_str().unwrap().contains("try again"), "{problem}");
}

#[test]
fn access_is_that_of_every_page() {
    let (_page, address) = start("127.0.0.1");
    let host = format!("Host: {address}");
    let (status, reply) = get(address, "/", &[&host]);
    assert!(status == 200 && reply.contains("calibrate.js"), "{reply}");
    assert_eq!(get(address, "/page.js", &[&host]).0, 404, "the page of a run is another one");
    assert_eq!(Client::open(address, "", Some("http://evil.example")).err(), Some(403));

    let (open, address) = start("0.0.0.0");
    assert_eq!(Client::open(address, "", None).err(), Some(401));
    let query = open.address().split_once('?').unwrap().1.to_owned();
    Client::open(address, &format!("?{query}"), None).unwrap().wait_for("hello");
}
