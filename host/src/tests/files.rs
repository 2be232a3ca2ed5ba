//! Numbers of files: every key of the rig file and of the camera file as their pages list them, and
//! every number of the other files.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::{Path, PathBuf};

use plumb_cameras::camera_file;
use plumb_config::reference::{Key, keys};
use plumb_protocol::Wiring;
use plumb_runtime::rig::{self, LawSettings};
use plumb_sim::cosim::{Cosim, Request};
use plumb_sim::limits::RigLimits;
use tempfile::TempDir;
use toml::{Table, Value};

use super::watch::Watch;
use super::{NO_PORT, NUMBERS, begin_line};

/// A file whose keys a page lists.
struct Format {
    keys: Vec<Key>,
    /// Contents to which a key is added.
    base: Table,
    /// Tables of which a file has one at most.
    choices: &'static [&'static str],
}

impl Format {
    fn new(page: &str, base: &str, choices: &'static [&'static str]) -> Self {
        Self { keys: keys(page), base: base.parse().unwrap(), choices }
    }

    /// Returns the value of a key on the page; of a number without one 1.
    fn example(key: &Key) -> Option<Value> {
        let is_number = !key.unit.is_empty() || key.range.starts_with("above");
        let text = if key.value.is_empty() && is_number { "1.0" } else { &key.value };
        let table: Table = format!("x = {text}").parse().ok()?;
        table.get("x").cloned()
    }

    /// Returns the base with the keys of the table that `key` is in.
    fn with_table(&self, key: &Key) -> Table {
        let mut contents = self.base.clone();
        let table = key.name.rsplit_once('.').map_or("", |(table, _)| table);
        if let Some(choice) = self.choices.iter().find(|choice| table.starts_with(&***choice)) {
            remove(&mut contents, choice);
        }
        for other in &self.keys {
            let is_beside = other.name.rsplit_once('.').is_some_and(|(it, _)| it == table);
            if is_beside && !table.is_empty() && get(&contents, &other.name).is_none() {
                let example = Self::example(other).filter(|_| !other.value.is_empty());
                if let Some(example) = example {
                    set(&mut contents, &other.name, example);
                }
            }
        }
        contents
    }

    /// Returns the texts of the file with `number` in each place for a number, and their names.
    fn texts(&self, number: &Value) -> Vec<(String, String)> {
        let mut texts = Vec::new();
        for key in &self.keys {
            let Some(example) = Self::example(key) else { continue };
            for (place, value) in replaced(&example, number).into_iter().enumerate() {
                let mut contents = self.with_table(key);
                set(&mut contents, &key.name, value);
                let name = format!("{} number {place} = {number}", key.name);
                texts.push((name, contents.to_string()));
            }
        }
        texts
    }
}

/// Returns the value of a dotted key.
fn get<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    match key.split_once('.') {
        Some((first, rest)) => get(table.get(first)?.as_table()?, rest),
        None => table.get(key),
    }
}

/// Sets the value of a dotted key.
fn set(table: &mut Table, key: &str, value: Value) {
    let Some((first, rest)) = key.split_once('.') else {
        table.insert(key.to_owned(), value);
        return;
    };
    let inner = table.entry(first).or_insert_with(|| Table::new().into());
    if !inner.is_table() {
        *inner = Table::new().into();
    }
    set(inner.as_table_mut().unwrap(), rest, value);
}

/// Removes a dotted key.
fn remove(table: &mut Table, key: &str) {
    match key.split_once('.') {
        Some((first, rest)) => {
            if let Some(inner) = table.get_mut(first).and_then(Value::as_table_mut) {
                remove(inner, rest);
            }
        }
        None => drop(table.remove(key)),
    }
}

