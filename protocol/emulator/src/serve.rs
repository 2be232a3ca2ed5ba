//! The board in real time, on a pseudo-terminal.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use plumb_core::TICK_US;
use plumb_protocol::units::Micros;
use thiserror::Error;

use crate::board::EmulatedBoard;
use crate::rig::RigError;
use crate::terminal::Terminal;

/// A board that lags further behind than this has its clock stopped for the rest: a busy machine
/// must not look like a silent host.
const LAG_MAX: Duration = Duration::from_millis(20);

/// Why a served board came to its end.
#[derive(Debug, Error)]
pub enum ServeError {
    /// The pseudo-terminal failed.
    #[error("the pseudo-terminal failed: {0}")]
    Terminal(#[from] io::Error),
    /// The rig cannot follow its motors.
    #[error("the simulated rig: {0}")]
    Rig(#[from] RigError),
}

/// A board that runs in a thread of its own until it is stopped or dropped.
pub struct Served {
    board: Arc<Mutex<EmulatedBoard>>,
    path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<(), ServeError>>>,
}

/// Serves `board` on a new pseudo-terminal in real time.
///
/// # Errors
/// Where there is no pseudo-terminal to be had.
pub fn serve(board: EmulatedBoard) -> io::Result<Served> {
    let terminal = Terminal::open()?;
    let path = terminal.path().to_owned();
    let board = Arc::new(Mutex::new(board));
    let stop = Arc::new(AtomicBool::new(false));
    let thread = thread::Builder::new().name("board".into()).spawn({
        let (board, stop) = (Arc::clone(&board), Arc::clone(&stop));
        move || run(&board, terminal, &stop)
    })?;
    Ok(Served { board, path, stop, thread: Some(thread) })
}

impl Served {
    /// The pseudo-terminal that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The board, to look at; its time stands still meanwhile.
    pub fn board(&self) -> MutexGuard<'_, EmulatedBoard> {
        lock(&self.board)
    }

    /// Whether the board has come to its end by itself; [`stop`](Self::stop) says why.
    pub fn ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Pulls the plug: the pseudo-terminal is gone when this returns.
    ///
    /// # Errors
    /// Where the board had come to its end by itself.
    pub fn stop(mut self) -> Result<(), ServeError> {
        self.halt()
    }

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

/// A poisoned lock means that another thread panicked; the board itself is as it was after its last
/// tick.
fn lock(board: &Mutex<EmulatedBoard>) -> MutexGuard<'_, EmulatedBoard> {
    board.lock().unwrap_or_else(PoisonError::into_inner)
}

fn run(
    board: &Mutex<EmulatedBoard>,
    mut terminal: Terminal,
    stop: &AtomicBool,
) -> Result<(), ServeError> {
    let mut buffer = [0; 4096];
    let mut last = Instant::now();
    let mut behind = Duration::ZERO;
    while !stop.load(Ordering::Relaxed) {
        let now = Instant::now();
        behind = (behind + (now - last)).min(LAG_MAX);
        last = now;
        let arrived = terminal.read(&mut buffer)?;
        let sent = {
            let mut board = lock(board);
            board.write(&buffer[..arrived]);
            let start = board.now();
            board.run_to(Micros(start.0 + behind.as_micros() as u64))?;
            behind -= Duration::from_micros(board.now().since(start)).min(behind);
            board.read()
        };
        terminal.write(&sent)?;
        thread::sleep(Duration::from_micros(u64::from(TICK_US)));
    }
    Ok(())
}
