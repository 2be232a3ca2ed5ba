//! Bytes on the wire, from an independent encoder. They change only with the schema; those of the
//! first three commands and of the board's Hello never change.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fmt::Debug;

use plumb_protocol::SCHEMA;
use plumb_protocol::config::{
    Config, Deadlines, Following, Growth, Interval, JogLimits, Law, Motor, PathLimits, Progress,
    Reached, Workspace,
};
use plumb_protocol::diagnostics::{
    ChipCounts, ChipMeasurement, Diagnostics, Measurement, ProcessorFault, PulseCount,
};
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::*;
use plumb_protocol::provenance::{BoardKind, Commit, Provenance, Release};
use plumb_protocol::units::{
    Acceleration, Bound, Covariance, Gain, Micrometres, Micros, Milliseconds, PathAcceleration,
    PathJerk, Point, Rate, RelativeTension, Speed, Steps16,
};
use plumb_protocol::wiring::{Drivers, Line, PinError, StepDir, Tmc2209, Wiring, WiringError};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Returns the bytes in hexadecimal.
fn in_hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Checks that the message encodes to these bytes, and that these bytes decode to the message.
fn assert_bytes<T: Serialize + DeserializeOwned + Clone + PartialEq + Debug>(
    message: T,
    hex: &str,
) {
    let frame = encode(&message).expect("it fits a frame");
    assert_eq!(in_hex(&frame), hex, "{message:?}");
    let mut accumulator = Accumulator::new();
    let read = frame.iter().find_map(|&b| accumulator.push::<T>(b));
    assert_eq!(read, Some(Ok(message)));
}

fn to_board(command: Command, hex: &str) {
    assert_bytes(ToBoard { id: 300, command }, hex);
}

fn point(x: i32, y: i32, z: i32) -> Point {
    Point([x, y, z].map(Micrometres))
}

/// A Hello whose schema does not depend on the types.
const HELLO: Hello = Hello { magic: MAGIC, version: 1, schema: [1, 2, 3, 4, 5, 6, 7, 8] };

#[test]
fn frames_that_never_change() {
    assert_eq!(MAGIC, *b"PLMB");
    to_board(Command::Hello(HELLO), "03ac0212504c4d420101020304050607081fb23e5e00");
    to_board(Command::Stop, "08ac0201022f126a00");
    to_board(Command::Bootloader, "08ac0202b87e1bf300");
    let hello = BoardHello { id: 300, hello: HELLO, max_pulse_rate: 1_250_000, accepted: true };
    assert_bytes(FromBoard::Hello(hello), "0118ac02504c4d42010102030405060708d0a54c01353dd97f00");
    let provenance = Provenance {
        release: Release([1, 2, 3]),
        commit: Commit::parse("0123abcd+"),
        board: BoardKind::Pico,
        stepping: Some(*b"B2"),
    };
    assert_bytes(FromBoard::Provenance(provenance), "1305010203010123abcd010101423262fe4b1400");
    let unknown = Provenance { commit: None, stepping: None, ..Provenance::EMULATED };
    let unknown = Provenance { release: Release([0, 1, 0]), ..unknown };
    assert_bytes(FromBoard::Provenance(unknown), "020502010101010569d934f200");
}

