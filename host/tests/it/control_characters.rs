//! Control characters in what others wrote: none of them reaches the terminal.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::{Emulator, folder, json, patient, rig_file};

/// Clears a terminal (ESC, and CSI of one character), rings, hides what stands before, deletes,
/// and turns the direction of writing.
const EVIL: &str = "e\u{1b}[2J\u{9b}2J\u{7}\r\u{7f}\u{202e}";

/// [`EVIL`] as escapes of JSON and of TOML.
const ESCAPED: &str = r"e\u001b[2J\u009b2J\u0007\u000d\u007f\u202e";

/// Runs the program with these arguments, variables and standard input.
fn run(arguments: &[&str], variable: &str, input: &str, folder: &Path) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(arguments)
        .env(variable, EVIL)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The program may end before it has read everything.
    let _closed = child.stdin.take().unwrap().write_all(input.as_bytes());
    child.wait_with_output().unwrap()
}

/// Checks that the characters were printed, and as escapes.
fn check(name: &str, output: &Output) {
    let all = [&output.stdout[..], &output.stderr[..]].concat();
    let text = String::from_utf8(all).unwrap();
    let raw = text.chars().find(|&c| (c.is_control() && c != '\n') || c == '\u{202e}');
    assert_eq!(raw, None, "{name}: {text:?}");
    let is_escaped =
        [r"\u001b", r"\u{1b}", r"\u009b", r"\u{9b}"].iter().any(|it| text.contains(it));
    assert!(is_escaped, "{name}: the characters are not in its output: {text}");
}

/// Writes the files that the commands below read.
fn write_files(folder: &Path) {
    let write = |name: &str, text: String| fs::write(folder.join(name), text).unwrap();
    rig_file(folder, patient);
    let rig = fs::read_to_string(folder.join("rig.toml")).unwrap();
    write("raw.toml", format!("{rig}\n# {EVIL}\n{EVIL}\n"));
    write("key.toml", format!("\"{ESCAPED}\" = 1\n{rig}"));
    write("value.toml", rig.replace("[board]", &format!("[board]\nkind = \"{ESCAPED}\"")));
    let other = format!("[camera]\nfile = \"{ESCAPED}.toml\" #");
    write("file.toml", rig.replace("[camera]\nfile", &other));
    write(EVIL, "x".to_owned());
    let (real, _) = rig.split_once("\n[simulation]").unwrap();
    let stream = "[camera]\nsource = \"stream\"\nstream = \"-\"\n";
    write("stream.toml", real.replace("[camera]\n", stream));
    for (name, line) in [("list", EVIL), ("name", "0.1 "), ("line", "x ")] {
        fs::create_dir(folder.join(name)).unwrap();
        fs::copy(folder.join("camera.toml"), folder.join(name).join("camera.toml")).unwrap();
        write(&format!("{name}/rgb.txt"), format!("{line}{EVIL}.png\n"));
        write(&format!("{name}/depth.txt"), "0.1 depth.png\n".to_owned());
    }
    write("places.csv", format!("x,y,z,{EVIL}\n0.4,0.3,0.2,1\n"));
    write("number.csv", format!("x,y,z\n0.4,0.3,{EVIL}\n"));
    write("a.gcode", "G1 X400 Y300 Z200\n\u{1b}[2J\n".to_owned());
    write("a.jsonl", format!("{{\"t\": 0, \"{ESCAPED}\": [0.4, 0.3, 0.2]}}\n"));
    let lens = "intrinsics: [600, 600, 320, 240]\n  distortion_model: radtan\n  \
                distortion_coeffs: [0, 0, 0, 0]\n  resolution: [640, 480]";
    write("a.yaml", format!("cam0:\n  camera_model: \"{ESCAPED}\"\n  {lens}\n"));
    fs::write(folder.join("a.mcap"), mcap(&format!("/{EVIL}"))).unwrap();
}

