//! `plumb jog`, `plumb stop` and `plumb clear` on an emulated board; the keys of `plumb jog`
//! through a pseudo-terminal; rig file and port from the environment.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use nix::pty::openpty;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::common::{Emulator, States, folder, json, patient, plumb, rig_file, stderr};

/// Emulated board, and a rig file for it.
struct Rig {
    emulator: Emulator,
    folder: tempfile::TempDir,
    file: String,
}

impl Rig {
    fn new() -> Self {
        Self::with(&[])
    }

    /// The board that `options` of `plumb emulate` describe.
    fn with(options: &[&str]) -> Self {
        let folder = folder();
        let file = rig_file(folder.path(), patient);
        Self { emulator: Emulator::in_real_time(options), folder, file }
    }

    /// Runs `plumb` with rig file and port from the environment.
    fn plumb(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(arguments).current_dir(self.folder.path());
        command.env("PLUMB_RIG", &self.file).env("PLUMB_PORT", &self.emulator.port);
        command
    }

    /// Returns the motor positions of the board, full steps.
    fn steps(&self) -> Vec<f64> {
        steps(&self.plumb(&["board", "status", "--json"]))
    }
}

/// Returns the motor positions in the last line of standard output.
fn steps(output: &Output) -> Vec<f64> {
    let line = json(output);
    let steps = line["motors_steps"].as_array().unwrap_or_else(|| panic!("{line}"));
    steps.iter().map(|steps| steps.as_f64().unwrap()).collect()
}

#[test]
fn a_jog_turns_one_motor_by_steps_or_by_millimetres_of_cable() {
    let rig = Rig::new();
    let jog = rig.plumb(&["jog", "--rig", &rig.file, "A", "40", "--json"]);
    assert_eq!(jog.status.code(), Some(0), "{}", stderr(&jog));
    assert!(stderr(&jog).contains("pays cable out"), "{}", stderr(&jog));
    assert_eq!(steps(&jog), [40.0, 0.0, 0.0]);
    // The rig file and the port come from the environment.
    let jog = rig.plumb(&["jog", "c", "-5.5", "--rate", "30"]);
    assert!(stderr(&jog).contains("winds cable in"), "{}", stderr(&jog));
    let jog = rig.plumb(&["jog", "A", "0"]);
    assert_eq!(jog.status.code(), Some(0), "{}", stderr(&jog));
    assert!(stderr(&jog).contains("motor A: stays where it is"), "{}", stderr(&jog));
    let clear = rig.plumb(&["clear"]);
    assert!(stderr(&clear).contains(": there was no fault\n"), "{}", stderr(&clear));
    // A step of the paper's rig is 0.471 mm of cable.
    rig.plumb(&["jog", "B", "-10mm"]);
    let steps = rig.steps();
    assert!((steps[1] + 10.0 / 0.4712).abs() < 0.1, "{steps:?}");
    assert_eq!([steps[0], steps[2]], [40.0, -5.5]);
}

#[test]
fn a_jog_beyond_its_limits_moves_nothing() {
    let rig = Rig::new();
    let real = rig.folder.path().join("real.toml");
    let text = std::fs::read_to_string(&rig.file).unwrap();
    let camera = "[camera]\nsource = \"openni\"";
    let text = text.split("\n[simulation]").next().unwrap().replace("[camera]", camera);
    std::fs::write(&real, text).unwrap();
    let real = real.to_str().unwrap();
    let cases: [(&[&str], i32, &str); 12] = [
        (&["jog", "A", "201"], 2, "jog.max_distance"),
        (&["jog", "A", "-200.5"], 2, "the distance is -200.50 steps; one jog is at most 200 steps"),
        (&["jog", "A", "20", "--rate", "51"], 2, "jog.max_rate"),
        (&["jog", "A", "nan"], 2, "must be a number"),
        (&["jog", "A", "20cm"], 2, "as in 20mm"),
        (&["jog", "D", "20"], 2, "[possible values: A, B, C]"),
        (&["jog", "20", "a"], 2, "invalid value '20' for '[MOTOR]'"),
        (&["jog", "20mm", "B"], 2, "invalid value '20mm' for '[MOTOR]'"),
        (&["jog", "A"], 2, "<DISTANCE>"),
        (&["jog", "--rig", real, "A", "20mm"], 2, "cable_per_step"),
        (&["jog"], 2, "need a terminal"),
        (&["jog", "B", "20", "mm"], 2, "unexpected argument 'mm' found"),
    ];
    for (arguments, code, named) in cases {
        let output = rig.command(arguments).stdin(Stdio::null()).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(named), "{arguments:?}: {}", stderr(&output));
    }
    assert_eq!(rig.steps(), [0.0; 3]);
}

