//! Command lines that a person mistypes, and files in the place of others: what the answer says.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::ffi::OsStr;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::{Command, Stdio};

use nix::pty::openpty;
use nix::sys::signal::Signal;

use crate::common::{Emulator, folder, json, patient, plumb, program, rig_file, send, stderr};

/// Runs the program with bad input. Returns what it prints for people.
fn refusal(arguments: &[&str], folder: &Path) -> String {
    let output = plumb(arguments, folder);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

#[test]
fn a_camera_file_and_a_rig_file_are_told_apart() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    fs::create_dir(folder.path().join("recording")).unwrap();
    let camera = "camera.toml: this is a camera file; give the rig file\n";
    for arguments in [
        &["goto", "camera.toml", "0.4", "0.3", "0.2"][..],
        &["emulate", "camera.toml"],
        &["run", "camera.toml"],
    ] {
        assert_eq!(refusal(arguments, folder.path()), format!("plumb: {camera}"));
    }
    let checked = refusal(&["check", "camera.toml", "--file-only"], folder.path());
    assert!(checked.starts_with("camera.toml: error: this is a camera file; give"), "{checked}");
    assert!(!checked.contains("remove it"), "{checked}");
    for (arguments, says) in [
        (&["replay", "recording", "--camera", "rig.toml"][..], "give the camera file"),
        (&["board", "flash", &rig], "rig.toml: this is a rig file, and no UF2 file: give it with"),
        (&["run", &rig, "--path", "rig.toml"], "this is a rig file, and no path"),
        (&["run", &rig, "--waypoints", "rig.toml"], "a rig file, and no list of waypoints"),
    ] {
        let text = refusal(arguments, folder.path());
        assert!(text.contains("rig.toml: this is a rig file") && text.contains(says), "{text}");
    }
}

