//! `--mcap` and `--foxglove`: the file agrees with the run folder, bad input is refused, and a full
//! disk ends the run with the cause.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use nix::sys::signal::Signal;

use crate::common::{
    Emulator, folder, json, limited, patient, plumb, program, rig_file, rigs, send, stderr,
    until_rows,
};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns a Python that has the mcap library, where `scripts/mcap` leaves one; without it the
/// test is passed over, but never with CI set.
fn python_with_mcap() -> Option<PathBuf> {
    let has_mcap = |python: &PathBuf| {
        Command::new(python)
            .args(["-c", "import mcap.reader, mcap_protobuf.decoder"])
            .output()
            .is_ok_and(|it| it.status.success())
    };
    let pythons = [PathBuf::from("python3"), repository().join("target/mcap/bin/python")];
    let python = pythons.into_iter().find(has_mcap);
    if python.is_none() {
        assert!(std::env::var_os("CI").is_none(), "no Python has mcap: scripts/mcap");
        println!("skipped: no Python has mcap (scripts/mcap)");
    }
    python
}

/// Checks `run.mcap` against the run folder `run`, both in `folder`. Returns the number of messages
/// by topic; with `--events` among the options only the events are checked. `None` without Python's
/// library.
pub(crate) fn mcap_agrees(folder: &Path, options: &[&str]) -> Option<Output> {
    let python = python_with_mcap()?;
    let checked = Command::new(python)
        .arg(repository().join("host/tests/stacks/mcap_agrees.py"))
        .args(["run.mcap", "run"])
        .args(options)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(checked.status.success(), "{}", stderr(&checked));
    Some(checked)
}

#[test]
fn the_mcap_file_agrees_with_the_run_folder() {
    let folder = folder();
    let arguments = ["demo", "--virtual-time", "--out", "run", "--mcap", "run.mcap"];
    let output = plumb(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let Some(checked) = mcap_agrees(folder.path(), &[]) else { return };
    let counts = json(&checked);
    assert_eq!(counts["/camera/image"], json(&output)["frames"], "{counts}");
}

/// The file has the colour pictures as JPEG and the lens: the ball is found in it, without depth.
#[test]
fn the_mcap_file_is_a_recording() {
    let folder = folder();
    let demo = ["demo", "--virtual-time", "--out", "run", "--mcap", "run.mcap"];
    let output = plumb(&demo, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let frames = json(&output)["frames"].as_u64().unwrap();

    let output = plumb(&["replay", "run.mcap"], folder.path());
    let text = stderr(&output);
    let says = "with --camera CAMERA.toml; for a file of `--mcap`, which has no depth, a copy";
    assert!(output.status.code() == Some(2) && text.contains(says), "{text}");

    let camera = fs::read_to_string(rigs().join("camera.toml")).unwrap();
    fs::write(folder.path().join("with-depth.toml"), &camera).unwrap();
    let without = camera.replace("depth_scale = 5000.0", "depth_scale = \"none\"");
    assert_ne!(camera, without);
    fs::write(folder.path().join("camera.toml"), without).unwrap();
    let replay =
        |camera| plumb(&["replay", "run.mcap", "--json", "--camera", camera], folder.path());
    let output = replay("camera.toml");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let line = String::from_utf8(output.stdout).unwrap().lines().last().unwrap().to_owned();
    let result: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!(result["frames"].as_u64(), Some(frames), "{result}");
    let located = result["located"].as_u64().unwrap();
    assert!(10 * located >= 9 * frames, "{result}");

    let output = replay("with-depth.toml");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("depth_scale = \"none\""), "{}", stderr(&output));
}

#[test]
fn a_file_that_exists_and_an_address_in_use_are_bad_input() {
    let folder = folder();
    fs::write(folder.path().join("run.mcap"), "precious").unwrap();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("--foxglove-address={}", taken.local_addr().unwrap());
    for (arguments, cause) in [
        (vec!["--virtual-time", "--mcap", "run.mcap"], "exists already"),
        (vec!["--foxglove", address.as_str()], "choose another port, or 0"),
        (vec!["--virtual-time", "--mcap", "run.bag"], "must end in .mcap: the file is an MCAP"),
        (vec!["--virtual-time", "--mcap", "none/run.mcap"], "cannot create none/run.mcap"),
        (
            vec!["--foxglove", "--foxglove-address=192.0.2.7"],
            "it is none of this computer: choose 127.0.0.1",
        ),
        (vec!["--foxglove", "--foxglove-address=here"], "127.0.0.1:8765"),
    ] {
        let output = plumb(&[&["demo", "--out", "run"], &arguments[..]].concat(), folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(cause), "{}", stderr(&output));
        assert!(!folder.path().join("run").exists(), "nothing moves");
    }
    assert_eq!(fs::read_to_string(folder.path().join("run.mcap")).unwrap(), "precious");
}

/// A file that is moved is not lost: its new name has everything.
#[test]
fn a_file_that_is_removed_under_way_fails_the_run() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::in_real_time(&[]);
    let hold = ["hold", "--rig", &rig, "--port", &emulator.port, "--out", "run", "--json"];
    let files = ["--mcap", "run.mcap", "--record", "recording"];
    let removed = ["run.mcap", "run/run.csv", "recording/rgb.txt", "recording/depth.txt"];
    for name in removed.into_iter().chain(["moved.mcap"]) {
        let mut hold = program(&[&hold[..], &files].concat(), folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        until_rows(&mut hold, &path("run"), 10);
        let is_moved = name == "moved.mcap";
        match is_moved {
            true => fs::rename(path("run.mcap"), path(name)).unwrap(),
            false => fs::remove_file(path(name)).unwrap(),
        }
        send(&hold, Signal::SIGINT);
        let output = hold.wait_with_output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(i32::from(!is_moved)), "{name}: {text}");
        let line = text.lines().find(|line| line.contains("was removed while it was written"));
        assert_eq!(line.is_some_and(|line| line.contains(name)), !is_moved, "{name}: {text}");
        for made in ["run", "recording"] {
            fs::remove_dir_all(path(made)).unwrap();
        }
        let _removed = fs::remove_file(path("run.mcap"));
    }
}

#[test]
fn a_full_disk_ends_the_run_in_order_at_the_same_frame() {
    let frames = [(); 2].map(|()| {
        let folder = folder();
        // 1 MiB: some 20 pictures, and all of the run folder.
        let demo = ["demo", "--virtual-time", "--out", "run", "--mcap", "run.mcap"];
        let output = limited(&demo, folder.path(), 2048, "");
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert_eq!(text.matches("run.mcap").count(), 1, "{text}");
        let line = json(&output);
        assert!(line["reached"] == false && line["at_rest"] == true, "{line}");
        let ending = line["ending"].as_str().unwrap();
        assert!(ending.contains("run.mcap") && ending.contains("ulimit -f"), "{line}");
        assert!(ending.contains(" s after the begin of the run; `mcap recover` reads"), "{line}");
        assert!(folder.path().join("run/summary.json").exists());
        line["frames"].as_u64().unwrap()
    });
    assert!(frames[0] > 1 && frames[0] == frames[1], "{frames:?}");
}