#[test]
fn a_jog_beyond_the_travel_names_the_position_and_the_key() {
    let rig = Rig::new();
    let text = std::fs::read_to_string(&rig.file).unwrap();
    std::fs::write(&rig.file, text.replace("travel = [-1000, 1500]", "travel = [-50, 50]"))
        .unwrap();
    assert_eq!(rig.plumb(&["jog", "A", "20"]).status.code(), Some(0));
    let jog = rig.plumb(&["jog", "A", "40"]);
    assert_eq!(jog.status.code(), Some(1), "{}", stderr(&jog));
    for words in ["motor A is at 20.00 steps", "motors.travel", "ends before 60.00", "plumb home"] {
        assert!(stderr(&jog).contains(words), "{words}: {}", stderr(&jog));
    }
    // Nothing has moved, so nothing is said to move.
    assert!(!stderr(&jog).contains("pays cable out"), "{}", stderr(&jog));
    assert_eq!(rig.steps(), [20.0, 0.0, 0.0]);
}

#[test]
fn a_fault_stays_until_it_is_cleared() {
    let folder = folder();
    let file = rig_file(folder.path(), |text| text);
    let mut emulator = Emulator::start();
    let mut states = States::of(&mut emulator.child);
    let mut jog = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["jog", "--rig", &file, "A", "200", "--rate", "10", "--port", &emulator.port])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let on = |arguments: &[&str]| {
        plumb(&[arguments, &["--port", &emulator.port, "--json"]].concat(), Path::new("."))
    };
    // The host dies during the jog, which takes 20 s.
    states.wait_for("jogging");
    jog.kill().unwrap();
    jog.wait().unwrap();
    // A status is a sign of life of a host: the board must first notice that the host is silent.
    states.wait_for("fault");
    let state = || json(&on(&["board", "status"]))["state"].as_str().unwrap().to_owned();
    assert!(state().contains("fault"), "{}", state());
    let jog = on(&["jog", "--rig", &file, "A", "1"]);
    assert_eq!(jog.status.code(), Some(1));
    assert!(stderr(&jog).contains("plumb clear"), "{}", stderr(&jog));
    let refused = on(&["board", "save", "--rig", &file]);
    assert_eq!(refused.status.code(), Some(1), "{}", stderr(&refused));
    let error = json(&refused)["error"].as_str().unwrap_or_default().to_owned();
    let clear = format!("`plumb clear --rig {file} --port {}`", emulator.port);
    for part in ["nothing came from the host", "overloaded or asleep", &clear] {
        assert!(error.contains(part), "{error}");
    }
    assert!(state().contains("fault"), "{}", state());
    let clear = on(&["clear"]);
    assert_eq!(json(&clear)["state"], "ready");
    assert!(stderr(&clear).contains(": faults are cleared\n"), "{}", stderr(&clear));
    assert_eq!(on(&["jog", "--rig", &file, "A", "1"]).status.code(), Some(0));
    let home = on(&["home", "--rig", &file]);
    assert_eq!(home.status.code(), Some(0), "{}", stderr(&home));
    assert_eq!(steps(&home), [0.0; 3]);
    assert_eq!(json(&on(&["stop"]))["state"], "ready");
}