/// Returns the values with `number` in place of each of the numbers of `value`.
fn replaced(value: &Value, number: &Value) -> Vec<Value> {
    match value {
        Value::Integer(_) | Value::Float(_) => vec![number.clone()],
        Value::Array(items) => {
            let at = |(i, item): (usize, &Value)| -> Vec<Value> {
                let with = |new| {
                    let mut items = items.clone();
                    items[i] = new;
                    Value::Array(items)
                };
                replaced(item, number).into_iter().map(with).collect()
            };
            items.iter().enumerate().flat_map(at).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns numbers that a TOML file can have.
fn toml_numbers() -> Vec<Value> {
    let number = |text: &str| format!("x = {text}").parse::<Table>().ok()?.remove("x");
    let tried = NUMBERS.iter().filter(|text| !["0.3", "7", "1000"].contains(text));
    let mut numbers: Vec<Value> = tried.filter_map(|text| number(text)).collect();
    numbers.extend([i64::MAX, i64::MIN].map(Value::Integer));
    numbers
}

/// Folder with the files of a rig.
struct Files(TempDir);

impl Files {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, text).unwrap();
        path
    }

    /// Begins the commands of a rig file that use the key in `name`. All commands read the files
    /// with the same code.
    fn begin(&self, name: &str, rig: &Path, watch: &mut Watch) {
        let file = rig.to_str().unwrap();
        let mut lines = vec![
            format!("check {file} --file-only"),
            format!("follow {file} circle --loop --port {NO_PORT}"),
        ];
        match name.split('.').next().unwrap_or_default() {
            "workspace" | "motors" | "path" => {
                lines.push(format!("follow {file} square --tolerance 0 --port {NO_PORT}"));
            }
            "size" | "jog" => lines.push(format!("jog {file} A 20mm --port {NO_PORT}")),
            "simulation" => lines.push(format!("emulate {file}")),
            _ => {}
        }
        for line in lines {
            let words = line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            watch.start(&format!("{name}: {line}"), move || begin_line(&words));
        }
    }
}

const PAPER: &str = include_str!("../../rigs/paper.toml");

#[test]
fn no_number_of_a_rig_file_breaks_a_start() {
    let (files, mut watch) = (Files::new(), Watch::begin());
    let format = Format::new(rig::REFERENCE, PAPER, &["law", "motors.driver"]);
    files.write("camera.toml", camera_file::PAPER);
    let mut count = 0;
    for number in toml_numbers() {
        for (name, text) in format.texts(&number) {
            let file = files.write("rig.toml", &text);
            files.begin(&name, &file, &mut watch);
            count += 1;
        }
    }
    assert!(count > 1400, "{count}");
    watch.end();
}

#[test]
fn no_number_of_a_camera_file_breaks_a_start() {
    let (files, mut watch) = (Files::new(), Watch::begin());
    let format = Format::new(camera_file::REFERENCE, camera_file::PAPER, &[]);
    let rig = files.write("rig.toml", PAPER);
    for number in toml_numbers() {
        for (name, text) in format.texts(&number) {
            files.write("camera.toml", &text);
            files.begin(&name, &rig, &mut watch);
        }
    }
    watch.end();
}

/// Returns the texts of a file of numbers between commas or brackets with `number` in place of
/// each.
fn with(text: &str, number: &str) -> Vec<String> {
    let is_part = |c: char| c.is_ascii_digit() || ".-".contains(c);
    let mut texts = Vec::new();
    let mut rest = 0;
    while let Some(begin) = text[rest..].find(|c: char| c.is_ascii_digit()).map(|at| rest + at) {
        let end = text[begin..].find(|c| !is_part(c)).map_or(text.len(), |length| begin + length);
        texts.push(format!("{}{number}{}", &text[..begin], &text[end..]));
        rest = end;
    }
    texts
}

#[test]
fn no_number_of_another_file_breaks_a_start() {
    let (files, mut watch) = (Files::new(), Watch::begin());
    let rig = files.write("rig.toml", PAPER);
    files.write("camera.toml", camera_file::PAPER);
    let rig = rig.to_str().unwrap();
    let columns = plumb_log::columns();
    let row = vec!["0.5"; columns.len()];
    let log = format!("{}\n{}\n", columns.join(","), row.join(","));
    let figures = r#"{"title": "taut", "threshold_m": 0.01, "motors_m": [[0.8, 0.6, 0.6],
                      [0.8, 0.1, 0.6], [0.1, 0.2, 0.6]]}"#;
    files.write("figures.json", figures);
    files.write("run.csv", &log);
    let folder = files.0.path().to_str().unwrap();
    for (name, text, line) in [
        (
            "path.csv",
            "x,y,z\n0.4,0.3,0.2\n0.5,0.3,0.2\n0.5,0.4,0.2\n",
            format!("follow {rig} FILE"),
        ),
        ("path.csv", "x,y,z\n0.4,0.3,0.2\n0.5,0.3,0.2\n", format!("follow {rig} --loop FILE")),
        (
            "timed.csv",
            "t,x,y,z\n0,0.4,0.3,0.2\n5,0.5,0.3,0.2\n9,0.5,0.4,0.2\n",
            format!("follow {rig} FILE"),
        ),
        (
            "way.csv",
            "x,y,z,dwell,tolerance\n0.4,0.3,0.2,1,0.02\n0.5,0.3,0.2\n",
            format!("follow {rig} FILE"),
        ),
        ("run.csv", &log, format!("plot {folder}")),
        ("figures.json", figures, format!("plot {folder}")),
    ] {
        for number in NUMBERS {
            for (place, text) in with(text, number).into_iter().enumerate() {
                let file = files.write(name, &text);
                let mut words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
                let named = words.iter_mut().filter(|word| *word == "FILE");
                named.for_each(|word| file.to_str().unwrap().clone_into(word));
                if words[0] == "run" {
                    words.extend(["--port", NO_PORT].map(str::to_owned));
                }
                let name = format!("{name} number {place} = {number}");
                watch.start(&name, move || begin_line(&words));
            }
        }
        files.write(name, text);
    }
    watch.end();
}

fn cosim() -> Cosim {
    let law = LawSettings::default();
    let mean = law.mean().config("mean").unwrap();
    let config = RigLimits::default().config(law.config(3).unwrap(), mean, 0.010);
    Cosim::new(Wiring::example(), config, None).unwrap()
}

#[test]
fn no_number_of_a_request_breaks_a_co_simulation() {
    let mut watch = Watch::begin();
    let request = r#"{"t": 0.5, "dt": 0.1, "position": [0.4, 0.3, 0.2], "age": 0.01,
                      "target": [0.5, 0.3, 0.2], "target_velocity": [0.1, 0.1, 0.1]}"#;
    let mut count = 0;
    for number in NUMBERS {
        for (place, text) in with(request, number).into_iter().enumerate() {
            let name = format!("cosim number {place} = {number}");
            let mut cosim = cosim();
            watch.start(&name, move || {
                let request = serde_json::from_str::<Request>(&text);
                request.ok().map(|request| cosim.step(&request, 1).map_err(|it| it.to_string()))
            });
            count += 1;
        }
    }
    assert!(count > 180, "{count}");
    watch.end();
}
