//! `plumb cosim`: the board in lock step with any physics engine.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Parser;
use plumb_config::bounded_read::read_line;
use plumb_config::error_chain::ErrorChain;
use plumb_protocol::config::Workspace;
use plumb_protocol::message::Refusal;
use plumb_protocol::prior::Prior;
use plumb_protocol::units::Point;
use plumb_protocol::{Config, MOTORS, Wiring};
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_sim::cosim::{Cosim, CosimError, Request};
use plumb_sim::limits::RigLimits;

use crate::cli::choices::law;
use crate::cli::exit::{Exit, Failure, Work, bad_input};
use crate::cli::numbers;
use crate::cli::print::{self, Reader};

/// The board in lock step with any physics engine: JSON lines on standard input and output
///
/// In: {"t": s, "dt": s, "position": [x, y, z] or null, "age": s, "target": [x, y, z]}, metres in
/// the rig frame, `target` where it changes. "target_velocity": [vx, vy, vz] in m/s beside "target"
/// has the ball follow a target that moves; give both with every picture. Out, after the board has
/// run from t to t plus dt: {"t": s, "steps": [[a, b, c], ...], "rates": [a, b, c], "state": "...",
/// "reached": bool}, full steps since the start, positive where cable is paid out. A board that
/// stopped because it received no position for half a second continues with the next one.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb cosim --rig rig.toml --samples 10",
    "echo '{\"t\": 0, \"dt\": 0.1, \"target\": [0.4, 0.4, 0.15]}' | plumb cosim",
])]
pub(crate) struct Args {
    /// Rig file with limits, workspace and law; without one: 400 steps/s, 2000 steps/s², all of
    /// ±4 m, 10 mm
    #[arg(short, long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Control law, with its default parameters [default: the rig file's, or the default law]
    #[arg(long, value_parser = law)]
    law: Option<LawSettings>,
    /// Number of motor positions in an answer, evenly spaced over dt, 1 to 100000
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u32>(1.0, 1e5, ""))]
    samples: u32,
}

/// Returns the wiring and the configuration of the options, and what is known of the rig.
fn setup(args: &Args) -> Result<(Wiring, Config, Option<Prior>), Failure> {
    if let Some(path) = &args.rig {
        let mut rig = Rig::read(path)?;
        if let Some(law) = &args.law {
            rig.law = law.clone();
        }
        return Ok((rig.wiring()?, rig.config()?, rig.prior()));
    }
    let law = args.law.clone().unwrap_or_default();
    let mean = law.mean().config("mean")?;
    let config = RigLimits::default().config(law.config(MOTORS)?, mean, 0.010);
    Ok((Wiring::example(), config, None))
}

/// Longest line of input, bytes. A request has about 150.
const LONGEST_LINE: u64 = 1 << 16;

/// Returns in words how far the workspace reaches, and which rig file says it.
fn limits(workspace: &Workspace, rig: Option<&Path>) -> String {
    let [min, max] = [workspace.min, workspace.max].map(Point::to_metres);
    let axes = ["x", "y", "z"].into_iter().zip(min.into_iter().zip(max));
    let ranges: Vec<String> =
        axes.map(|(axis, (low, high))| format!("{axis} {low:.3} to {high:.3} m")).collect();
    let whose = rig.map_or("without a rig file".to_owned(), |rig| format!("of {}", rig.display()));
    format!("The workspace {whose} is {}", ranges.join(", "))
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    let (wiring, config, prior) = setup(&args)?;
    let workspace = config.workspace;
    let cosim = Cosim::new(wiring, config, prior)?;
    Ok(Box::new(move || serve(&args, cosim, &workspace)))
}

/// Answers the requests on standard input.
fn serve(args: &Args, mut cosim: Cosim, workspace: &Workspace) -> Result<Exit, Failure> {
    let mut input = std::io::stdin().lock();
    for number in 1_u64.. {
        let wrong = |error: &(dyn Error + 'static)| {
            bad_input(format!("line {number}: {}", ErrorChain(error)))
        };
        let line = read_line(&mut input, LONGEST_LINE).map_err(|e| wrong(&e))?;
        let Some(line) = line else { break };
        if line.trim().is_empty() {
            continue;
        }
        let request: Request = serde_json::from_str(&line).map_err(|e| wrong(&e))?;
        let answer = cosim.step(&request, args.samples).map_err(|error| match error {
            CosimError::Refused(Refusal::TargetOutside) => {
                wrong(&error).with_advice(limits(workspace, args.rig.as_deref()))
            }
            _ => wrong(&error),
        })?;
        let answer = serde_json::to_string(&answer)?;
        // The engine waits for each line.
        if print::results(answer)? == Reader::Closed {
            break;
        }
    }
    Ok(Exit::Done)
}
