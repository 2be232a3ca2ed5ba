//! Dependency rules between the crates of this workspace, checked against `cargo metadata`.
//!
//! ```text
//! protocol <- core <- { firmware, emulator }
//! vision <- cameras <- runtime <- plumb;   protocol <- runtime
//! { emulator, vision, cameras, runtime } <- sim <- { bench, plumb, tests }
//! ```
//!
//! `runtime`, `cameras` and `vision` never depend on `sim`, `bench`, `verify` or `emulator`;
//! `protocol` knows no control, `core` no camera. [`CRATES`] lists what each crate may depend on,
//! [`EXCEPTIONS`] the edges of today that the rules forbid.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeSet;
use std::fmt;
use std::process::Command;

use serde_json::Value;

/// The crates that a crate of the workspace may depend on.
struct Rule {
    name: &'static str,
    /// In what it ships.
    uses: &'static [&'static str],
    /// In its tests besides.
    tests_use: &'static [&'static str],
}

/// Every crate of the workspace, and the crates that `plumb` is still to be divided into.
const CRATES: &[Rule] = &[
    Rule { name: "plumb-protocol", uses: &[], tests_use: &[] },
    Rule { name: "plumb-core", uses: &["plumb-protocol"], tests_use: &[] },
    Rule { name: "plumb-firmware", uses: &["plumb-core", "plumb-protocol"], tests_use: &[] },
    Rule { name: "plumb-image", uses: &[], tests_use: &[] },
    Rule { name: "plumb-emulator", uses: &["plumb-core", "plumb-protocol"], tests_use: &[] },
    Rule { name: "plumb-vision", uses: &[], tests_use: &[] },
    Rule { name: "plumb-openni", uses: &[], tests_use: &[] },
    Rule { name: "plumb-realsense", uses: &[], tests_use: &[] },
    Rule {
        name: "plumb-cameras",
        uses: &["plumb-openni", "plumb-realsense", "plumb-vision"],
        tests_use: &["plumb-openni-driver"],
    },
    Rule {
        name: "plumb-runtime",
        uses: &["plumb-cameras", "plumb-protocol", "plumb-vision"],
        tests_use: &[],
    },
    Rule {
        name: "plumb-sim",
        uses: &[
            "plumb-cameras",
            "plumb-emulator",
            "plumb-protocol",
            "plumb-runtime",
            "plumb-vision",
        ],
        tests_use: &[],
    },
    Rule {
        name: "plumb-verify",
        uses: &[],
        // References: the law on the chip and the kinematics of the emulated rig.
        tests_use: &["plumb-core", "plumb-emulator", "plumb-protocol"],
    },
    Rule {
        name: "plumb-bench",
        uses: &[
            "plumb-cameras",
            "plumb-core",
            "plumb-emulator",
            "plumb-protocol",
            "plumb-runtime",
            "plumb-sim",
            "plumb-vision",
        ],
        tests_use: &[],
    },
    Rule {
        name: "plumb",
        uses: &[
            "plumb-bench",
            "plumb-cameras",
            "plumb-protocol",
            "plumb-runtime",
            "plumb-sim",
            "plumb-verify",
            "plumb-vision",
        ],
        tests_use: &["plumb-openni-driver"],
    },
    Rule { name: "plumb-openni-driver", uses: &["plumb-openni"], tests_use: &[] },
    Rule { name: "plumb-adversary", uses: &["plumb-core", "plumb-protocol"], tests_use: &[] },
    Rule {
        name: "plumb-tests",
        uses: &[
            "plumb",
            "plumb-cameras",
            "plumb-core",
            "plumb-emulator",
            "plumb-protocol",
            "plumb-runtime",
            "plumb-sim",
            "plumb-vision",
        ],
        tests_use: &["plumb-openni", "plumb-openni-driver"],
    },
];

/// An edge that the rules forbid and that is still to be mended.
struct Exception {
    from: &'static str,
    to: &'static str,
    /// What goes where, so that the edge ends.
    mend: &'static str,
}

const EXCEPTIONS: &[Exception] = &[
    Exception {
        from: "plumb",
        to: "plumb-core",
        mend: "bench/control goes to plumb-bench, cosim and memory to plumb-sim",
    },
    Exception {
        from: "plumb",
        to: "plumb-emulator",
        mend: "source, cosim, memory and the emulated board go to plumb-sim, bench to plumb-bench",
    },
];

/// A dependency of one crate of the workspace on another.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    from: String,
    to: String,
    /// Whether only tests, examples and benchmarks have it.
    tests_only: bool,
}

impl fmt::Display for Edge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.tests_only { " in its tests" } else { "" };
        write!(f, "{} -> {}{kind}", self.from, self.to)
    }
}

fn edge(from: &str, to: &str, tests_only: bool) -> Edge {
    Edge { from: from.to_owned(), to: to.to_owned(), tests_only }
}

