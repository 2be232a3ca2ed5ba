//! An hour of frames of 640x480 at 30 frames/s, in virtual time: memory stays bounded, with a
//! client that reads and one that does not.
//!
//! The page encodes the newest picture when a client is ready for it. Here frames come faster than
//! a browser takes them. Of every [`AWAITED`] frames the test waits for one picture, which is
//! encoded, sent and received.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

mod common;

use std::fs;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Weak};
use std::thread;
use std::time::Duration;

use common::{Client, page};
use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{ColourImage, DepthImage, Image};
use plumb_page::{Limits, Rate};
use plumb_runtime::observer::{FrameRecord, Observer};
use tungstenite::Message;

/// Frames of an hour at 30 frames/s.
const HOUR: u64 = 108_000;

/// Frames of which one picture at least is received: 2700 pictures of the hour.
const AWAITED: u64 = 40;

/// Frames that the page may hold: the newest, and one that is encoded.
const HELD: usize = 2;

/// Frames after which the memory has its size.
const SETTLED: u64 = 3_000;

/// Largest growth of the process after that, kB. The JPEGs of the received pictures are
/// more than 80 MB.
const GROWTH_KB: u64 = 32_000;

/// Returns images of 640x480 with texture: about 32 kB as JPEG.
fn images() -> (ColourImage, DepthImage) {
    let wave = |column: usize, row: usize| ((column * 7) ^ (row * 5)) as u8;
    let colour = Image::from_fn(640, 480, |column, row| {
        [wave(column, row) / 4, wave(row, column) / 8, (column / 3) as u8]
    });
    (colour, Image::filled(640, 480, 1000))
}

fn frame(time: f64, (colour, depth): &(ColourImage, DepthImage)) -> Arc<RgbdFrame> {
    let intrinsics = camera_file::paper().unwrap().intrinsics;
    Arc::new(RgbdFrame::new(time, colour.clone(), depth.clone(), intrinsics).unwrap())
}

fn record(number: u64, images: &(ColourImage, DepthImage)) -> FrameRecord {
    let time = number as f64 / 30.0;
    FrameRecord {
        number,
        time,
        frame: Some(frame(time, images)),
        target: Some(Point3::origin()),
        ..FrameRecord::default()
    }
}

/// Returns the physical memory of this process, kB.
fn resident_kb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

/// What a client has received.
#[derive(Debug, Default)]
struct Received {
    updates: u64,
    /// Samples, and those that it missed.
    samples: u64,
    /// Frame of the last sample.
    last: u64,
    pictures: u64,
    /// Bytes of all pictures.
    bytes: u64,
}

/// Reads until the page closes. Sends the frame number of each picture.
fn read_all(mut client: Client, shown: &Sender<u64>) -> Received {
    let (mut received, mut picture) = (Received::default(), 0);
    loop {
        match client.0.read() {
            Ok(Message::Text(text)) => {
                let message: serde_json::Value = serde_json::from_str(&text).unwrap();
                let Some(number) = message["number"].as_u64() else { continue };
                picture = message["picture"]["frame"].as_u64().unwrap_or(picture);
                let new = message["samples"].as_array().unwrap();
                received.updates += 1;
                received.samples += new.len() as u64 + message["missed"].as_u64().unwrap();
                let last = new.last().and_then(|sample| sample[0].as_u64());
                received.last = last.unwrap_or(received.last);
                let seen = format!(r#"{{"type":"seen","update":{number}}}"#);
                let _closed = client.0.send(Message::text(seen));
            }
            Ok(Message::Binary(jpeg)) => {
                assert!(jpeg.starts_with(b"\xff\xd8"));
                received.pictures += 1;
                received.bytes += jpeg.len() as u64;
                shown.send(picture).unwrap();
            }
            Ok(Message::Close(_)) | Err(_) => return received,
            Ok(_) => {}
        }
    }
}

/// Waits until the client has received a picture of the last [`AWAITED`] frames up to `number`.
fn wait_for_picture(shown: &Receiver<u64>, number: u64) {
    let longest = Duration::from_secs(60);
    while shown.recv_timeout(longest).expect("a picture") + AWAITED <= number {}
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
    let (sender, shown) = channel();
    let reader = thread::spawn(move || read_all(reader, &sender));

    let images = images();
    let mut alive: Vec<Weak<RgbdFrame>> = Vec::new();
    let mut settled_kb = 0;
    for number in 0..HOUR {
        let record = record(number, &images);
        alive.push(Arc::downgrade(record.frame.as_ref().unwrap()));
        page.frame(&record);
        drop(record);
        alive.retain(|frame| frame.strong_count() > 0);
        assert!(alive.len() <= HELD, "{} frames are alive after {number}", alive.len());
        if (number + 1).is_multiple_of(AWAITED) {
            wait_for_picture(&shown, number);
        }
        if number == SETTLED {
            settled_kb = resident_kb();
        }
    }
    let grown_kb = resident_kb().saturating_sub(settled_kb);
    assert!(grown_kb <= GROWTH_KB, "{grown_kb} kB more than after {SETTLED} frames");
    drop(page);
    let received = reader.join().unwrap();
    println!("{settled_kb} kB, {grown_kb} kB more at the end, {received:?}");
    assert!(received.pictures >= HOUR / AWAITED && received.updates > 1, "{received:?}");
    assert!(received.bytes / received.pictures > 30_000, "small pictures: {received:?}");
    let known = (received.samples, received.last);
    assert_eq!(known, (HOUR, HOUR - 1), "the reader knows of every frame");
    // The dead client never acknowledged an update, so that one was waiting for it, and the last.
    let mut waiting = 0;
    while let Ok(message) = dead.0.read() {
        waiting += u64::from(matches!(message, Message::Text(_)));
    }
    assert!(waiting <= 2, "{waiting} updates were waiting for a client that does not read");
}
