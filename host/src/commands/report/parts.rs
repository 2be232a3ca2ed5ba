//! The parts of a report: what is known about program, computer, board, rig and run.

use std::fmt::Write;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use plumb_cameras::discovery::discover;
use plumb_config::bounded_read::{ReadError, read, read_text};
use plumb_config::escape::escaped;
use plumb_config::toml_file::TomlFileError;
use plumb_log::{FIRST_PICTURE, LAST_PICTURE};
use plumb_protocol::RELEASE;
use plumb_runtime::link::{Link, Serial};
use plumb_runtime::rig::{BoardPort, Rig};
use serde_json::Value;

use crate::cli::exit::{Failure, failed};
use crate::cli::port_args::PortArgs;
use crate::cli::rig_path::is_default;
use crate::commands::board::status::status_line;

/// Most bytes of a file in a report: the rows of a run of an hour and a half at 30 Hz.
const MAX_BYTES: u64 = 64 << 20;

/// Most rows of `run.csv` in a report, the last ones: 11 minutes at 30 Hz, some 4 MB.
const MAX_ROWS: usize = 20_000;

/// Folder of the runs that are named by no option.
const RUNS: &str = "runs";

/// Results of the self-test that are named by no option.
const SELFTEST: &str = "plumb-selftest.json";

/// Files of a run's folder, and what they have. They are in the folder `run` of the report.
const RUN_FILES: [(&str, &str); 9] = [
    ("summary.json", "how the run ended, its targets and events"),
    ("run.csv", "a row for each picture"),
    ("lost.csv", "lost pictures"),
    ("figures.json", "what the figures show"),
    ("figure4.svg", "figure: position and error over time"),
    ("figure5.svg", "figure: the path in space"),
    ("deviation.svg", "figure: the distance from the path over time"),
    (FIRST_PICTURE, "the first picture of the run"),
    (LAST_PICTURE, "the last picture of the run"),
];

/// Files that a run which has ended may lack: it lost no picture, or followed no path.
const OPTIONAL_FILES: [&str; 2] = ["lost.csv", "deviation.svg"];

/// A file of the report.
pub(super) struct Part {
    /// Name in the report.
    pub(super) name: String,
    /// What it has, in words.
    pub(super) content: &'static str,
    pub(super) bytes: Vec<u8>,
}

/// Parts so far.
#[derive(Default)]
pub(super) struct Parts {
    parts: Vec<Part>,
    /// What could not be added, and why.
    missing: Vec<String>,
}

impl Parts {
    fn add(&mut self, name: &str, content: &'static str, bytes: impl Into<Vec<u8>>) {
        self.parts.push(Part { name: name.to_owned(), content, bytes: bytes.into() });
    }

    /// Adds a file, or the reason why it cannot be read.
    fn add_file(&mut self, name: &str, content: &'static str, file: &Path) {
        match read(file, MAX_BYTES) {
            Ok(bytes) if name.ends_with(".csv") => {
                self.add(name, content, last_rows(&String::from_utf8_lossy(&bytes)));
            }
            Ok(bytes) => self.add(name, content, bytes),
            Err(error) => self.miss(name, &error.into()),
        }
    }

    fn miss(&mut self, name: &str, reason: &Failure) {
        self.missing.push(format!("{name}: {}", reason.message()));
    }

    /// Asks the board for its program, its state and what it has counted. A rig file with a mistake
    /// names no board.
    pub(super) fn add_board(&mut self, port: &PortArgs, rig: Option<&Path>) {
        let rig = rig.filter(|path| Rig::read(path).is_ok());
        let ask = || {
            let BoardPort { port, baud } = port.board_or_only(rig)?;
            let mut link = Link::connect(Serial::open(&port, baud)?)?;
            status_line(&mut link)
        };
        match ask() {
            Ok(line) => self.add("board.json", "the board's program, state and counts", text(line)),
            Err(failure) => self.miss("board.json", &failure),
        }
    }

    /// Adds the results of the self-test.
    ///
    /// # Errors
    /// Where a file that an option names cannot be read.
    pub(super) fn add_selftest(&mut self, named: Option<&Path>) -> Result<(), ReadError> {
        let (name, content) = ("selftest.json", "the board's self-test");
        let usual = Path::new(SELFTEST);
        match named {
            Some(file) => self.add(name, content, read_text(file, MAX_BYTES)?),
            None if usual.exists() => self.add_file(name, content, usual),
            None => self.missing.push(format!(
                "{name}: there is no {SELFTEST}, the results of `plumb board selftest`. A question \
                 that is not about the board does not need them"
            )),
        }
        Ok(())
    }

    /// Adds the cameras, and the libraries of cameras.
    pub(super) fn add_cameras(&mut self) -> Result<(), Failure> {
        let found = serde_json::to_value(discover(Path::new("/")))?;
        self.add("cameras.json", "cameras and their libraries", text(found));
        Ok(())
    }