#[test]
fn commands() {
    let position = |sequence, age_us, ball| {
        Command::Position(Position { sequence, age_us, ball, covariance: None })
    };
    to_board(
        position(65_535, 45_000, Some(point(540_000, -220_000, 459_000))),
        "14ac0204ffff03c8df0201c0f541bfed1af0833805cb7f26e100",
    );
    let sure = Covariance { variances: [400, 100, 1], covariances: [-3, 0, 40] };
    let ball = Some(point(540_000, -220_000, 459_000));
    let seen = Position { sequence: 1, age_us: 45_000, ball, covariance: Some(sure) };
    to_board(
        Command::Position(seen),
        "18ac020401c8df0201c0f541bfed1af083380190036401050650dd6dc74600",
    );
    to_board(position(0, 0, None), "04ac020401010105af612fa500");
    to_board(
        Command::Target(point(400_000, 400_000, 150_000)),
        "11ac020580ea3080ea30e0a7120669a85300",
    );
    let jog = Jog { motor: 2, distance: Steps16(-320), rate: Rate(25_600) };
    to_board(Command::Jog(jog), "0eac020602ff04809003e166dfc400");
    to_board(Command::Hold, "08ac0207378a718300");
    to_board(Command::ClearFault, "08ac0208a697ce1300");
    to_board(Command::Status, "08ac020930a7c96400");
    to_board(Command::Store, "08ac020a8af6c0fd00");
    to_board(Command::Home, "08ac020b1cc6c78a00");
    to_board(Command::Diagnose, "08ac020d2963a46300");
    to_board(Command::Measure, "08ac020e9332adfa00");
    to_board(Command::TestFlash, "08ac020f0502aa8d00");
    let knot = |k: i32| Knot {
        position: point(400_000 + 7_500 * k, -200_000, 150_000),
        velocity: [50_000, 0, -1].map(Speed),
    };
    let reference = Reference {
        sequence: 7,
        now: Micros(1_234_567),
        waits: true,
        first: Micros(1_200_000),
        interval_us: 150_000,
        knots: [0, 1, 2, 3, 4, 5].map(knot),
    };
    to_board(
        Command::Follow(reference),
        "1bac020c0787ad4b01809f49f0930980ea30ffb418e0a712a08d060e0198df31ffb418e0a712a08d\
         060e01b0d432ffb418e0a712a08d060e01c8c933ffb418e0a712a08d060e01e0be34ffb418e0a712\
         a08d060e01f8b335ffb418e0a712a08d0606017bf9d7e400",
    );
}

#[test]
fn the_configuration() {
    let motor = Motor {
        max_rate: Rate(400 * 256),
        max_acceleration: Acceleration(2000),
        travel_min: Steps16(-48_000),
        travel_max: Steps16(48_000),
        reversed: false,
    };
    let config = Config {
        law: Law::Interval(Interval::uniform(Bound(327), Bound(32_768), Gain(4172))),
        motors: [motor; 3].into(),
        microsteps: 16,
        workspace: Workspace {
            min: point(-200_000, -200_000, -100_000),
            max: point(1_100_000, 900_000, 640_000),
        },
        reached: Reached { radius: Micrometres(10_000), frames: 10 },
        deadlines: Deadlines {
            host: Milliseconds(300),
            position: Milliseconds(500),
            max_age: Milliseconds(250),
        },
        growth: Growth { margin: Micrometres(60_000), time: Milliseconds(600) },
        following: Following { turn: Steps16(6400), movement: Micrometres(20_000) },
        progress: Progress { margin: Micrometres(1_000), time: Milliseconds(10_000) },
        jog: JogLimits { max_rate: Rate(50 * 256), max_distance: Steps16(3200) },
        path: PathLimits {
            speed: Speed(300_000),
            acceleration: PathAcceleration(1_000),
            jerk: PathJerk(10_000),
            deviation: Micrometres(20_000),
        },
        mean: Milliseconds(300),
    };
    to_board(
        Command::Configure(config),
        "04ac02030803ffff0103ff014603ffffff03c702c702c70203c702c702c70203c702c702c7020380\
         80028080028080020380800280800280800203808002808002808002cc200380c00cd00fffed0580\
         ee050c80c00cd00fffed0580ee050c80c00cd00fffed0580ee054210ffb418ffb418bf9a0cc0a386\
         01c0ee6d80904ea09c010aac02f403fa01c0a907d8048064c0b802d00f904e80c8018032c0cf24e8\
         07904ec0b802ac027904fac600",
    );
}

