//! `plumb emulate`: the emulated board on a pseudo-terminal.

mod link;
mod motors;
mod rehearsal;
mod wire;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::Parser;
use plumb_runtime::rig::Rig;
use plumb_sim::emulator::{EMULATED, EmulatedBoard, Served, serve_at};
use serde_json::{Value, json};
use tracing::info;

use self::link::TerminalLink;
use self::motors::MotorLines;
use self::rehearsal::{RehearsalOptions, Rehearsed};
use self::wire::WireOptions;
use crate::cli::choices::Physics;
use crate::cli::exit::{Exit, Failure, Work, bad_input, failed};
use crate::cli::interrupt::interrupt_flag;
use crate::cli::numbers;
use crate::cli::print;

/// An emulated board on a pseudo-terminal, for anything that speaks the protocol
///
/// Prints the terminal's path, with -v also every change of the board's state, and runs until it is
/// interrupted.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb emulate --link /tmp/board",
    "plumb emulate --rig rig.toml --link /tmp/board --baud 115200 --lost 0.05",
])]
pub(crate) struct Args {
    /// Rig file, whose simulated rig the board's motors move; neither PLUMB_RIG nor rig.toml in
    /// this folder is taken without the option
    #[arg(short, long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Model of this emulation's own rig, for its last line; `plumb run`, `goto` and `check`
    /// simulate theirs, with a --physics of their own
    #[arg(long, value_enum, default_value = "quasi-static", requires = "rig")]
    physics: Physics,
    /// Create this symbolic link to the terminal, and remove it at the end; replaces a link that
    /// an earlier emulation left behind
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Print the motor positions to standard output every 5 ms of the board's time, for a simulator
    /// of the rig: {"t": 1.005, "motors": [12.25, -3.0, 7.5]}, seconds and full steps since the
    /// start, positive where cable is paid out. A slow reader loses lines
    #[arg(long)]
    motors: bool,
    /// Seconds of the simulation in a second of the computer, 0.01 to 1000, while a command with a
    /// simulated camera, or none, has the board; others are in real time
    #[arg(long, value_name = "N", default_value_t = 1.0, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::PACE))]
    pace: f64,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    rehearsal: RehearsalOptions,
    #[command(flatten)]
    wire: WireOptions,
}

/// Returns the present state of a board in JSON.
fn state(served: &Served) -> Value {
    let board = served.board();
    json!({
        "state": board.state().to_string(),
        "motors": board.motors(),
        "ball": board.ball().map(<[f64; 3]>::from),
        "time_s": board.now().0 as f64 * 1e-6,
    })
}

/// Interval at which the board's state is read, short enough for a person to follow.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    let rig = args.rig.as_deref().map(Rig::read).transpose()?;
    let mut board = board(&args, rig.as_ref())?.with_wire(args.wire.wire()?);
    if args.motors {
        board.sample_motors(motors::INTERVAL);
    }
    let named = args.rig.as_deref().zip(rig.as_ref());
    let rehearsed = args.rehearsal.plan(&mut board, named)?;
    Ok(Box::new(move || emulate(&args, board, rehearsed)))
}

/// Serves the board until an interrupt.
fn emulate(args: &Args, board: EmulatedBoard, rehearsed: Vec<Rehearsed>) -> Result<Exit, Failure> {
    let interrupted = interrupt_flag(false)?;
    let served = serve_at(board, args.pace)?;
    let link = args.link.as_ref().map(|link| TerminalLink::create(link, served.path()));
    let link = link.transpose().map_err(bad_input)?;
    print::result(served.path().display())?;
    let mut lines = args.motors.then(MotorLines::start).transpose()?;
    follow(&served, lines.as_mut(), rehearsed, &interrupted);
    drop(link);
    let line = state(&served);
    // A reader that takes no lines takes no result.
    let has_reader = lines.is_none_or(MotorLines::end);
    print::json(args.json && has_reader, line)?;
    served.stop()?;
    Ok(Exit::Done)
}

/// Returns the board of the options, with its simulated rig if there is one.
fn board(args: &Args, rig: Option<&Rig>) -> Result<EmulatedBoard, Failure> {
    let Some((path, rig)) = args.rig.as_deref().zip(rig) else {
        return Ok(EmulatedBoard::new(EMULATED));
    };
    let Some(simulation) = &rig.simulation else {
        return Err(failed(format!(
            "{}: no [simulation] table: this is the file of a real rig. A board without a rig \
             needs no file (`plumb emulate --link board`); `plumb init trial --simulated` writes a \
             rig that is simulated",
            path.display()
        )));
    };
    Ok(EmulatedBoard::with_plant(EMULATED, args.physics.plant(rig, simulation)?))
}

/// Reports every change of the board's state (`-v`) and what goes wrong by plan, and prints the
/// board's motor positions to `lines`, until the board's thread ends or `interrupted` is set.
fn follow(
    served: &Served,
    mut lines: Option<&mut MotorLines>,
    rehearsed: Vec<Rehearsed>,
    interrupted: &AtomicBool,
) {
    let mut state = None;
    let mut rehearsed = rehearsed.into_iter().peekable();
    while !interrupted.load(Ordering::Relaxed) && !served.ended() {
        let (now, time) = {
            let board = served.board();
            (board.state(), board.now())
        };
        while let Some(due) = rehearsed.next_if(|it| it.time <= time) {
            due.tell(&served.board());
        }
        if let Some(lines) = &mut lines {
            let samples = served.board().take_samples();
            lines.add(samples);
        }
        if state.replace(now) != Some(now) {
            info!(state = %now, "the board's state has changed");
        }
        thread::sleep(POLL_INTERVAL);
    }
}
