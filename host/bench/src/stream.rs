//! `plumb-lab stream`: pictures through a Unix socket as another program sends them, in real
//! time: dropped frames, ages, positions.

mod sender;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{fmt, thread};

use plumb_cameras::open::{OpenedCamera, open_camera};
use plumb_cameras::settings::{CameraSettings, SourceName};
use plumb_cameras::stream::{StreamAddress, StreamError};
use plumb_frame::source::{BoxedError, CameraSource, SourceError};
use plumb_vision::camera::{Camera, Intrinsics};
use plumb_vision::detect::DetectorKind;
use plumb_vision::image::ImageSize;
use serde::Serialize;

use crate::control::quantile;
use sender::{SenderReport, encoded_frames, send};

/// Options of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamOptions {
    /// Frames that are sent in a second.
    pub rate: f64,
    /// Duration, seconds.
    pub seconds: f64,
    /// Columns and rows.
    pub size: ImageSize,
    /// Whether depth is sent, 16 bits for each pixel.
    pub has_depth: bool,
}

/// Result of a measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StreamReport {
    /// Frames that were sent.
    pub sent: u64,
    /// Mean bytes of a frame.
    pub frame_bytes: u64,
    /// Longest time in which a frame was sent, milliseconds: what a sender waits for Plumb.
    pub longest_send_ms: f64,
    /// Frames that were searched for the ball.
    pub searched: u64,
    /// Frames that a newer one replaced.
    pub dropped: u64,
    /// Frames that were lost by an error.
    pub lost: u64,
    /// Frames in which the ball was found.
    pub balls: u64,
    /// Frames that gave a position.
    pub positions: u64,
    /// Duration of the stream, seconds.
    pub seconds: f64,
    /// Ages of the frames when they were searched and could be reported, milliseconds.
    pub age_ms: Ages,
}

/// Quantiles of ages, milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ages {
    /// Median.
    pub median: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

impl StreamReport {
    /// Returns the positions in a second.
    #[must_use]
    pub fn positions_per_second(&self) -> f64 {
        self.positions as f64 / self.seconds
    }
}

impl fmt::Display for StreamReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Ages { median, p99, max } = self.age_ms;
        writeln!(
            f,
            "sent       {} frames in {:.1} s, {} kB each; the longest took {:.1} ms to send",
            self.sent,
            self.seconds,
            self.frame_bytes / 1000,
            self.longest_send_ms
        )?;
        writeln!(
            f,
            "searched   {} frames; {} dropped for a newer one, {} lost",
            self.searched, self.dropped, self.lost
        )?;
        writeln!(
            f,
            "ball       in {} frames; {} positions, {:.1} in a second",
            self.balls,
            self.positions,
            self.positions_per_second()
        )?;
        write!(f, "age        median {median:.1} ms, p99 {p99:.1} ms, at most {max:.1} ms")
    }
}

/// Returns the paper's camera with pictures of `size` and the same field of view of the columns.
fn camera(paper: &Camera, size: ImageSize) -> Camera {
    let scale = size.width as f64 / (2.0 * paper.intrinsics.cx + 1.0);
    let intrinsics = Intrinsics {
        fx: paper.intrinsics.fx * scale,
        fy: paper.intrinsics.fy * scale,
        cx: (size.width as f64 - 1.0) / 2.0,
        cy: (size.height as f64 - 1.0) / 2.0,
        depth_scale: paper.intrinsics.depth_scale,
        distortion: None,
    };
    Camera { intrinsics, ..paper.clone() }
}

/// Measures a stream of rendered pictures, which the camera `paper` takes with another size. The
/// Unix socket is in `folder`.
///
/// # Errors
/// Where pictures cannot be made, the socket cannot be used, or a frame cannot be searched.
pub fn measure(
    paper: &Camera,
    folder: &Path,
    options: &StreamOptions,
) -> Result<StreamReport, BoxedError> {
    let camera = camera(paper, options.size);
    let frames = encoded_frames(&camera, options)?;
    let path = folder.join("camera.sock");
    thread::scope(|scope| {
        let sender = scope.spawn(|| send(&path, &frames, options));
        let received = receive(&path, camera.clone(), || sender.is_finished());
        // The sender ends by itself: the stream is closed.
        let sent = sender.join().map_err(|_| "the sender has panicked")?;
        Ok(report(received?, &sent?))
    })
}

/// Measurements at the receiving end.
#[derive(Debug, Default)]
struct Received {
    /// Ages, milliseconds.
    ages: Vec<f64>,
    dropped: u64,
    lost: u64,
    balls: u64,
    positions: u64,
}

/// Takes and searches frames until the sender has disconnected or `has_ended`.
fn receive(
    path: &Path,
    camera: Camera,
    has_ended: impl Fn() -> bool,
) -> Result<Received, BoxedError> {
    let settings = CameraSettings {
        source: Some(SourceName::Stream),
        stream: Some(StreamAddress::Unix(PathBuf::from(path))),
        ..CameraSettings::new(path)
    };
    let OpenedCamera { mut source, camera, .. } = open_camera(&settings, camera, None)?;
    let mut detector = DetectorKind::Ball.build(&camera);
    let mut received = Received::default();
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => {
                let ball = detector.detect(&frame)?;
                received.ages.push((source.now() - frame.time()) * 1e3);
                received.balls += u64::from(ball.is_some());
                received.positions += u64::from(ball.is_some_and(|it| it.position.is_some()));
            }
            Err(error) if is_disconnection(&error) || has_ended() => break,
            Err(_) => received.lost += 1,
            Ok(None) => break,
        }
    }
    received.dropped = source.skipped();
    Ok(received)
}

/// Returns whether the sender has disconnected.
fn is_disconnection(error: &SourceError) -> bool {
    let cause = error.source().and_then(|cause| cause.downcast_ref());
    matches!(cause, Some(StreamError::Disconnected))
}

/// Combines the measurements of both ends.
fn report(mut received: Received, sent: &SenderReport) -> StreamReport {
    received.ages.sort_by(f64::total_cmp);
    let age = |q| quantile(&received.ages, q);
    StreamReport {
        sent: sent.frames,
        frame_bytes: sent.bytes / sent.frames.max(1),
        longest_send_ms: sent.longest.as_secs_f64() * 1e3,
        searched: received.ages.len() as u64,
        dropped: received.dropped,
        lost: received.lost,
        balls: received.balls,
        positions: received.positions,
        seconds: sent.duration.as_secs_f64(),
        age_ms: Ages { median: age(0.5), p99: age(0.99), max: age(1.0) },
    }
}

#[cfg(test)]
mod tests {
    use plumb_cameras::camera_file;

    use super::*;

    #[test]
    fn every_frame_that_is_sent_is_searched_or_counted() {
        let folder = std::env::temp_dir().join(format!("plumb-stream-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let size = ImageSize { width: 320, height: 240 };
        let options = StreamOptions { rate: 100.0, seconds: 0.5, size, has_depth: true };
        let report = measure(&camera_file::paper().unwrap(), &folder, &options).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!((report.sent, report.lost), (50, 0), "{report}");
        assert_eq!(report.searched + report.dropped, 50, "{report}");
        assert!(report.positions > 0 && report.positions == report.balls, "{report}");
        assert!(report.age_ms.max >= report.age_ms.median, "{report}");
    }
}
