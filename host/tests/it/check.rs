//! `plumb check RIG.toml`: every mistake of a rig file at once, and a rig that does not move before
//! a yes. tutorial.rs tries the jogs.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

use nix::pty::openpty;
use nix::sys::signal::Signal;

use crate::common::{Emulator, folder, json, patient, plumb, program, rig_file, send, stderr};

#[test]
fn every_mistake_is_reported_with_exit_code_2() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| {
        let text = text.replace("microsteps = 16", "microsteps = 17");
        let text = text.replace("travel = [-1000, 1500]", "travel = [1500, -1000]");
        let law = "[law.interval]\ngamma = 30.0\nalpha = 0.7\nbeta = 0.5\n\n[motors]";
        text.replace("[motors]", law)
    });
    let output = plumb(&["check", "--rig", &rig, "--file-only", "--json"], folder.path());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    for expected in [
        "`motors.microsteps = 17` is out of range",
        "`motors.travel = [1500, -1000]` must have the lower limit first: write [-1000, 1500]",
        "`law.interval.alpha = 0.7`, `law.interval.beta = 0.5` is out of range",
        "rig.toml: 3 errors, 0 warnings",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    let line = json(&output);
    assert_eq!(line["errors"], 3);
    assert_eq!(line["findings"][0]["severity"], "error");
}

#[test]
fn a_file_without_an_error_has_exit_code_0() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let output = plumb(&["check", "--rig", &rig, "--file-only"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("0 errors, 1 warning"), "{}", stderr(&output));
}

#[test]
fn a_run_without_targets_is_refused_before_the_board_is_configured() {
    let folder = folder();
    let targets = "targets = [[0.400, 0.400, 0.150]]";
    let rig = rig_file(folder.path(), |text| text.replace(targets, "targets = []"));
    let emulator = Emulator::start();
    let output = plumb(&["run", "--rig", &rig, "--port", &emulator.port], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("`targets = []` has no target"), "{}", stderr(&output));
}

#[test]
fn a_run_answers_a_mistake_in_the_words_of_the_check() {
    let folder = folder();
    for (right, wrong, says) in [
        (
            "targets = [[0.400, 0.400, 0.150]]",
            "targets = [0.4, 0.4, 0.15]",
            "`targets = [0.4, 0.4, 0.15]` is wrong: ",
        ),
        ("microsteps = 16", "microsteps = \"16\"", "`motors.microsteps = \"16\"` is wrong: "),
        ("microsteps = 16", "microsteps = [16]", "; allowed: 1, 2, 4, 8, 16, for example 16"),
        (
            "max_rate = 400.0",
            "max_rat = 400.0",
            "`motors.max_rat` is wrong: unknown field `max_rat`, expected one of ",
        ),
    ] {
        let rig = rig_file(folder.path(), |text| text.replacen(right, wrong, 1));
        for command in [
            &["run", "--rig", &rig][..],
            &["goto", "--rig", &rig, "0.4", "0.3", "0.2"],
            &["check", "--rig", &rig, "--file-only"],
        ] {
            let output = plumb(command, folder.path());
            let text = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{command:?}: {text}");
            assert!(text.contains(says) && !text.contains("?."), "{command:?}: {text}");
        }
    }
}

#[test]
fn a_deadline_below_the_age_of_a_position_is_one_mistake() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text.replace("position = 0.5", "position = 0.05"));
    let text = stderr(&plumb(&["check", "--rig", &rig, "--file-only"], folder.path()));
    assert!(
        text.contains("`deadlines.max_age = 0.25` is not below `deadlines.position`"),
        "{text}"
    );
    assert!(text.contains(": 1 error, "), "{text}");
}

#[test]
fn an_empty_port_of_the_rig_file_is_named() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| {
        let lines = text.lines().map(|line| match line.starts_with("port = ") {
            true => "port = \"\"".to_owned(),
            false => line.to_owned(),
        });
        lines.collect::<Vec<_>>().join("\n")
    });
    for (command, says) in [
        (
            &["check", "--rig", &rig, "--file-only"][..],
            "is no path: name the port of the board, such as",
        ),
        (
            &["home", "--rig", &rig],
            "plumb: `board.port` of the rig file is empty: name the port of the",
        ),
    ] {
        let text = stderr(&plumb(command, folder.path()));
        assert!(text.contains(says), "{text}");
    }
}

#[test]
fn targets_beside_the_motors_and_below_the_floor_are_refused() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let emulator = Emulator::start();
    for [x, y, z] in [["0.4", "-0.1", "0.3"], ["0.4", "0.3", "-0.05"]] {
        let goto = ["goto", "--rig", &rig, x, y, z, "--port", &emulator.port];
        let output = plumb(&goto, folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains("outside the workspace"), "{}", stderr(&output));
    }
}

#[test]
fn nothing_moves_before_a_yes() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let emulator = Emulator::start();
    let output =
        plumb(&["check", "--rig", &rig, "--port", &emulator.port, "--json"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let error = json(&output)["error"].as_str().unwrap_or_default().to_owned();
    assert!(error.ends_with("? Nobody can be asked on this input: say yes with --yes"), "{error}");
    let status = plumb(&["board", "status", "--port", &emulator.port], folder.path());
    let text = stderr(&status) + &String::from_utf8_lossy(&status.stdout);
    assert!(text.contains("unconfigured"), "{text}");
}

#[test]
fn a_file_with_an_error_is_not_tried_on_the_rig() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text.replace("microsteps = 16", "microsteps = 17"));
    let output = plumb(&["check", "--rig", &rig, "--yes", "--port", "absent"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(!stderr(&output).contains("absent"), "{}", stderr(&output));
}

/// Without a terminal nobody can be asked; a person may say no.
#[test]
fn a_check_without_a_yes_moves_nothing_and_says_why() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let check = ["check", "--rig", &rig, "--port", &emulator.port];
    let output = program(&check, folder.path()).output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    let nobody = "? Nobody can be asked on this input: say yes with --yes\n";
    assert!(text.ends_with(nobody), "{text}");
    let terminal = openpty(None, None).unwrap();
    File::from(terminal.master.try_clone().unwrap()).write_all(b"n\n").unwrap();
    let output = program(&check, folder.path()).stdin(terminal.slave).output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.ends_with("plumb: nothing has moved: the check goes on after a yes only\n"),
        "{text}"
    );
}

/// The board's process is stopped, so that the check waits for its greeting when the signal comes.
#[test]
fn a_signal_before_a_check_moves_nothing_and_says_so() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    send(&emulator.child, Signal::SIGSTOP);
    let check = ["check", "--rig", &rig, "--port", &emulator.port, "--yes", "-vv"];
    let mut check = program(&check, folder.path()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(check.stderr.take().unwrap()).lines().map(Result::unwrap);
    let waits = lines.find(|line| line.contains("no answer from the board: sending"));
    assert!(waits.is_some(), "the check has ended");
    send(&check, Signal::SIGINT);
    assert!(lines.any(|line| line.contains("Ctrl-C again")));
    send(&emulator.child, Signal::SIGCONT);
    let last = lines.last().unwrap();
    assert_eq!(last, "plumb: interrupted before the check began: nothing was moved");
    assert_eq!(check.wait().unwrap().code(), Some(1));
}
