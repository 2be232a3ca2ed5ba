//! Emulated board on a pseudo-terminal, in the time of the computer or of its host.

mod lead;
mod pace;
mod peer;
mod terminal;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use plumb_core::TICK_US;
use plumb_protocol::units::Micros;
use thiserror::Error;

use crate::board::EmulatedBoard;
use crate::plant::RigError;
use lead::{LeadListener, LeadingHost, Request};
use pace::LED_LAG_MAX;

pub use lead::{BoardTime, Reply};
pub use pace::Pace;
pub use terminal::Terminal;

/// Largest lag of the board's clock behind real time. Beyond it the board's clock pauses, so that a
/// busy machine does not look like a silent host.
const LAG_MAX: Duration = Duration::from_millis(20);

/// Longest wait for a request of a host.
const WAIT: Duration = Duration::from_millis(1);

/// Time of the computer between two looks at the clock.
const SLEEP: Duration = Duration::from_micros(TICK_US as u64);

/// Reason why a served board ended.
#[derive(Debug, Error)]
pub enum ServeError {
    /// The pseudo-terminal failed.
    #[error("the pseudo-terminal failed")]
    Terminal(#[from] io::Error),
    /// The rig cannot follow its motors.
    #[error("the simulated rig cannot follow its motors")]
    Rig(#[from] RigError),
}

/// Board that runs in its own thread until it is stopped or dropped.
pub struct Served {
    board: Arc<Mutex<EmulatedBoard>>,
    path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<(), ServeError>>>,
}

/// Serves `board` on a new pseudo-terminal in real time, for a host of any kind. One that takes the
/// board's time ([`BoardTime`]) is waited for.
///
/// # Errors
/// If the operating system provides no pseudo-terminal, no socket or no thread.
pub fn serve(board: EmulatedBoard) -> io::Result<Served> {
    serve_at(board, 1.0)
}

/// The same, with `speed` seconds of the board in a second of the computer for a host that takes
/// the board's time.
///
/// # Errors
/// As [`serve`].
pub fn serve_at(board: EmulatedBoard, speed: f64) -> io::Result<Served> {
    let terminal = Terminal::open()?;
    let path = terminal.path().to_owned();
    let listener = LeadListener::open(&path)?;
    let board = Arc::new(Mutex::new(board));
    let stop = Arc::new(AtomicBool::new(false));
    let thread = thread::Builder::new().name("board".into()).spawn({
        let (board, stop) = (Arc::clone(&board), Arc::clone(&stop));
        let paces = Paces { free: Pace::begin(1.0), led: Pace::begin(speed) };
        let server = Server { board, terminal, listener, paces, stop };
        move || server.run()
    })?;
    Ok(Served { board, path, stop, thread: Some(thread) })
}

impl Served {
    /// Returns the path of the pseudo-terminal that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Locks the board for inspection. Its time pauses until the guard is dropped.
    pub fn board(&self) -> MutexGuard<'_, EmulatedBoard> {
        lock(&self.board)
    }

    /// Returns whether the board has ended by itself; [`stop`](Self::stop) returns the reason.
    pub fn ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Stops the board and closes its pseudo-terminal, like unplugging it.
    ///
    /// # Errors
    /// If the board had ended by itself.
    pub fn stop(mut self) -> Result<(), ServeError> {
        self.halt()
    }

    /// Stops the thread and returns its result.
    fn halt(&mut self) -> Result<(), ServeError> {
        self.stop.store(true, Ordering::Relaxed);
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => Ok(()),
        }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.halt();
    }
}

/// Locks the board, also if another thread has panicked with the lock: the board is then in its
/// state after the last tick.
fn lock(board: &Mutex<EmulatedBoard>) -> MutexGuard<'_, EmulatedBoard> {
    board.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;

/// The thread of a served board.
struct Server {
    board: Arc<Mutex<EmulatedBoard>>,
    terminal: Terminal,
    listener: LeadListener,
    paces: Paces,
    stop: Arc<AtomicBool>,
}

/// Paces of a served board.
struct Paces {
    /// Real time.
    free: Pace,
    /// For a host that takes the board's time.
    led: Pace,
}

impl Server {
    /// Runs the board until it is stopped.
    fn run(mut self) -> Result<(), ServeError> {
        let mut host = None;
        while !self.stop.load(Ordering::Relaxed) {
            match &mut host {
                None => {
                    self.run_freely()?;
                    host = self.listener.accept()?;
                    if host.is_some() {
                        // What an earlier host left unread.
                        lock(&self.board).read();
                    }
                }
                Some(leading) => {
                    if !self.serve(leading)? {
                        host = None;
                    }
                }
            }
        }
        Ok(())
    }

    /// Serves the host that has the board's time. Returns whether it is still there.
    fn serve(&mut self, host: &mut LeadingHost) -> Result<bool, ServeError> {
        match host.request(WAIT) {
            Ok(Some(request)) => {
                let reply = self.run_for(&request)?;
                Ok(host.answer(&reply).is_ok())
            }
            Ok(None) if host.is_awaited() => Ok(true),
            // Its bytes wait for it.
            Ok(None) => self.advance(&[]).map(|()| true),
            Err(_) => Ok(false),
        }
    }

    /// Lets the board run as its host asks, at the pace of the simulation at most.
    fn run_for(&mut self, request: &Request) -> Result<Reply, ServeError> {
        lock(&self.board).write(&request.bytes);
        loop {
            let mut board = lock(&self.board);
            let start = board.now();
            let due = start.0 + self.paces.led.due(LED_LAG_MAX).as_micros() as u64;
            let end = Micros(due.min(request.until.0));
            let is_over = match request.ends_with_bytes {
                true => board.run_until_bytes(end)?,
                false => board.run_to(end).map(|()| false)?,
            };
            self.paces.led.pass(Duration::from_micros(board.now().since(start)));
            let is_there = board.now().0 + u64::from(TICK_US) > request.until.0;
            if is_over || is_there || self.stop.load(Ordering::Relaxed) {
                return Ok(Reply { now: board.now(), bytes: board.read() });
            }
            drop(board);
            thread::sleep(SLEEP);
        }
    }

    /// Passes bytes between the board and the terminal, and lets the board run in real time.
    fn run_freely(&mut self) -> Result<(), ServeError> {
        let mut buffer = [0; 4096];
        let arrived = self.terminal.read(&mut buffer)?;
        self.advance(&buffer[..arrived])?;
        let sent = lock(&self.board).read();
        self.terminal.write(&sent)?;
        Ok(())
    }

    /// Passes `bytes` to the board, and lets it run in real time for a moment.
    fn advance(&mut self, bytes: &[u8]) -> Result<(), ServeError> {
        {
            let mut board = lock(&self.board);
            board.write(bytes);
            let start = board.now();
            let due = self.paces.free.due(LAG_MAX).as_micros() as u64;
            board.run_to(Micros(start.0 + due))?;
            self.paces.free.pass(Duration::from_micros(board.now().since(start)));
        }
        thread::sleep(SLEEP);
        Ok(())
    }
}
