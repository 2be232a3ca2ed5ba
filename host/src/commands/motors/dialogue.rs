//! `plumb jog` with keys.

use std::io::{self, IsTerminal, Stdin, stdin};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::sys::termios::{
    LocalFlags, SetArg, SpecialCharacterIndices, Termios, tcgetattr, tcsetattr,
};
use nix::unistd;
use plumb_protocol::message::{Jog, Refusal, State, Telemetry};
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::Rig;

use super::keys::{Key, KeyDecoder, KeyJogger, Motion, NAMES};
use crate::cli::exit::{Failure, failed};
use crate::cli::port::Port;
use crate::cli::print::{message, renew};

/// Interval in which keys are read and the board is asked for its state.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Explanation of the keys.
const HELP: &str = "\
a b c   select a motor
+ or o  pay cable out (a tap: 2 steps; held: turns on)
- or i  wind cable in
Space   stop
q       end
The ball falls when the motors lose their current: at the emergency button, and without power.";

/// Checks that there are keys to read.
pub(super) fn check_terminal() -> Result<(), Failure> {
    if is_terminal() {
        return Ok(());
    }
    Err(failed(
        "the keys need a terminal on standard input; without one, name motor and distance: \
         plumb jog A 200",
    ))
}

/// Turns motors with keys until `q`, or until the board has stopped by itself. Returns the state of
/// the board at the end.
pub(super) fn run(
    link: &mut Link<Port>,
    rig: &Rig,
    rate: Rate,
    interrupted: &AtomicBool,
) -> Result<Telemetry, Failure> {
    tell!("{HELP}");
    let terminal = KeyMode::begin()?;
    let ended = turn(link, rig, rate, interrupted, &terminal);
    message(format_args!("\n"));
    // Also after an error: the motors must not turn on.
    let stopped = link.stop();
    ended?;
    stopped?;
    Ok(link.status()?)
}

/// Reads keys and turns motors until `q`, an interrupt or a fault of the board.
fn turn(
    link: &mut Link<Port>,
    rig: &Rig,
    rate: Rate,
    interrupted: &AtomicBool,
    terminal: &KeyMode,
) -> Result<(), Failure> {
    let (start, mut decoder, mut keys) =
        (Instant::now(), KeyDecoder::default(), KeyJogger::default());
    let mut shown = String::new();
    while !interrupted.load(Ordering::Relaxed) {
        let telemetry = link.status()?;
        if let State::Fault(_) = telemetry.state {
            return Ok(());
        }
        for key in terminal.read()?.into_iter().filter_map(|byte| decoder.decode(byte)) {
            if key == Key::Quit {
                return Ok(());
            }
            keys.press(key, start.elapsed());
        }
        let is_turning = telemetry.state != State::Ready;
        match keys.motion(start.elapsed(), is_turning) {
            Some(Motion::Stop) => link.stop()?,
            Some(Motion::Jog { motor, steps }) => {
                let turns = begin(link, rig, rate, &telemetry, motor, steps)?;
                if !turns {
                    keys.halt();
                }
            }
            None => {}
        }
        let line = line(keys.motor(), &(&telemetry).into());
        if line != shown {
            renew(format_args!("{line}"));
            shown = line;
        }
        link.wait(POLL_INTERVAL)?;
    }
    Ok(())
}

/// Begins a jog that ends at the travel limit at the latest. Returns whether the motor turns.
fn begin(
    link: &mut Link<Port>,
    rig: &Rig,
    rate: Rate,
    telemetry: &Telemetry,
    motor: u8,
    steps: f64,
) -> Result<bool, Failure> {
    let position = telemetry.motors[usize::from(motor)].to_si();
    let [low, high] = rig.motors.travel.map(|limit| limit.get());
    let limit = rig.jog.max_distance.get();
    let end = position + steps.clamp(-limit, limit);
    let end = end.clamp(low.min(position), high.max(position));
    let name = NAMES[usize::from(motor)];
    let Some(distance) = Steps16::from_si(end - position).filter(|distance| distance.0 != 0) else {
        tell!("\nmotor {name} is at its travel limit ({low} to {high} steps)");
        return Ok(false);
    };
    match link.jog(Jog { motor, distance, rate }) {
        Ok(()) => Ok(true),
        // The motor has not quite come to rest: the next repeat of the key turns it.
        Err(LinkError::Refused { refusal: Refusal::Busy(_), .. }) => Ok(true),
        Err(LinkError::Refused { refusal, .. }) => {
            tell!("\nmotor {name}: {refusal}");
            Ok(false)
        }
        Err(error) => Err(error.into()),
    }
}

/// Returns the line with the selected motor, the motor positions and the state.
fn line(selected: u8, board: &BoardReport) -> String {
    let (name, state) = (NAMES[usize::from(selected)], board.state);
    let positions = NAMES.iter().zip(&board.motors).map(|(name, at)| format!("{name} {at:.2}  "));
    format!("motor {name}   {}steps   {state}", positions.collect::<String>())
}

/// Returns whether standard input is a terminal.
pub(super) fn is_terminal() -> bool {
    stdin().is_terminal()
}

/// Mode of standard input in which a key arrives without Enter and is not shown. Dropping it
/// restores the mode before.
pub(super) struct KeyMode {
    input: Stdin,
    before: Termios,
}

impl KeyMode {
    /// Begins the mode.
    ///
    /// # Errors
    /// Where standard input is no terminal.
    pub(super) fn begin() -> io::Result<Self> {
        let input = stdin();
        let before = tcgetattr(&input)?;
        let mut mode = before.clone();
        mode.local_flags.remove(LocalFlags::ICANON | LocalFlags::ECHO);
        // A read returns at once, also without a key.
        mode.control_chars[SpecialCharacterIndices::VMIN as usize] = 0;
        mode.control_chars[SpecialCharacterIndices::VTIME as usize] = 0;
        tcsetattr(&input, SetArg::TCSANOW, &mode)?;
        Ok(Self { input, before })
    }

    /// Returns the bytes of the keys since the last call.
    ///
    /// # Errors
    /// Where the terminal is gone.
    pub(super) fn read(&self) -> io::Result<Vec<u8>> {
        let mut buffer = [0; 256];
        // Not through the buffer of `Stdin`.
        let count = match unistd::read(&self.input, &mut buffer) {
            Err(Errno::EINTR) => 0,
            read => read?,
        };
        Ok(buffer[..count].to_vec())
    }
}

impl Drop for KeyMode {
    fn drop(&mut self) {
        // A terminal that is gone needs no mode. The repetitions of a key that is held down are no
        // part of the next command.
        let _gone = tcsetattr(&self.input, SetArg::TCSAFLUSH, &self.before);
    }
}
