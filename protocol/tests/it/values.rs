//! Quantities, points and texts of the protocol.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first error")]

use plumb_protocol::config::{Law, SIGNS, Workspace};
use plumb_protocol::message::{
    Command, ConfigField, DriverFault, Fault, Position, Refusal, StartCause, State, ToBoard,
};
use plumb_protocol::panic_place;
use plumb_protocol::provenance::{BoardKind, Commit, Provenance, Release};
use plumb_protocol::units::{Micrometres, Micros, Point, Rate};
use plumb_protocol::{Config, MotorList};

fn point(um: [i32; 3]) -> Point {
    Point(um.map(Micrometres))
}

#[test]
fn a_point_is_the_same_in_metres_and_micrometres() {
    let p = Point::from_metres([0.5, -1.25, 0.000_001]).unwrap();
    assert_eq!(p.micrometres(), [500_000, -1_250_000, 1]);
    let back = p.to_metres();
    assert!((0..3).all(|i| (back[i] - [0.5, -1.25, 0.000_001][i]).abs() < 1e-12), "{back:?}");
    assert_eq!(Point::from_metres([0.0, f64::NAN, 0.0]), None);
    assert_eq!(Point::from_metres([0.0, 0.0, 3_000.0]), None);
}

#[test]
fn a_quantity_is_rounded_to_the_nearest_and_limited() {
    assert_eq!(Rate::from_si(-1.5 / 256.0), Some(Rate(-2)));
    assert_eq!(Rate::from_si(1.4 / 256.0), Some(Rate(1)));
    assert_eq!(Rate::from_si(1e8), None);
    assert_eq!(Rate(-512).to_si(), -2.0);
}

#[test]
fn time_before_a_moment_is_none_and_the_clock_has_a_start() {
    assert_eq!((Micros(70).since(Micros(20)), Micros(20).since(Micros(70))), (50, 0));
    assert_eq!((Micros(70).back(20), Micros(20).back(70)), (Micros(50), Micros(0)));
}

#[test]
fn the_border_of_a_workspace_is_inside() {
    let workspace = Workspace { min: point([-10, -20, -30]), max: point([10, 20, 30]) };
    assert!(workspace.contains(point([10, 20, 30])) && workspace.contains(point([-10, -20, -30])));
    for (axis, limit) in [10, 20, 30].into_iter().enumerate() {
        for beyond in [limit + 1, -limit - 1] {
            let mut outside = [0; 3];
            outside[axis] = beyond;
            assert!(!workspace.contains(point(outside)), "{outside:?}");
        }
    }
}

/// Eq. (12) of the paper; rows x, y, z.
#[test]
fn the_sign_pattern_is_that_of_the_paper() {
    assert_eq!(SIGNS[0], [-1, -1, 1]);
    assert_eq!(SIGNS[1], [-1, 1, 0]);
    assert_eq!(SIGNS[2], [-1, -1, -1]);
}

/// The numbers are CRC-32/ISO-HDLC of the path and the line, from another program (zlib).
#[test]
fn a_panic_has_the_number_of_its_place() {
    assert_eq!(panic_place("firmware/src/main.rs", 42), 0xe4ba_74f6);
    assert_ne!(panic_place("firmware/src/main.rs", 43), 0xe4ba_74f6);
}

#[test]
fn a_position_with_bytes_behind_it_is_none() {
    let position = Position { sequence: 1, age_us: 2, ball: None, covariance: None };
    let message = ToBoard { id: 9, command: Command::Position(position) };
    let mut bytes = [0; 64];
    let used = postcard::to_slice(&message, &mut bytes).unwrap().len();
    assert_eq!(ToBoard::position(&bytes[..used]).map(|command| command.id), Some(9));
    assert!(ToBoard::position(&bytes[..used + 1]).is_none());
}

#[test]
fn a_commit_is_read_from_its_text() {
    let name = [0x01, 0x23, 0xab, 0xcd];
    assert_eq!(Commit::parse("0123abcd"), Some(Commit { name, modified: false }));
    assert_eq!(Commit::parse("0123abcd+"), Some(Commit { name, modified: true }));
    for other in ["", "0123abc", "0123abcde", "0123abcg", "0123abcd-", "0123abcd++"] {
        assert_eq!(Commit::parse(other), None, "{other:?}");
    }
}

#[test]
fn a_provenance_names_what_is_known() {
    let unknown = Provenance { release: Release([0, 1, 0]), ..Provenance::EMULATED };
    assert_eq!(unknown.to_string(), "Plumb 0.1.0 on an emulated board");
    let commit = Commit::parse("0123abcd+");
    let (board, stepping) = (BoardKind::Pico, Some(*b"B2"));
    assert_eq!(
        Provenance { commit, board, stepping, ..unknown }.to_string(),
        "Plumb 0.1.0 (0123abcd, modified) on a Raspberry Pi Pico, stepping B2"
    );
}

#[test]
fn texts_name_what_they_are_about() {
    let texts = [
        (Fault::Travel(1).to_string(), "motor B"),
        (Refusal::Faulted(Fault::Travel(2)).to_string(), "motor C"),
        (State::Fault(Fault::Driver(DriverFault::Hat)).to_string(), "a Motor HAT does not answer"),
        (Fault::Driver(DriverFault::Short(1)).to_string(), "motor B has a short circuit"),
        (StartCause::Panic(0x1a2b).to_string(), "00001a2b"),
        (ConfigField::Gain.to_string(), "the gain"),
        (Refusal::Config(ConfigField::Bounds).to_string(), "the bounds"),
    ];
    for (text, part) in texts {
        assert!(text.contains(part), "{text}");
    }
}

/// A list has an entry for each motor: none, and more than four, are no message.
#[test]
fn a_list_has_one_to_four_entries() {
    let list = |bytes: &[u8]| postcard::from_bytes::<MotorList<u8>>(bytes).ok();
    assert_eq!(list(&[0]), None);
    assert_eq!(list(&[5, 1, 2, 3, 4, 5]), None);
    assert_eq!(list(&[3, 7, 8]), None);
    assert_eq!(list(&[2, 7, 8]), Some([7, 8].into()));
    assert_eq!(list(&[4, 1, 2, 3, 4]), Some([1, 2, 3, 4].into()));
}

/// The values are those of the documentation of [`Config::example`].
#[test]
fn the_example_is_the_rig_of_its_documentation() {
    let config = Config::example();
    for motor in &config.motors {
        let travel = [motor.travel_min, motor.travel_max].map(|at| at.to_si());
        assert_eq!((motor.max_rate.to_si(), travel), (400.0, [-4_000.0, 4_000.0]));
        assert_eq!(motor.max_acceleration.to_si(), 2_000.0);
    }
    let Law::Interval(law) = config.law else { panic!("{:?}", config.law) };
    assert_eq!((law.signs, law.beta[2][2].to_si()), (SIGNS.map(MotorList::new), 0.5));
    let corners = [config.workspace.min, config.workspace.max].map(Point::micrometres);
    assert_eq!(corners, [[-1_000_000; 3], [2_000_000, 2_000_000, 600_000]]);
    assert_eq!(config.following.turn.to_si(), 400.0);
    assert_eq!(config.jog.max_rate.to_si(), 400.0);
    assert_eq!(config.jog.max_distance.to_si(), 8_000.0);
}
