//! The program `plumb-lab`, as a shell starts it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod control;
mod verify;

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs the program in a folder.
fn lab(arguments: &[&str], folder: &Path) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_plumb-lab"));
    program.args(arguments).current_dir(folder).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Returns the only line of results.
fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(output)))
}

/// Numbers far from those of a rig.
const NUMBERS: [&str; 9] = ["0", "-1", "1e-300", "1e308", "-1e308", "nan", "inf", "1e999", "x"];

#[test]
fn no_number_breaks_a_start() {
    for (command, options) in [
        (
            "control --law interval",
            &["--gamma", "--mean", "--first-rig", "--seed", "--targets"][..],
        ),
        ("verify --cells 10", &["--tolerance", "--lambda"]),
        ("verify --cells 10", &["--depth=0.5,", "--width=0.5,", "--apex=0.1,", "--below=0.1,"]),
    ] {
        for option in options {
            for number in NUMBERS {
                let word = match option.ends_with(',') {
                    true => format!("{option}{number}"),
                    false => format!("{option}={number}"),
                };
                let mut line: Vec<&str> = command.split(' ').collect();
                if !command.starts_with("verify") {
                    line.push("--rigs=1");
                }
                line.extend([word.as_str(), "--json"]);
                let output = lab(&line, Path::new("."));
                let (code, text) = (output.status.code(), stderr(&output));
                assert!(matches!(code, Some(0..=2)), "{line:?}: {code:?}: {text}");
                assert_eq!(code == Some(2), json(&output)["exit_code"] == 2, "{line:?}: {text}");
            }
        }
    }
}

#[test]
fn a_result_that_cannot_be_written_is_an_error_and_a_reader_that_has_gone_is_none() {
    let run = |stdout: std::process::Stdio| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_plumb-lab"));
        program.args(["verify", "--cells", "10000", "--json"]).stdout(stdout).output().unwrap()
    };
    let full = std::fs::File::create("/dev/full").unwrap();
    let output = run(full.into());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("cannot be written: No space left"), "{}", stderr(&output));
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    assert_eq!(run(writer.into()).status.code(), Some(0));
}