/// Reads the workspace's crates and the edges between them from `cargo metadata`.
fn workspace() -> (BTreeSet<String>, BTreeSet<Edge>) {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--no-deps", "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"))
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value =
        serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let name = |entry: &Value| entry["name"].as_str().expect("a name").to_owned();
    let names: BTreeSet<String> = packages.iter().map(name).collect();
    let mut edges = BTreeSet::new();
    for package in packages {
        let dependencies = package["dependencies"].as_array().expect("dependencies");
        edges.extend(dependencies.iter().filter(|d| names.contains(&name(d))).map(|dependency| {
            Edge {
                from: name(package),
                to: name(dependency),
                tests_only: dependency["kind"] == "dev",
            }
        }));
    }
    (names, edges)
}

fn rule(name: &str) -> Option<&'static Rule> {
    CRATES.iter().find(|rule| rule.name == name)
}

/// Whether the rules allow an edge; the exceptions do not count.
fn is_allowed(edge: &Edge) -> bool {
    let to = edge.to.as_str();
    rule(&edge.from).is_some_and(|rule| {
        rule.uses.contains(&to) || edge.tests_only && rule.tests_use.contains(&to)
    })
}

fn is_exception(edge: &Edge) -> bool {
    !edge.tests_only && EXCEPTIONS.iter().any(|e| e.from == edge.from && e.to == edge.to)
}

/// The edges that are neither allowed nor exceptions.
fn violations(edges: &BTreeSet<Edge>) -> Vec<String> {
    edges.iter().filter(|e| !is_allowed(e) && !is_exception(e)).map(Edge::to_string).collect()
}

/// Every crate that `name` may depend on, directly or through others.
fn reach(name: &str) -> BTreeSet<&'static str> {
    let uses = |name: &str| rule(name).map_or(&[][..], |rule| rule.uses);
    let mut found = BTreeSet::new();
    let mut open = uses(name).to_vec();
    while let Some(name) = open.pop() {
        if found.insert(name) {
            open.extend(uses(name));
        }
    }
    found
}

#[test]
fn the_crates_depend_on_each_other_as_the_rules_allow() {
    let (names, edges) = workspace();
    let unknown: Vec<_> = names.iter().filter(|name| rule(name).is_none()).collect();
    assert!(
        unknown.is_empty(),
        "{unknown:?}: say in CRATES of tests/tests/crates.rs what they may use"
    );
    let found = violations(&edges);
    assert!(
        found.is_empty(),
        "the dependency rules (top of tests/tests/crates.rs) do not allow:\n{}\n\
         Move what the edge is for into a crate that may have it.",
        found.join("\n")
    );
}

#[test]
fn every_exception_is_still_needed() {
    let (_, edges) = workspace();
    for Exception { from, to, mend } in EXCEPTIONS {
        let it = edge(from, to, false);
        assert!(edges.contains(&it), "{it} is mended ({mend}): remove it from EXCEPTIONS");
        assert!(!is_allowed(&it), "{it} is allowed: remove it from EXCEPTIONS");
        println!("still to be mended: {it}: {mend}");
    }
}

#[test]
fn a_forbidden_edge_is_reported() {
    let forbidden = [
        edge("plumb-vision", "plumb-emulator", false),
        edge("plumb-vision", "plumb-emulator", true),
        edge("plumb-runtime", "plumb-sim", false),
        edge("plumb-core", "plumb-vision", false),
        edge("plumb-protocol", "plumb-core", false),
        // An exception of what ships is none of the tests, and the other way round.
        edge("plumb", "plumb-emulator", true),
        edge("plumb", "plumb-openni-driver", false),
        edge("plumb-new", "plumb-protocol", false),
    ];
    for it in forbidden {
        assert_eq!(violations(&[it.clone()].into()), [it.to_string()]);
    }
    let allowed =
        [edge("plumb-core", "plumb-protocol", false), edge("plumb", "plumb-openni-driver", true)];
    assert_eq!(violations(&allowed.into()), [""; 0]);
}

#[test]
fn the_lists_themselves_keep_the_rules() {
    for Rule { name, uses, tests_use } in CRATES {
        assert_eq!(
            CRATES.iter().filter(|rule| rule.name == *name).count(),
            1,
            "{name} is listed twice"
        );
        for to in uses.iter().chain(*tests_use) {
            assert!(rule(to).is_some(), "{name} may use {to}, which is not listed");
        }
        assert!(!reach(name).contains(name), "{name} reaches itself");
    }
    for name in ["plumb-vision", "plumb-cameras", "plumb-runtime"] {
        for never in ["plumb-sim", "plumb-bench", "plumb-verify", "plumb-emulator", "plumb-core"] {
            assert!(!reach(name).contains(never), "{name} reaches {never}");
        }
    }
    assert_eq!(reach("plumb-protocol"), BTreeSet::new());
    assert_eq!(reach("plumb-core"), BTreeSet::from(["plumb-protocol"]));
}
