//! Circles of modules: modules of which none can be read, moved or tested without the others. No
//! crate has one, except those that [`KNOWN`] lists.
//!
//! A module is a file. It needs another module of its program or library if a path in its code
//! means an item that the other defines: in a `use`, in an expression, a type or a pattern, in the
//! tokens of a macro or of an attribute. Re-exports are followed to the module that defines the
//! item. Hence:
//!
//! - A parent that declares its children (`mod x;`) or re-exports their items does not need them. A
//!   parent that uses a child's item in its own code needs the child; if the child uses an item of
//!   the parent, they are a circle.
//! - A path only names the modules on its way, and a `use` of a module only names it.
//! - Code of tests (`#[cfg(test)]`, `#[test]`) does not count. Code of every feature does: a module
//!   with another file for a feature has the code of all its files.
//! - Methods are not seen: a call names no module.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

mod modules;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::Path;

use crate::crates::{name, packages};
use modules::Modules;

/// Crates with circles, and the number of modules in them. A change that opens circles lowers it.
const KNOWN: &[(&str, usize)] = &[
    // Options of an optional part, and the part: import, ROS 2, viewers.
    ("plumb", 6),
    // `control` and `vision` define what their children measure, and call them.
    ("plumb-bench", 17),
    // `lens` and `sheet` likewise.
    ("plumb-calibrate", 4),
    // Its root defines the imported calibration, which every reader makes.
    ("plumb-import", 8),
    // Its root likewise.
    ("plumb-foxglove", 3),
    // Its root has the options that the commands share.
    ("plumb-lab", 4),
    // The page and its server.
    ("plumb-page", 2),
    // The node's loop and its outputs; the table of messages and the messages.
    ("plumb-ros2", 7),
];

/// Names of modules, and for each the modules that it needs.
type Edges = BTreeMap<String, BTreeSet<String>>;

/// Returns a shortest circle through the module `start`, as its names; `None` if there is none.
fn circle(edges: &Edges, start: &str) -> Option<Vec<String>> {
    let mut before = BTreeMap::new();
    let mut open = VecDeque::from([start]);
    while let Some(name) = open.pop_front() {
        for next in edges.get(name).into_iter().flatten() {
            if !before.contains_key(next.as_str()) {
                before.insert(next.as_str(), name);
                open.push_back(next);
            }
        }
    }
    let mut circle = vec![start.to_owned()];
    let mut last = *before.get(start)?;
    while last != start {
        circle.push(last.to_owned());
        last = before[last];
    }
    circle.push(start.to_owned());
    circle.reverse();
    Some(circle)
}

/// Returns a shortest circle through each module that is in one.
fn circles(edges: &Edges) -> Vec<Vec<String>> {
    edges.keys().filter_map(|name| circle(edges, name)).collect()
}

/// Renders circles as lines `a -> b -> a`, each circle once.
fn lines(circles: &[Vec<String>]) -> String {
    let mut seen = BTreeSet::new();
    let mut lines = Vec::new();
    for circle in circles {
        if seen.insert(circle.iter().collect::<BTreeSet<_>>()) {
            lines.push(circle.join(" -> "));
        }
    }
    lines.join("\n")
}

#[test]
fn no_crate_has_a_circle_of_modules() {
    let mut found = Vec::new();
    for package in packages() {
        let targets = package["targets"].as_array().expect("targets");
        let is_code =
            |kind: &&serde_json::Value| kind["kind"][0] == "lib" || kind["kind"][0] == "bin";
        let roots = targets.iter().filter(is_code).filter_map(|it| it["src_path"].as_str());
        let read = |path: &Path| fs::read_to_string(path).ok();
        let circles: Vec<_> =
            roots.flat_map(|root| circles(&Modules::new(Path::new(root), &read).edges())).collect();
        let (name, count) = (name(&package), circles.len());
        match KNOWN.iter().find(|(known, _)| *known == name).map_or(0, |it| it.1) {
            known if count > known => found.push(format!(
                "{name}: {count} modules in circles, {known} allowed:\n{}",
                lines(&circles)
            )),
            known if known > 0 && count == 0 => {
                found.push(format!("{name}: has no circle any more; take it out of KNOWN"));
            }
            _ => {}
        }
    }
    assert!(
        found.is_empty(),
        "{}\nMove what both need into a module below both.",
        found.join("\n")
    );
}

/// Returns the circles in a crate of these files.
fn circles_of(files: &[(&str, &str)]) -> String {
    let read = |path: &Path| {
        files.iter().find(|(name, _)| Path::new(name) == path).map(|(_, text)| (*text).to_owned())
    };
    lines(&circles(&Modules::new(Path::new("lib.rs"), &read).edges()))
}

#[test]
fn a_circle_through_a_reexport_is_found() {
    let found = circles_of(&[
        ("lib.rs", "pub mod a;\npub mod b;\npub use b::B;\n"),
        ("a.rs", "use crate::B;\npub struct A(B);\n"),
        ("b.rs", "mod deep;\npub use deep::B;\n"),
        ("b/deep.rs", "pub struct B;\nfn f() { let _ = vec![crate::a::A::new()]; }\n"),
    ]);
    assert_eq!(found, "a -> b::deep -> a");
}

#[test]
fn a_parent_that_uses_its_child_and_is_used_by_it_is_a_circle() {
    let parent = "mod child;\npub struct Shared;\nfn f(it: child::Part) {}\n";
    let child = "use super::*;\npub struct Part(Shared);\n";
    let files = [("lib.rs", "mod parent;\n"), ("parent.rs", parent), ("parent/child.rs", child)];
    assert_eq!(circles_of(&files), "parent -> parent::child -> parent");
}

#[test]
fn a_parent_that_reexports_its_children_is_no_circle() {
    let found = circles_of(&[
        ("lib.rs", "mod parent;\npub use parent::{Part, Shared};\nuse self::parent as p;\n"),
        ("parent.rs", "mod child;\npub use child::Part;\npub struct Shared;\n"),
        ("parent/child.rs", "use crate::Shared;\npub struct Part(Shared);\n"),
    ]);
    assert_eq!(found, "");
}

#[test]
fn tests_and_other_crates_make_no_circle() {
    let a = "use std::fmt;\nuse crate::b::B;\nuse fmt::Debug;\npub struct A(B);\n";
    let b = "pub struct B;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n\
             #[cfg(test)]\nuse crate::a::A;\nimpl B {\n    #[cfg(test)]\n    fn a() -> A {}\n}\n";
    let files = [("lib.rs", "mod a;\nmod b;\n"), ("a.rs", a), ("b.rs", b)];
    assert_eq!(circles_of(&files), "");
}
