//! docs/use/tutorial.md against the program: its commands are run, and their output is
//! compared with the page.
//!
//! A `sh` block is run by bash, in a folder of its own. The `text` block behind it, if there is
//! one, is its output. In a line with a decimal point, and in a line about pictures, every number
//! may differ.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::common::{folder, patient};
use serde_json::Value;

const PAGE: &str = include_str!("../../../../docs/use/tutorial.md");

/// What the program says where a measurement is spoilt, as by a busy computer.
const SPOILT: &str = "could not be told";

/// How often commands are run again for that, at most.
const MOST_REPEATS: u32 = 8;

/// Commands of the page with their output.
struct Block {
    commands: String,
    /// `None` where the page shows no output.
    output: Option<String>,
}

/// Returns the blocks of the page in their order.
fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for (number, part) in page.split("```").enumerate() {
        let Some((language, text)) = part.split_once('\n').filter(|_| number % 2 == 1) else {
            continue;
        };
        match language {
            "sh" => blocks.push(Block { commands: text.to_owned(), output: None }),
            "text" => blocks.last_mut().unwrap().output = Some(text.to_owned()),
            other => panic!("a block in the language {other}"),
        }
    }
    blocks
}

/// Shell with the environment of the page so far.
struct Shell<'a> {
    folder: &'a Path,
    environment: String,
    background: Vec<Child>,
}

impl Shell<'_> {
    /// Runs the commands of a block. Returns what they print.
    fn run(&mut self, commands: &str) -> String {
        let is_export = |line: &&str| line.starts_with("export ");
        for line in commands.lines().filter(is_export) {
            self.environment.push_str(&format!("{line}\n"));
        }
        if let Some(command) = commands.trim_end().strip_suffix('&') {
            self.start(command.trim_end());
            return String::new();
        }
        let output = self.bash(&format!("{{ {commands}\n}} 2>&1")).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Runs commands, and again where a measurement is spoilt.
    fn run_undisturbed(&mut self, commands: &str) -> String {
        let mut printed = self.run(commands);
        for _ in 0..MOST_REPEATS {
            if !printed.contains(SPOILT) {
                break;
            }
            printed = self.run(commands);
        }
        printed
    }

    /// Starts a command that stays, and waits for the file that it links.
    fn start(&mut self, command: &str) {
        // The simulation is as quick as the computer.
        let mut child = self.bash(&format!("exec {command} --pace 100"));
        let log = fs::File::create(self.folder.join("background.log")).unwrap();
        let child = child.stdout(Stdio::null()).stderr(log).spawn().unwrap();
        self.background.push(child);
        let link = self.folder.join(command.split_whitespace().last().unwrap());
        let exists = (0..500).any(|_| {
            std::thread::sleep(Duration::from_millis(20));
            link.exists()
        });
        assert!(exists, "{command}: no {}", link.display());
    }

    fn bash(&self, commands: &str) -> Command {
        let program = Path::new(env!("CARGO_BIN_EXE_plumb")).parent().unwrap();
        let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
        let mut bash = Command::new("bash");
        bash.arg("-c").arg(format!("{}{commands}", self.environment));
        bash.current_dir(self.folder).env("PATH", path).stdin(Stdio::null());
        bash
    }
}

impl Drop for Shell<'_> {
    fn drop(&mut self) {
        for child in &mut self.background {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Returns the text with `#` for the numbers that may differ.
fn without_measurements(text: &str) -> String {
    let lines = text.lines().map(|line| {
        let characters: Vec<char> = line.chars().collect();
        let is_decimal = characters
            .windows(3)
            .any(|w| w[0].is_ascii_digit() && w[1] == '.' && w[2].is_ascii_digit());
        if is_decimal || line.contains("pictures") { without_numbers(line) } else { line.into() }
    });
    lines.collect::<Vec<String>>().join("\n")
}

/// Returns the line with `#` for each number with its sign.
fn without_numbers(line: &str) -> String {
    let mut out = String::new();
    for character in line.chars() {
        let is_inside = out.ends_with('#');
        match character {
            '0'..='9' if is_inside => {}
            '.' if is_inside => {}
            '0'..='9' => {
                if out.ends_with('-') {
                    out.pop();
                }
                out.push('#');
            }
            other => out.push(other),
        }
    }
    out
}

#[test]
fn the_commands_of_the_tutorial_print_what_the_page_says() {
    let folder = folder();
    let mut shell =
        Shell { folder: folder.path(), environment: String::new(), background: Vec::new() };
    let rig = folder.path().join("rig.toml");
    for Block { commands, output } in blocks(PAGE) {
        let printed = shell.run_undisturbed(&commands);
        if let Some(expected) = output {
            let (printed, expected) =
                (without_measurements(&printed), without_measurements(&expected));
            let background = || fs::read_to_string(folder.path().join("background.log"));
            assert_eq!(printed, expected, "after: {commands}{:?}", background());
        }
        if commands.starts_with("plumb init") {
            // Deadlines that a busy machine keeps.
            fs::write(&rig, patient(fs::read_to_string(&rig).unwrap())).unwrap();
        }
    }
    let summary = fs::read_to_string(folder.path().join("runs/run-0001/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!((&summary["reached"], &summary["targets_reached"]), (&true.into(), &20.into()));
}

#[test]
fn only_measured_numbers_may_differ() {
    let line = "output A, 32 steps: the ball moves by (3.0, -10.7, 11.0) mm";
    assert_eq!(without_measurements(line), "output A, # steps: the ball moves by (#, #, #) mm");
    assert_eq!(
        without_measurements("exit code 1\nseen in 5 of 6 pictures"),
        "exit code 1\nseen in # of # pictures"
    );
}
