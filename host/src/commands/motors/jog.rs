//! `plumb jog`: turns one motor, by a distance or with keys.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::Parser;
use plumb_config::error_chain::ErrorChain;
use plumb_protocol::message::{Jog, Refusal, State, Telemetry};
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::link::{Link, LinkError, Serial};
use plumb_runtime::rig::Rig;

use super::super::connection::{connect, explained};
use super::super::interrupt::interrupt_flag;
use super::super::print::{self, note, tell};
use super::super::rig_args::PortArgs;
use super::super::rig_path::{RIG_VARIABLE, check_rig_first, split_rig};
use super::super::{FAILED, Failure, bad_input, board, failed, numbers};
use super::dialogue;
use super::keys::NAMES;

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
#[command(
    override_usage = USAGE,
    after_help = examples![
        "plumb jog rig.toml A 200",
        "plumb jog rig.toml C -20mm",
        "plumb jog rig.toml              # with keys",
        "PLUMB_RIG=rig.toml plumb jog B 50 --rate 20",
    ]
)]
pub(crate) struct JogArgs {
    /// Rig file (TOML, SI units) [env: PLUMB_RIG]
    rig: Option<String>,
    /// Motor: A, B or C
    #[arg(allow_hyphen_values = true)]
    motor: Option<String>,
    /// Distance in full steps, or in millimetres of cable: 200, -200, 20mm (-100000000 to
    /// 100000000)
    #[arg(allow_hyphen_values = true)]
    distance: Option<String>,
    /// Unit that is a word of its own, for the message about it
    #[arg(hide = true)]
    unit: Option<String>,
    /// Highest rate, above 0, to 1250000 full steps/s [default: the rig file's jog.max_rate]
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::within(numbers::RATE))]
    rate: Option<f64>,
    #[command(flatten)]
    port: PortArgs,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Move of one motor.
struct Move {
    /// Index of the motor.
    motor: u8,
    /// Distance, full steps.
    steps: f64,
}