#[test]
fn the_wiring() {
    let pico = Wiring::pico(Drivers::StepDir(StepDir::A4988));
    to_board(
        Command::Wire(pico),
        "07ac02100103020203020402050206020701020e020f030119010109e807e807c801c80101043db4\
         b900",
    );
    let board = plumb_protocol::boards::SKR_PICO;
    let drivers = Drivers::StepDir(StepDir::DM542);
    to_board(
        Command::Wire(Wiring { board: board.kind, pins: board.pins, drivers }),
        "07ac021002030b040a010604050113021c0601030c070202040101010fc413c41388278827c80110\
         2b87cc00",
    );
    let drivers = Drivers::Tmc2209(Tmc2209::of(&board));
    to_board(
        Command::Wire(Wiring { board: board.kind, pins: board.pins, drivers }),
        "07ac021002030b040a010604050113021c0601030c0702020401010d03c801c80132328201080903\
         080201a006a0066e059c4a50a800",
    );
    let wrong = WiringError::Pin(Line::Direction(1), PinError::Taken);
    let answer = |refusal| FromBoard::Answer(Answer { id: 300, refusal, time: Micros(1_234_567) });
    assert_bytes(answer(Some(Refusal::Wiring(wrong))), "1101ac0201160201010187ad4bbd858f7500");
    assert_bytes(answer(Some(Refusal::NotWired)), "0d01ac02011787ad4bc9d6388a00");
}

#[test]
fn reports() {
    let answer = |refusal| FromBoard::Answer(Answer { id: 300, refusal, time: Micros(1_234_567) });
    assert_bytes(answer(None), "0401ac020887ad4b8601d83100");
    assert_bytes(
        answer(Some(Refusal::Faulted(Fault::PositionLost))),
        "0e01ac0201040187ad4bbea6b20300",
    );
    assert_bytes(
        answer(Some(Refusal::Config(ConfigField::Workspace))),
        "0e01ac0201050787ad4bd2d0b91b00",
    );
    let telemetry = Telemetry {
        time: Micros(1_234_567),
        state: State::Fault(Fault::Travel(1)),
        configuration: Some(298),
        target: Some(300),
        sequence: Some(77),
        motors: [1398, 8155, 0].map(Steps16).into(),
        rates: [17_390, 0, -256].map(Rate).into(),
        error: point(140_000, -180_000, 309_000),
        filtered_error: Micrometres(384_000),
        bad_frames: 3,
        tensions: Some([102, 64, 381].map(RelativeTension).into()),
        reference: None,
        late_ticks: 2,
    };
    assert_bytes(
        FromBoard::Telemetry(telemetry),
        "150287ad4b04040101aa0201ac02014d03ec15b67f0503dc8f0216ff03c08b11bffc1590dc2580f0\
         2e0301036640fd0206027a0f658f00",
    );
    let reference = ReferenceState {
        sequence: 7,
        time: Micros(1_234_567),
        pace: 192,
        position: point(400_000, -200_000, 150_000),
    };
    assert_bytes(
        FromBoard::Telemetry(Telemetry { reference: Some(reference), ..telemetry }),
        "150287ad4b04040101aa0201ac02014d03ec15b67f0503dc8f022bff03c08b11bffc1590dc2580f0\
         2e0301036640fd02010787ad4bc00180ea30ffb418e0a712020123fee800",
    );
    let idle = Telemetry { configuration: None, target: None, tensions: None, ..telemetry };
    assert_bytes(
        FromBoard::Telemetry(idle),
        "080287ad4b0404010108014d03ec15b67f0503dc8f0210ff03c08b11bffc1590dc2580f02e030106\
         02c3401e1200",
    );
    for (state, hex) in [
        (
            State::Jogging,
            "060287ad4b050108014d03ec15b67f0503dc8f0210ff03c08b11bffc1590dc2580f02e03010602dc\
         b4104c00",
        ),
        (
            State::Stopping,
            "060287ad4b060108014d03ec15b67f0503dc8f0210ff03c08b11bffc1590dc2580f02e0301060286\
         47962100",
        ),
        (
            State::Storing,
            "060287ad4b070108014d03ec15b67f0503dc8f0210ff03c08b11bffc1590dc2580f02e03010602b0\
         16140500",
        ),
    ] {
        assert_bytes(FromBoard::Telemetry(Telemetry { state, ..idle }), hex);
    }
    for (fault, hex) in [
        (Fault::HostSilent, "0503a8a9120701aa023f9efe0100"),
        (Fault::NotFollowing, "0d03a8a9120901aa02b5d1f67d00"),
        (Fault::NoProgress, "0d03a8a9120a01aa025b7e436f00"),
        (Fault::Driver(DriverFault::Hat), "0603a8a9120b0801aa02168ff5f600"),
        (Fault::Driver(DriverFault::Short(1)), "0f03a8a9120b080101aa02de01ad4b00"),
        (Fault::LateTicks, "0d03a8a9120c01aa028721284a00"),
        (Fault::Clock, "0d03a8a9120d01aa02e24694f200"),
    ] {
        let report = FaultReport { time: Micros(300_200), fault, configuration: Some(298) };
        assert_bytes(FromBoard::Fault(report), hex);
    }
    let quiet = DriverReading::default();
    let motors = [
        DriverReading { stall_guard: Some(300), ..quiet },
        DriverReading { is_hot: true, has_lost_replies: true, stall_guard: Some(0), ..quiet },
        DriverReading { has_open_load: true, ..quiet },
    ];
    assert_bytes(
        FromBoard::Drivers(DriverReport { time: Micros(1_234_567), motors: motors.into() }),
        "060887ad4b0301010501ac02010301010102010105da58069c00",
    );
    let pulses = [(1, 2), (3, 4), (5, 70_000)].map(|(low, high)| PulseCount { low, high });
    let chip = ChipMeasurement { pulses: pulses.into(), time_us: 1_234_567, usb_frame: Some(2047) };
    assert_bytes(
        FromBoard::Measurement(Measurement { id: 300, chip }),
        "1707ac02030102030405f0a20487ad4b01ff0fac087d8200",
    );
    let chip = ChipCounts {
        late_ticks: 1,
        late_at_rest: 20,
        free_stack: Some(20_000),
        usb_resets: 2,
        fault: Some(ProcessorFault { pc: 0x1000_1234, lr: 0x2000_5679 }),
        dropped_frames: 300,
    };
    let diagnostics = Diagnostics { id: 300, start: StartCause::Requested, bad_frames: 3, chip };
    assert_bytes(
        FromBoard::Diagnostics(diagnostics),
        "1e06ac020503011401a09c010201b4a4808001f9ac818002ac028d8cd34000",
    );
}

