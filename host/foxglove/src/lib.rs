//! A run in the viewers Foxglove and Lichtblick: an MCAP file and a live server.
//!
//! [`FoxgloveOutput::start`] opens either or both and returns an observer for the run. The program
//! puts it behind a [`BoundedObserver`](plumb_runtime::bounded_observer::BoundedObserver), so that
//! neither a slow disk nor a slow viewer delays a position:
//!
//! ```text
//! run -> bounded queue -> FoxgloveOutput -> channels -> MCAP file
//!                                            -> live server -> a queue for each viewer -> front
//! ```
//!
//! docs/use/logs.md lists the topics and their messages. The pictures, the camera and the scene use
//! Foxglove's own schemas. The measurement and the board's telemetry are the
//! [records](plumb_runtime::record) of the run, with schemas made from them; the events and the
//! summary are JSON with the schemas in `host/foxglove/schemas/`.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod camera;
mod channels;
mod clock;
mod file;
mod front;
mod message;
mod scene;

use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use foxglove::{Context, WebSocketServerHandle};
use plumb_frame::camera::Camera;
use plumb_frame::source::BoxedError;
use plumb_runtime::listening::other_address;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer};
use plumb_runtime::record::observation;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::Summary;
use plumb_runtime::wall_clock::RunClock;
use thiserror::Error;

use channels::Channels;
use file::McapFile;
use front::Front;
use message::telemetry_message;
use scene::Scene;

/// Number of messages that may wait for a viewer: about a second. Older ones are dropped.
const VIEWER_BACKLOG: usize = 200;

/// Longest wait for the viewers' connections to close at the end of a run, on either side of the
/// front.
const CLOSING: Duration = Duration::from_millis(500);

/// Quality of the JPEG: about 60 kB at 640x480.
const JPEG_QUALITY: u8 = 75;

/// Outputs to open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FoxgloveSettings {
    /// MCAP file, which must not exist.
    pub mcap: Option<PathBuf>,
    /// Address of the live server. Port 0 takes any free port.
    pub server: Option<SocketAddr>,
}