#[test]
fn the_help_of_clear_names_the_page_about_faults_by_its_title() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/use/faults.md");
    let page = std::fs::read_to_string(page).unwrap();
    let title = page.lines().next().unwrap().trim_start_matches("# ");
    let help = String::from_utf8(plumb(&["clear", "--help"], Path::new(".")).stdout).unwrap();
    assert!(help.contains(&format!("the book's page \"{title}\"")), "{help}");
}

/// The emergency button is pressed during a jog, and stays pressed for 3 s.
#[test]
fn a_jog_that_ends_in_a_fault_says_what_to_do_next() {
    let rig = Rig::with(&["--emergency-after", "6"]);
    let jog = rig.plumb(&["jog", "A", "200", "--rate", "10"]);
    assert_eq!(jog.status.code(), Some(1), "{}", stderr(&jog));
    let options = format!("--port {}", rig.emulator.port);
    let says = format!(
        "plumb: the board has stopped by itself: the emergency input opened. The motors have no \
         current and the ball falls. End the run if it still goes on. Close the emergency loop, \
         then clear the fault with your hands off the drums. Hang the ball again, and run `plumb \
         home` with it at a known place. `plumb clear {options}` clears it\n"
    );
    assert!(stderr(&jog).ends_with(&says), "{}", stderr(&jog));
    // `plumb home` does not advise itself as another command.
    let home = rig.plumb(&["home"]);
    assert_eq!(home.status.code(), Some(1), "{}", stderr(&home));
    let says = format!(
        "Nothing has moved. Run `plumb clear {options}`, then hang the ball (`plumb jog {options}` \
         winds the cables), then this command with it at a known place\n"
    );
    assert!(stderr(&home).ends_with(&says), "{}", stderr(&home));
    // The fault stands before the run, whose message names the port once.
    let run = rig.plumb(&["run", "--out", "run"]);
    let says = format!("plumb: {}: the board stands in a fault (", rig.emulator.port);
    assert!(stderr(&run).contains(&says), "{run:?}");
}

#[test]
fn keys_that_end_in_a_fault_say_what_to_do_next() {
    let rig = Rig::with(&["--emergency-after", "6"]);
    let mut dialogue = Dialogue::start(&rig);
    dialogue.until("motor A");
    dialogue.until("the board has stopped by itself: the emergency input opened. The motors have");
    dialogue.until(&format!("`plumb clear --port {}` clears it", rig.emulator.port));
    assert_eq!(dialogue.child.wait().unwrap().code(), Some(1));
}

/// `plumb jog` with its keys on a pseudo-terminal.
struct Dialogue {
    child: Child,
    keys: File,
    shown: String,
}

impl Dialogue {
    fn start(rig: &Rig) -> Self {
        let terminal = openpty(None, None).unwrap();
        let child = rig
            .command(&["jog", "--json"])
            .stdin(terminal.slave)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Self { child, keys: File::from(terminal.master), shown: String::new() }
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
    }

    /// Waits until the program has shown `text`. Later calls search what comes after it.
    fn until(&mut self, text: &str) {
        let stderr = self.child.stderr.as_mut().unwrap();
        let mut buffer = [0; 4096];
        loop {
            if let Some((_, rest)) = self.shown.split_once(text) {
                self.shown = rest.to_owned();
                return;
            }
            let count = stderr.read(&mut buffer).unwrap();
            let end = self.shown.len().saturating_sub(300);
            assert!(count > 0, "{text:?} is not in ...{}", &self.shown[end..]);
            self.shown.push_str(&String::from_utf8_lossy(&buffer[..count]));
        }
    }

    /// Presses `q`. Returns the motor positions at the end.
    fn end(mut self) -> Vec<f64> {
        self.press("q");
        let mut rest = Vec::new();
        self.child.stderr.take().unwrap().read_to_end(&mut rest).unwrap();
        let output = self.child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&rest));
        steps(&output)
    }
}

