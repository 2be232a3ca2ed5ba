//! The pages of the rig file and the camera file against the program: every key, its default, the
//! names that it may have, and its range.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use plumb_cameras::camera_file;
use plumb_config::toml_file::parse_toml;
use plumb_core::params::Params;
use plumb_emulator::EMULATED;
use plumb_runtime::rig::Rig;

/// A name that no file format has.
const UNKNOWN: &str = "unknown_key";

/// What a page says about leaving a key out.
enum Absent {
    /// It cannot be left out; an example.
    Error(String),
    /// It then has this value.
    Default(String),
    /// It then has no value.
    Nothing,
}

/// A row of a reference page.
struct Row {
    key: String,
    /// Unit; empty for none.
    unit: String,
    range: String,
    absent: Absent,
}

impl Row {
    /// Returns the row of a table line that begins with a key.
    fn parse(line: &str) -> Option<Self> {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let key = cells.get(1)?.strip_prefix('`')?.strip_suffix('`')?.to_owned();
        let value = |cell: &str| cell.split('`').nth(1).unwrap_or_default().to_owned();
        let absent = match cells[4] {
            "none" => Absent::Nothing,
            cell if cell.starts_with("required") => Absent::Error(value(cell)),
            cell => Absent::Default(value(cell)),
        };
        let unit = if cells[2] == "1" { "" } else { cells[2] }.to_owned();
        Some(Self { key, unit, range: cells[3].to_owned(), absent })
    }

    /// Returns the line of a file that has the example; `None` for a key that may be left out.
    fn example(&self) -> Option<String> {
        match &self.absent {
            Absent::Error(example) => Some(format!("{} = {example}", self.key)),
            _ => None,
        }
    }

    /// Returns the line of a file that has the example or default with `number` in place of each of
    /// its numbers; a key without one has a number.
    fn with(&self, number: f64) -> String {
        let value = match &self.absent {
            Absent::Error(value) | Absent::Default(value) => value.as_str(),
            Absent::Nothing => "1",
        };
        let separators = ['[', ']', ',', ' '];
        let written = value.split_inclusive(separators).map(|part| {
            let word = part.trim_end_matches(separators);
            let is_number = word.parse::<f64>().is_ok();
            if is_number { part.replacen(word, &number.to_string(), 1) } else { part.to_owned() }
        });
        format!("{} = {}", self.key, written.collect::<String>())
    }

    /// Returns whether the row has the range of the key's type. `range` is that range with its
    /// unit, such as "above 0, to 5 s". In the row, words may follow behind a comma or "and".
    fn has_range(&self, range: &str) -> bool {
        let number = match self.unit.as_str() {
            "" | "the driver's" => Some(range),
            unit => range.strip_suffix(unit).and_then(|range| range.strip_suffix(' ')),
        };
        let rest = number.and_then(|number| self.range.strip_prefix(number));
        rest.is_some_and(|rest| {
            rest.is_empty() || rest.starts_with(", ") || rest.starts_with(" and ")
        })
    }

    /// Returns the names that the range lists in quotes.
    fn names(&self) -> BTreeSet<String> {
        self.range.split('"').skip(1).step_by(2).map(str::to_owned).collect()
    }
}

/// Returns the number that a text begins with.
fn number(text: &str) -> Option<f64> {
    text.split([' ', ',']).next()?.parse().ok()
}

/// Numbers inside a range and outside it.
#[derive(Debug, Default, PartialEq)]
struct Samples {
    inside: Vec<f64>,
    outside: Vec<f64>,
}

impl Samples {
    /// Returns the ends of a range and numbers beyond them: "0 to 0.4", "above 0, to 5",
    /// "1, 2, 4"; none of a range in words. A limit behind "and" may exclude the ends.
    fn of(range: &str) -> Self {
        let mut samples = Self::default();
        let list: Option<Vec<f64>> = range.split(", ").map(|part| part.parse().ok()).collect();
        if let Some(list) = list.filter(|list| list.len() > 1) {
            let largest = list.iter().copied().fold(0.0, f64::max);
            samples.outside = vec![0.0, 3.0, 2.0 * largest];
            samples.inside = list;
            return samples;
        }
        if range.starts_with("above 0") {
            samples.outside.extend([0.0, -1.0]);
        } else if let Some(least) = number(range).filter(|_| range.contains(" to ")) {
            samples.inside.push(least);
            samples.outside.push(if least == 0.0 {
                -0.01
            } else {
                least - 0.1 * least.abs() - 0.1
            });
        }
        let largest = range.split("to ").nth(1).and_then(number);
        if let Some(largest) = largest {
            samples.inside.push(largest);
            samples.outside.push(largest * 1.02 + if largest.fract() == 0.0 { 1.0 } else { 0.0 });
        }
        if range.contains(" and ") {
            samples.inside.clear();
        }
        samples
    }
}

