//! The book in `docs/` and the other Markdown files: every page is in the summary, and every link,
//! path and make target that they name exists.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use plumb_tests::source_tree::{files, normalise, read, root};

/// Folders at the top level whose files the pages name in backticks.
const TOP: &[&str] =
    &[".ci/", ".cargo/", "docs/", "firmware/", "host/", "protocol/", "scripts/", "tests/"];

fn markdown() -> Vec<PathBuf> {
    files(&root(), &[".md"])
}

/// Returns the lines of a page outside its code blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    })
}

/// Returns the targets of the links and images of a page, without those in inline code.
fn links(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in prose(text) {
        let outside: String = line.split('`').step_by(2).collect();
        let targets = outside.split("](").skip(1);
        found.extend(targets.filter_map(|rest| rest.split(')').next()).map(str::to_owned));
    }
    found
}

/// Returns the inline code of a page.
fn inline_code(text: &str) -> Vec<String> {
    let prose: Vec<&str> = prose(text).collect();
    prose.join("\n").split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Returns the anchor of a heading, as mdBook and GitHub make it.
fn anchor(heading: &str) -> String {
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    let text: String = heading.trim().to_lowercase().chars().filter(kept).collect();
    text.replace(' ', "-")
}

fn anchors(text: &str) -> BTreeSet<String> {
    let headings = prose(text).filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

fn is_outside(link: &str) -> bool {
    link.contains("://") || link.starts_with("mailto:")
}

/// Returns what is wrong with a link of `page`, if anything.
fn problem(page: &Path, link: &str) -> Option<String> {
    if is_outside(link) {
        return None;
    }
    let (path, fragment) = link.split_once('#').unwrap_or((link, ""));
    let target = match path {
        "" => page.to_owned(),
        _ => normalise(&page.parent().expect("a folder").join(path)),
    };
    if !target.exists() {
        return Some(format!("{}: there is no {path}", page.display()));
    }
    let book = root().join("docs");
    if page.starts_with(&book) && !target.starts_with(&book) {
        let why = "leads out of the book, where it would be dead: name the file in backticks";
        return Some(format!("{}: {path} {why}", page.display()));
    }
    let known = || anchors(&read(&target)).contains(fragment);
    (!fragment.is_empty() && !known())
        .then(|| format!("{}: {path} has no heading for #{fragment}", page.display()))
}

fn report(problems: &[String]) {
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
}

#[test]
fn every_link_leads_somewhere() {
    let mut problems = Vec::new();
    for page in markdown() {
        let links = links(&read(&page));
        problems.extend(links.iter().filter_map(|link| problem(&page, link)));
    }
    report(&problems);
}

#[test]
fn the_summary_lists_every_page_of_the_book_once() {
    let docs = root().join("docs");
    let summary = docs.join("SUMMARY.md");
    let mut listed = links(&read(&summary));
    listed.sort();
    let pages = files(&docs, &[".md"]);
    let names = pages.iter().filter(|page| **page != summary).map(|page| {
        page.strip_prefix(&docs).expect("a page of the book").to_string_lossy().into_owned()
    });
    assert_eq!(listed, names.collect::<Vec<_>>());
}

/// Returns whether `word` is a path of this repository, without wildcards or placeholders.
fn is_path(word: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    TOP.iter().any(|top| word.starts_with(top)) && word.chars().all(plain)
}

#[test]
fn every_file_that_a_page_names_exists() {
    let mut problems = Vec::new();
    for page in markdown() {
        for word in inline_code(&read(&page)).iter().flat_map(|code| code.split_whitespace()) {
            if is_path(word) && !root().join(word).exists() {
                problems.push(format!("{}: there is no {word}", page.display()));
            }
        }
    }
    report(&problems);
}

#[test]
fn every_page_that_a_source_names_exists() {
    let mut sources = files(&root(), &[".rs", ".toml", ".py", ".mjs", ".sh"]);
    sources.extend(files(&root().join("scripts"), &[""]));
    let part = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    let mut problems = Vec::new();
    for source in sources {
        let text = read(&source);
        for word in text.split(|c| !part(c)).map(|word| word.trim_end_matches('.')) {
            let named = word.starts_with("docs/") && word.ends_with(".md");
            if named && !root().join(word).exists() {
                problems.push(format!("{}: there is no {word}", source.display()));
            }
        }
        // Messages name a page by `plumb_config::book`.
        let calls = [" page(\"", "(page(\""];
        let by_name = calls.iter().flat_map(|call| text.split(call).skip(1));
        for name in by_name.filter_map(|rest| rest.split_once("\")").map(|(name, _)| name)) {
            let is_name = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
            if is_name && !root().join(format!("docs/use/{name}.md")).exists() {
                problems.push(format!("{}: there is no page {name}", source.display()));
            }
        }
    }
    report(&problems);
}

#[test]
fn every_make_target_that_a_page_names_exists() {
    let makefile = read(&root().join("Makefile"));
    let targets: BTreeSet<&str> =
        makefile.lines().filter_map(|line| line.split_once(':').map(|(name, _)| name)).collect();
    let mut problems = Vec::new();
    for page in markdown() {
        let text = read(&page);
        let lines = text.lines().map(str::trim_start).filter(|line| line.starts_with("make "));
        let inline = inline_code(&text);
        for code in lines.chain(inline.iter().map(String::as_str)) {
            let mut words = code.split_whitespace();
            if let (Some("make"), Some(target)) = (words.next(), words.next())
                && !targets.contains(target.trim_end_matches(','))
                && target.chars().all(|c| c.is_ascii_lowercase() || c == '-')
            {
                problems.push(format!("{}: there is no `make {target}`", page.display()));
            }
        }
    }
    report(&problems);
}

#[test]
fn dead_links_are_found() {
    let page = root().join("docs/introduction.md");
    for dead in ["absent.md", "glossary.md#absent", "../README.md"] {
        assert!(problem(&page, dead).is_some(), "{dead}");
    }
    assert_eq!(problem(&page, "https://example.org/absent"), None);
    assert_eq!(links("[a](b.md#c) `[no](link)` ![d](e.svg)"), ["b.md#c", "e.svg"]);
    assert_eq!(anchor(" When it stops: exit codes, `faults`"), "when-it-stops-exit-codes-faults");
}
