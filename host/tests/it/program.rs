//! The program as a person or a script meets it: what it prints, what it leaves, how it ends.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common::{Emulator, folder, json, plumb, rig_file, rigs, stderr, until_rows};

#[test]
fn the_demo_in_memory_reaches_the_target_and_repeats_itself() {
    let folder = folder();
    let run = |out: &str| {
        plumb(
            &["demo", "--virtual-time", "--law", "interval", "--seed", "7", "--out", out],
            folder.path(),
        )
    };
    let (one, two) = (run("one"), run("two"));
    assert!(one.status.success(), "{}", stderr(&one));
    let line = json(&one);
    assert_eq!(line["reached"], true);
    assert_eq!(line["law"], "interval");
    assert!(
        line["filtered_error_mm"].as_f64().unwrap() < 10.0
            && line["true_error_mm"].as_f64().unwrap() < 10.0,
        "{line}"
    );
    assert!(line["frames"].as_u64().unwrap() > 100);
    assert_eq!(one.stdout, two.stdout);
    for file in ["run.csv", "summary.json", "figure4.svg", "figure5.svg"] {
        let read = |run: &str| fs::read(folder.path().join(run).join(file)).unwrap();
        assert!(!read("one").is_empty());
        assert!(read("one") == read("two"), "{file} differs");
    }
    // y arrives first, x then, z last: the elbow of the paper's figure 4.
    let rows: Vec<Vec<String>> = fs::read_to_string(folder.path().join("one/run.csv"))
        .unwrap()
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(str::to_owned).collect())
        .collect();
    let arrival = |column: usize, target: f64| {
        rows.iter()
            .position(|r| r[column].parse::<f64>().is_ok_and(|v| (v - target).abs() < 0.010))
            .unwrap()
    };
    let (x, y, z) = (arrival(6, 0.4), arrival(7, 0.4), arrival(8, 0.15));
    assert!(y < x && x < z, "x after {x} frames, y after {y}, z after {z}");
}

#[test]
fn the_demo_drives_with_the_default_law_or_with_each_in_turn() {
    let folder = folder();
    let demo = |more: &[&str]| {
        plumb(&[&["demo", "--virtual-time", "--out"], more].concat(), folder.path())
    };
    let usual = demo(&["usual"]);
    assert!(usual.status.success(), "{}", stderr(&usual));
    assert_eq!(json(&usual)["law"], "taut");

    // Too little patience for any of them: every law is run all the same.
    let all = demo(&["all", "--compare", "--timeout", "0.5"]);
    assert_eq!(all.status.code(), Some(1), "{}", stderr(&all));
    let laws: Vec<Value> = String::from_utf8_lossy(&all.stdout)
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    let names: Vec<&str> = laws.iter().map(|line| line["law"].as_str().unwrap()).collect();
    assert_eq!(names, ["interval", "sign", "adaptive", "taut"]);
    let figure = fs::read_to_string(folder.path().join("all/laws.svg")).unwrap();
    for name in names {
        assert!(folder.path().join("all").join(name).join("run.csv").exists());
        assert!(figure.contains(name), "{name} is not in the figure");
    }
}

