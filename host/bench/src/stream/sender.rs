//! Sender of a stream: another program's part.

use std::f64::consts::TAU;
use std::io::{self, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use plumb_frame::source::BoxedError;
use plumb_pictures::jpeg;
use plumb_sim::synthetic::{Background, RenderOptions, Room, Scene, SyntheticCamera};
use plumb_vision::camera::Camera;

use super::StreamOptions;

/// Number of different pictures: the ball goes round once.
const PICTURES: usize = 60;

/// Quality of the JPEG pictures, 1 to 100: that of common webcams.
const QUALITY: u8 = 90;

/// Middle of the ball's circle in the rig frame, metres, and its radius.
const MIDDLE: [f64; 3] = [0.45, 0.30, 0.30];
const CIRCLE_RADIUS_M: f64 = 0.12;

/// Longest wait for a stream that is to be opened.
const CONNECT: Duration = Duration::from_secs(20);

/// Frame that is ready to be sent.
pub(super) struct EncodedFrame {
    /// Header without the time stamp and the brace before it.
    header: String,
    /// Colour and depth.
    pictures: Vec<u8>,
}

/// Measurements at the sending end.
#[derive(Debug, Default)]
pub(super) struct SenderReport {
    pub(super) frames: u64,
    pub(super) bytes: u64,
    /// Longest time of one write.
    pub(super) longest: Duration,
    pub(super) duration: Duration,
}

/// Renders and encodes the pictures.
///
/// # Errors
/// Where a picture cannot be rendered or encoded.
pub(super) fn encoded_frames(
    camera: &Camera,
    options: &StreamOptions,
) -> Result<Vec<EncodedFrame>, BoxedError> {
    let [width, height] =
        [options.size.width, options.size.height].map(|side| side.try_into().unwrap_or(u16::MAX));
    let render = RenderOptions { width, height, ..RenderOptions::default() };
    let room = Background::Room(Room::furnished());
    let mut synthetic = SyntheticCamera::new(camera.clone(), room, render, 1)?;
    (0..PICTURES).map(|number| encoded_frame(&mut synthetic, number, options.has_depth)).collect()
}

/// Renders and encodes picture `number`.
fn encoded_frame(
    synthetic: &mut SyntheticCamera,
    number: usize,
    has_depth: bool,
) -> Result<EncodedFrame, BoxedError> {
    let angle = TAU * number as f64 / PICTURES as f64;
    let ball = Point3::from(MIDDLE) + Vector3::new(0.0, angle.cos(), angle.sin()) * CIRCLE_RADIUS_M;
    let frame = synthetic.render(0.0, &Scene { ball: Some(ball), ..Scene::default() })?;
    let mut pictures = jpeg::encode(frame.colour(), QUALITY)?;
    let size = frame.colour().size();
    let mut header = format!(
        r#""width": {}, "height": {}, "colour": "jpeg", "colour_bytes": {}"#,
        size.width,
        size.height,
        pictures.len()
    );
    if has_depth {
        let depth: Vec<u8> =
            frame.depth().pixels().iter().flat_map(|depth| depth.to_le_bytes()).collect();
        let scale = frame.intrinsics().depth_scale;
        header +=
            &format!(r#", "depth": "z16", "depth_bytes": {}, "depth_scale": {scale}"#, depth.len());
        pictures.extend(depth);
    }
    Ok(EncodedFrame { header, pictures })
}

/// Sends `frames` in turn to the socket at `path`, at the rate of `options`.
///
/// # Errors
/// Where nothing listens at `path` in time, or the stream is closed.
pub(super) fn send(
    path: &Path,
    frames: &[EncodedFrame],
    options: &StreamOptions,
) -> io::Result<SenderReport> {
    let mut stream = connect(path)?;
    let begin = Instant::now();
    let mut report = SenderReport::default();
    let count = (options.rate * options.seconds).round() as u64;
    for (number, frame) in (0..count).zip(frames.iter().cycle()) {
        let due = Duration::from_secs_f64(number as f64 / options.rate);
        thread::sleep(due.saturating_sub(begin.elapsed()));
        let sent = Instant::now();
        let t = (sent - begin).as_secs_f64();
        let bytes =
            [format!("{{\"t\": {t:?}, {}}}\n", frame.header).as_bytes(), &frame.pictures].concat();
        stream.write_all(&bytes)?;
        report.frames += 1;
        report.bytes += bytes.len() as u64;
        report.longest = report.longest.max(sent.elapsed());
    }
    report.duration = begin.elapsed();
    Ok(report)
}

/// Connects to the socket at `path`; waits until something listens.
fn connect(path: &Path) -> io::Result<UnixStream> {
    let begin = Instant::now();
    loop {
        match UnixStream::connect(path) {
            Err(_) if begin.elapsed() < CONNECT => thread::sleep(Duration::from_millis(5)),
            result => return result,
        }
    }
}
