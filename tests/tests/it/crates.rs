//! Dependency rules between the crates of this workspace, checked against `cargo metadata`.
//!
//! ```text
//! protocol <- core <- { firmware, emulator }
//! { config, frame } <- { openni, realsense, webcam } <- cameras
//! cameras <- runtime <- { page, foxglove, ros2 } <- plumb
//! { path, protocol } <- runtime;   { cameras, protocol } <- calibrate <- plumb
//! protocol <- verify;   frame <- import <- plumb;   image <- plumb
//! frame <- vision <- { bench, lab, plumb, tests };   { bench, verify } <- lab
//! { emulator, frame, cameras, path, runtime } <- sim <- { bench, plumb, tests }
//! ```
//!
//! `runtime`, `cameras`, `vision` and `frame` never depend on `sim`, `bench`, `verify` or
//! `emulator`; `runtime`, `cameras`, `calibrate`, `page`, `foxglove`, `ros2` and `sim` use the
//! detectors in `vision` in their tests only; `protocol` has no control, `core` no camera.
//! [`CRATES`] lists what each crate may depend on.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

use plumb_tests::source_tree::{files, read};
use serde_json::Value;

/// Allowed dependencies of a crate on other crates of the workspace.
struct Rule {
    name: &'static str,
    /// Dependencies of the crate itself.
    uses: &'static [&'static str],
    /// Further dependencies of its tests.
    tests_use: &'static [&'static str],
}