/// Returns an MCAP file with one topic and no message: <https://mcap.dev/spec>.
fn mcap(topic: &str) -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let record = |opcode: u8, parts: &[&[u8]]| {
        let content = parts.concat();
        [&[opcode][..], &(content.len() as u64).to_le_bytes(), &content].concat()
    };
    let (magic, id, nothing) = (b"\x89MCAP0\r\n", 1_u16.to_le_bytes(), 0_u32.to_le_bytes());
    let image = [text("sensor_msgs/msg/Image"), text("ros2msg")].concat();
    [
        magic.to_vec(),
        record(1, &[&text("ros2"), &text("")]),
        record(3, &[&id, &image, &nothing]),
        record(4, &[&id, &id, &text(topic), &text("cdr"), &nothing]),
        record(15, &[&nothing]),
        record(2, &[&[0; 20]]),
        magic.to_vec(),
    ]
    .concat()
}

#[test]
fn what_others_wrote_is_printed_with_escapes() {
    let folder = folder();
    write_files(folder.path());
    for arguments in [
        &[EVIL][..],
        &[&format!("--{EVIL}")],
        &["demo", "--law", EVIL],
        &["demo", "--timeout", EVIL],
        &["demo", "--page", &format!("--page-address={EVIL}")],
        &["demo", "--out", EVIL],
        &["run", "--rig", &format!("{EVIL}/rig.toml")],
        &["run", "--port", EVIL],
        &["follow", EVIL],
        &["goto", "1", "2", EVIL],
        &["check", "--rig", "raw.toml"],
        &["check", "--rig", "key.toml"],
        &["check", "--rig", "key.toml", "--json"],
        &["check", "--rig", "value.toml"],
        &["check", "--rig", "file.toml"],
        &["run", "--rig", "key.toml"],
        &["replay", EVIL],
        &["replay", "list"],
        &["replay", "name"],
        &["replay", "line"],
        &["replay", "name", "-v"],
        &["follow", "places.csv"],
        &["follow", "number.csv"],
        &["follow", "a.gcode"],
        &["follow", "a.jsonl"],
        &["calibrate", "--place", EVIL],
        &["plot", EVIL],
        &["report", "--run", EVIL],
        &["report", "--out", &format!("{EVIL}.gz"), "--json"],
        &["init", EVIL, "--yes"],
        &["init", &format!("{EVIL}new"), "--yes", "--json"],
        &["init", "asked", "--recording", EVIL, "--yes"],
    ] {
        check(&arguments.join(" "), &run(arguments, "UNUSED", "", folder.path()));
    }
    let optional: &[&[&str]] = &[
        &["demo", "--ros2", &format!("--ros2-namespace={EVIL}")],
        &["replay", "a.mcap", "--camera", "camera.toml"],
        &["calibrate", "--import", "a.yaml"],
    ];
    for arguments in optional.iter().filter(|_| cfg!(feature = "full")) {
        check(&arguments.join(" "), &run(arguments, "UNUSED", "", folder.path()));
    }
    check("PLUMB_RIG", &run(&["jog", "A", "1"], "PLUMB_RIG", "", folder.path()));
    check("PLUMB_PORT", &run(&["stop"], "PLUMB_PORT", "", folder.path()));
}

#[test]
fn what_senders_wrote_is_printed_with_escapes() {
    let folder = folder();
    write_files(folder.path());
    let emulator = Emulator::start();
    let key = format!("{{\"{ESCAPED}\": 1}}\n");
    let port = ["--port", &emulator.port];
    for (arguments, input) in [
        (&["follow", "-", "-v", "--out", "1"][..], &key),
        (&["run", "--rig", "stream.toml", "--timeout", "1", "-v", "--out", "2"], &key),
    ] {
        let output = run(&[arguments, &port].concat(), "UNUSED", input, folder.path());
        check(&arguments.join(" "), &output);
    }
}

#[test]
fn a_line_of_json_keeps_its_meaning() {
    let folder = folder();
    let output = run(&["demo", "--out", EVIL, "--timeout", "x"], "UNUSED", "", folder.path());
    assert!(json(&output)["error"].is_string());
    let init = ["init", EVIL, "--yes", "--json"];
    let rig = json(&run(&init, "UNUSED", "", folder.path()))["rig"].as_str().unwrap().to_owned();
    assert!(folder.path().join(&rig).exists() && rig.contains(EVIL), "{rig:?}");
}
