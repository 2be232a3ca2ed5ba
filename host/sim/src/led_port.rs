//! A port to an emulated board in another program, with the board's time in the hands of this one.

use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use plumb_emulator::BoardTime;
use plumb_protocol::units::Micros;
use plumb_runtime::link::{LinkError, Serial, Transport};

/// Port to an emulated board whose time passes only while this host waits for the board. Clones are
/// the same port: a run has one, and its simulated camera another.
#[derive(Clone)]
pub struct LedPort(Arc<Mutex<Led>>);

/// Time of the computer for which the board's clock need not be asked for again.
const FRESH: Duration = Duration::from_millis(5);

struct Led {
    /// The pseudo-terminal, which no other host may open.
    serial: Serial,
    time: BoardTime,
    now: Micros,
    /// When that was heard.
    heard: Instant,
    /// Bytes for a board whose program is stopped.
    sent: Vec<u8>,
    /// Bytes from the board that nobody has taken.
    arrived: Vec<u8>,
    /// Why the last exchange failed, for the next call of the link.
    failure: Option<LinkError>,
}

impl LedPort {
    /// Takes the time of the board at `serial`.
    ///
    /// # Errors
    /// `serial` again, where no emulated board that gives its time is at its other end.
    pub fn take(serial: Serial) -> Result<Self, Serial> {
        let time = BoardTime::of(Path::new(&serial.name())).ok().flatten();
        let Some(time) = time.filter(|_| serial.is_pseudo_terminal()) else { return Err(serial) };
        let (sent, arrived) = (Vec::new(), Vec::new());
        let (now, heard) = (Micros(0), Instant::now());
        let led = Led { serial, time, now, heard, sent, arrived, failure: None };
        let port = Self(Arc::new(Mutex::new(led)));
        port.run_to(0.0);
        Ok(port)
    }

    /// Returns the time on the board's clock, seconds.
    pub(crate) fn seconds(&self) -> f64 {
        self.lock().present().0 as f64 * 1e-6
    }

    /// Lets the board run to `time`, seconds on its clock. Where the board has gone the link says
    /// so, at its next call.
    pub(crate) fn run_to(&self, time: f64) {
        let mut led = self.lock();
        let ran = led.run(Micros((time * 1e6) as u64), false);
        led.failure = led.failure.take().or(ran.err());
    }

    fn lock(&self) -> MutexGuard<'_, Led> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Led {
    /// Returns the time on the board's clock, which has gone on where this program was stopped.
    fn present(&mut self) -> Micros {
        if self.heard.elapsed() > FRESH {
            let ran = self.run(self.now, false);
            self.failure = self.failure.take().or(ran.err());
        }
        self.now
    }

    /// Exchanges bytes with the board, and lets it run to `until`, or until it has bytes for the
    /// host if `ends_with_bytes`. The time of a board that is stopped goes on in real time.
    fn run(&mut self, until: Micros, ends_with_bytes: bool) -> Result<(), LinkError> {
        let begin = Instant::now();
        let reply = self.time.run(&mut self.sent, until, ends_with_bytes);
        self.heard = Instant::now();
        match reply.map_err(|source| LinkError::Lost { port: self.serial.name(), source })? {
            Some(reply) => {
                self.now = self.now.max(reply.now);
                self.arrived.extend(reply.bytes);
            }
            None => {
                let left = Duration::from_micros(until.since(self.now));
                thread::sleep(left.saturating_sub(begin.elapsed()));
                self.now.0 += begin.elapsed().as_micros() as u64;
            }
        }
        Ok(())
    }
}

impl Transport for LedPort {
    fn name(&self) -> String {
        self.lock().serial.name()
    }

    fn now(&self) -> Duration {
        Duration::from_micros(self.lock().present().0)
    }

    fn leads(&self) -> bool {
        true
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let mut led = self.lock();
        led.sent.extend_from_slice(bytes);
        let now = led.now;
        led.run(now, false)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let mut led = self.lock();
        if let Some(failure) = led.failure.take() {
            return Err(failure);
        }
        let wait = if led.arrived.is_empty() { wait } else { Duration::ZERO };
        if !wait.is_zero() {
            let end = led.now.0 + wait.as_micros() as u64;
            // The board's time is whole ticks: a wait for less would never end.
            led.run(Micros(end.next_multiple_of(u64::from(plumb_core::TICK_US))), true)?;
        }
        bytes.append(&mut led.arrived);
        Ok(())
    }
}

/// The last bytes go to the board too.
impl Drop for Led {
    fn drop(&mut self) {
        let _gone = self.run(self.now, false);
    }
}

impl fmt::Debug for LedPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("LedPort").field(&self.name()).finish()
    }
}
