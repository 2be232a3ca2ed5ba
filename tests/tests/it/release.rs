//! `scripts/release` in a small repository, with the builds replaced.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use plumb_tests::source_tree::{read, root};

/// Programs that stand in the place of the builds.
const STANDINS: [(&str, &str); 4] = [
    (
        "scripts/package",
        "mkdir -p target/package target/firmware\n\
         for file in plumb plumb-pico2; do\n\
         for kind in elf uf2; do echo $kind > target/firmware/$file.$kind; done; done\n\
         echo deb > target/package/plumb.deb && echo target/package/plumb.deb",
    ),
    ("scripts/sbom", "echo bill > \"$1/plumb.cdx.json\""),
    ("bin/cargo", ""),
    ("bin/cargo-cyclonedx", ""),
];

/// Runs a command in the repository with the standins.
fn run(folder: &Path, program: &str, arguments: &[&str]) -> Output {
    let path = std::env::var("PATH").expect("a path");
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder);
    command.env("PATH", format!("{}/bin:{path}", folder.display()));
    for role in ["AUTHOR", "COMMITTER"] {
        command.env(format!("GIT_{role}_NAME"), "test").env(format!("GIT_{role}_EMAIL"), "a@b.c");
    }
    command.output().expect("it starts")
}

/// Returns a repository with version 0.1.0 and the scripts of a release.
fn repository() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let put = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("created");
        fs::write(&path, text).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    };
    for script in ["scripts/release", "scripts/lib.sh"] {
        put(script, &read(&root().join(script)));
    }
    for (name, lines) in STANDINS {
        put(name, &format!("#!/bin/sh\n{lines}\n"));
    }
    put("Cargo.toml", "[workspace.package]\nversion = \"0.1.0\"\n\n[other]\nversion = \"9.0.0\"\n");
    put("CHANGELOG.md", "# Changelog\n\n## Unreleased\n\n- New.\n\n## 0.1.0\n\n- Old.\n");
    put(".gitignore", "/target\n");
    for line in ["init --quiet", "add --all", "commit --quiet --message begin"] {
        let arguments: Vec<&str> = line.split(' ').collect();
        assert!(run(folder.path(), "git", &arguments).status.success(), "git {line}");
    }
    folder
}

#[test]
fn a_release_sets_the_version_once_and_has_the_same_bytes_again() {
    let folder = repository();
    let release = |version: &str| run(folder.path(), "scripts/release", &[version]);
    let first = release("0.2.0");
    let errors = String::from_utf8_lossy(&first.stderr);
    assert!(first.status.success(), "{errors}");
    assert!(errors.contains("git tag --sign v0.2.0"), "{errors}");
    let manifest = read(&folder.path().join("Cargo.toml"));
    assert_eq!(manifest.matches("version = \"0.2.0\"").count(), 1, "{manifest}");
    let changelog = read(&folder.path().join("CHANGELOG.md"));
    assert!(changelog.starts_with("# Changelog\n\n## Unreleased\n\n## 0.2.0 - 2"), "{changelog}");
    let out = folder.path().join("target/release-0.2.0");
    assert_eq!(read(&out.join("CHANGES.md")), "\n- New.\n\n");
    let sums = read(&out.join("SHA256SUMS"));
    let files: Vec<&str> = sums.lines().filter_map(|line| line.split("  ").nth(1)).collect();
    let expected = [
        "CHANGES.md",
        "plumb-0.2.0-pico.elf",
        "plumb-0.2.0-pico.uf2",
        "plumb-0.2.0-pico2.elf",
        "plumb-0.2.0-pico2.uf2",
        "plumb-0.2.0.tar.gz",
        "plumb.cdx.json",
        "plumb.deb",
    ];
    assert_eq!(files, expected);
    let second = release("0.2.0");
    assert!(second.status.success(), "{}", String::from_utf8_lossy(&second.stderr));
    assert_eq!(second.stdout, first.stdout);
    let commits = run(folder.path(), "git", &["rev-list", "--count", "HEAD"]);
    assert_eq!(String::from_utf8_lossy(&commits.stdout).trim(), "2");
}

#[test]
fn a_release_is_refused_for_an_older_version_and_with_changes() {
    let folder = repository();
    for (version, reason) in [("0.0.9", "0.0.9 is older"), ("next", "needs a version")] {
        let output = run(folder.path(), "scripts/release", &[version]);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{errors}");
        assert!(errors.contains(reason), "{errors}");
    }
    fs::write(folder.path().join("new"), "").expect("written");
    let output = run(folder.path(), "scripts/release", &["0.2.0"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    assert!(errors.contains("?? new"), "{errors}");
}
