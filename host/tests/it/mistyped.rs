//! Command lines that a person mistypes: what the answer says.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::process::Command;

use crate::common::{Emulator, folder, json, patient, plumb, program, refusal, rig_file, stderr};

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
        (
            &["replay", "--rig", "rec/rig.toml", "rec"],
            "'--rig' found; a recording takes a camera file, and no rig file: --camera FILE",
        ),
        (&["cameras", "--rig", "rig.toml"], "'--rig' found; commands with --rig: board"),
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
fn a_word_that_is_no_text_does_not_hide_the_mistake() {
    let folder = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(["run", "--out"]).arg(OsStr::from_bytes(b"run-\xff"));
    let output = command.env("PLUMB_RIG", "gone.toml").current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("gone.toml (named by PLUMB_RIG): "), "{}", stderr(&output));
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