pub(crate) fn jog(args: JogArgs) -> Result<ExitCode, Failure> {
    let words = [args.rig, args.motor, args.distance];
    check_unit(&words, args.unit.as_deref())?;
    let (file, words) = split(words)?;
    let rig = Rig::read(&file)?;
    let wanted = words.map(|[motor, distance]| parse(&motor, &distance, &rig)).transpose()?;
    let rate = rate(args.rate, &rig)?;
    let interrupted = interrupt_flag(true)?;
    if wanted.is_none() {
        // Before anything is sent to the board.
        dialogue::check_terminal()?;
    }
    let mut link = connect(&file, &rig, &args.port)?;
    let telemetry = match wanted {
        Some(wanted) => turn(&mut link, &wanted, rate, &interrupted)?,
        None => dialogue::run(&mut link, &rig, rate, &interrupted)?,
    };
    if let State::Fault(fault) = telemetry.state {
        return Err(explained(LinkError::Fault(fault), &file, &args.port));
    }
    let report = BoardReport::from(&telemetry);
    let [a, b, c] = report.motors;
    note!("motors at {a:.2}, {b:.2}, {c:.2} steps from the zero of travel");
    if args.json {
        print::result(board::line(&link.port(), &report))?;
    }
    Ok(if interrupted.load(Ordering::Relaxed) { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

/// Checks that the last word is no unit: `jog rig.toml A 10 mm`. `unit` is a word behind the
/// distance.
fn check_unit(words: &[Option<String>; 3], unit: Option<&str>) -> Result<(), Failure> {
    let is_number = |word: &&str| word.parse::<f64>().is_ok();
    let mut words: Vec<&str> = words.iter().flatten().map(String::as_str).chain(unit).collect();
    let Some(last) = words.pop() else { return Ok(()) };
    let number = words.last().copied().unwrap_or_default();
    let is_unit = last.chars().all(char::is_alphabetic) && motor(last).is_none();
    if is_number(&number) && is_unit {
        let line = words.join(" ");
        return Err(bad_input(match last {
            "mm" => {
                format!("{number} mm: write number and unit in one word: `plumb jog {line}mm`")
            }
            unit => wrong_unit(number, unit),
        }));
    }
    match unit {
        Some(unit) => Err(bad_input(format!("{unit}: a word too many; usage: {USAGE}"))),
        None => Ok(()),
    }
}

/// Usage of `plumb jog`.
const USAGE: &str = "plumb jog [OPTIONS] [RIG] [MOTOR DISTANCE]";

/// Splits `[RIG] [MOTOR DISTANCE]`.
fn split(words: [Option<String>; 3]) -> Result<(PathBuf, Option<[String; 2]>), Failure> {
    let count = words.iter().flatten().count();
    let names: &[&str] = if count < 2 { &[] } else { &["MOTOR", "DISTANCE"] };
    let rig = words[0].as_deref().filter(|_| count == names.len() + 1);
    if let [Some(motor), Some(distance), Some(last)] = &words {
        check_rig_first(&[motor, distance, last].map(String::clone), USAGE)?;
    }
    if let Some(motor) = rig.filter(|word| !Path::new(word).exists()).and_then(motor) {
        let name = NAMES[motor];
        // Where a variable names the rig file, a wrong number of words is the mistake.
        return Err(bad_input(if std::env::var_os(RIG_VARIABLE).is_some() {
            format!(
                "the distance is missing: `plumb jog {name} 200` turns by 200 steps, and \
                 `plumb jog {name} 20mm` moves 20 mm of cable; {RIG_VARIABLE} names the rig file"
            )
        } else {
            format!(
                "{name} is a motor, and no rig file: name the rig file first, then the motor and \
                 its distance, such as `plumb jog rig.toml {name} 200`"
            )
        }));
    }
    let (rig, rest) = split_rig(words, names, USAGE)?;
    Ok((rig, rest.try_into().ok()))
}

/// Returns the index of the motor with this name; `None` where none has it.
fn motor(name: &str) -> Option<usize> {
    NAMES.iter().position(|motor| name.eq_ignore_ascii_case(&motor.to_string()))
}

/// Parses motor and distance.
fn parse(motor: &str, distance: &str, rig: &Rig) -> Result<Move, Failure> {
    let index = self::motor(motor).ok_or_else(|| {
        bad_input(match self::motor(distance) {
            Some(index) => {
                let name = NAMES[index];
                format!("the motor comes first, then its distance: write {name} {motor}")
            }
            None => format!("motor {motor}: must be A, B or C"),
        })
    })?;
    let (number, is_mm) = match distance.strip_suffix("mm") {
        Some(number) => (number.trim_end(), true),
        None => (distance, false),
    };
    let named = |why: String| bad_input(format!("distance {distance}: {why}"));
    if let Some((number, unit)) = other_unit(number) {
        return Err(named(wrong_unit(number, unit)));
    }
    let number = numbers::parse(number, &numbers::DISTANCE)
        .map_err(|why| named(format!("{why}; full steps as in 200, or millimetres as in 20mm")))?;
    let steps = if is_mm { number * 1e-3 / cable_per_step(rig, index)? } else { number };
    let limit = rig.jog.max_distance.get();
    if steps.abs() > limit {
        // A number of steps is the one that is typed.
        let steps = if is_mm { format!("{steps:.2} steps; ") } else { String::new() };
        return Err(named(format!(
            "{steps}one jog is at most {limit} steps (jog.max_distance in the rig file)"
        )));
    }
    Ok(Move { motor: index as u8, steps })
}

/// Returns the message about a distance in another unit.
fn wrong_unit(number: &str, unit: &str) -> String {
    format!(
        "{number} without a unit are full steps, with mm millimetres as in 20mm; {unit} is none \
         of them"
    )
}

/// Returns number and unit of a distance with a unit behind the number; `None` for any other text.
fn other_unit(distance: &str) -> Option<(&str, &str)> {
    let number = distance.trim_end_matches(char::is_alphabetic);
    let unit = &distance[number.len()..];
    let number = number.trim_end();
    (!unit.is_empty() && number.parse::<f64>().is_ok()).then_some((number, unit))
}

/// Returns the cable length of a full step of `motor`, metres.
fn cable_per_step(rig: &Rig, motor: usize) -> Result<f64, Failure> {
    if let Some(size) = &rig.size {
        return Ok(size.cable_per_step.get());
    }
    let simulated = rig.simulation.as_ref().and_then(|it| plumb_sim::simulated::geometry(it).ok());
    simulated.map(|geometry| geometry.step_lengths_m()[motor]).ok_or_else(|| {
        bad_input(
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
        return Err(bad_input(format!(
            "--rate {rate}: must be at most {limit} steps/s (jog.max_rate and motors.max_rate in \
             the rig file)"
        )));
    }
    Rate::from_si(rate).filter(|rate| rate.0 > 0).ok_or_else(|| {
        bad_input(format!("--rate {rate} is out of the board's range: 1/256 step/s or more"))
    })
}

/// Turns a motor and waits until it stands. An interrupt stops it. Returns the state of the board
/// at the end, which may be a fault.
fn turn(
    link: &mut Link<Serial>,
    wanted: &Move,
    rate: Rate,
    interrupted: &AtomicBool,
) -> Result<Telemetry, Failure> {
    let Move { motor, steps } = *wanted;
    let distance = Steps16::from_si(steps)
        .ok_or_else(|| bad_input(format!("{steps} steps are out of the board's range")))?;
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
    note!("motor {name}: {what}, {:.2} steps", distance.to_si().abs());
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
        thread::sleep(POLL_INTERVAL);
    }
}
