//! Input that is not what it should be: recordings with odd time stamps, files that are no files,
//! numbers out of range.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use nix::sys::stat::Mode;
use nix::unistd::mkfifo;

use crate::common::{Emulator, folder, json, plumb, program, record, rig_file, rigs, stderr};

/// Runs the program, and stops it where it hangs.
fn ended(arguments: &[&str], folder: &Path) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    for _ in 0..600 {
        if child.try_wait().unwrap().is_some() {
            return child.wait_with_output().unwrap();
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    panic!("it hangs: {arguments:?}");
}

/// Plays the recording of [`record`], each time stamp changed by `stamp` (seconds, and the frame's
/// number), as the camera of a run with an emulated board.
fn play(folder: &Path, stamp: impl Fn(f64, usize) -> String) -> Output {
    let recording = record(folder);
    for list in ["rgb.txt", "depth.txt"] {
        let text = fs::read_to_string(recording.join(list)).unwrap();
        let lines = text.lines().skip(1).enumerate().map(|(number, line)| {
            let (time, file) = line.split_once(' ').unwrap();
            format!("{} {file}\n", stamp(time.parse().unwrap(), number))
        });
        fs::write(recording.join(list), lines.collect::<String>()).unwrap();
    }
    let rig = rig_file(folder, |text| {
        let text = text[..text.find("\n[simulation]").unwrap()].to_owned();
        // What is looked at here is not how busy the machine is.
        let text =
            text.replace("host = 0.3", "host = 5.0").replace("position = 0.5", "position = 5.0");
        let text = text.replace("max_age = 0.25", "max_age = 2.0");
        text.replace("file = \"camera.toml\"", "file = \"camera.toml\"\nrecording = \"recording\"")
    });
    let emulator = Emulator::start();
    ended(&["run", "--rig", &rig, "--port", &emulator.port, "--json", "--out", "run"], folder)
}

#[test]
fn a_recording_with_time_stamps_since_1970_is_played_to_its_end() {
    let folder = folder();
    let output = play(folder.path(), |time, _| format!("{:.6}", 1_305_031_102.175_304 + time));
    let (line, text) = (json(&output), stderr(&output));
    let frames =
        fs::read_to_string(folder.path().join("recording/rgb.txt")).unwrap().lines().count() as u64;
    assert_eq!(line["ending"].as_str(), Some("no more pictures"));
    // A busy computer leaves out pictures that are late.
    assert!((frames - 3..=frames).contains(&line["frames"].as_u64().unwrap()), "{line}");
    assert!(frames > 10 && line["time_s"].as_f64().unwrap() < 60.0, "{line} {text}");
    let rows = fs::read_to_string(folder.path().join("run/run.csv")).unwrap();
    let first: f64 = rows.lines().nth(1).unwrap().split(',').nth(1).unwrap().parse().unwrap();
    assert!((-60.0..60.0).contains(&first), "{first}");
}

#[test]
fn a_gap_in_a_recording_ends_the_run() {
    let folder = folder();
    let output =
        play(
            folder.path(),
            |time, k| if k < 5 { time.to_string() } else { (time + 5e3).to_string() },
        );
    let (line, text) = (json(&output), stderr(&output));
    assert_eq!(
        (output.status.code(), line["frames"].as_u64()),
        (Some(1), Some(5)),
        "{line} {text}"
    );
    assert!(text.contains("gaps of at most 2 s"), "{text}");
}

#[test]
fn time_stamps_beyond_all_clocks_are_lost_frames() {
    let folder = folder();
    let output = play(
        folder.path(),
        |time, k| if k % 5 == 3 { "1e19".to_owned() } else { time.to_string() },
    );
    let (line, text) = (json(&output), stderr(&output));
    assert_eq!(line["ending"], "no more pictures", "{line} {text}");
    // Those of both lists. A busy computer leaves out pictures that are late. A count of 0 is not
    // written.
    let count = |key: &str| line[key].as_u64().unwrap_or(0);
    assert!(
        count("frames") > 5 && count("frames") + count("skipped") > 8 && count("lost") > 2,
        "{line} {text}"
    );
}

#[test]
fn only_regular_files_are_read() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    mkfifo(&folder.path().join("pipe"), Mode::S_IRWXU).unwrap();
    for other in ["pipe", "/dev/zero", "."] {
        for arguments in [
            &["run", "--rig", other] as &[&str],
            &["replay", ".", "--camera", other],
            &["emulate", "--rig", other],
            &["cosim", "--rig", other],
        ] {
            let output = ended(arguments, folder.path());
            let text = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
            assert!(
                text.contains(other) && text.contains("must be a regular file"),
                "{arguments:?}: {text}"
            );
        }
        fs::write(
            &rig,
            fs::read_to_string(rigs().join("paper.toml")).unwrap().replace("camera.toml", other),
        )
        .unwrap();
        let text = stderr(&ended(&["run", "--rig", &rig], folder.path()));
        assert!(text.contains("must be a regular file"), "{text}");
    }
}

