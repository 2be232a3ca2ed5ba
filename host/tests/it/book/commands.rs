//! The book against the program: every command and every option that a page names exists.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{folder, plumb};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
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

/// Help texts by command: "board save".
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
    assert!(problem("plumb run --absent", &helps).is_some());
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
