//! `plumb jog`, `plumb home`, `plumb stop`, `plumb clear`: motors turned and stopped by hand.

mod dialogue;
mod jog;
mod keys;

use std::time::Duration;

use clap::Parser;
use plumb_protocol::message::State;
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::link::{Link, LinkError, Serial, Transport};
use plumb_runtime::rig::{BoardPort, Driver};

use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::port::Port;
use crate::cli::port_args::BoardArgs;
use crate::commands::board::status::report;
use crate::session::connection::RigBoard;

pub(crate) use jog::{JogArgs, jog};

/// Ramp the motors down
///
/// The motors keep their current, and the ball hangs where it is. A program that drives the board
/// holds its port, and this command then sends nothing: stop that program with Ctrl-C or on its
/// page, or press the emergency button.
#[derive(Parser)]
#[command(after_help = examples!["plumb stop", "plumb stop --port /dev/ttyACM0"])]
pub(crate) struct StopArgs {
    #[command(flatten)]
    board: BoardArgs,
}

/// Make the present motor positions the zero of travel
///
/// Nothing moves. `motors.travel` of the rig file counts from there, until the board restarts. A
/// simulated rig begins again at its start: that is where its motors are at 0.
#[derive(Parser)]
#[command(after_help = examples!["plumb home"])]
pub(crate) struct HomeArgs {
    #[command(flatten)]
    board: BoardArgs,
}

/// Clear the fault for which the board stopped by itself
///
/// Nothing moves. Remove the cause first: the book's page "When it goes wrong" names it for each
/// fault. The command looks for a second whether the board stops again.
#[derive(Parser)]
#[command(after_help = examples!["plumb clear", "plumb clear --port /dev/ttyACM0"])]
pub(crate) struct ClearArgs {
    #[command(flatten)]
    board: BoardArgs,
}

/// What a person must know where `plumb stop` has not reached the board.
const NOT_STOPPED: &str = "`plumb stop` has sent nothing, and the motors may still turn; the \
                           emergency button stops them at once, and the ball falls";

/// The same where the board has answered, or may have got the request.
const MAY_TURN: &str = "The motors may still turn; the emergency button stops them at once, and \
                        the ball falls";

pub(crate) fn stop(args: StopArgs) -> Result<Work, Failure> {
    let not_stopped = |failure: Failure| failure.with_advice(NOT_STOPPED);
    let BoardPort { port, baud } = args.board.board().map_err(not_stopped)?;
    let serial = Serial::open(&port, baud).map_err(|error| match error {
        LinkError::Busy { port, .. } => failed(format!(
            "{port}: another program drives this board and holds its port: `plumb stop` has sent \
             nothing, and the motors may still turn. Press Ctrl-C where that program runs, or Stop \
             on its page; the emergency button stops the motors at once, and the ball falls"
        )),
        error => not_stopped(args.board.not_open(error)),
    })?;
    // Only the greeting is sent before an answer.
    let link = Link::connect(serial).map_err(|error| not_stopped(error.into()))?;
    Ok(Box::new(move || {
        serve(link, args.board.json, |link| {
            link.stop().map_err(|error| Failure::from(error).with_advice(MAY_TURN))?;
            Ok("the motors stand")
        })
    }))
}

pub(crate) fn clear(args: ClearArgs) -> Result<Work, Failure> {
    let link = Link::connect(args.board.open()?)?;
    let clear = |link: &mut Link<Port>| {
        let had_fault = matches!(link.status()?.state, State::Fault(_));
        link.clear_fault()?;
        if !had_fault {
            return Ok("there was no fault");
        }
        check_stands(link)?;
        Ok("faults are cleared")
    };
    Ok(Box::new(move || serve(link, args.board.json, clear)))
}

/// Time in which the board sets drivers on a UART up and reads each of them, with room: 0.2 s.
const SETUP_CHECK: Duration = Duration::from_secs(1);

/// Checks that the board does not stop again, as where a driver fails once the board has read it.
fn check_stands<T: Transport>(link: &mut Link<T>) -> Result<(), Failure> {
    link.wait(SETUP_CHECK)?;
    match link.status()?.state {
        State::Fault(fault) => {
            let (port, advice) = (link.port(), BoardFault::from(fault).advice());
            Err(failed(format!("{port}: the board has stopped again: {fault}. {advice}")))
        }
        _ => Ok(()),
    }
}

pub(crate) fn home(args: HomeArgs) -> Result<Work, Failure> {
    let BoardArgs { rig, port, json } = args.board;
    let (file, rig) = rig.read()?;
    port.note(&file, &rig);
    let link = RigBoard { file: &file, rig: &rig, port: &port }.connect(true)?;
    Ok(Box::new(move || {
        serve(link, json, |link| {
            link.home()?;
            if let Driver::Tmc2209Uart(_) = rig.motors.driver {
                check_stands(link)?;
            }
            Ok("the zero of travel is here")
        })
    }))
}

/// Makes a request of the board, and prints what `request` has done, and the state.
fn serve<T: Transport>(
    mut link: Link<T>,
    is_json: bool,
    request: impl FnOnce(&mut Link<T>) -> Result<&'static str, Failure>,
) -> Result<Exit, Failure> {
    let done = request(&mut link)?;
    note!("{}: {done}", link.port());
    let telemetry = link.status()?;
    report(&link, &telemetry, is_json)?;
    Ok(Exit::Done)
}
