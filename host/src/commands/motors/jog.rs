//! `plumb jog`: turns one motor, by a distance or with keys.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Parser;
use plumb_config::error_chain::ErrorChain;
use plumb_protocol::message::{Jog, Refusal, State, Telemetry};
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::Rig;

use super::dialogue;
use super::keys::NAMES;
use crate::cli::choices::MotorName;
use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::interrupt::interrupt_flag;
use crate::cli::port::Port;
use crate::cli::port_args::PortArgs;
use crate::cli::rig_path::RigArg;
use crate::cli::{numbers, print};
use crate::commands::board::status;
use crate::session::connection::RigBoard;

/// Interval of the requests for the state during a jog: below the shortest usual deadline of the
/// board for a silent host, 300 ms.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Turn one motor: a distance, or with keys
///
/// A distance above 0 pays cable out, one below 0 winds it in. It is in full steps, or in
/// millimetres of cable with the unit: 20mm. Without motor and distance, keys turn the motors: for
/// winding cables, hanging the ball and checking a direction.
///
/// Jogs have limits of their own in the rig file (`jog.max_rate`, `jog.max_distance`). The ball
/// falls when the motors lose their current: at the emergency button, and without power.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb jog A 200",
    "plumb jog C -20mm",
    "plumb jog          # with keys",
    "plumb jog --rig trial/rig.toml B 50 --rate 20",
])]
pub(crate) struct JogArgs {
    /// Motor
    #[arg(value_enum, ignore_case = true, requires = "distance")]
    motor: Option<MotorName>,
    /// Distance in full steps, or in millimetres of cable: 200, -200, 20mm (-100000000 to
    /// 100000000)
    #[arg(allow_hyphen_values = true, value_parser = distance)]
    distance: Option<Distance>,
    #[command(flatten)]
    rig: RigArg,
    /// Highest rate, above 0, to 1250000 full steps/s [default: the rig file's jog.max_rate]
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::within(numbers::RATE))]
    rate: Option<f64>,
    #[command(flatten)]
    port: PortArgs,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Distance of a jog, in the unit of the command line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Distance {
    /// Full steps, or millimetres of cable.
    number: f64,
    is_mm: bool,
}

/// Move of one motor.
struct Move {
    /// Index of the motor.
    motor: u8,
    /// Distance.
    distance: Steps16,
}

pub(crate) fn jog(args: JogArgs) -> Result<Work, Failure> {
    let (file, rig) = args.rig.read()?;
    let wanted = args.motor.zip(args.distance);
    let wanted = wanted.map(|(motor, distance)| wanted_move(motor, distance, &rig)).transpose()?;
    let rate = rate(args.rate, &rig)?;
    if wanted.is_none() {
        dialogue::check_terminal()?;
    }
    args.port.note(&file, &rig);
    let mut link = RigBoard { file: &file, rig: &rig, port: &args.port }.connect(false)?;
    Ok(Box::new(move || {
        let board = RigBoard { file: &file, rig: &rig, port: &args.port };
        let interrupted = interrupt_flag(true)?;
        let telemetry = match wanted {
            Some(wanted) => turn(&mut link, &wanted, rate, &interrupted)?,
            None => dialogue::run(&mut link, &rig, rate, &interrupted)?,
        };
        if let State::Fault(fault) = telemetry.state {
            return Err(board.explained(LinkError::Fault(fault), false));
        }
        let report = BoardReport::from(&telemetry);
        note!("motors at {} steps from the zero of travel", status::positions(&report.motors));
        print::json(args.json, status::line(&link.port(), &report))?;
        let is_interrupted = interrupted.load(Ordering::Relaxed);
        Ok(Exit::done_if(!is_interrupted))
    }))
}

/// Parses a distance: full steps, or millimetres with their unit.
fn distance(text: &str) -> Result<Distance, String> {
    let (number, is_mm) = match text.strip_suffix("mm") {
        Some(number) => (number.trim_end(), true),
        None => (text, false),
    };
    let number = number.parse().ok().filter(|number| numbers::DISTANCE.contains(*number));
    number.map(|number| Distance { number, is_mm }).ok_or_else(|| {
        let range = numbers::DISTANCE;
        format!("must be a number, {range}; full steps as in 200, or millimetres as in 20mm")
    })
}

