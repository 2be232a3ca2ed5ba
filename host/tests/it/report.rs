//! `plumb report`: what the file has, and what it does not tell.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{Emulator, folder, json, plumb, rig_file, stderr};

/// Unpacks a report. Returns a function that reads a part of it.
fn unpack(folder: &Path, file: &str) -> impl Fn(&str) -> Vec<u8> {
    let unpacked = Command::new("tar").args(["xzf", file]).current_dir(folder).status().unwrap();
    assert!(unpacked.success());
    let parts = folder.join("plumb-report");
    move |name| fs::read(parts.join(name)).unwrap()
}

#[test]
fn a_report_has_the_board_the_files_and_the_last_run() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    for law in ["interval", "taut"] {
        let demo = plumb(&["demo", "--virtual-time", "--law", law], folder.path());
        assert_eq!(demo.status.code(), Some(0), "{}", stderr(&demo));
    }
    fs::write(folder.path().join("plumb-selftest.json"), "{}\n").unwrap();
    let emulator = Emulator::start();
    let report = ["report", "--rig", &rig, "--port", &emulator.port, "--json"];
    let output = plumb(&report, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let names = [
        "report.txt",
        "board.json",
        "selftest.json",
        "cameras.json",
        "rig.toml",
        "camera.toml",
        "run/summary.json",
        "run/run.csv",
        "run/figures.json",
        "run/figure4.svg",
        "run/figure5.svg",
        "run/first.jpg",
        "run/last.jpg",
    ];
    assert_eq!(json(&output)["parts"], Value::from(names.to_vec()));
    let bytes = unpack(folder.path(), "plumb-report.tar.gz");
    let part = |name: &str| String::from_utf8_lossy(&bytes(name)).into_owned();
    for name in names {
        assert!(stderr(&output).contains(&format!("bytes  {name}: ")), "{}", stderr(&output));
    }
    assert!(part("report.txt").contains(&format!("plumb: {}\n", env!("CARGO_PKG_VERSION"))));
    let board: Value = serde_json::from_str(&part("board.json")).unwrap();
    assert!(board["firmware"]["release"].is_string() && board["state"].is_string(), "{board}");
    assert_eq!(part("rig.toml"), fs::read_to_string(&rig).unwrap());
    // The newest run, not the first one.
    assert!(part("run/summary.json").contains("\"law\": \"taut\""));
    for file in ["run.csv", "figure4.svg"] {
        let run = fs::read_to_string(folder.path().join("runs/demo-0002").join(file)).unwrap();
        assert_eq!(part(&format!("run/{file}")), run);
    }
    for file in ["first.jpg", "last.jpg"] {
        let picture = fs::read(folder.path().join("runs/demo-0002").join(file)).unwrap();
        assert!(picture.starts_with(&[0xff, 0xd8]));
        assert_eq!(bytes(&format!("run/{file}")), picture);
    }
    assert_ne!(bytes("run/first.jpg"), bytes("run/last.jpg"));
}

#[test]
fn what_is_missing_is_named_in_the_report_and_a_named_folder_must_be_a_run() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text.replace("microsteps = 16", "microsteps = 5000"));
    let port = ["--port", "/dev/plumb-no-such-port"];
    let before = [0x1f, 0x8b, 1, 2, 3];
    fs::write(folder.path().join("plumb-report.tar.gz"), before).unwrap();
    let output = plumb(&[&["report", "--rig", &rig], &port[..]].concat(), folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let former = "plumb-report.tar.gz.bak";
    assert!(stderr(&output).contains(&format!("The former report is now {former}\n")));
    assert_eq!(fs::read(folder.path().join(former)).unwrap(), before);
    let bytes = unpack(folder.path(), "plumb-report.tar.gz");
    let part = |name: &str| String::from_utf8(bytes(name)).unwrap();
    let text = part("report.txt");
    for reason in [
        "missing: board.json: /dev/plumb-no-such-port: ",
        "missing: selftest.json: there is no plumb-selftest.json, the results of `plumb board",
        &format!("missing: rig.toml has a mistake: {rig}:"),
        "missing: run: there is no run in runs",
    ] {
        assert!(text.contains(reason), "{reason}: {text}");
    }
    assert!(part("rig.toml").contains("microsteps = 5000") && part("camera.toml").contains("fx"));
    fs::create_dir(folder.path().join("empty")).unwrap();
    let output = plumb(&[&["report", "--run", "empty"], &port[..]].concat(), folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("empty: is not the folder of a run"), "{}", stderr(&output));
}

/// As in another folder than that of the tutorial, whose variable names a file there.
#[test]
fn a_report_lacks_a_rig_file_that_is_not_there() {
    let folder = folder();
    for (variable, says) in [
        ("none/rig.toml", "missing: rig.toml: none/rig.toml: cannot be read"),
        ("", "missing: rig.toml: there is none in this folder, and none is named"),
    ] {
        let mut report = Command::new(env!("CARGO_BIN_EXE_plumb"));
        report.args(["report", "--port", "/dev/plumb-no-such-port"]).current_dir(folder.path());
        let output = report.env("PLUMB_RIG", variable).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
    let output = plumb(&["report", "--rig", "none/rig.toml"], folder.path());
    assert_eq!(output.status.code(), Some(2), "typed: {}", stderr(&output));
}

#[test]
fn no_former_report_is_lost() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("plumb-report.tar.gz"), [0x1f, 0x8b, 1]).unwrap();
    fs::write(path("plumb-report.tar.gz.bak"), "of somebody").unwrap();
    for former in ["plumb-report.tar.gz.bak2", "plumb-report.tar.gz.bak3"] {
        let before = fs::read(path("plumb-report.tar.gz")).unwrap();
        let output = plumb(&["report", "--port", "/dev/plumb-no-such-port"], folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let says = format!("The former report is now {former}\n");
        assert!(stderr(&output).contains(&says), "{}", stderr(&output));
        assert_eq!(fs::read(path(former)).unwrap(), before);
    }
    assert_eq!(fs::read_to_string(path("plumb-report.tar.gz.bak")).unwrap(), "of somebody");
}

#[test]
fn a_report_takes_the_place_of_a_report_only() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("keep.toml"), "of the rig").unwrap();
    fs::create_dir(path("archive")).unwrap();
    std::os::unix::fs::symlink(path("archive"), path("link")).unwrap();
    for (out, says) in [
        ("keep.toml", "keep.toml: exists already and is no report; give another name"),
        ("archive", "archive: is a folder; name a file"),
        ("link", "link: is a folder; name a file"),
    ] {
        let report = ["report", "--port", "/dev/plumb-no-such-port", "--out", out];
        let output = plumb(&report, folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
    assert_eq!(fs::read_to_string(path("keep.toml")).unwrap(), "of the rig");
    assert!(path("link").symlink_metadata().unwrap().is_symlink());
}
