//! Tests of the status.

use nalgebra::Vector3;
use plumb_frame::observation::{BallObservation, Circle, Gaussian3};
use plumb_protocol::MOTORS;
use plumb_protocol::message::Fault;
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::observer::PathPoint;
use plumb_runtime::operator::CommandRefusal;
use plumb_runtime::rig::{Outside, Side};
use plumb_runtime::run::StopReason;

use super::*;

fn target(x: f64) -> Point3<f64> {
    Point3::new(x, 0.3, 0.2)
}

fn command(command: OperatorCommand, outcome: CommandOutcome) -> RunEvent {
    RunEvent::Command { number: 1, command, outcome }
}

fn record(state: Option<State>) -> FrameRecord {
    FrameRecord { target: Some(target(0.4)), state, ..FrameRecord::default() }
}

#[test]
fn a_fault_is_an_error_with_its_advice_until_it_is_cleared() {
    let now = Instant::now();
    let mut status = RunStatus::new(now);
    assert_eq!(status.run(now).level, Level::Ok);
    let fault = BoardFault::from(Fault::PositionLost);
    status.note_event(&RunEvent::TargetEnded { number: 0, reason: StopReason::Fault(fault) });
    let report = status.run(now);
    assert_eq!(report.level, Level::Error);
    assert!(report.message.contains(&fault.to_string()), "{}", report.message);
    assert!(report.values.contains(&KeyValue::new("advice", fault.advice())));
    status.note_event(&command(OperatorCommand::ClearFault, CommandOutcome::Accepted));
    assert_eq!(status.run(now).level, Level::Ok);
}

#[test]
fn the_state_before_a_new_target_is_not_that_of_the_drive_to_it() {
    let now = Instant::now();
    let mut status = RunStatus::new(now);
    let set = |number, x| RunEvent::TargetSet { number, target: target(x) };
    status.note_event(&set(0, 0.4));
    status.note_frame(&record(Some(State::Holding)), now);
    assert!(status.run(now).values.contains(&KeyValue::new("state", State::Holding)));
    status.note_event(&set(1, 0.5));
    let keys = |status: &RunStatus| status.run(now).values.iter().any(|it| it.key == "state");
    assert!(!keys(&status));
    status.note_frame(&record(None), now);
    assert!(!keys(&status));
}

/// Returns the report of a board at rest.
fn board(drivers: Option<MotorList<DriverReading>>) -> BoardReport {
    BoardReport {
        time: 0.0,
        state: State::Ready,
        configuration: None,
        target: None,
        sequence: None,
        motors: [0.0; MOTORS].into(),
        rates: [0.0; MOTORS].into(),
        error: [0.0; 3],
        bad_frames: 0,
        late_ticks: 0,
        tensions: None,
        reference: None,
        drivers,
    }
}

#[test]
fn a_warning_of_a_driver_is_a_warning_of_the_run() {
    let now = Instant::now();
    let mut status = RunStatus::new(now);
    let cool = DriverReading::default();
    let hot = DriverReading { is_hot: true, ..cool };
    let open = DriverReading { has_open_load: true, ..cool };
    let circle = Circle::rough(1.0, 1.0, 1.0);
    let position = Some(Gaussian3 { mean: target(0.4), covariance: nalgebra::zero() });
    let ball = BallObservation { stamp: 0.0, circle, score: 1.0, position, depths: None };
    let mut report = |drivers| {
        let board = Some(board(drivers));
        let record = FrameRecord { board, observation: Some(ball), ..record(None) };
        status.note_frame(&record, now);
        status.run(now)
    };
    let warned = report(Some([cool, hot, open].into()));
    assert_eq!(warned.level, Level::Warn);
    assert!(warned.message.ends_with("motor drivers: B hot, C open coil"), "{}", warned.message);
    assert!(warned.values.contains(&KeyValue::new("driver_warnings", "B hot, C open coil")));
    let cooled = report(Some([cool; MOTORS].into()));
    assert_eq!(cooled.level, Level::Ok);
    assert!(cooled.values.contains(&KeyValue::new("driver_warnings", "none")));
    let others = report(None);
    assert!(others.values.iter().all(|value| value.key != "driver_warnings"), "{others:?}");
}

#[test]
fn a_target_that_moves_is_shown_and_does_not_count_as_a_set_point() {
    let now = Instant::now();
    let mut status = RunStatus::new(now);
    status.note_event(&RunEvent::TargetSet { number: 0, target: target(0.4) });
    let position = target(0.5);
    let path = Some(PathPoint { time: 0.1, pace: 1.0, position, velocity: Vector3::zeros() });
    let moved = FrameRecord { target: Some(position), path, ..record(Some(State::Following)) };
    status.note_frame(&moved, now);
    assert!(status.run(now).values.contains(&KeyValue::new("target_m", "0.500 0.300 0.200")));
    // A set point there ends the motion, also while the target rests.
    let rests = FrameRecord { target: Some(position), ..record(Some(State::Holding)) };
    status.note_frame(&rests, now);
    assert_eq!(status.present_target(), None);
    status.note_event(&RunEvent::TargetSet { number: 1, target: position });
    status.note_frame(&rests, now);
    assert_eq!(status.present_target(), Some(position));
}

#[test]
fn a_camera_that_is_silent_is_an_error() {
    let now = Instant::now();
    let status = RunStatus::new(now);
    let report = status.run(now + Duration::from_secs(3));
    assert_eq!((report.level, report.message.as_str()), (Level::Error, "no picture for 3 s"));
}

#[test]
fn a_refused_command_is_reported_until_the_next() {
    let mut status = RunStatus::new(Instant::now());
    let (value_m, limit_m) = (7.0, 0.6);
    let outside = Outside { axis: 'z', value_m, side: Side::Above, limit_m, unit: None };
    let refused = CommandOutcome::Refused(CommandRefusal::TargetOutside(outside));
    status.note_event(&command(OperatorCommand::Target(target(7.0)), refused));
    let report = status.commands(false);
    assert_eq!(report.level, Level::Warn);
    assert!(report.message.contains("outside the workspace"), "{}", report.message);
    status.note_event(&command(OperatorCommand::Hold, CommandOutcome::Accepted));
    assert_eq!(status.commands(false).level, Level::Ok);
    assert!(status.commands(false).values.contains(&KeyValue::new("refused", 1)));
}

#[test]
fn the_present_target_ends_with_its_drive_unless_it_is_held() {
    let mut status = RunStatus::new(Instant::now());
    let set = RunEvent::TargetSet { number: 0, target: target(0.4) };
    let ended = |reason| RunEvent::TargetEnded { number: 0, reason };
    status.note_event(&set);
    status.note_event(&ended(StopReason::Reached));
    assert_eq!(status.present_target(), Some(target(0.4)));
    status.note_event(&command(OperatorCommand::Stop, CommandOutcome::Accepted));
    assert_eq!(status.present_target(), None);
    status.note_event(&set);
    status.note_event(&ended(StopReason::Timeout));
    assert_eq!(status.present_target(), None);
}