#[test]
fn only_regular_files_are_pictures_and_lists() {
    let folder = folder();
    let replay = || ended(&["replay", ".", "--camera", "camera.toml"], folder.path());
    rig_file(folder.path(), |text| text);
    let (rgb, depth) = (folder.path().join("rgb.txt"), folder.path().join("depth.txt"));
    mkfifo(&folder.path().join("pipe"), Mode::S_IRWXU).unwrap();
    fs::write(&depth, "0.0 pipe\n").unwrap();
    fs::write(&rgb, "0.0 pipe\n0.1 /dev/zero\n").unwrap();
    let (output, text) = (replay(), stderr(&replay()));
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("pipe: is a named pipe") && text.contains("/dev/zero: is a device"),
        "{text}"
    );
    fs::remove_file(&rgb).unwrap();
    mkfifo(&rgb, Mode::S_IRWXU).unwrap();
    let (output, text) = (replay(), stderr(&replay()));
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("rgb.txt: is a named pipe"), "{text}");
}

#[test]
fn a_file_above_its_limit_is_refused_with_the_limit() {
    let folder = folder();
    let large = rig_file(folder.path(), |text| format!("{text}{}", "# filled\n".repeat(200_000)));
    let output = plumb(&["run", "--rig", &large], folder.path());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("rig.toml: is too large") && text.contains("at most 1048576"), "{text}");
}

#[test]
fn numbers_that_cannot_be_are_named_with_their_option() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let mut cases = Vec::new();
    for number in ["nan", "inf", "0", "-1"] {
        cases.push((vec!["demo", "--virtual-time", "--timeout", number], "--timeout"));
        cases.push((vec!["run", "--rig", &rig, "--timeout", number], "--timeout"));
        cases.push((vec!["demo", "--virtual-time", "--gamma", number], "--gamma"));
    }
    for number in ["nan", "inf", "1e999"] {
        cases.push((vec!["goto", "--rig", &rig, "0.4", number, "0.15"], "<Y>"));
    }
    for (arguments, named) in cases {
        let output = ended(&arguments, folder.path());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
        assert!(text.contains(named), "{arguments:?}: {text}");
    }
}

/// Starts `plumb cosim` with its input and both outputs in pipes.
fn cosim() -> Child {
    Command::new(env!("CARGO_BIN_EXE_plumb"))
        .arg("cosim")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[test]
fn a_request_with_an_unknown_key_is_refused() {
    let mut cosim = cosim();
    let mut requests = cosim.stdin.take().unwrap();
    writeln!(requests, r#"{{"t": 0.0, "dt": 0.1, "tagret": [0.4, 0.4, 0.15]}}"#).unwrap();
    drop(requests);
    let output = cosim.wait_with_output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("line 1: unknown field `tagret`") && text.contains("`target`"), "{text}");
}

#[test]
fn a_request_without_an_end_is_refused() {
    let mut cosim = cosim();
    let mut requests = cosim.stdin.take().unwrap();
    writeln!(requests, r#"{{"t": 0.0, "dt": 0.1}}"#).unwrap();
    // It goes before all of this is written.
    let _closed = requests.write_all(&vec![b' '; 1 << 20]);
    let status = cosim.wait().unwrap();
    drop(requests);
    let output = cosim.wait_with_output().unwrap();
    let text = stderr(&output);
    assert_eq!(status.code(), Some(2), "{text}");
    assert!(text.contains("line 2: is too long") && text.contains("65536"), "{text}");
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 1);
}

#[test]
fn a_target_that_is_mistyped_is_explained_before_the_port_is_opened() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    for (words, named) in [
        (
            &["0,4", "0.2", "0.3"][..],
            "'0,4' for '<X>': must be a number, -100 to 65535 m or pixels",
        ),
        (&["0.4", "0.2"], "a rig file without [plane] takes a place: x y z"),
        (&["0.4"], "required arguments were not provided:\n  <Y>\n"),
        (&[], "required arguments were not provided:\n  <X>\n  <Y>\n"),
        (&["0.4", "0.2", "-1"], "z = -1 m is below the 0.05 m of `workspace.min`"),
        (&["0.9", "0.2", "0.3"], "x = 0.9 m is above the 0.8 m of `workspace.max`"),
    ] {
        let goto =
            [&["goto", "--rig", &rig] as &[&str], words, &["--port", "/dev/no-such-port"]].concat();
        let output = plumb(&goto, folder.path());
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(named), "{words:?}: {}", stderr(&output));
    }
}