#[test]
fn a_tapped_key_turns_the_selected_motor_a_little() {
    let rig = Rig::new();
    let mut dialogue = Dialogue::start(&rig);
    dialogue.until("The ball falls");
    dialogue.press("b");
    dialogue.until("motor B");
    dialogue.press("+");
    dialogue.until("B 2.00");
    dialogue.until("ready");
    // The letters of an arrow key select no motor.
    dialogue.press("\x1b[A-");
    dialogue.until("B 0.00");
    dialogue.until("ready");
    dialogue.press("c");
    dialogue.until("motor C");
    dialogue.press("-");
    dialogue.until("C -2.00");
    assert_eq!(dialogue.end(), [0.0, 0.0, -2.0]);
}

#[test]
fn a_held_key_turns_a_motor_until_it_is_released() {
    let rig = Rig::new();
    let mut dialogue = Dialogue::start(&rig);
    dialogue.until("motor A");
    for _ in 0..40 {
        dialogue.press("+");
        std::thread::sleep(Duration::from_millis(30));
    }
    dialogue.until("jogging");
    // Nothing is pressed: the motor stops long before the jog of 200 steps ends, which takes 4 s.
    dialogue.until("ready");
    let end = dialogue.end();
    assert!(end[0] > 2.0 && end[0] < 190.0 && end[1..] == [0.0, 0.0], "{end:?}");
}

/// As in another folder than that of the tutorial, whose variable names a file there.
#[test]
fn a_stop_needs_no_rig_file_where_the_port_is_named() {
    let rig = Rig::new();
    let folder = folder();
    let folder = folder.path().to_str().unwrap();
    for (variable, says) in [
        ("none/rig.toml", "none/rig.toml: cannot be read"),
        (folder, "is a folder, but must be a regular file; without it the baud rate is 115200"),
        ("", "since its start 0 damaged frames"),
    ] {
        for command in ["stop", "clear"] {
            let mut command = rig.command(&[command, "--port", &rig.emulator.port]);
            let output = command.env("PLUMB_RIG", variable).output().unwrap();
            assert_eq!(output.status.code(), Some(0), "{variable}: {}", stderr(&output));
            assert!(stderr(&output).contains(says), "{variable}: {}", stderr(&output));
        }
    }
    let mut command = rig.command(&["stop"]);
    command.env("PLUMB_RIG", "none/rig.toml").env_remove("PLUMB_PORT");
    let text = stderr(&command.output().unwrap());
    assert!(
        text.contains("Without a rig file: name the port of the board with --port. "),
        "{text}"
    );
    assert!(text.ends_with(NOT_STOPPED), "{text}");
}

/// The end of the message of a `plumb stop` that has not reached the board.
const NOT_STOPPED: &str = ". `plumb stop` has sent nothing, and the motors may still turn; the \
                           emergency button stops them at once, and the ball falls\n";

#[test]
fn a_stop_that_does_not_reach_the_board_says_that_the_motors_may_turn() {
    let rig = Rig::new();
    let board = Pid::from_raw(i32::try_from(rig.emulator.child.id()).unwrap());
    kill(board, Signal::SIGSTOP).unwrap();
    let gone = ["--port", "/dev/absent"];
    for (arguments, code, says) in [
        (&["stop", "--port", &rig.emulator.port][..], 1, "no answer to the greeting within"),
        (&["stop", gone[0], gone[1]], 2, "there is no such serial port"),
        // A simulated rig.
        (
            &["stop", "--rig", &rig.file, gone[0], gone[1]],
            2,
            "`plumb emulate --link board &` starts",
        ),
    ] {
        let output = plumb(arguments, rig.folder.path());
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        let text = stderr(&output);
        assert!(text.contains(says) && text.ends_with(NOT_STOPPED), "{arguments:?}: {text}");
    }
    kill(board, Signal::SIGCONT).unwrap();
}