/// A file format: its page, its parser, and the tables of which a file has one at most.
struct Format {
    rows: Vec<Row>,
    /// Returns the file's contents in their debug format, or the error message.
    parse: fn(&str) -> Result<String, String>,
    choices: &'static [&'static str],
}

impl Format {
    fn new(
        page: &str,
        parse: fn(&str) -> Result<String, String>,
        choices: &'static [&'static str],
    ) -> Self {
        let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/use");
        let text = fs::read_to_string(pages.join(page)).unwrap();
        let rows: Vec<Row> = text.lines().filter_map(Row::parse).collect();
        assert!(!rows.is_empty(), "{page} has no rows");
        Self { rows, parse, choices }
    }

    /// Returns the choice (`law.sign`) that a key belongs to, if any.
    fn choice(&self, key: &str) -> Option<String> {
        let table = self.choices.iter().find(|table| key.starts_with(&format!("{table}.")))?;
        let name = key[table.len() + 1..].split('.').next().unwrap_or_default();
        Some(format!("{table}.{name}"))
    }

    /// Returns every choice, and `None` for the keys that belong to none.
    fn groups(&self) -> BTreeSet<Option<String>> {
        self.rows.iter().map(|row| self.choice(&row.key)).collect()
    }

    /// Parses the smallest file of a group, without the key `without` and with the line `more`.
    fn parsed(&self, group: Option<&str>, without: &str, more: &str) -> Result<String, String> {
        let rows = self.rows.iter().filter(|row| row.key != without);
        let of_group = rows.filter(|row| {
            let choice = self.choice(&row.key);
            choice.is_none() || choice.as_deref() == group
        });
        let mut lines: Vec<String> = of_group.filter_map(Row::example).collect();
        lines.push(more.to_owned());
        if let Some(group) = group
            && !lines.iter().any(|line| line.starts_with(&format!("{group}.")))
        {
            lines.push(format!("{group} = {{}}"));
        }
        (self.parse)(&lines.join("\n"))
    }

    fn check_keys(&self) {
        for group in self.groups() {
            let parsed = self.parsed(group.as_deref(), "", "");
            assert!(parsed.is_ok(), "the examples of {group:?}: {parsed:?}");
        }
        for row in &self.rows {
            let group = self.choice(&row.key);
            let group = group.as_deref();
            match &row.absent {
                Absent::Error(_) => {
                    let error = self.parsed(group, &row.key, "").expect_err(&row.key);
                    let mut names = row.key.split('.');
                    assert!(names.any(|name| error.contains(name)), "{}: {error}", row.key);
                }
                Absent::Default(value) => {
                    let set = self.parsed(group, "", &format!("{} = {value}", row.key));
                    assert_eq!(set, self.parsed(group, "", ""), "{}: its default", row.key);
                }
                Absent::Nothing => {}
            }
        }
    }

    /// Returns the names that the program accepts in a table or as the value of a key, from its
    /// error about the unknown one in `line`. The file has no other line of the key `without`.
    fn known(&self, group: Option<&str>, without: &str, line: &str) -> BTreeSet<String> {
        let error = self.parsed(group, without, line).expect_err(line);
        // Of an enum's table the crate `toml` lists the keys without backticks.
        if let Some((_, names)) = error.split_once("available keys: ") {
            return names.split(", ").map(str::to_owned).collect();
        }
        let names = error.split_once("expected").map_or("", |(_, names)| names);
        names.split('`').skip(1).step_by(2).map(str::to_owned).collect()
    }

    /// Returns the keys of the page by their tables; those of the top level have the table "".
    fn tables(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut tables: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for row in &self.rows {
            let mut table = String::new();
            for name in row.key.split('.') {
                tables.entry(table.clone()).or_default().insert(name.to_owned());
                table = if table.is_empty() { name.to_owned() } else { format!("{table}.{name}") };
            }
        }
        tables
    }

    fn check_tables(&self) {
        for (table, mut documented) in self.tables() {
            let dot = if table.is_empty() { "" } else { "." };
            let inside = format!("{table}{dot}{UNKNOWN}");
            if let Some(row) = self.rows.iter().find(|row| row.key == table) {
                documented.extend(row.names());
            }
            let group = self
                .groups()
                .into_iter()
                .flatten()
                .find(|group| table == *group || table.starts_with(&format!("{group}.")));
            let known = self.known(group.as_deref(), "", &format!("{inside} = 1"));
            assert_eq!(documented, known, "the keys of [{table}]");
        }
    }

    /// Checks that the page has the units and ranges of the types in the code; returns how many
    /// there are.
    fn check_types(&self) -> usize {
        /// A number that is out of every range.
        const BEYOND: f64 = 1e18;
        let (mut count, mut wrong) = (0, Vec::new());
        for row in &self.rows {
            let group = self.choice(&row.key);
            let error = self.parsed(group.as_deref(), &row.key, &row.with(BEYOND)).err();
            let error = error.unwrap_or_default();
            let Some((_, range)) = error.trim_end().split_once(" must be ") else { continue };
            count += 1;
            if !row.has_range(range) {
                wrong.push(format!("`{}`: {range}", row.key));
            }
        }
        assert!(wrong.is_empty(), "write these ranges and units:\n{}", wrong.join("\n"));
        count
    }

    /// Checks the ends of every range that is given in numbers; returns how many there are.
    fn check_ranges(&self) -> usize {
        let mut count = 0;
        for row in &self.rows {
            let group = self.choice(&row.key);
            let set = |number: f64| {
                let line = row.with(number);
                (self.parsed(group.as_deref(), &row.key, &line), line)
            };
            let samples = Samples::of(&row.range);
            for (result, line) in samples.inside.iter().map(|number| set(*number)) {
                assert!(result.is_ok(), "{line} is in its range: {result:?}");
            }
            for (result, line) in samples.outside.iter().map(|number| set(*number)) {
                assert!(result.is_err(), "{line} is accepted, but its range is {}", row.range);
            }
            count += samples.inside.len() + samples.outside.len();
        }
        count
    }

    fn check_names(&self) {
        for row in self.rows.iter().filter(|row| !row.names().is_empty()) {
            let group = self.choice(&row.key);
            let known =
                self.known(group.as_deref(), &row.key, &format!("{} = {UNKNOWN:?}", row.key));
            let tables = self.tables().remove(&row.key).unwrap_or_default();
            let documented: BTreeSet<String> = row.names().union(&tables).cloned().collect();
            assert_eq!(documented, known, "the values of {}", row.key);
        }
    }
}

