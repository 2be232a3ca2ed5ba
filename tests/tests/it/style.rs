//! Layout rules that rustfmt does not check: lines of at most 100 characters in code, comments,
//! manifests and scripts. No file is exempt; `Cargo.lock` and `package-lock.json`, which programs
//! write, have other endings.

use std::path::Path;

use plumb_tests::source_tree::{files, read, root};

/// Maximum width of a line, characters.
const MAX_WIDTH: usize = 100;

/// Endings of the files that are checked, besides the scripts.
const ENDINGS: [&str; 6] = [".rs", ".toml", ".py", ".sh", ".js", ".mjs"];

/// Folders in which every file is a script.
const SCRIPT_FOLDERS: [&str; 2] = ["scripts", ".ci"];

/// Returns the numbers (from 1) and widths of the lines that are too long.
fn long_lines(text: &str) -> Vec<(usize, usize)> {
    let widths = text.lines().enumerate().map(|(n, line)| (n + 1, line.chars().count()));
    widths.filter(|&(_, width)| width > MAX_WIDTH).collect()
}

/// Returns a message for each long line of a file.
fn violations(root: &Path, file: &Path) -> Vec<String> {
    let name = file.strip_prefix(root).unwrap_or(file).display();
    let lines = long_lines(&read(file)).into_iter();
    lines.map(|(line, width)| format!("{name}:{line}: {width} characters")).collect()
}

#[test]
fn lines_have_at_most_100_characters() {
    let root = root();
    let mut checked = files(&root, &ENDINGS);
    for folder in SCRIPT_FOLDERS {
        checked.extend(files(&root.join(folder), &[""]));
    }
    checked.sort();
    checked.dedup();
    let found: Vec<String> = checked.iter().flat_map(|file| violations(&root, file)).collect();
    assert!(
        found.is_empty(),
        "{} lines have more than {MAX_WIDTH} characters:\n{}",
        found.len(),
        found.join("\n")
    );
}

/// Files that read the computer's wall clock, which may be set: for stamps that leave the program.
/// Every deadline is on the monotonic clock ([`std::time::Instant`]).
const WALL_CLOCK: [&str; 3] = [
    "host/page/src/feed.rs",
    "host/runtime/src/operator/stop_latch.rs",
    "host/runtime/src/wall_clock.rs",
];

#[test]
fn no_deadline_is_on_the_wall_clock() {
    let root = root();
    let sources = files(&root.join("host"), &[".rs"]).into_iter();
    let is_source = |name: &str| !name.contains("/tests") && !name.contains("/examples/");
    let mut found: Vec<String> = sources
        .filter(|file| read(file).contains("SystemTime::now"))
        .map(|file| file.strip_prefix(&root).unwrap_or(&file).display().to_string())
        .filter(|name| is_source(name))
        .collect();
    found.sort();
    assert_eq!(found, WALL_CLOCK);
}

#[test]
fn characters_are_counted_and_not_bytes() {
    let text = format!("{}\n{}\n{}\n", "a".repeat(100), "µ".repeat(100), "é".repeat(101));
    assert_eq!(long_lines(&text), [(3, 101)]);
}