#[test]
fn the_last_line_of_a_wrong_command_line_says_what_is_wrong() {
    let folder = folder();
    let last = |arguments: &[&str]| {
        let text = refusal(arguments, folder.path());
        assert!(!text.contains("as a value") && !text.contains("--help"), "{text}");
        text.lines().last().unwrap().to_owned()
    };
    let similar = "plumb: unexpected argument '--ye' found; a similar argument exists: '--yes'";
    assert_eq!(last(&["check", "rig.toml", "--ye"]), similar);
    let law = last(&["run", "rig.toml", "--detector", "bal"]);
    assert!(law.starts_with("plumb: invalid value 'bal' for '--detector"), "{law}");
    assert!(law.ends_with("[possible values: ball, red]; a similar value exists: 'ball'"), "{law}");
    let missing = last(&["run", "--speed", "0.1"]);
    let expected = "plumb: no rig file is named: put it first, or set PLUMB_RIG (`plumb init` \
                    writes one); --path <FILE|SHAPE> is missing too; usage: plumb run [OPTIONS] \
                    [RIG]";
    assert_eq!(missing, expected);
    for (arguments, says) in [
        (&["run", "--rig", "x.toml"][..], "'--rig' found; the rig file has no option: put it"),
        (&["status"], "'status'; write `plumb board status`"),
        (&["flash"], "'flash'; write `plumb board flash`"),
        (&["control", "--json"], "'control'; write `plumb bench control`"),
        (&["rig.toml"], "a command comes first: `plumb run rig.toml`"),
        (&["way.csv"], "`plumb run RIG --waypoints FILE` or `--path FILE`"),
        (&["circle"], "for a shape: `plumb run RIG --path circle`"),
        (&["simulate"], "'simulate'; a similar subcommand exists: 'emulate'"),
        (&["board", "stauts"], "'stauts'; a similar subcommand exists: 'status'"),
        (&["hold", "rig.toml", "--timeout", "9"], "`timeout -s INT 9 plumb hold RIG` ends it"),
        (&["run", "rig.toml", "way.csv"], "`plumb run RIG --waypoints FILE` or `--path FILE`"),
        (
            &["run", "rig.toml", "--path", "eight", "--centre", "0.5", "0.2", "0.3"],
            "without spaces: 0.4",
        ),
        (&["init", "--sides", "0.6,", "0.8,", "0.9"], "without spaces"),
        (&["run", "rig.toml", "circle"], "for a shape: --path circle"),
        (&["demo", "circle"], "for a shape: --path circle"),
        (&["demo", "way.csv"], "found; for a list of places: --path way.csv"),
        (&["version"], "unrecognized subcommand 'version'; write `plumb --version`"),
        (&["examples"], "'examples'; the commands are demo, run, goto, hold, jog,"),
        (&["board", "xyz"], "'xyz'; the commands are status, save, selftest,"),
        (&["demo", "--port", "x"], "'--port' found; the demo has its own board: `plumb run RIG"),
        (&["emulate", "--port", "x"], "a port of its own: --link PATH names it"),
        (&["cosim", "--loop"], "'--loop' found; commands with --loop: run"),
        (
            &["emulate", "--driver", "hot"],
            "'--driver' found; a similar argument exists: '--driver-",
        ),
        (&["demo", "0.4", "0.2", "0.1"], "'0.4' found"),
        (&["check", "rig.toml", "circle"], "'circle' found"),
        (&["check", "rig.toml", "way.csv"], "'way.csv' found"),
        (&["board", "status", "rig.toml", "0.4"], "'0.4' found"),
        (&["demo", "--path", "eight", "--speed", "50mm"], "; write 0.05, in m/s"),
        (&["run", "rig.toml", "--baud", "115200baud"], "; write 115200 alone, in bit/s"),
        (&["run", "rig.toml", "--port", ""], "--port <PORT>': name a port, such as /dev/ttyACM0"),
        (&["board", "status", "--port="], "--port <PORT>': name a port, such as /dev/ttyACM0"),
        (&["run", "rig.toml", "--timeout", "2min"], "; write 120, in s"),
        (&["init", "--microsteps", "1/16"], "1 to 16 microsteps; write 16"),
        (&["board", "status", "/dev/ttyACM0"], "no rig file: give it with --port /dev/ttyACM0"),
        (&["board", "status", "ttyACM0"], "no rig file: give it with --port /dev/ttyACM0"),
        (&["board", "status", "rig.toml", "/dev/ttyACM0"], "port: --port /dev/ttyACM0"),
        (&["board", "status", "/dev/ttyACM0", "rig.toml"], "port: --port /dev/ttyACM0"),
        (&["emulate", "/dev/ttyACM0"], "a port of its own, which --link names"),
        (&["cosim", "/dev/ttyACM0"], "a port is no rig file: this command opens no port"),
        (&["emulate", "board"], ". For the name of the board's port: --link board"),
        (&["home", "A"], "the word is taken for the rig file; write its name, such as rig.toml"),
        (&["hold", "5"], "the word is taken for the rig file; write its name, such as rig.toml"),
        (&["run", "--timeout", "30", "s"], "above 0, to 1e9 s; write 30 alone, in s"),
        (
            &["run", "circle"],
            "'circle' for '<RIG>': this is no rig file; for a shape: `plumb run RIG --path circle`",
        ),
        (&["run", "0.6,0.25,0.3"], "one place: `plumb goto RIG 0.6 0.25 0.3`"),
        (&["run", "rig.toml", "0.6;0.25;0.3"], "one place: `plumb goto RIG 0.6 0.25 0.3`"),
        (&["0.6,0.25,0.3"], "one place: `plumb goto RIG 0.6 0.25 0.3`"),
        (&["goto", "rig.toml", "0.6,0.25,0.3"], "plumb: write `plumb goto rig.toml 0.6 0.25 0.3`"),
        (&["goto", "[0.6; 0.25; 0.3]"], "plumb: write `plumb goto RIG 0.6 0.25 0.3`"),
        (
            &["goto", "rig.toml", "650 -300 40"],
            "write `plumb goto rig.toml 0.65 -0.3 0.04`, in metres, if these are millimetres",
        ),
        (
            &["goto", "rig.toml", "650", "300", "400"],
            "If these are millimetres: `plumb goto rig.toml 0.65 0.3 0.4`",
        ),
        (&["goto", "rig.toml", "circle"], "for a shape: `plumb run RIG --path circle`; usage:"),
        (&["goto", "way.csv"], "for a list of places: `plumb run RIG --waypoints FILE`"),
        (&["run", "rig.toml", "/dev/ttyACM0"], "for the board's port: --port /dev/ttyACM0"),
        (&["goto", "rig.toml", "1", "1", "1", "/dev/ttyACM0"], "port: --port /dev/ttyACM0"),
        (&["run", "0.6", "0.25", "0.3"], "one place: `plumb goto RIG 0.4 0.2 0.15`"),
        (&["run", "rig.toml", "-0.6,0.25,0.3"], "one place: `plumb goto RIG -0.6 0.25 0.3`"),
        (&["goto", "rig.toml", "-0.6,0.25,0.3"], "'-0' found; write `plumb goto rig.toml -0.6"),
        (
            &["goto", "rig.toml", "40", "30", "20", "cm"],
            "write numbers alone, the coordinates in m",
        ),
        (&["demo", "rig.toml"], "the demo has its own rig: `plumb run RIG` takes a rig file"),
        (&["run", "rig.toml", "--timeout", "30", "s"], "above 0, to 1e9 s; write 30 alone, in s"),
        (&["run", "--timeout=30", "s", "rig.toml"], "above 0, to 1e9 s; write 30 alone, in s"),
        (&["demo", "--path", "eight", "--size", "20", "cm"], "0.001 to 8 m; write 0.2, in m"),
        (&["demo", "--path", "eight", "--timeout", "9", "circle"], "for a shape: --path circle"),
        (&["emulate", "--lost", "5"], "5 must be 0 to 1; write 0.05 for 5 %"),
        (&["demo", "--seed", "1e3"], "must be a whole number, 0 to 1e15; write 1000"),
        (&["board", "flash", "/dev/ttyACM0"], "a port is no UF2 file: give it with --port"),
    ] {
        let text = last(arguments);
        assert!(text.contains(says), "{text}");
        assert!(!says.ends_with("found") || text.ends_with(says), "{text}");
    }
    let numbers = last(&["goto", "0.62", "0.26", "0.36", "0.4"]);
    assert!(numbers.starts_with("plumb: too many numbers: <X> <Y> <Z> are needed"), "{numbers}");
    let port = last(&["demo", "--page", "99999"]);
    assert_eq!(port, last(&["demo", "--page=99999"]));
    assert!(port.contains("give an IP address, a port or both"), "{port}");
}

