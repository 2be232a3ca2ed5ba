//! An hour of frames: memory stays bounded, with a client that reads and one that does not.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;

use std::sync::{Arc, Weak};
use std::thread;
use std::time::Duration;

use common::{Client, page};
use nalgebra::Point3;
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_page::{Limits, Rate};
use plumb_runtime::observer::{FrameRecord, Observer};
use tungstenite::Message;

/// Frames of an hour at 30 frames/s.
const HOUR: u64 = 108_000;

/// Frames that the page may hold: the newest, and one that is encoded.
const HELD: usize = 2;

fn frame(time: f64) -> Arc<RgbdFrame> {
    let intrinsics =
        Intrinsics { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, depth_scale: 1000.0, distortion: None };
    let (colour, depth) = (Image::filled(64, 48, [90; 3]), Image::filled(64, 48, 1));
    Arc::new(RgbdFrame::new(time, colour, depth, intrinsics).unwrap())
}

/// Reads until the page closes. Returns the numbers of updates, samples and pictures, and the frame
/// of the last sample.
fn read_all(mut client: Client) -> (u64, u64, u64, u64) {
    let (mut updates, mut samples, mut pictures, mut last) = (0, 0, 0, 0);
    loop {
        match client.0.read() {
            Ok(Message::Text(text)) => {
                let message: serde_json::Value = serde_json::from_str(&text).unwrap();
                let Some(number) = message["number"].as_u64() else { continue };
                let new = message["samples"].as_array().unwrap();
                updates += 1;
                samples += new.len() as u64 + message["missed"].as_u64().unwrap();
                last = new.last().and_then(|sample| sample[0].as_u64()).unwrap_or(last);
                let seen = format!(r#"{{"type":"seen","update":{number}}}"#);
                let _closed = client.0.send(Message::text(seen));
            }
            Ok(Message::Binary(jpeg)) => {
                assert!(jpeg.starts_with(b"\xff\xd8"));
                pictures += 1;
            }
            Ok(Message::Close(_)) | Err(_) => return (updates, samples, pictures, last),
            Ok(_) => {}
        }
    }
}

#[test]
fn an_hour_of_frames_takes_bounded_memory() {
    // Real time is far shorter than the hour: no limit of a rate or of silence is to act.
    let unlimited = Rate { per_second: 1e6, burst: 1e6 };
    let limits = Limits {
        silence: Duration::from_secs(3600),
        messages: unlimited,
        bytes: Rate { per_second: 1e9, burst: 1e9 },
        updates: unlimited,
        ..Limits::DEFAULT
    };
    let (mut page, address) = page("127.0.0.1", limits, None);
    let mut reader = Client::open(address, "", None).unwrap();
    reader.wait_for("update");
    let mut dead = Client::open(address, "", None).unwrap();
    dead.wait_for("hello");
    let reader = thread::spawn(move || read_all(reader));

    let mut alive: Vec<Weak<RgbdFrame>> = Vec::new();
    let record = |number: u64| FrameRecord {
        number,
        time: number as f64 / 30.0,
        frame: Some(frame(number as f64 / 30.0)),
        observation: None,
        target: Point3::origin(),
        telemetry: None,
        state: None,
        ground_truth: None,
    };
    for number in 0..HOUR {
        let record = record(number);
        alive.push(Arc::downgrade(record.frame.as_ref().unwrap()));
        page.frame(&record);
        drop(record);
        alive.retain(|frame| frame.strong_count() > 0);
        assert!(alive.len() <= HELD, "{} frames are alive after {number}", alive.len());
    }
    drop(page);
    let (updates, samples, pictures, last) = reader.join().unwrap();
    assert!(updates > 1 && pictures > 0, "{updates} updates, {pictures} pictures");
    assert_eq!((samples, last), (HOUR, HOUR - 1), "the reader knows of every frame");
    // The dead client never acknowledged an update, so that one was waiting for it, and the last.
    let mut waiting = 0;
    while let Ok(message) = dead.0.read() {
        waiting += u64::from(matches!(message, Message::Text(_)));
    }
    assert!(waiting <= 2, "{waiting} updates were waiting for a client that does not read");
}