    /// Adds the rig file, and the camera file that it names. A rig file with a mistake is added,
    /// too, with the mistake.
    ///
    /// # Errors
    /// Where the rig file cannot be read, and the command line names it.
    pub(super) fn add_rig(&mut self, path: Option<&Path>) -> Result<(), Failure> {
        let Some(path) = path else {
            self.missing
                .push("rig.toml: there is none in this folder, and none is named".to_owned());
            return Ok(());
        };
        let text = match read_text(path, MAX_BYTES).map_err(TomlFileError::from) {
            Ok(text) => text,
            Err(error) if is_default(path) => {
                self.miss("rig.toml", &error.into());
                return Ok(());
            }
            Err(error) => return Err(error.into()),
        };
        self.add("rig.toml", "the rig file", text);
        let camera = match Rig::read(path) {
            Ok(rig) => rig.camera.file,
            Err(error) => {
                self.missing.push(format!("rig.toml has a mistake: {error}"));
                path.with_file_name("camera.toml")
            }
        };
        self.add_file("camera.toml", "the camera file", &camera);
        Ok(())
    }

    /// Adds the files of a run.
    ///
    /// # Errors
    /// Where a folder that an option names is not that of a run.
    pub(super) fn add_run(&mut self, named: Option<&Path>) -> Result<(), Failure> {
        let folder = match named {
            Some(folder) => {
                check_run(folder)?;
                folder.to_owned()
            }
            None => match newest_run(Path::new(RUNS)) {
                Some(folder) => {
                    note!("run: {}, the newest in {RUNS}; --run names another", folder.display());
                    folder
                }
                None => {
                    self.missing.push(format!(
                        "run: there is no run in {RUNS}; name its folder with --run"
                    ));
                    return Ok(());
                }
            },
        };
        let is_ended = folder.join("summary.json").exists();
        if !is_ended {
            let why = "is still going on, or its program was killed";
            self.missing
                .push(format!("run: what it writes at its end; {} {why}", folder.display()));
        }
        // A run that has not ended may lack any of its files; one that has, these.
        let is_needed = |file: &str| is_ended && !OPTIONAL_FILES.contains(&file);
        let has = |file: &str| folder.join(file).exists() || is_needed(file);
        for (file, content) in RUN_FILES.into_iter().filter(|(file, _)| has(file)) {
            self.add_file(&format!("run/{file}"), content, &folder.join(file));
        }
        Ok(())
    }

    /// Returns what could not be added, and why.
    pub(super) fn missing(&self) -> &[String] {
        &self.missing
    }

    /// Returns the parts of the report, first the one about the program and what is missing.
    pub(super) fn finish(mut self) -> Vec<Part> {
        let bytes = escaped(&overview(&self.missing)).into_bytes();
        let content = "versions, and what is missing";
        self.parts.insert(0, Part { name: "report.txt".to_owned(), content, bytes });
        self.parts
    }
}

/// Checks that a folder is that of a run.
fn check_run(folder: &Path) -> Result<(), Failure> {
    let rows = folder.join("run.csv");
    match rows.try_exists() {
        Ok(true) => Ok(()),
        Err(error) if error.kind() != ErrorKind::NotADirectory => {
            Err(ReadError::Io { path: rows, error }.into())
        }
        Ok(false) | Err(_) => Err(failed(format!(
            "{}: is not the folder of a run: there is no run.csv in it",
            folder.display()
        ))),
    }
}

/// Returns a value of JSON in lines.
fn text(value: Value) -> String {
    format!("{value:#}\n")
}

/// Returns the text about the program, the computer and what is missing.
fn overview(missing: &[String]) -> String {
    let system = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = system.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="));
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let processors = std::thread::available_parallelism().map_or(0, usize::from);
    let mut text = format!(
        "plumb: {RELEASE}\nfeatures: {}\nsystem: {}\nkernel: {} {}\nprocessors: {processors}, {}\n",
        features().join(" "),
        name.unwrap_or("unknown").trim_matches('"'),
        std::env::consts::OS,
        kernel.trim(),
        std::env::consts::ARCH,
    );
    for line in missing {
        // A text in memory takes every line.
        let _written = writeln!(text, "missing: {line}");
    }
    text
}

/// Returns the features with which the program is built.
fn features() -> Vec<&'static str> {
    let all = [
        ("foxglove", cfg!(feature = "foxglove")),
        ("import", cfg!(feature = "import")),
        ("ros2", cfg!(feature = "ros2")),
        ("videoio", cfg!(feature = "videoio")),
    ];
    all.into_iter().filter(|(_, is_built)| *is_built).map(|(name, _)| name).collect()
}

/// Returns the folder in `runs` whose run was written last.
fn newest_run(runs: &Path) -> Option<PathBuf> {
    let folders = fs::read_dir(runs).ok()?.flatten().map(|entry| entry.path());
    let dated = folders.filter_map(|folder| {
        let written = fs::metadata(folder.join("run.csv")).and_then(|data| data.modified());
        Some((written.ok()?, folder))
    });
    dated.max().map(|(_, folder)| folder)
}

/// Returns the first line of a table and its last [`MAX_ROWS`] rows.
fn last_rows(table: &str) -> String {
    let rows = table.lines().count().saturating_sub(1);
    let left_out = rows.saturating_sub(MAX_ROWS);
    let kept = table.lines().take(1).chain(table.lines().skip(1 + left_out));
    kept.flat_map(|line| [line, "\n"]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_rows_of_a_long_table_are_kept() {
        let row = |n: usize| format!("{n}\n");
        let table: String = std::iter::once("n\n".to_owned()).chain((0..20_002).map(row)).collect();
        let kept = last_rows(&table);
        assert!(kept.starts_with("n\n2\n3\n") && kept.ends_with("\n20001\n"));
        assert_eq!(last_rows("n\n1\n"), "n\n1\n");
        assert_eq!(last_rows(""), "");
    }
}