#[test]
fn the_usage_says_that_a_variable_can_name_the_rig_file() {
    let folder = folder();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(arguments).env("PLUMB_RIG", "rig.toml").current_dir(folder.path());
        command.output().unwrap()
    };
    let help = String::from_utf8(run(&["run", "--help"]).stdout).unwrap();
    assert!(help.contains("Usage: plumb run [OPTIONS] [RIG]\n"), "{help}");
    let output = run(&["run", "--speed", "0.1", "--port", "x"]);
    let expected = "Usage: plumb run [OPTIONS] [RIG]\nplumb: the following required arguments were \
                    not provided: --path <FILE|SHAPE>\n";
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(2), expected));
}

#[test]
fn a_missing_file_or_port_of_a_variable_is_told_with_the_variable() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let port = "/dev/plumb-gone";
    for (variable, value, arguments, says) in [
        ("PLUMB_RIG", "gone.toml", &["jog", "A", "1"][..], "gone.toml (named by PLUMB_RIG): "),
        ("PLUMB_RIG", "gone.toml", &["jog", "gone.toml", "A", "1"], "plumb: gone.toml: cannot"),
        ("PLUMB_PORT", port, &["jog", &rig, "A", "1"], "plumb-gone (named by PLUMB_PORT): there"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(arguments).env(variable, value).current_dir(folder.path());
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
}

#[test]
fn a_word_that_is_no_file_is_told_as_taken_for_the_rig_file() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    for (arguments, says) in [
        (
            &["home", "A"][..],
            "for the rig file; PLUMB_RIG names that already: leave the word out\n",
        ),
        (&["run", "--timeout", "30", "s"], "; write 30 alone, in s\n"),
        (&["jog", "A"], "the distance is missing"),
        (&["jog", "A", "200", "rig.toml"], "put the rig file rig.toml first; usage: "),
        (&["goto", "0.6", "0.3", "0.4", "rig.toml"], "put the rig file rig.toml first; usage: "),
        (&["goto", "650,300,400"], "`plumb goto 0.65 0.3 0.4`, in metres"),
    ] {
        let output = program(arguments, folder.path()).env("PLUMB_RIG", &rig).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
}

#[test]
fn a_missing_rig_file_is_told_with_the_command_that_writes_one() {
    let folder = folder();
    for arguments in [
        &["run", "gone.toml"][..],
        &["hold", "gone.toml"],
        &["goto", "gone.toml", "1", "2", "3"],
        &["home", "gone.toml"],
        &["jog", "gone.toml", "A", "1"],
        &["check", "gone.toml"],
        &["calibrate", "gone.toml", "--board"],
        &["report", "gone.toml"],
        &["emulate", "gone.toml"],
        &["cosim", "gone.toml"],
    ] {
        let text = refusal(arguments, folder.path());
        let says = "`plumb init` writes a rig file and its camera file\n";
        assert!(text.ends_with(says), "{arguments:?}: {text}");
    }
}

#[test]
fn a_word_that_is_no_text_does_not_hide_the_mistake() {
    let folder = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(["run", "--out"]).arg(OsStr::from_bytes(b"run-\xff"));
    let output = command.env("PLUMB_RIG", "gone.toml").current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("gone.toml (named by PLUMB_RIG): "), "{}", stderr(&output));
}

