//! Numbers of the command line: every numeric option of every command, as the parser lists them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::any::TypeId;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Arg, CommandFactory};
use nalgebra::{Point2, Point3};
use plumb_calibrate::board::CharucoSheet;
use plumb_vision::image::ImageSize;
use tempfile::TempDir;

use super::watch::Watch;
use super::{Cli, NO_PORT, NUMBERS, begin_line};

/// Number of a command line.
struct Number {
    /// Command, as in "board save".
    command: String,
    /// Name of the option with its dashes, or of the argument.
    name: String,
    help: String,
    /// Name of the value, as in "X,Y,Z".
    value_name: String,
    is_positional: bool,
}

/// Arguments that are texts, and hold numbers.
const NUMBERS_IN_TEXT: [(&str, &str); 1] = [("jog", "distance")];

/// Returns whether the values of an argument are numbers.
fn is_number(command: &str, arg: &Arg) -> bool {
    let numbers = [
        TypeId::of::<f64>(),
        TypeId::of::<u8>(),
        TypeId::of::<u16>(),
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
        TypeId::of::<CharucoSheet>(),
        TypeId::of::<Point2<f64>>(),
        TypeId::of::<Point3<f64>>(),
        TypeId::of::<[f64; 3]>(),
        TypeId::of::<ImageSize>(),
    ];
    let parser = arg.get_value_parser();
    let is_known = numbers.iter().any(|number| parser.type_id() == *number);
    is_known || NUMBERS_IN_TEXT.contains(&(command, arg.get_id().as_str()))
}

/// Returns whether the values of an argument are no numbers.
fn is_text(arg: &Arg) -> bool {
    let texts = [TypeId::of::<String>(), TypeId::of::<PathBuf>(), TypeId::of::<bool>()];
    let parser = arg.get_value_parser();
    !arg.get_possible_values().is_empty()
        || texts.iter().any(|text| parser.type_id() == *text)
        || TEXTS.contains(&arg.get_id().as_str())
}

/// Arguments of other types that are no numbers.
const TEXTS: [&str; 9] = [
    "law",
    "paper",
    "stream",
    "what",
    "page_address",
    "foxglove_address",
    "mcap",
    "ros2_interface",
    "shell",
];

/// Returns the numbers of a command and of those below it.
fn numbers(path: &str, command: &clap::Command, found: &mut Vec<Number>) {
    for arg in command.get_arguments().filter(|arg| arg.get_action().takes_values()) {
        if is_number(path, arg) {
            let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string);
            found.push(Number {
                command: path.to_owned(),
                name: arg.get_long().map_or(arg.get_id().to_string(), |long| format!("--{long}")),
                help: help.unwrap_or_default(),
                value_name: arg.get_value_names().unwrap_or_default().join(" "),
                is_positional: arg.is_positional(),
            });
        } else {
            assert!(is_text(arg), "{path} {}: is it a number?", arg.get_id());
        }
    }
    for sub in command.get_subcommands().filter(|sub| sub.get_name() != "help") {
        numbers(format!("{path} {}", sub.get_name()).trim(), sub, found);
    }
}

/// Returns every number of the command line.
fn all() -> Vec<Number> {
    let mut found = Vec::new();
    let mut cli = Cli::command();
    cli.build();
    numbers("", &cli, &mut found);
    found
}

/// Files of the commands.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
        let rig = fs::read_to_string(rigs.join("paper.toml")).unwrap();
        // A calibration starts up to its first picture.
        let blind = rig.replace("[camera]\n", "[camera]\nsource = \"openni\"\n");
        assert!(blind != rig, "{rig}");
        let uart = rig.replace("\"a4988\"", "{ tmc2209-uart = { run_current = 0.8 } }");
        fs::write(folder.path().join("uart.toml"), uart).unwrap();
        fs::write(folder.path().join("rig.toml"), rig).unwrap();
        let lens = "K: [[600, 0, 320], [0, 600, 240], [0, 0, 1]]\nD: [0, 0, 0, 0]\n";
        fs::write(folder.path().join("lens.yaml"), lens).unwrap();
        fs::write(folder.path().join("blind.toml"), blind).unwrap();
        fs::copy(rigs.join("camera.toml"), folder.path().join("camera.toml")).unwrap();
        let firmware = plumb_image::uf2::file(&plumb_image::chip::RP2040, &[0; 256]);
        fs::write(folder.path().join("plumb.uf2"), firmware).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    /// Returns a path that does not exist yet.
    fn fresh(&self) -> String {
        static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
        self.path(&format!("new-{}", COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed)))
    }

    /// Returns the lines with which a command is tried: with what its options need.
    fn lines(&self, command: &str) -> Vec<Vec<String>> {
        let (rig, blind, new) = (self.path("rig.toml"), self.path("blind.toml"), self.fresh());
        let text = match command {
            "demo" => "demo --law interval --follow spline".to_owned(),
            "run" => format!("run --rig {rig} --port {NO_PORT}"),
            "follow" => format!("follow --rig {rig} spline --port {NO_PORT}"),
            "goto" => format!("goto --rig {rig} 0.4 0.3 0.2 --port {NO_PORT}"),
            "jog" => format!("jog --rig {rig} A 20 --port {NO_PORT}"),
            "hold" => format!("hold --rig {rig} --port {NO_PORT}"),
            "home" => format!("home --rig {rig} --port {NO_PORT}"),
            "check" => format!("check --rig {rig} --yes --port {NO_PORT}"),
            "stop" | "clear" => format!("{command} --port {NO_PORT}"),
            "board save" => format!("board save --rig {rig} --port {NO_PORT}"),
            "board status" | "board bootloader" => format!("{command} --port {NO_PORT}"),
            "board flash" => format!("{command} {} --port {NO_PORT}", self.path("plumb.uf2")),
            "report" => format!("report --port {NO_PORT} --out {new}"),
            "init" => format!("init {new} --yes"),
            "calibrate" => {
                let motors = "--motors --pixel 100,100 --pixel 500,100 --pixel 300,50";
                return [
                    format!("calibrate --rig {blind} --board"),
                    format!("calibrate --rig {blind} {motors}"),
                    format!("calibrate --rig {blind} --ball --place 0.4,0.3,0.2"),
                    format!("calibrate --rig {blind} --lens"),
                    format!("calibrate --rig {rig} --import {}", self.path("lens.yaml")),
                ]
                .map(|line| words(&line))
                .into();
            }
            "emulate" => {
                format!("emulate --rig {} --lost=0.1 --driver-trouble=hot", self.path("uart.toml"))
            }
            other => other.to_owned(),
        };
        vec![words(&text)]
    }
}

fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(str::to_owned).collect()
}

impl Number {
    /// Returns the ways to write `value` beside usual values: of one number, and of several with
    /// commas between them.
    fn written(&self, value: &str) -> Vec<String> {
        let shapes: &[&str] = match (self.value_name.split(',').count(), self.name.as_str()) {
            (2, _) => &["V,0.5", "0.1,V"],
            (3, _) => &["V,0.5,0.5", "0.5,V,0.5", "0.5,0.5,V"],
            (_, "distance") => &["V", "Vmm"],
            (_, "--import-size") => &["Vx480", "640xV"],
            _ => &["V"],
        };
        shapes.iter().map(|shape| shape.replace('V', value)).collect()
    }

    /// Returns a line with this word for the number, in place of the line's own.
    fn line(&self, base: &[String], word: &str) -> Vec<String> {
        let mut line = base.to_vec();
        if self.is_positional {
            // The rig file comes first, the words before it name the command.
            let first = line.iter().position(|word| word.ends_with(".toml")).unwrap() + 1;
            let place = ["motor", "distance"].iter().position(|name| *name == self.name);
            let place = place.or(["x", "y", "z"].iter().position(|name| *name == self.name));
            word.clone_into(&mut line[first + place.unwrap()]);
        } else {
            line.retain(|word| !word.starts_with(&format!("{}=", self.name)));
            line.push(format!("{}={word}", self.name));
        }
        line
    }

    /// Tries `value`. Returns whether the parser takes it in some way, and its errors.
    fn try_value(&self, folder: &Folder, value: &str, watch: &mut Watch) -> (bool, Vec<String>) {
        let (mut is_taken, mut errors) = (false, Vec::new());
        for base in folder.lines(&self.command) {
            for word in self.written(value) {
                let line = self.line(&base, &word);
                let name = line.join(" ");
                match watch.start(&name, move || begin_line(&line)) {
                    Some(Ok(end)) => {
                        is_taken = true;
                        errors.push(end);
                    }
                    Some(Err(error)) => errors.push(error),
                    None => {}
                }
            }
        }
        (is_taken, errors)
    }
}

#[test]
fn no_number_of_the_command_line_breaks_a_start() {
    let (folder, mut watch) = (Folder::new(), Watch::begin());
    let all = all();
    assert!(all.len() > 60, "{}", all.len());
    for number in &all {
        let mut is_taken = false;
        for value in NUMBERS {
            is_taken |= number.try_value(&folder, value, &mut watch).0;
        }
        // With --ros2, which this option needs, a command would join the network.
        let is_tried = number.name != "--ros2-domain";
        // Else the lines of the command lack what the option needs.
        assert!(is_taken || !is_tried, "{} {} takes no number", number.command, number.name);
    }
    watch.end();
}

/// Returns the ranges that the errors about `nan` name.
fn ranges(number: &Number, folder: &Folder, watch: &mut Watch) -> Vec<String> {
    let (_, errors) = number.try_value(folder, "nan", watch);
    let mut ranges: Vec<String> = errors.iter().filter_map(|error| range(error)).collect();
    ranges.sort();
    ranges.dedup();
    ranges
}

/// Returns the range that an error names: "must be a number, 0 to 1 m".
fn range(error: &str) -> Option<String> {
    let (_, range) = error.split_once("must be ")?;
    let range = range.split(['\n', ';']).next().unwrap_or_default();
    let range = range.trim_start_matches("a whole number, ").trim_start_matches("a number, ");
    range.contains("to ").then(|| range.trim().to_owned())
}

/// The page has a row for each option, with its commands and its range. This test prints them.
#[test]
fn help_and_page_name_the_range_of_every_number() {
    let (folder, mut watch) = (Folder::new(), Watch::begin());
    let mut rows: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    for number in all() {
        let ranges = ranges(&number, &folder, &mut watch);
        let name = format!("{} {}", number.command, number.name);
        let [range] = &ranges[..] else {
            panic!("{name}: no single range in its errors: {ranges:?}")
        };
        let help = number.help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(help.contains(range.as_str()), "{name}: its help lacks `{range}`: {help}");
        let shown = if number.is_positional { number.name.to_uppercase() } else { number.name };
        rows.entry((shown, range.clone())).or_default().push(number.command);
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/use/commands.md");
    let page = fs::read_to_string(page).unwrap();
    let row = |((name, range), commands): (&(String, String), &Vec<String>)| {
        format!("| `{name}` | {} | {range} |", commands.join(", "))
    };
    let expected: Vec<String> = rows.iter().map(row).collect();
    let missing: Vec<&String> = expected.iter().filter(|row| !page.contains(*row)).collect();
    assert!(missing.is_empty(), "docs/use/commands.md lacks some of\n{}", expected.join("\n"));
    watch.end();
}