#[test]
fn a_run_folder_is_never_overwritten() {
    let folder = folder();
    fs::create_dir(folder.path().join("run")).unwrap();
    fs::write(folder.path().join("run/run.csv"), "kept").unwrap();
    let output = plumb(&["demo", "--virtual-time", "--out", "run"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(fs::read_to_string(folder.path().join("run/run.csv")).unwrap(), "kept");
}

#[test]
fn a_timeout_ends_a_run_with_exit_code_1_and_a_whole_folder() {
    let folder = folder();
    let output =
        plumb(&["demo", "--virtual-time", "--timeout", "1", "--out", "run"], folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert_eq!(json(&output)["reached"], false);
    assert!(
        folder.path().join("run/figure4.svg").exists()
            && folder.path().join("run/summary.json").exists()
    );
}

#[test]
fn a_mistake_in_a_rig_file_is_named_with_its_line() {
    let folder = folder();
    let cases: [(&str, &str, &str); 6] = [
        ("max_rate = 400.0", "max_rat = 400.0", "max_rat"),
        ("max_rate = 400.0", "max_rate = -1.0", "max_rate"),
        ("microsteps = 16", "", "microsteps"),
        ("radius = 0.010", "radius = nan", "radius"),
        ("travel = [-1000, 1500]", "travel = [-1000]", "travel"),
        ("start = [0.540, 0.220, 0.459]", "start = [0.540, inf, 0.459]", "start"),
    ];
    for (old, new, named) in cases {
        let rig = rig_file(folder.path(), |text| {
            assert!(text.contains(old));
            text.replacen(old, new, 1)
        });
        let output = plumb(&["run", "--rig", &rig], folder.path());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        let line =
            text.split("rig.toml:").nth(1).and_then(|t| t.split(':').next()).map(str::parse::<u32>);
        assert!(text.contains(named) && matches!(line, Some(Ok(_))), "{new:?}: {text}");
    }
    let law = "[law.interval]\ngamma = 30.0\nalpha = 0.7\nbeta = 0.5\n\n[motors]";
    let rig = rig_file(folder.path(), |text| text.replace("[motors]", law));
    let emulator = Emulator::start();
    let output = plumb(&["run", "--rig", &rig, "--port", &emulator.port], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("alpha <= beta"), "{}", stderr(&output));
}

#[test]
fn a_tilde_that_no_shell_expanded_is_the_home_folder() {
    let folder = folder();
    let home = folder.path().join("home");
    let work = folder.path().join("work");
    fs::create_dir(&home).unwrap();
    fs::create_dir(&work).unwrap();
    let short = ["demo", "--virtual-time", "--timeout", "0.1"];
    let outputs = ["--out=~/runs/1", "--record", "~/rec"];
    for (arguments, file) in [
        (&["init", "~/r", "--yes"][..], "r/rig.toml"),
        (&["check", "--rig", "~/r/rig.toml", "--file-only"], "r/rig.toml"),
        (&["man", "~/man"], "man/plumb.1"),
        (&["report", "--rig", "~/r/rig.toml", "--out=~/a.tar.gz"], "a.tar.gz"),
        (&["calibrate", "--print-board=~/board.pdf"], "board.pdf"),
        (&[&short[..], &outputs].concat(), "runs/1/run.csv"),
        (&["plot", "~/runs/1"], "runs/1/figure4.svg"),
        (&["replay", "~/rec"], "rec/rgb.txt"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        let output = command.args(arguments).current_dir(&work).env("HOME", &home).output();
        let text = stderr(&output.unwrap());
        assert!(home.join(file).exists(), "{arguments:?}: {text}");
        assert!(!work.join("~").exists() && !text.contains('~'), "{arguments:?}: {text}");
    }
}

#[test]
fn a_mistake_in_a_camera_file_is_named_with_its_line() {
    let folder = folder();
    let camera = fs::read_to_string(rigs().join("camera.toml")).unwrap();
    fs::write(folder.path().join("camera.toml"), camera.replace("cx = 319.5", "cz = 319.5"))
        .unwrap();
    let output = plumb(&["replay", ".", "--camera", "camera.toml"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("camera.toml:6:"), "{}", stderr(&output));
}

#[test]
fn a_port_that_cannot_be_opened_is_named() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let run = |port: &str| {
        plumb(&["goto", "--rig", &rig, "0.4", "0.4", "0.15", "--port", port], folder.path())
    };
    let absent = run("/dev/ttyNOSUCH");
    assert_eq!(absent.status.code(), Some(2));
    assert!(
        stderr(&absent).contains(
            "/dev/ttyNOSUCH: there is no such serial port. This rig is simulated: `plumb emulate"
        ),
        "{}",
        stderr(&absent)
    );
    let file = run("camera.toml");
    assert_eq!(file.status.code(), Some(2));
    assert!(
        stderr(&file).contains("this is a regular file, not a serial port"),
        "{}",
        stderr(&file)
    );
    let emulator = Emulator::start();
    let _held = serialport::new(&emulator.port, 115_200).open_native().unwrap();
    let busy = run(&emulator.port);
    assert_eq!(busy.status.code(), Some(2));
    assert!(stderr(&busy).contains("another program uses this serial port"), "{}", stderr(&busy));
    let stop = plumb(&["stop", "--port", &emulator.port, "--json"], folder.path());
    assert_eq!(stop.status.code(), Some(2));
    let error = json(&stop)["error"].as_str().unwrap().to_owned();
    assert!(error.contains("has sent nothing") && error.contains("Ctrl-C"), "{error}");
    assert!(!folder.path().join("runs").exists(), "nothing was run");
}

#[test]
fn a_board_is_asked_how_it_is_and_configured() {
    let emulator = Emulator::start();
    let board = |arguments: &[&str]| {
        plumb(&[&["board"], arguments, &["--port", &emulator.port]].concat(), Path::new("."))
    };
    let line = json(&board(&["status", "--json"]));
    assert_eq!(
        (&line["state"], &line["bad_frames"]),
        (&"unconfigured".into(), &0.into()),
        "{line}"
    );
    assert_eq!(line["motors_steps"], serde_json::json!([0.0, 0.0, 0.0]));
    let firmware = serde_json::json!({
        "release": env!("CARGO_PKG_VERSION"),
        "commit": null,
        "board": "an emulated board",
        "stepping": null,
    });
    assert_eq!(line["firmware"], firmware);
    let counts = &line["counts"];
    assert_eq!((&counts["start_cause"], &counts["late_ticks"]), (&"power on".into(), &0.into()));

    let test = board(&["selftest", "--yes"]);
    assert_eq!(test.status.code(), Some(1), "an emulated board has no pins: {}", stderr(&test));
    assert!(stderr(&test).contains("cannot do that"), "{}", stderr(&test));
    let unasked = board(&["selftest"]);
    assert_eq!(unasked.status.code(), Some(2));
    assert!(stderr(&unasked).contains("--yes"), "{}", stderr(&unasked));

    let folder = folder();
    let skr =
        rig_file(folder.path(), |text| text.replace("[board]", "[board]\nkind = \"skr-pico\""));
    let test = board(&["selftest", "--rig", &skr, "--yes"]);
    assert!(stderr(&test).contains("board.kind = \"skr-pico\""), "{}", stderr(&test));

    let save = board(&["save", "--rig", &rig_file(folder.path(), |text| text)]);
    assert_eq!(save.status.code(), Some(1));
    // The emulated board has no flash; its configuration has arrived all the same.
    assert!(stderr(&save).contains("cannot do that"), "{}", stderr(&save));
    assert_eq!(json(&board(&["status", "--json"]))["state"], "ready");
}

#[test]
fn a_target_outside_the_workspace_is_bad_input() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let emulator = Emulator::start();
    let goto = ["goto", "--rig", &rig, "0.4", "0.4", "0.7", "--port", &emulator.port];
    let output = plumb(&goto, folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("outside the workspace"), "{}", stderr(&output));
    assert!(!folder.path().join("runs").exists(), "nothing was run");
}

#[test]
fn pulling_the_plug_ends_a_run_with_its_folder_whole() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let emulator = Emulator::start();
    let mut run = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["run", "--rig", &rig, "--port", &emulator.port, "--json", "--out", "run"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let rows = || {
        fs::read_to_string(folder.path().join("run/run.csv")).unwrap_or_default().lines().count()
    };
    until_rows(&mut run, &folder.path().join("run"), 10);
    drop(emulator);
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("unplugged"), "{text}");
    let last = text.lines().last().unwrap();
    assert!(last.contains(". Start `plumb emulate` again"), "{text}");
    let line = json(&output);
    assert_eq!(line["reached"], false);
    assert_eq!(line["frames"].as_u64().unwrap() as usize, rows() - 1);
    let summary = fs::read_to_string(folder.path().join("run/summary.json")).unwrap();
    assert!(summary.contains("unplugged"), "{summary}");
    assert!(
        folder.path().join("run/figure4.svg").exists()
            && folder.path().join("run/figure5.svg").exists()
    );
}

#[test]
fn the_emulated_board_stops_by_its_own_deadline_when_its_host_dies() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let mut emulator = Emulator::start();
    let mut run = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["run", "--rig", &rig, "--port", &emulator.port, "--out", "run"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut states =
        BufReader::new(emulator.child.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(states.any(|line| line.ends_with("state=seeking")));
    run.kill().unwrap();
    run.wait().unwrap();
    assert!(states.any(|line| line.contains("state=fault: nothing came from the host")));
}
