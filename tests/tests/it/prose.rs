//! Nothing branches on a text that people read: who edits a sentence must not change what the
//! program does. The calls that would do so are searched for in the sources.

use plumb_tests::source_tree::{code_lines, files, is_test, read, root};

/// Methods that look into a text.
const METHODS: [&str; 8] = [
    ".contains(",
    ".starts_with(",
    ".ends_with(",
    ".strip_prefix(",
    ".strip_suffix(",
    ".split_once(",
    ".rsplit_once(",
    ".find(",
];

/// Names of what a person reads.
const PROSE: [&str; 8] =
    ["to_string()", "message()", "advice()", "error", "message", "problem", "reason", "stderr"];

/// Files that may: the crates `toml` and `serde` tell the kind of an error by its text only.
const EXEMPT: [&str; 1] = ["host/config/src/toml_file/mistake.rs"];

/// Returns whether a line of code looks into a text that people read: one with such a name, or for
/// a literal with two words or with the name of a key.
fn looks_into_prose(line: &str) -> bool {
    METHODS.iter().any(|method| {
        line.match_indices(method).any(|(at, _)| {
            let before = &line[..at];
            let argument = line[at + method.len()..].trim_start();
            let literal = argument.strip_prefix('"').and_then(|rest| rest.split('"').next());
            PROSE.iter().any(|name| before.ends_with(name))
                || literal.is_some_and(|text| text.contains('`') || is_sentence(text))
        })
    })
}

/// Returns whether a text has two words of letters with a space between them.
fn is_sentence(text: &str) -> bool {
    let is_word = |word: &&str| word.len() >= 2 && word.chars().all(char::is_alphabetic);
    let words: Vec<&str> = text.split(' ').collect();
    words.windows(2).any(|pair| pair.iter().all(is_word))
}

#[test]
fn nothing_branches_on_a_text_that_people_read() {
    let root = root();
    let mut found = Vec::new();
    for folder in ["firmware", "host", "protocol"] {
        for path in files(&root.join(folder), &[".rs"]) {
            let relative = path.strip_prefix(&root).unwrap_or(&path);
            let name = relative.display().to_string();
            if is_test(relative) || EXEMPT.contains(&name.as_str()) {
                continue;
            }
            let text = read(&path);
            let wrong = code_lines(&text).into_iter().filter(|(_, line)| looks_into_prose(line));
            found.extend(wrong.map(|(number, line)| format!("{name}:{number}: {}", line.trim())));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_line_that_looks_into_a_sentence_is_found() {
    for line in [
        "if advice.contains(\"`plumb home`\") {",
        "if fault.advice().starts_with(\"wind\") {",
        "false if text.contains(\"not permitted\") => {",
        "let begins = message.starts_with(&prefix);",
    ] {
        assert!(looks_into_prose(line), "{line}");
    }
    for line in [
        "text.contains(\"[board]\")",
        "name.split_once(\" in \")",
        "path.starts_with(\"/dev/pts/\")",
        "errors.iter().find(|error| error.is_last())",
    ] {
        assert!(!looks_into_prose(line), "{line}");
    }
}