#[test]
fn the_rig_file_page_is_what_the_program_reads() {
    let parse = |text: &str| {
        // Motor HATs are slower than the example's motors.
        let slow = text.contains("motor-hats").then(|| text.replace("= 400.0", "= 300.0"));
        let text = slow.as_deref().unwrap_or(text);
        let path = Path::new("rig.toml");
        parse_toml::<Rig>(path, text).map_err(|e| e.to_string())?;
        // Beside the types of the keys it checks which of them go together.
        let rig = Rig::parse(path, text).map_err(|e| e.to_string())?;
        let config = rig.config().map_err(|error| error.to_string())?;
        let drivers = rig.wiring().map_err(|error| error.to_string())?.drivers;
        Params::check(&config, &drivers, &EMULATED).map_err(|field| field.to_string())?;
        Ok(format!("{rig:?}"))
    };
    let format = Format::new("rig-file.md", parse, &["law", "motors.driver"]);
    format.check_keys();
    format.check_tables();
    format.check_names();
    assert!(format.check_types() > 60);
    assert!(format.check_ranges() > 60);
}

#[test]
fn the_camera_file_page_is_what_the_program_reads() {
    let parse = |text: &str| {
        let camera = camera_file::parse(Path::new("camera.toml"), text);
        camera.map(|camera| format!("{camera:?}")).map_err(|error| error.to_string())
    };
    let format = Format::new("camera-file.md", parse, &[]);
    format.check_keys();
    format.check_tables();
    format.check_names();
    assert!(format.check_types() > 10);
    assert!(format.check_ranges() > 10);
}

#[test]
fn ranges_are_read() {
    let samples = |inside: &[f64], outside: &[f64]| Samples {
        inside: inside.to_vec(),
        outside: outside.to_vec(),
    };
    assert_eq!(Samples::of("a serial port"), Samples::default());
    assert_eq!(Samples::of("above 0"), samples(&[], &[0.0, -1.0]));
    assert_eq!(Samples::of("1, 2, 4"), samples(&[1.0, 2.0, 4.0], &[0.0, 3.0, 8.0]));
    assert_eq!(Samples::of("40 to 4000"), samples(&[40.0, 4000.0], &[35.9, 4081.0]));
    assert_eq!(Samples::of("-10 to 10"), samples(&[-10.0, 10.0], &[-11.1, 11.2]));
    assert_eq!(Samples::of("0 to 1 and below `max`"), samples(&[], &[-0.01, 2.02]));
}
