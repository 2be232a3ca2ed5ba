//! A camera or a recording, as Plumb reads it.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::OpenniError;
use crate::library::OpenNi;
use crate::mailbox::{Mailbox, Overflow};
use crate::picture::{DepthUnit, Mode, Pair};
use crate::worker::{Event, Worker};

/// What to open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// The first camera that is plugged in.
    First,
    /// The camera of this URI, as [`OpenNi::devices`] lists them.
    Uri(String),
    /// An `.oni` file, which is read picture by picture, once.
    Recording(PathBuf),
}

impl Target {
    /// How it is called in messages.
    fn name(&self) -> String {
        match self {
            Self::First => "the first camera".to_owned(),
            Self::Uri(uri) => uri.clone(),
            Self::Recording(path) => path.display().to_string(),
        }
    }
}

/// How long is waited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadlines {
    /// For a camera to open and start.
    pub open: Duration,
    /// For the next picture.
    pub picture: Duration,
    /// For a camera to stop and close.
    pub close: Duration,
}

impl Default for Deadlines {
    /// 20 s, 2 s, 5 s: a Carmine's firmware may take seconds to begin.
    fn default() -> Self {
        Self {
            open: Duration::from_secs(20),
            picture: Duration::from_secs(2),
            close: Duration::from_secs(5),
        }
    }
}

/// How a camera is to be set. A recording is as it is: only the deadlines are of use.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Columns of both pictures.
    pub width: u16,
    /// Rows of both pictures.
    pub height: u16,
    /// Pairs a second.
    pub rate: u16,
    /// From exposure to the earliest arrival of a picture, seconds; see
    /// [`HostClock`](crate::HostClock).
    pub latency: f64,
    /// Also record to this `.oni` file.
    pub record: Option<PathBuf>,
    /// How long is waited.
    pub deadlines: Deadlines,
}

impl Default for Settings {
    /// 640x480 at 30 Hz, 45 ms late (as PrimeSense cameras are said to be; not measured), not
    /// recorded.
    fn default() -> Self {
        let (record, deadlines) = (None, Deadlines::default());
        Self { width: 640, height: 480, rate: 30, latency: 0.045, record, deadlines }
    }
}

/// What was opened.
#[derive(Debug, Clone, PartialEq)]
pub struct Opened {
    /// Its URI; the path of a recording.
    pub uri: String,
    /// Who made it and what it is called.
    pub name: String,
    /// Size and rate of its pictures.
    pub mode: Mode,
    /// What a unit of depth is.
    pub unit: DepthUnit,
    /// Field of view of the colour picture, horizontal and vertical, radians, where the device
    /// tells.
    pub field_of_view: Option<(f64, f64)>,
    /// What it could not be set to, and what follows from that.
    pub notes: Vec<String>,
}

/// A camera or a recording that gives colour and depth in pairs.
///
/// A thread of its own talks to the library. Where that thread does not come back it is left
/// behind, and what was waited for is an error.
#[derive(Debug)]
pub struct Camera {
    opened: Opened,
    deadlines: Deadlines,
    mailbox: Arc<Mailbox<Event>>,
    thread: Option<JoinHandle<()>>,
    /// Begun with the thread: the clock of live pictures.
    start: Instant,
    ended: Option<Result<(), OpenniError>>,
}

impl Camera {
    /// Opens `target` as `settings` say, and starts it. Depth is registered to colour, mirroring is
    /// off, size and rate are those asked for; where the camera does otherwise, it is not opened.
    ///
    /// # Errors
    /// Where there is no such thing, it cannot be set so, or it takes longer than
    /// [`Deadlines::open`].
    pub fn open(openni: &OpenNi, target: &Target, settings: Settings) -> Result<Self, OpenniError> {
        let live = !matches!(target, Target::Recording(_));
        let (room, overflow) = if live { (1, Overflow::Drop) } else { (4, Overflow::Block) };
        let mailbox = Arc::new(Mailbox::new(room, overflow));
        let first = Arc::new(Mailbox::new(1, Overflow::Block));
        let (start, deadlines) = (Instant::now(), settings.deadlines);
        let worker = Worker {
            openni: openni.clone(),
            target: target.clone(),
            settings,
            start,
            opened: Arc::clone(&first),
            mailbox: Arc::clone(&mailbox),
        };
        let thread = thread::Builder::new().name("openni".to_owned()).spawn(move || worker.run());
        let failed = |error: std::io::Error| OpenniError::Open {
            uri: target.name(),
            error: error.to_string(),
        };
        let thread = thread.map_err(failed)?;
        let Some(opened) = first.take(deadlines.open) else {
            mailbox.close();
            let seconds = deadlines.open.as_secs_f64();
            return Err(OpenniError::Stuck { uri: target.name(), what: "opening it", seconds });
        };
        Ok(Self { opened: opened?, deadlines, mailbox, thread: Some(thread), start, ended: None })
    }

    /// What was opened.
    pub fn opened(&self) -> &Opened {
        &self.opened
    }

    /// The time on the clock of live pictures, seconds.
    pub fn now(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// The next pair: of a camera the newest, of a recording each; `None` at a recording's end.
    ///
    /// # Errors
    /// About one picture ([`OpenniError::is_passing`]), after which the next may come; or about all
    /// of them, and then again at every further call. Comes back within [`Deadlines::picture`] and
    /// a little.
    pub fn next_pair(&mut self) -> Result<Option<Pair>, OpenniError> {
        if let Some(ended) = &self.ended {
            return ended.clone().map(|()| None);
        }
        // The worker tells by itself when nothing comes; this is for when it is stuck.
        let timeout = self.deadlines.picture + Duration::from_secs(1);
        let event = self.mailbox.take(timeout).unwrap_or_else(|| {
            let uri = self.opened.uri.clone();
            Event::Over(Err(OpenniError::Stuck {
                uri,
                what: "waiting for a picture",
                seconds: timeout.as_secs_f64(),
            }))
        });
        match event {
            Event::Pair(pair) => Ok(Some(pair)),
            Event::Problem(error) => Err(error),
            Event::Over(result) => {
                self.ended = Some(result.clone());
                result.map(|()| None)
            }
        }
    }

    /// Stops and closes the camera, and completes its recording.
    ///
    /// # Errors
    /// Where that takes longer than [`Deadlines::close`]; the camera is then left as it is.
    pub fn close(mut self) -> Result<(), OpenniError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), OpenniError> {
        self.mailbox.close();
        let Some(thread) = self.thread.take() else { return Ok(()) };
        let deadline = Instant::now() + self.deadlines.close;
        while !thread.is_finished() {
            if Instant::now() > deadline {
                let (uri, seconds) = (self.opened.uri.clone(), self.deadlines.close.as_secs_f64());
                return Err(OpenniError::Stuck { uri, what: "closing it", seconds });
            }
            thread::sleep(Duration::from_millis(2));
        }
        Ok(())
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        // Who wants to know calls close().
        let _ = self.end();
    }
}