/// Every crate of the workspace.
const CRATES: &[Rule] = &[
    Rule { name: "plumb-protocol", uses: &[], tests_use: &[] },
    // The tests run a board in the emulator's harness, and its motor drivers.
    Rule { name: "plumb-core", uses: &["plumb-protocol"], tests_use: &["plumb-emulator"] },
    Rule { name: "plumb-firmware", uses: &["plumb-core", "plumb-protocol"], tests_use: &[] },
    Rule { name: "plumb-image", uses: &["plumb-protocol"], tests_use: &[] },
    Rule { name: "plumb-emulator", uses: &["plumb-core", "plumb-protocol"], tests_use: &[] },
    // Its tests drive the paper's rig.
    Rule {
        name: "plumb-rp2350",
        uses: &["plumb-image", "plumb-protocol"],
        tests_use: &["plumb-emulator", "plumb-runtime"],
    },
    Rule { name: "plumb-config", uses: &[], tests_use: &[] },
    Rule { name: "plumb-frame", uses: &[], tests_use: &[] },
    // The tests read recorded pictures.
    Rule { name: "plumb-vision", uses: &["plumb-frame"], tests_use: &["plumb-cameras"] },
    Rule { name: "plumb-path", uses: &["plumb-config"], tests_use: &[] },
    Rule { name: "plumb-pictures", uses: &["plumb-frame"], tests_use: &[] },
    Rule {
        name: "plumb-openni",
        uses: &["plumb-config", "plumb-frame", "plumb-pictures"],
        tests_use: &[],
    },
    Rule {
        name: "plumb-webcam",
        uses: &["plumb-config", "plumb-frame", "plumb-pictures"],
        tests_use: &[],
    },
    Rule {
        name: "plumb-realsense",
        uses: &["plumb-config", "plumb-frame", "plumb-pictures"],
        tests_use: &[],
    },
    Rule {
        name: "plumb-cameras",
        uses: &[
            "plumb-config",
            "plumb-frame",
            "plumb-openni",
            "plumb-pictures",
            "plumb-realsense",
            "plumb-webcam",
        ],
        tests_use: &["plumb-openni-driver"],
    },
    Rule {
        name: "plumb-calibrate",
        uses: &["plumb-cameras", "plumb-config", "plumb-frame", "plumb-protocol"],
        tests_use: &[],
    },
    Rule { name: "plumb-import", uses: &["plumb-frame"], tests_use: &[] },
    Rule {
        name: "plumb-runtime",
        uses: &["plumb-cameras", "plumb-config", "plumb-frame", "plumb-path", "plumb-protocol"],
        tests_use: &["plumb-vision"],
    },
    Rule {
        name: "plumb-log",
        uses: &[
            "plumb-cameras",
            "plumb-config",
            "plumb-frame",
            "plumb-pictures",
            "plumb-protocol",
            "plumb-runtime",
        ],
        tests_use: &["plumb-vision"],
    },
    Rule {
        name: "plumb-setup",
        uses: &["plumb-cameras", "plumb-config", "plumb-frame", "plumb-protocol", "plumb-runtime"],
        tests_use: &[],
    },
    Rule {
        name: "plumb-foxglove",
        uses: &[
            "plumb-cameras",
            "plumb-frame",
            "plumb-pictures",
            "plumb-protocol",
            "plumb-runtime",
        ],
        tests_use: &["plumb-emulator", "plumb-sim", "plumb-vision"],
    },
    Rule {
        name: "plumb-page",
        uses: &["plumb-frame", "plumb-pictures", "plumb-protocol", "plumb-runtime"],
        tests_use: &["plumb-cameras", "plumb-emulator", "plumb-sim", "plumb-vision"],
    },
    Rule {
        name: "plumb-ros2",
        uses: &[
            "plumb-cameras",
            "plumb-config",
            "plumb-frame",
            "plumb-pictures",
            "plumb-protocol",
            "plumb-runtime",
        ],
        tests_use: &[],
    },
    Rule {
        name: "plumb-sim",
        uses: &[
            "plumb-cameras",
            "plumb-config",
            "plumb-core",
            "plumb-emulator",
            "plumb-frame",
            "plumb-path",
            "plumb-protocol",
            "plumb-runtime",
        ],
        tests_use: &["plumb-vision"],
    },
    Rule {
        name: "plumb-verify",
        // The numbers of motors and of axes.
        uses: &["plumb-protocol"],
        // References: the board's law and the kinematics of the emulated rig.
        tests_use: &["plumb-core", "plumb-emulator"],
    },
    Rule {
        name: "plumb-bench",
        uses: &[
            "plumb-config",
            "plumb-core",
            "plumb-emulator",
            "plumb-frame",
            "plumb-path",
            "plumb-pictures",
            "plumb-protocol",
            "plumb-runtime",
            // The two jogs, on simulated rigs.
            "plumb-setup",
            "plumb-sim",
            "plumb-vision",
        ],
        tests_use: &["plumb-cameras"],
    },
    Rule {
        name: "plumb-lab",
        uses: &[
            "plumb-bench",
            "plumb-cameras",
            "plumb-config",
            "plumb-frame",
            "plumb-protocol",
            "plumb-runtime",
            "plumb-verify",
            "plumb-vision",
        ],
        tests_use: &[],
    },
    Rule {
        name: "plumb",
        uses: &[
            "plumb-calibrate",
            "plumb-cameras",
            "plumb-config",
            "plumb-foxglove",
            "plumb-frame",
            "plumb-image",
            "plumb-import",
            "plumb-log",
            "plumb-page",
            "plumb-path",
            "plumb-pictures",
            "plumb-protocol",
            "plumb-ros2",
            "plumb-runtime",
            "plumb-setup",
            "plumb-sim",
            "plumb-vision",
        ],
        tests_use: &[
            "plumb-openni",
            "plumb-openni-driver",
            "plumb-realsense",
            "plumb-realsense-device",
        ],
    },
    Rule { name: "plumb-openni-driver", uses: &["plumb-openni"], tests_use: &[] },
    Rule {
        name: "plumb-realsense-device",
        uses: &["plumb-openni-driver", "plumb-realsense"],
        tests_use: &[],
    },
    Rule {
        name: "plumb-adversary",
        uses: &["plumb-core", "plumb-emulator", "plumb-protocol"],
        tests_use: &[],
    },
    Rule {
        name: "plumb-faults",
        uses: &[
            "plumb-adversary",
            "plumb-cameras",
            "plumb-core",
            "plumb-emulator",
            "plumb-frame",
            "plumb-path",
            "plumb-protocol",
            "plumb-runtime",
            "plumb-tests",
            "plumb-vision",
        ],
        tests_use: &[],
    },
    Rule {
        name: "plumb-fuzz",
        uses: &[
            "plumb-adversary",
            "plumb-cameras",
            "plumb-config",
            "plumb-core",
            "plumb-frame",
            "plumb-import",
            "plumb-openni",
            "plumb-page",
            "plumb-path",
            "plumb-pictures",
            "plumb-protocol",
            "plumb-ros2",
            "plumb-runtime",
        ],
        tests_use: &[],
    },
    Rule {
        name: "plumb-tests",
        uses: &[
            "plumb-cameras",
            "plumb-config",
            "plumb-core",
            "plumb-emulator",
            "plumb-frame",
            "plumb-log",
            "plumb-page",
            "plumb-path",
            "plumb-protocol",
            "plumb-runtime",
            "plumb-setup",
            "plumb-sim",
            "plumb-vision",
        ],
        tests_use: &[
            "plumb-image",
            "plumb-openni",
            "plumb-openni-driver",
            "plumb-realsense",
            "plumb-realsense-device",
        ],
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

/// Runs `cargo metadata` and returns the workspace's packages.
pub(super) fn packages() -> Vec<Value> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--no-deps", "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"))
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value =
        serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON");
    metadata["packages"].as_array().expect("packages").clone()
}

pub(super) fn name(entry: &Value) -> String {
    entry["name"].as_str().expect("a name").to_owned()
}

/// Reads the workspace's crates and the edges between them from `cargo metadata`.
fn workspace() -> (BTreeSet<String>, BTreeSet<Edge>) {
    let packages = packages();
    let names: BTreeSet<String> = packages.iter().map(name).collect();
    let mut edges = BTreeSet::new();
    for package in &packages {
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

/// Returns whether the rules allow an edge.
fn is_allowed(edge: &Edge) -> bool {
    let to = edge.to.as_str();
    rule(&edge.from).is_some_and(|rule| {
        rule.uses.contains(&to) || edge.tests_only && rule.tests_use.contains(&to)
    })
}

/// Returns the edges that the rules forbid.
fn violations(edges: &BTreeSet<Edge>) -> Vec<String> {
    edges.iter().filter(|edge| !is_allowed(edge)).map(Edge::to_string).collect()
}

/// Returns every crate that `name` may depend on, directly or through others.
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
    assert!(unknown.is_empty(), "{unknown:?}: add them to CRATES of tests/tests/it/crates.rs");
    let found = violations(&edges);
    assert!(
        found.is_empty(),
        "the dependency rules (top of tests/tests/it/crates.rs) do not allow:\n{}\n\
         Move what the edge is for into a crate that may have it.",
        found.join("\n")
    );
}

/// Returns the source files of a program: its file, or its folder where it has one for itself.
fn sources(target: &Value) -> Vec<PathBuf> {
    let path = Path::new(target["src_path"].as_str().expect("a path"));
    let folder = path.parent().expect("a folder");
    if path.ends_with("main.rs") && !folder.join("lib.rs").exists() {
        return files(folder, &[".rs"]);
    }
    vec![path.to_owned()]
}

#[test]
fn a_program_whose_tests_are_not_run_has_none() {
    let packages = packages();
    // The firmware builds for its chip only, and libFuzzer's targets have no tests.
    let host = packages.iter().filter(|it| !["plumb-firmware", "plumb-fuzz"].contains(&&*name(it)));
    let targets = host.flat_map(|package| package["targets"].as_array().expect("targets"));
    let untested: Vec<&Value> = targets.filter(|target| target["test"] == false).collect();
    let names: Vec<String> = untested.iter().map(|target| name(target)).collect();
    assert!(names.contains(&"links".to_owned()), "{names:?}");
    for path in untested.into_iter().flat_map(sources) {
        let has_tests = read(&path).lines().any(|line| line.trim() == "#[test]");
        assert!(!has_tests, "{}: Cargo.toml says test = false", path.display());
    }
}

#[test]
fn a_forbidden_edge_is_reported() {
    let forbidden = [
        edge("plumb-vision", "plumb-emulator", false),
        edge("plumb-vision", "plumb-emulator", true),
        edge("plumb-runtime", "plumb-sim", false),
        // An edit of a detector must not compile the control loop.
        edge("plumb-runtime", "plumb-vision", false),
        edge("plumb-core", "plumb-vision", false),
        edge("plumb-protocol", "plumb-core", false),
        edge("plumb", "plumb-core", false),
        edge("plumb", "plumb-emulator", false),
        edge("plumb", "plumb-bench", false),
        // What only tests may use.
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
    for name in ["plumb-frame", "plumb-vision", "plumb-cameras", "plumb-runtime"] {
        for never in ["plumb-sim", "plumb-bench", "plumb-verify", "plumb-emulator", "plumb-core"] {
            assert!(!reach(name).contains(never), "{name} reaches {never}");
        }
    }
    for name in ["cameras", "calibrate", "runtime", "page", "sim"] {
        let reach = reach(&format!("plumb-{name}"));
        assert!(!reach.contains("plumb-vision"), "{name} reaches the detectors");
    }
    assert_eq!(reach("plumb-frame"), BTreeSet::new());
    assert_eq!(reach("plumb-protocol"), BTreeSet::new());
    assert_eq!(reach("plumb-core"), BTreeSet::from(["plumb-protocol"]));
}