#[test]
fn a_command_without_a_rig_file_is_told_what_to_do() {
    let folder = folder();
    for command in [
        &["run"][..],
        &["goto", "0.4", "0.4", "0.15"],
        &["hold"],
        &["jog", "A", "1"],
        &["home"],
        &["check", "--file-only"],
        &["calibrate", "--board"],
        &["board", "save"],
    ] {
        let output = program(command, folder.path()).env("PLUMB_RIG", "").output().unwrap();
        let says = "plumb: there is no rig.toml in this folder: `plumb init` writes one, and --rig \
                    FILE names another\n";
        assert_eq!(
            (output.status.code(), stderr(&output).as_str()),
            (Some(2), says),
            "{command:?}"
        );
    }
}

#[test]
fn an_option_names_the_rig_file_before_the_variable_and_this_before_the_folder() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    for other in ["a.toml", "b.toml"] {
        fs::copy(&rig, folder.path().join(other)).unwrap();
    }
    let emulator = Emulator::start();
    let port = ["--port", &emulator.port];
    for (options, variable, named) in [
        (&[][..], "", "rig.toml"),
        (&[], "b.toml", "b.toml"),
        (&["--rig", "a.toml"], "b.toml", "a.toml"),
        (&["-r", "a.toml"], "", "a.toml"),
    ] {
        let jog = |more: &[&str]| {
            let line = [&["jog", "A", "0"], &port[..], options, more].concat();
            let output = program(&line, folder.path()).env("PLUMB_RIG", variable).output().unwrap();
            assert_eq!(output.status.code(), Some(0), "{line:?}: {}", stderr(&output));
            stderr(&output)
        };
        let note = format!("rig file {named}, board at {}", emulator.port);
        assert_eq!(jog(&[]).lines().next(), Some(note.as_str()));
        assert_eq!(jog(&["--quiet"]), "");
    }
}

#[test]
fn targets_of_a_file_outside_the_workspace_are_named_with_their_lines() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| {
        text.replace("targets = [[0.400, 0.400, 0.150]]", "targets = [[0.4, 0.4, 0.7]]")
    });
    let fine = rigs().join("paper.toml").to_str().unwrap().to_owned();
    fs::write(folder.path().join("way.csv"), "x,y,z,dwell\n9,0.2,0.3\n0.4,0.2,0.01\n").unwrap();
    fs::write(folder.path().join("path.csv"), "x,y,z\n0.5,0.3,0.3\n0.5,0.9,0.3\n").unwrap();
    for (rig, more, named) in [
        (&rig, &[][..], &["rig.toml:5: error: `targets", "z = 0.7 m is above the 0.6 m of"][..]),
        (&fine, &["way.csv"], &["way.csv:2: [9.0000, 0.2000, 0.3000] m", "way.csv:3:"]),
        (&fine, &["path.csv"], &["path.csv:3: [0.5000, 0.9000, 0.3000] m"]),
    ] {
        let command = if more.is_empty() { "run" } else { "follow" };
        let run = [&[command, "--rig", rig, "--port", "/dev/no-such-port"] as &[&str], more];
        let run = run.concat();
        let output = plumb(&run, folder.path());
        assert_eq!(output.status.code(), Some(2), "{more:?}: {}", stderr(&output));
        for named in named {
            assert!(stderr(&output).contains(named), "{named}: {}", stderr(&output));
        }
    }
}

/// Noise may take the ball across the border, and the board stops then.
#[test]
fn a_target_at_the_border_of_the_workspace_is_named() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let told = |z: &str| {
        let output =
            plumb(&["goto", "--rig", &rig, "0.5", "0.3", z, "--port", "absent"], folder.path());
        stderr(&output).lines().nth(1).unwrap_or_default().to_owned()
    };
    let note = "target 1 is 2 mm from the border of the workspace: the board stops if the ball \
                swings across it; 10 mm are enough";
    assert_eq!(told("0.598"), note);
    assert!(told("0.59").starts_with("plumb: absent: there is no such"), "{}", told("0.59"));
}

#[test]
fn the_help_has_what_is_needed_in_the_brackets_of_the_usage() {
    let help = plumb(&["goto", "--help"], folder().path());
    let text = String::from_utf8(help.stdout).unwrap();
    for line in ["Usage: plumb goto [OPTIONS] <X> <Y> [Z]", "  <X>", "  <Y>", "  [Z]"] {
        assert!(text.lines().any(|it| it == line), "{line}: {text}");
    }
}

#[test]
fn a_port_that_is_no_port_is_named_as_what_it_is() {
    let folder = folder();
    fs::write(folder.path().join("port"), "").unwrap();
    for (port, kind) in
        [("port", "a regular file"), (".", "a folder"), ("/dev/null", "another device")]
    {
        let output = plumb(&["board", "status", "--port", port], folder.path());
        assert_eq!(output.status.code(), Some(2));
        let named = format!("plumb: {port}: this is {kind}, not a serial port; name the port");
        assert!(stderr(&output).contains(&named), "{}", stderr(&output));
    }
}