/// Failure of the MCAP file or the live server.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FoxgloveError {
    /// The MCAP file exists.
    #[error("{} exists already: recordings are never overwritten; give another name", .0.display())]
    Exists(PathBuf),
    /// The MCAP file cannot be created.
    #[error("cannot create {}", .path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The MCAP file cannot be written (a full disk).
    #[error(
        "cannot write {} any more, {time_s:.1} s after the begin of the run; `mcap recover` reads \
         what is in it",
        .path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// Time of the last frame, seconds.
        time_s: f64,
        /// Cause.
        source: std::io::Error,
    },
    /// The MCAP file was removed.
    #[error("{} was removed while it was written", .0.display())]
    Removed(PathBuf),
    /// The MCAP file cannot be begun or completed for another reason.
    #[error("cannot write {}", .path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: foxglove::FoxgloveError,
    },
    /// The address cannot be listened at.
    #[error(
        "the live server for viewers cannot use the address {address}; {}",
        other_address(.source)
    )]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Cause.
        source: std::io::Error,
    },
    /// The live server cannot be started.
    #[error("cannot start the live server for viewers")]
    Server(#[source] foxglove::FoxgloveError),
    /// A channel cannot be made.
    #[error("cannot describe the topic {topic} to viewers")]
    Channel {
        /// The topic.
        topic: &'static str,
        /// Cause.
        source: foxglove::FoxgloveError,
    },
    /// A picture cannot be encoded as JPEG.
    #[error("cannot encode a picture for viewers")]
    Picture(#[source] BoxedError),
}

/// Observer that writes a run to an MCAP file, serves it to viewers, or both.
///
/// Its methods encode pictures and write to a disk: put it behind a queue.
pub struct FoxgloveOutput {
    channels: Channels,
    camera: Camera,
    scene: Scene,
    clock: RunClock,
    /// Time of the last frame or target, seconds since the run's start.
    time: f64,
    /// Board's time of the last telemetry that was sent.
    board_time: Option<f64>,
    file: Option<McapFile>,
    server: Option<LiveServer>,
    failure: Option<FoxgloveError>,
    /// Owner of the channels.
    _context: Arc<Context>,
}

impl FoxgloveOutput {
    /// Opens the outputs for a run of `rig` with `camera`.
    ///
    /// # Errors
    /// Where the file exists or cannot be created, or the address cannot be used.
    pub fn start(
        settings: &FoxgloveSettings,
        rig: &Rig,
        camera: &Camera,
    ) -> Result<Self, FoxgloveError> {
        let context = Context::new();
        let address = settings.server;
        let server = address.map(|address| LiveServer::start(&context, address)).transpose()?;
        let path = settings.mcap.as_ref();
        let file = path.map(|path| McapFile::create(&context, path)).transpose()?;
        Ok(Self {
            channels: Channels::new(&context)?,
            camera: camera.clone(),
            scene: Scene::new(rig, camera.ball_diameter),
            clock: RunClock::default(),
            time: 0.0,
            board_time: None,
            file,
            server,
            failure: None,
            _context: context,
        })
    }

    /// Returns the port of the live server; `None` without one.
    pub fn port(&self) -> Option<u16> {
        self.server.as_ref().map(|server| server.front.port())
    }

    /// Logs the picture and what is needed to draw on it.
    fn log_picture(&mut self, record: &FrameRecord, stamp: u64) {
        let Some(frame) = &record.frame else { return };
        let calibration = camera::calibration(frame, stamp);
        self.channels.calibration.log_with_time(&calibration, stamp);
        if self.channels.image.has_sinks() {
            match camera::image(frame, JPEG_QUALITY, stamp) {
                Ok(image) => self.channels.image.log_with_time(&image, stamp),
                Err(error) => self.fail(FoxgloveError::Picture(error)),
            }
        }
    }

    /// Keeps the first failure.
    fn fail(&mut self, error: FoxgloveError) {
        self.failure.get_or_insert(error);
    }

    /// Gives the file up where it cannot be written.
    fn check_file(&mut self) {
        if let Some(error) = self.file.as_ref().and_then(|file| file.failure(self.time)) {
            self.file = None;
            self.fail(error);
        }
    }
}

impl Observer for FoxgloveOutput {
    fn frame(&mut self, record: &FrameRecord) {
        self.time = record.time;
        let stamp = self.clock.stamp(record.time);
        self.log_picture(record, stamp);
        self.channels.transform.log_with_time(&camera::transform(&self.camera.pose, stamp), stamp);
        self.channels.scene.log_with_time(&self.scene.update(record, stamp), stamp);
        self.channels.observation.log(&observation(record), stamp);
        if let Some(board) = &record.board
            && self.board_time.replace(board.time) != Some(board.time)
        {
            self.channels.telemetry.log(&telemetry_message(record), stamp);
        }
        self.check_file();
    }

    fn event(&mut self, event: &EventRecord) {
        let stamp = self.clock.stamp(event.time);
        self.channels.event.log(event, stamp);
        self.check_file();
    }

    fn end(&mut self, summary: &Summary) {
        let stamp = self.clock.stamp(self.time);
        self.channels.summary.log(summary, stamp);
        if let Some(file) = self.file.take()
            && let Err(error) = file.finish(self.time)
        {
            self.fail(error);
        }
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.failure.take().map(Into::into)
    }
}

/// Server of the channels to viewers.
struct LiveServer {
    /// `None` once it ends.
    server: Option<WebSocketServerHandle>,
    /// Ends after the server, whose last messages it still has.
    front: Front,
}

impl LiveServer {
    /// Begins to serve the channels of `context`. Viewers can only look: the server has no
    /// capabilities.
    fn start(context: &Arc<Context>, address: SocketAddr) -> Result<Self, FoxgloveError> {
        let failed = |source| FoxgloveError::Listen { address, source };
        let listener = TcpListener::bind(address).map_err(failed)?;
        let server = context
            .websocket_server()
            .name("plumb")
            .bind("127.0.0.1", 0)
            .message_backlog_size(VIEWER_BACKLOG)
            .start_blocking()
            .map_err(FoxgloveError::Server)?;
        let front = Front::start(listener, server.port(), CLOSING).map_err(failed)?;
        Ok(Self { server: Some(server), front })
    }
}

impl Drop for LiveServer {
    /// Ends the server. A viewer that does not close its connection is left after half a second.
    fn drop(&mut self) {
        let Some(server) = self.server.take() else { return };
        let closing = server.stop();
        let (done, closed) = channel();
        let waiting = thread::Builder::new().name("viewers".into()).spawn(move || {
            closing.wait_blocking();
            let _ = done.send(());
        });
        if waiting.is_ok() {
            let _ = closed.recv_timeout(CLOSING);
        }
    }
}
