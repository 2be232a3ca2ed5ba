//! `-v`: the events of the libraries as lines on standard error.
//!
//! A thread of its own writes the lines. A terminal that is stopped (Ctrl-S) or a pipe that nobody
//! reads never delays a run: lines without room in the queue are left out, and counted.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;
use std::time::Duration;

use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::MakeWriter;
use tracing_subscriber::fmt::time::uptime;

use crate::cli::exit::Failure;
use crate::cli::print::message;

/// Lines that may wait for standard error: some 150 kB.
const CAPACITY: usize = 1000;

/// Longest wait for the lines at the end of the program.
const END_TIMEOUT: Duration = Duration::from_millis(500);

/// Item of the queue.
enum Item {
    Line(String),
    /// A request for an answer when the lines before it are written.
    Flush(Sender<()>),
}

/// Log of the events. Dropping it waits a little for the lines that were not written.
pub(crate) struct Log(Option<SyncSender<Item>>);

impl Drop for Log {
    fn drop(&mut self) {
        let (done, answer) = channel();
        if let Some(queue) = &self.0
            && queue.try_send(Item::Flush(done)).is_ok()
        {
            let _too_slow = answer.recv_timeout(END_TIMEOUT);
        }
    }
}

/// Starts the log of the events at the level of `count` options `-v`: info, debug, trace. Without
/// one there is no log.
///
/// # Errors
/// Where the operating system starts no thread.
pub(crate) fn start(count: u8) -> Result<Log, Failure> {
    let level = match count {
        0 => return Ok(Log(None)),
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let (sender, receiver) = sync_channel(CAPACITY);
    let lines = Lines { queue: sender.clone(), dropped: Arc::default() };
    let dropped = Arc::clone(&lines.dropped);
    thread::Builder::new().name("log".to_owned()).spawn(move || write(&receiver, &dropped))?;
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_timer(uptime())
        .with_writer(lines)
        .log_internal_errors(false)
        .finish();
    tracing::subscriber::set_global_default(subscriber)?;
    Ok(Log(Some(sender)))
}

/// Writes the lines of the queue to standard error, until the program ends.
fn write(queue: &Receiver<Item>, dropped: &AtomicU64) {
    for item in queue {
        match item {
            Item::Line(line) => message(format_args!("{line}")),
            Item::Flush(done) => {
                let _ended = done.send(());
            }
        }
        match dropped.swap(0, Ordering::Relaxed) {
            0 => {}
            count => message(format_args!("plumb: {count} lines of the log were left out\n")),
        }
    }
}

/// Writer of whole lines into the queue.
#[derive(Clone)]
struct Lines {
    queue: SyncSender<Item>,
    /// Number of lines that had no room in the queue.
    dropped: Arc<AtomicU64>,
}

impl MakeWriter<'_> for Lines {
    type Writer = Self;

    fn make_writer(&self) -> Self {
        self.clone()
    }
}

/// Each call writes a line: the subscriber formats an event before it writes.
impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let line = String::from_utf8_lossy(bytes).into_owned();
        if self.queue.try_send(Item::Line(line)).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
