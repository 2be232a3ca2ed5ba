//! Files, folders and ports in the place of others, and missing ones: what the answer says.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::process::Command;

use crate::common::{Emulator, folder, plumb, refusal, rig_file, stderr};

#[test]
fn a_camera_file_and_a_rig_file_are_told_apart() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    fs::create_dir(folder.path().join("recording")).unwrap();
    let camera = "camera.toml: this is a camera file; give the rig file\n";
    for arguments in [
        &["goto", "--rig", "camera.toml", "0.4", "0.3", "0.2"][..],
        &["emulate", "--rig", "camera.toml"],
        &["run", "--rig", "camera.toml"],
    ] {
        assert_eq!(refusal(arguments, folder.path()), format!("plumb: {camera}"));
    }
    let checked = refusal(&["check", "--rig", "camera.toml", "--file-only"], folder.path());
    assert!(checked.starts_with("camera.toml: error: this is a camera file; give"), "{checked}");
    assert!(!checked.contains("remove it"), "{checked}");
    for (arguments, says) in [
        (&["replay", "recording", "--camera", "rig.toml"][..], "give the camera file"),
        (&["board", "flash", &rig], "rig.toml: this is a rig file, and no UF2 file: give it with"),
    ] {
        let text = refusal(arguments, folder.path());
        assert!(text.contains("rig.toml: this is a rig file") && text.contains(says), "{text}");
    }
}

#[test]
fn a_missing_rig_file_of_the_variable_is_told_with_the_variable() {
    let folder = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(["jog", "A", "1"]).env("PLUMB_RIG", "gone.toml").current_dir(folder.path());
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(stderr(&output), "plumb: gone.toml: no such file (PLUMB_RIG)\n");
}

#[test]
fn a_missing_rig_file_is_told_with_the_command_that_writes_one() {
    let folder = folder();
    for arguments in [
        &["run", "--rig", "gone.toml"][..],
        &["hold", "--rig", "gone.toml"],
        &["goto", "--rig", "gone.toml", "1", "2", "3"],
        &["home", "--rig", "gone.toml"],
        &["jog", "--rig", "gone.toml", "A", "1"],
        &["check", "--rig", "gone.toml"],
        &["calibrate", "--rig", "gone.toml", "--board"],
        &["report", "--rig", "gone.toml"],
        &["emulate", "--rig", "gone.toml"],
        &["cosim", "--rig", "gone.toml"],
    ] {
        let text = refusal(arguments, folder.path());
        let says = "`plumb init` writes a rig file and its camera file\n";
        assert!(text.ends_with(says), "{arguments:?}: {text}");
    }
}

#[test]
fn a_place_that_is_no_number_or_no_text_is_told() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    fs::write(folder.path().join("nan.csv"), "0.4,0.3,0.2\n0.4,nan,0.3\n").unwrap();
    fs::write(folder.path().join("latin.csv"), b"# H\xf6he\n0.4,0.3,0.2\n").unwrap();
    for (file, says) in [
        ("nan.csv", "nan.csv:2: `y = nan` is wrong: must be a number"),
        ("latin.csv", "latin.csv:1: is not UTF-8 text; save it as UTF-8, from a spreadsheet as"),
    ] {
        let text = refusal(&["follow", "--rig", &rig, "--port", "/dev/null", file], folder.path());
        assert!(text.contains(says), "{file}: {text}");
    }
}

#[test]
fn a_file_that_cannot_be_looked_at_is_not_told_as_missing() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let long = "x".repeat(300);
    for arguments in [
        &["follow", "--rig", &rig, "--port", "/dev/null", &long][..],
        &["replay", &long],
        &["report", "--run", &long],
    ] {
        let text = refusal(arguments, folder.path());
        assert!(text.contains("cannot be read: File name too long"), "{arguments:?}: {text}");
    }
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
    fs::create_dir(path.join("bag2")).unwrap();
    fs::write(path.join("bag2/metadata.yaml"), "").unwrap();
    for (arguments, says) in [
        (&["replay", "nix", "--camera", "c.toml"][..], "nix: there is no such recording"),
        (
            &["replay", "way.csv"],
            "way.csv: is no recording, but a list. Of pictures: give the folder that it is in. Of",
        ),
        (&["replay", "r2"], "r2: has no rgb.txt or color.txt or colour.txt: a recording is"),
        (&["replay", "bag2"], "then a file); of a folder of rosbag2 give the .mcap file in it"),
        (&["man", "way.csv"], "way.csv: is a file, but must be a folder: name"),
        (&["replay", "r2/rig.toml"], "a .bag or .db3 file of librealsense2, or an .mcap file of"),
        (&["plot", "r2", "runs/run-0001", "--out", "both.png"], "both.png: must end in .svg"),
        (
            &["replay", "runs/run-0001"],
            "this is a run's folder, and no recording: `plumb run --rec",
        ),
        (&["run", "--rig", "r2"], "r2: is a folder, but must be a regular file"),
        (&["calibrate", "--rig", "r2", "--board"], "r2: is a folder, but must be a regular file"),
        (&["emulate", "--rig", "r2"], "r2: is a folder, but must be a regular file"),
        (&["board", "status", "--rig", "r2"], "r2: is a folder, but must be a regular file"),
        (
            &["goto", "--rig", "r2", "0.4", "0.3", "0.2"],
            "r2: is a folder, but must be a regular file",
        ),
        (&["plot", "runs/run-0001", "--out", "x.png"], "--out is for the errors of several runs"),
        (&["init", "--yes", "--sides", "61,88,93"], "is it in centimetres?"),
        (&["init", "--yes", "--height", "66"], "is it in centimetres?"),
        (
            &["check", "--rig", "absent.toml", "--file-only"],
            "absent.toml: error: absent.toml: cannot be read: No such",
        ),
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
    let run = ["run", "--rig", &rig, "--port", &emulator.port, "--out", "out"];
    let text = refusal(&run, folder.path());
    assert!(text.contains("out") && !text.contains("preparing"), "{text}");
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
         --rig trial/rig.toml --port {}`\n",
        emulator.port
    );
    for command in
        [&["run", "--rig", &rig][..], &["hold", "--rig", &rig], &["check", "--rig", &rig, "--yes"]]
    {
        let arguments = [command, &["--port", &emulator.port]].concat();
        let text = refusal(&arguments, folder.path());
        assert!(text.ends_with(&says), "{command:?}: {text}");
    }
    let text = refusal(&["run", "--rig", &rig, "--port", "/dev/ttyNOSUCH"], folder.path());
    assert!(
        text.ends_with("Without a board: `plumb init trial --simulated` writes a simulated rig\n")
    );
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