/// A name that is too long fails as a folder without permission does.
#[test]
fn a_file_that_cannot_be_looked_at_is_not_told_as_missing() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let long = "x".repeat(300);
    for arguments in [
        &["run", &rig, "--port", "/dev/null", "--targets", &long][..],
        &["replay", &long],
        &["report", "--run", &long],
    ] {
        let text = refusal(arguments, folder.path());
        assert!(text.contains("cannot be read: File name too long"), "{arguments:?}: {text}");
    }
}

#[test]
fn a_real_rig_at_an_emulated_board_is_told_of_a_simulated_one() {
    let folder = folder();
    let webcam = "file = \"camera.toml\"\nsource = \"webcam\"\nwebcam.device = \"/dev/nix\"";
    let rig = rig_file(folder.path(), |text| {
        let text = text[..text.find("\n[simulation]").unwrap()].to_owned();
        text.replace("file = \"camera.toml\"", webcam)
    });
    let emulator = Emulator::start();
    let says = format!(
        "has no [simulation]: its pictures come from a real camera or from another program. A \
         simulated rig for this board: `plumb init trial --simulated`, then `plumb run \
         trial/rig.toml --port {}`\n",
        emulator.port
    );
    for command in [&["run", &rig][..], &["hold", &rig], &["check", &rig, "--yes"]] {
        let arguments = [command, &["--port", &emulator.port]].concat();
        let text = refusal(&arguments, folder.path());
        assert!(text.ends_with(&says), "{command:?}: {text}");
    }
    let text = refusal(&["run", &rig, "--port", "/dev/ttyNOSUCH"], folder.path());
    assert!(
        text.ends_with("Without a board: `plumb init trial --simulated` writes a simulated rig\n")
    );
}