/// Returns the move of `distance`, within the limit of the rig file.
fn wanted_move(motor: MotorName, distance: Distance, rig: &Rig) -> Result<Move, Failure> {
    let Distance { number, is_mm } = distance;
    let motor = motor as u8;
    let steps = if is_mm { number * 1e-3 / cable_per_step(rig, motor)? } else { number };
    let limit = rig.jog.max_distance.get();
    if steps.abs() > limit {
        return Err(failed(format!(
            "the distance is {steps:.2} steps; one jog is at most {limit} steps (jog.max_distance \
             in the rig file)"
        )));
    }
    let distance = Steps16::from_si(steps)
        .ok_or_else(|| failed(format!("{steps} steps are out of the board's range")))?;
    Ok(Move { motor, distance })
}

/// Returns the cable length of a full step of `motor`, metres.
fn cable_per_step(rig: &Rig, motor: u8) -> Result<f64, Failure> {
    if let Some(size) = &rig.size {
        return Ok(size.cable_per_step.get());
    }
    let simulated = rig.simulation.as_ref().and_then(|it| plumb_sim::simulated::geometry(it).ok());
    simulated.map(|geometry| geometry.step_lengths_m()[usize::from(motor)]).ok_or_else(|| {
        failed(
            "a distance in mm needs the key `size.cable_per_step` in the rig file: metres of cable \
             a full step, the drum's circumference / 200; or give the distance in steps",
        )
    })
}

/// Returns the highest rate of a jog: the one asked for, or that of the rig file.
fn rate(asked: Option<f64>, rig: &Rig) -> Result<Rate, Failure> {
    let limit = rig.jog.max_rate.get().min(rig.motors.max_rate.get());
    let rate = asked.unwrap_or(limit);
    if rate > limit {
        return Err(failed(format!(
            "--rate {rate}: must be at most {limit} steps/s (jog.max_rate and motors.max_rate in \
             the rig file)"
        )));
    }
    Rate::from_si(rate).filter(|rate| rate.0 > 0).ok_or_else(|| {
        failed(format!("--rate {rate} is out of the board's range: 1/256 step/s or more"))
    })
}

/// Turns a motor and waits until it stands. An interrupt stops it. Returns the state of the board
/// at the end, which may be a fault.
fn turn(
    link: &mut Link<Port>,
    wanted: &Move,
    rate: Rate,
    interrupted: &AtomicBool,
) -> Result<Telemetry, Failure> {
    let Move { motor, distance } = *wanted;
    let steps = distance.to_si();
    let what = match steps {
        steps if steps < 0.0 => "winds cable in",
        steps if steps > 0.0 => "pays cable out",
        _ => "stays where it is",
    };
    let name = NAMES[usize::from(motor)];
    match link.jog(Jog { motor, distance, rate }) {
        Err(error @ LinkError::Refused { refusal: Refusal::JogTravel, .. }) => {
            let position = BoardReport::from(&link.status()?).motors[usize::from(motor)];
            return Err(failed(format!(
                "{}: motor {name} is at {position:.2} steps, and motors.travel in the rig file \
                 ends before {:.2}. Jog it less far; or `plumb home`, where the cables were \
                 wound anew",
                ErrorChain(&error),
                position + steps
            )));
        }
        accepted => accepted?,
    };
    note!("motor {name}: {what}, {:.2} steps", steps.abs());
    loop {
        let telemetry = link.status()?;
        if let State::Fault(_) = telemetry.state {
            return Ok(telemetry);
        }
        if interrupted.load(Ordering::Relaxed) {
            link.stop()?;
            tell!("interrupted: the motor has stopped on the way");
            return Ok(link.status()?);
        }
        if !link.is_jogging(&telemetry)? {
            return Ok(telemetry);
        }
        link.wait(POLL_INTERVAL)?;
    }
}
