//! Two cables in the picture of a camera whose place is unknown.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;

use crate::common::{Emulator, folder, json, plumb, refusal, stderr};

/// Writes the files of a simulated rig of two motors. Returns the path of the rig file.
fn wall(folder: &Path) -> String {
    let written = plumb(&["init", "wall", "--planar", "--simulated"], folder);
    assert!(written.status.success(), "{}", stderr(&written));
    folder.join("wall/rig.toml").to_str().unwrap().to_owned()
}

#[test]
fn two_jogs_and_the_ball_goes_to_a_pixel() {
    let folder = folder();
    let rig = wall(folder.path());
    let emulator = Emulator::start();
    let goto = ["goto", "389", "303", "--rig", &rig, "--port", &emulator.port, "--yes", "--json"];
    let output = plumb(&goto, folder.path());
    let line = json(&output);
    assert_eq!(line["ending"], "reached", "{line} {}", stderr(&output));
    let told = stderr(&output);
    assert!(told.contains("motor A: +2 steps") && told.contains("ms late"), "{told}");
    assert!(told.contains("`plane.motors` is not set"), "{told}");
}

#[test]
fn the_demo_of_two_cables_reaches_its_pixel_with_each_law() {
    let folder = folder();
    for law in ["adaptive", "sign"] {
        let demo = ["demo", "--planar", "--virtual-time", "--law", law, "--out", law];
        let output = plumb(&demo, folder.path());
        let line = json(&output);
        assert_eq!(line["ending"], "reached", "{law}: {line} {}", stderr(&output));
        // Within the two pixels of "reached", measured in the true picture.
        assert!(line["true_error_px"].as_f64().unwrap() < 2.0, "{law}: {line}");
    }
}

#[test]
fn nothing_moves_before_a_yes_or_towards_a_wrong_target() {
    let folder = folder();
    let rig = wall(folder.path());
    let emulator = Emulator::start();
    let with = |options: &[&str]| {
        let base = ["goto", "--rig", &rig, "--port", &emulator.port];
        refusal(&[&base, options].concat(), folder.path())
    };
    let asked = with(&["389", "303"]);
    assert!(asked.contains("Two jogs come first"), "{asked}");
    assert!(with(&["0.4", "0.2", "0.1"]).contains("takes a pixel: u v"));
    // The camera of the file is real, and has no physics to choose.
    let real = folder.path().join("real.toml");
    let text = fs::read_to_string(&rig).unwrap();
    let text = text.replace("file = \"camera.toml\"", "file = \"wall/camera.toml\"");
    fs::write(&real, text.replace("[simulation]", "source = \"webcam\"\n\n[simulation]")).unwrap();
    let physics = ["goto", "--rig", real.to_str().unwrap(), "389", "303", "--physics", "elastic"];
    let refused = refusal(&physics, folder.path());
    assert!(refused.contains("--physics is of a simulated rig"), "{refused}");
    // The jogs alone tell that this pixel is beside the region.
    let base = ["goto", "--rig", &rig, "--port", &emulator.port, "20", "303", "--yes"];
    let at_border = plumb(&base, folder.path());
    assert_eq!(at_border.status.code(), Some(1), "{}", stderr(&at_border));
    assert!(stderr(&at_border).contains("too near to the border"), "{}", stderr(&at_border));
}

#[test]
fn the_next_run_keeps_the_frame_where_the_ball_hangs_as_it_was_left() {
    let folder = folder();
    let rig = wall(folder.path());
    let pixels = ["--pixel", "455,69", "--pixel", "116,109"];
    let choose = [&["calibrate", "--rig", &rig, "--motors", "--yes"], &pixels[..]].concat();
    assert!(plumb(&choose, folder.path()).status.success());
    let emulator = Emulator::start();
    let base = ["--rig", &rig, "--port", &emulator.port];
    let goto = |options: &[&str]| plumb(&[&["goto"], options, &base].concat(), folder.path());
    let first = goto(&["300", "300", "--yes"]);
    assert!(stderr(&first).contains("motor B: +2 steps"), "{}", stderr(&first));
    assert!(!stderr(&first).contains("`plane.motors` is not set"), "{}", stderr(&first));
    let second = goto(&["320", "290", "--record", "recording"]);
    assert!(second.status.success(), "{}", stderr(&second));
    assert!(!stderr(&second).contains("steps"), "{}", stderr(&second));
    // The recording has the frame: it gives the places of the run.
    let replayed = plumb(&["replay", "recording"], folder.path());
    let replayed = String::from_utf8(replayed.stdout).unwrap();
    let run = fs::read_to_string(folder.path().join("runs/run-0002/run.csv")).unwrap();
    for axis in ["position_m_x", "position_m_y", "position_m_z"] {
        let [there, here] = [&replayed, &run].map(|rows| last_value(rows, axis));
        assert!((there - here).abs() < 1e-4, "{axis}: {there} {here}");
    }
    // A path in the picture, from where the ball hangs.
    fs::write(folder.path().join("way.csv"), "u,v\n320,290\n350,290\n350,310\n").unwrap();
    let follow = [&["follow", "way.csv", "--json"], &base[..]].concat();
    let line = json(&plumb(&follow, folder.path()));
    assert_eq!(line["ending"], "reached", "{line}");
    fs::write(folder.path().join("metres.csv"), "x,y,z\n0,0.1,0.2\n0,0.1,0.3\n").unwrap();
    let metres = [&["follow", "metres.csv"], &base[..]].concat();
    assert!(refusal(&metres, folder.path()).contains("metres.csv:1: a rig file with [plane]"));
    // The camera has moved.
    let kept = folder.path().join("wall/rig.frame.toml");
    let frame = fs::read_to_string(&kept).unwrap();
    let place = frame.lines().find(|line| line.starts_with("ball_px")).unwrap();
    fs::write(&kept, frame.replace(place, "ball_px = [300.0, 300.0]")).unwrap();
    let moved = goto(&["320", "290"]);
    assert!(stderr(&moved).contains("Two jogs come first"), "{}", stderr(&moved));
}

/// Returns the value of a column in the last row of a table.
fn last_value(table: &str, column: &str) -> f64 {
    let place = table.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    table.lines().last().unwrap().split(',').nth(place).unwrap().parse().unwrap()
}

#[test]
fn a_plane_beside_metres_or_three_motors_is_refused_with_its_key() {
    let folder = folder();
    let rig = wall(folder.path());
    let text = fs::read_to_string(&rig).unwrap();
    for (from, to, key) in [
        ("[board]", "targets = [[0.0, 0.4, 0.2]]\n\n[board]", "targets"),
        ("[camera]", "[workspace]\nmin = [0, 0, 0]\nmax = [0, 1, 1]\n\n[camera]", "workspace"),
        ("count = 2", "count = 3", "motors.count"),
    ] {
        fs::write(&rig, text.replacen(from, to, 1)).unwrap();
        let found = refusal(&["check", "--rig", &rig, "--file-only"], folder.path());
        assert!(found.contains(key) && found.contains("plane"), "{key}: {found}");
    }
    fs::write(&rig, text.replace("[plane]", "# no plane")).unwrap();
    let missing = refusal(&["check", "--rig", &rig, "--file-only"], folder.path());
    assert!(missing.contains("`targets` is missing"), "{missing}");
    assert!(missing.contains("`workspace` is missing"), "{missing}");
}