#[test]
fn folders_and_devices_in_the_place_of_files_are_named() {
    let folder = folder();
    let path = folder.path();
    let recorded = path.join("runs/run-0001");
    fs::create_dir_all(&recorded).unwrap();
    fs::write(recorded.join("run.csv"), "").unwrap();
    fs::create_dir(path.join("r2")).unwrap();
    fs::write(path.join("way.csv"), "x,y,z\n").unwrap();
    fs::write(path.join("r2/rig.toml"), "").unwrap();
    for (arguments, says) in [
        (&["replay", "nix", "--camera", "c.toml"][..], "nix: there is no such recording"),
        (
            &["replay", "way.csv"],
            "way.csv: is no recording, but a list. Of pictures: give the folder that it is in. Of",
        ),
        (&["replay", "r2"], "r2: has no rgb.txt or color.txt or colour.txt: a recording is"),
        (&["man", "way.csv"], "way.csv: is a file, but must be a folder: name"),
        (&["replay", "r2/rig.toml"], "a .bag or .db3 file of librealsense2, or an .mcap file of"),
        (&["plot", "r2", "runs/run-0001", "--out", "both.png"], "both.png: must end in .svg"),
        (&["bench", "control", "--svg", "all.pdf"], "all.pdf: must end in .svg"),
        (
            &["replay", "runs/run-0001"],
            "this is a run's folder, and no recording: `plumb run --rec",
        ),
        (&["run", "r2"], "r2 is a folder, but must be a regular file: its rig file is r2/rig.toml"),
        (&["calibrate", "r2", "--board"], "r2 is a folder, but must be a regular file"),
        (&["emulate", "r2"], "r2 is a folder, but must be a regular file: its rig file is"),
        (&["board", "status", "r2"], "r2 is a folder, but must be a regular file: its rig file"),
        (
            &["goto", "r2", "0.4", "0.3", "0.2"],
            "r2 is a folder, but must be a regular file: its rig file is r2/rig.toml",
        ),
        (&["plot", "runs/run-0001", "--out", "x.png"], "--out is for the errors of several runs"),
        (&["init", "--yes", "--sides", "61,88,93"], "is it in centimetres?"),
        (&["init", "--yes", "--height", "66"], "is it in centimetres?"),
        (&["check", "absent.toml", "--file-only"], "absent.toml: error: cannot be read: No such"),
    ] {
        let text = refusal(arguments, path);
        assert!(text.contains(says), "{says}: {text}");
    }
    let output = plumb(&["init", "new", "--yes", "--driver", "TMC2209"], path);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(fs::read_to_string(path.join("new/rig.toml")).unwrap().contains("\"tmc2209\""));
}

#[test]
fn a_folder_of_an_earlier_run_is_refused_before_the_camera_is_prepared() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("out/run.csv"), "").unwrap();
    let emulator = Emulator::start();
    let run = ["run", &rig, "--port", &emulator.port, "--out", "out"];
    let text = refusal(&run, folder.path());
    assert!(text.contains("out") && !text.contains("preparing"), "{text}");
}

#[test]
fn a_second_board_at_one_link_is_told_that_the_first_one_can_be_used() {
    let folder = folder();
    let link = folder.path().join("board");
    let link = link.to_str().unwrap();
    let _first = Emulator::start_with(&["--link", link]);
    let text = refusal(&["emulate", "--link", link], folder.path());
    let says = format!("an emulated board runs there, and `--port {link}` uses it");
    assert!(text.contains(&says), "{text}");
}

