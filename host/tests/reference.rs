//! The book against the program: every key of the rig file and the camera file with its default,
//! every command and every option that a page names.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use common::{folder, plumb};
use plumb_cameras::camera_file;
use plumb_cameras::toml_file::parse_toml;
use plumb_runtime::rig::Rig;

/// A name that no file format knows.
const UNKNOWN: &str = "unknown_key";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

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
        Some(Self { key, range: cells[3].to_owned(), absent })
    }

    /// Returns the line of a file that has the example; `None` for a key that may be left out.
    fn example(&self) -> Option<String> {
        match &self.absent {
            Absent::Error(example) => Some(format!("{} = {example}", self.key)),
            _ => None,
        }
    }

    /// Returns the names that the range lists in quotes.
    fn names(&self) -> BTreeSet<String> {
        self.range.split('"').skip(1).step_by(2).map(str::to_owned).collect()
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
        let text = fs::read_to_string(root().join("docs/use").join(page)).unwrap();
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

    /// Returns the names that the program knows in a table, from its error about an unknown one.
    fn known(&self, group: Option<&str>, line: &str) -> BTreeSet<String> {
        let error = self.parsed(group, "", line).expect_err(line);
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
            let known = self.known(group.as_deref(), &format!("{inside} = 1"));
            assert_eq!(documented, known, "the keys of [{table}]");
        }
    }

    fn check_names(&self) {
        for row in self.rows.iter().filter(|row| !row.names().is_empty()) {
            let group = self.choice(&row.key);
            let known = self.known(group.as_deref(), &format!("{} = {UNKNOWN:?}", row.key));
            let tables = self.tables().remove(&row.key).unwrap_or_default();
            let documented: BTreeSet<String> = row.names().union(&tables).cloned().collect();
            assert_eq!(documented, known, "the values of {}", row.key);
        }
    }
}

#[test]
fn the_rig_file_page_is_what_the_program_reads() {
    let parse = |text: &str| {
        let rig = parse_toml::<Rig>(Path::new("rig.toml"), text);
        rig.map(|rig| format!("{rig:?}")).map_err(|error| error.to_string())
    };
    let format = Format::new("rig-file.md", parse, &["law", "motors.driver"]);
    format.check_keys();
    format.check_tables();
    format.check_names();
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
}

/// Returns the pages whose commands are checked.
fn pages() -> Vec<PathBuf> {
    let root = root();
    let mut pages: Vec<PathBuf> =
        ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root.join(name)).into();
    pages.push(root.join("firmware/README.md"));
    for part in ["docs", "docs/use", "docs/understand", "docs/change"] {
        let entries = fs::read_dir(root.join(part)).unwrap();
        let files = entries.map(|entry| entry.unwrap().path());
        pages.extend(files.filter(|path| path.extension().is_some_and(|end| end == "md")));
    }
    pages
}

/// Returns the code of a page: the lines of its code blocks, and its inline code.
fn code(text: &str) -> Vec<String> {
    let (mut block, mut lines, mut prose) = (false, Vec::new(), String::new());
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            block = !block;
        } else if block {
            lines.push(line.split(" #").next().unwrap_or_default().trim().to_owned());
        } else {
            prose.push_str(line);
            prose.push(' ');
        }
    }
    lines.extend(prose.split('`').skip(1).step_by(2).map(str::to_owned));
    lines
}

/// Help texts by command: "bench control".
type Helps = BTreeMap<String, String>;

/// Collects the help of a command and of those below it.
fn collect(path: &[&str], helps: &mut Helps) {
    let output = plumb(&[path, &["--help"]].concat(), folder().path());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "plumb {}: {text}", path.join(" "));
    let commands = text.split_once("\nCommands:\n").map_or("", |(_, rest)| rest);
    let commands = commands.split("\n\n").next().unwrap_or_default();
    let names = commands.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    for name in names.filter_map(|line| line.split_whitespace().next()) {
        if name != "help" {
            collect(&[path, &[name]].concat(), helps);
        }
    }
    helps.insert(path.join(" "), text);
}

/// Returns the options in a piece of code: `--law`, `--rigs`.
fn options(code: &str) -> impl Iterator<Item = &str> {
    let words = code.split(|c: char| c.is_whitespace() || "=\"|,()[]".contains(c));
    words.filter(|word| word.starts_with("--") && word.len() > 2)
}

/// Returns what is wrong with a command line, if anything.
fn problem(code: &str, helps: &Helps) -> Option<String> {
    let rest = match code.split_once("make demo ARGS=") {
        Some(("", arguments)) => format!("demo {arguments}"),
        _ => code.strip_prefix("plumb ")?.to_owned(),
    };
    let words: Vec<&str> = rest.split_whitespace().collect();
    let known = (1..=words.len().min(2)).rev().map(|count| words[..count].join(" "));
    let Some(command) = known.clone().find(|command| helps.contains_key(command)) else {
        let is_option = words.first().is_none_or(|word| word.starts_with("--"));
        return (!is_option && !words[0].starts_with("COMMAND"))
            .then(|| format!("there is no command in `{code}`"));
    };
    options(&rest)
        .find(|option| !options(&helps[&command]).any(|known| known == *option))
        .map(|option| format!("`{code}`: {command} has no option {option}"))
}

#[test]
fn every_command_and_option_on_a_page_exists() {
    let mut helps = Helps::new();
    collect(&[], &mut helps);
    let mut problems = Vec::new();
    for page in pages() {
        for code in code(&fs::read_to_string(&page).unwrap()) {
            if let Some(problem) = problem(&code, &helps) {
                problems.push(format!("{}: {problem}", page.display()));
            }
        }
    }
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
    assert!(problem("plumb absent", &helps).is_some());
    assert!(problem("plumb run RIG.toml --absent", &helps).is_some());
}

#[test]
fn every_command_is_on_the_page_of_commands() {
    let mut helps = Helps::new();
    collect(&[], &mut helps);
    let text = fs::read_to_string(root().join("docs/use/commands.md")).unwrap();
    let code = code(&text);
    for command in helps.keys().filter(|name| !name.is_empty()) {
        let parent = helps.keys().any(|other| other.starts_with(&format!("{command} ")));
        let shown = code.iter().any(|code| code.starts_with(&format!("plumb {command}")));
        assert!(parent || shown, "docs/use/commands.md lacks plumb {command}");
    }
}