/// Every frame in the wire format's documentation is a message, and both directions are shown.
#[test]
fn the_documentation_of_the_wire_format_has_valid_frames() {
    let page = include_str!("../../../docs/understand/wire-format.md");
    let is_frame = |word: &&str| word.len() >= 16 && word.bytes().all(|b| b.is_ascii_hexdigit());
    let (mut to_board, mut from_board) = (0, 0);
    for hex in page.split('`').filter(is_frame) {
        let bytes: Vec<u8> = (0..hex.len())
            .step_by(2)
            .map(|at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal"))
            .collect();
        if is_message::<ToBoard>(&bytes) {
            to_board += 1;
        } else {
            assert!(is_message::<FromBoard>(&bytes), "{hex} is not a message");
            from_board += 1;
        }
    }
    assert!(
        to_board >= 5 && from_board >= 3,
        "{to_board} frames to the board, {from_board} from it"
    );
}

/// A change of a message changes the schema, and with it the Hello.
#[test]
fn the_documentation_of_the_wire_format_has_the_hello_of_this_build() {
    let page = include_str!("../../../docs/understand/wire-format.md");
    let hello = ToBoard { id: 300, command: Command::Hello(Hello::OURS) };
    let frame = in_hex(&encode(&hello).expect("it fits a frame"));
    let schema = in_hex(&SCHEMA);
    let row = format!("| Hello: version {VERSION}, schema {schema} | `{frame}` |");
    assert!(page.contains(&row), "docs/understand/wire-format.md: the row of Hello is {row}");
}

/// A change of a message changes the schema. The client in Python then has to follow.
#[test]
fn the_client_in_python_has_the_schema() {
    let client = include_str!("../../../protocol/examples/client.py");
    let schema = in_hex(&SCHEMA);
    assert!(client.contains(&format!("\"{schema}\"")), "client.py: set SCHEMA to {schema}");
}

/// Returns whether `bytes` are exactly one frame with a message of this type.
fn is_message<T: Serialize + DeserializeOwned>(bytes: &[u8]) -> bool {
    let mut accumulator = Accumulator::new();
    let read = bytes.iter().find_map(|&b| accumulator.push::<T>(b));
    matches!(read, Some(Ok(message)) if encode(&message).is_ok_and(|frame| frame == bytes))
}