#[test]
fn the_port_of_an_emulated_board_in_the_place_of_a_file_is_told_with_its_option() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let link = folder.path().join("board");
    let emulator = Emulator::start_with(&["--link", link.to_str().unwrap()]);
    for port in ["board", &emulator.port] {
        for command in ["run", "check", "hold", "jog", "stop", "clear"] {
            let text = refusal(&[command, port], folder.path());
            let says = format!(": a port is no rig file: give it with --port {port}\n");
            assert!(text.ends_with(&says), "{text}");
            assert!(text.contains(&format!("invalid value '{port}' for ")), "{text}");
        }
        let text = refusal(&["run", &rig, port], folder.path());
        assert!(text.ends_with(&format!("; for the board's port: --port {port}\n")), "{text}");
    }
}

#[test]
fn a_rig_file_and_a_list_may_be_called_like_a_shape() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let waypoints = ["run", &rig, "--waypoints", "circle"];
    let text = refusal(&waypoints, folder.path());
    let says = "--waypoints circle: there is no such file; for a shape: --path circle\n";
    assert!(text.ends_with(says), "{text}");
    fs::write(folder.path().join("circle"), "").unwrap();
    let text = refusal(&waypoints, folder.path());
    assert!(!text.contains("--path"), "{text}");
    fs::rename(&rig, folder.path().join("circle")).unwrap();
    let output = plumb(&["check", "circle", "--file-only"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

/// Without a terminal nobody can be asked; a person may say no.
#[test]
fn a_check_without_a_yes_moves_nothing_and_says_why() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let check = ["check", &rig, "--port", &emulator.port];
    let output = program(&check, folder.path()).output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    let nobody = "? Nobody can be asked on this input: say yes with --yes\n";
    assert!(text.ends_with(nobody), "{text}");
    let terminal = openpty(None, None).unwrap();
    fs::File::from(terminal.master.try_clone().unwrap()).write_all(b"n\n").unwrap();
    let output = program(&check, folder.path()).stdin(terminal.slave).output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.ends_with("plumb: nothing has moved: the check goes on after a yes only\n"),
        "{text}"
    );
}

/// The board's process is stopped, so that the check waits for its greeting when the signal comes.
#[test]
fn a_signal_before_a_check_moves_nothing_and_says_so() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    send(&emulator.child, Signal::SIGSTOP);
    let check = ["check", &rig, "--port", &emulator.port, "--yes", "-vv"];
    let mut check = program(&check, folder.path()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(check.stderr.take().unwrap()).lines().map(Result::unwrap);
    let waits = lines.find(|line| line.contains("no answer from the board: sending"));
    assert!(waits.is_some(), "the check has ended");
    send(&check, Signal::SIGINT);
    assert!(lines.any(|line| line.contains("Ctrl-C again")));
    send(&emulator.child, Signal::SIGCONT);
    let last = lines.last().unwrap();
    assert_eq!(last, "plumb: interrupted before the check began: nothing was moved");
    assert_eq!(check.wait().unwrap().code(), Some(1));
}

#[test]
fn a_jog_with_another_unit_or_of_no_distance_is_told_in_words() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let jog = |words: &[&str], variable: bool| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.arg("jog").args(words).args(["--port", &emulator.port, "--json"]);
        if variable {
            command.env("PLUMB_RIG", &rig);
        }
        command.output().unwrap()
    };
    for (words, variable) in [(&[&rig, "A", "10", "mm"][..], false), (&["A", "10", "mm"], true)] {
        let output = jog(words, variable);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        let error = json(&output)["error"].as_str().unwrap().to_owned();
        let line = words[..words.len() - 1].join(" ");
        let says = format!("10 mm: write number and unit in one word: `plumb jog {line}mm`");
        assert_eq!(error, says);
    }
    let text = stderr(&jog(&["A", "10cm"], true));
    assert!(text.contains("cm is none of them") && !text.contains("write 10 alone"), "{text}");
    let output = jog(&["A", "0"], true);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("motor A: stays where it is"), "{}", stderr(&output));
    let clear = plumb(&["clear", "--port", &emulator.port], folder.path());
    assert!(stderr(&clear).contains(": there was no fault\n"), "{}", stderr(&clear));
}
