//! `plumb follow`: a run along a file over an emulated board, and paths that are refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;

use crate::common::{Emulator, folder, json, patient, plumb, rig_file, stderr};

#[test]
fn a_run_along_a_file_tells_how_well_the_ball_followed() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let path = "x,y,z\n0.52,0.25,0.42\n0.48,0.25,0.42\n0.48,0.29,0.40\n";
    fs::write(folder.path().join("path.csv"), path).unwrap();
    let run = ["follow", "--rig", &rig, "path.csv", "--law", "adaptive", "--port", &emulator.port];
    let output = plumb(&[&run as &[&str], &["--json", "--out", "run"]].concat(), folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let line = json(&output);
    let legs = line["legs"].as_array().unwrap();
    assert_eq!(legs.len(), 2, "the start and the end of the path: {line}");
    assert_eq!(legs[1]["target_m"].to_string(), "[0.48,0.29,0.4]");
    let path = &line["path"];
    // Its length of 8 cm at 5 cm/s, and the time of start, corner and end.
    let time = path["path_time_s"].as_f64().unwrap();
    assert!((1.6..4.0).contains(&time), "{line}");
    assert!(path["frames"].as_u64().unwrap() > 10, "{line}");
    assert!(path["error"]["rms_mm"].as_f64().unwrap() > 0.0, "{line}");
    let text = stderr(&output);
    assert!(text.contains("of its speed; distance from it"), "{text}");
    // Its corner is rounded within 5 mm.
    assert!(text.contains("\npath: 0.079 m, 2.2 s\n"), "{text}");
    assert!(text.find("path: ") < text.find("preparing"), "{text}");
    let report = plumb(&["report", "--run", "run", "--json"], folder.path());
    assert!(json(&report)["parts"].to_string().contains("\"run/deviation.svg\""));
    assert!(folder.path().join("run/deviation.svg").exists());
}

#[test]
fn a_path_that_is_not_possible_is_refused_before_anything_moves() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    fs::write(folder.path().join("bad.csv"), "x,y,z\n0.5,0.3,0.3\n0.5,o.3,0.3\n").unwrap();
    let log = "frame,time_s,position_m_x,position_m_y,position_m_z\n0,0.1,0.5,0.3,0.3\n";
    fs::write(folder.path().join("run.csv"), log).unwrap();
    fs::write(folder.path().join("one.csv"), "x,y,z\n0.5,0.3,0.3\n").unwrap();
    fs::write(folder.path().join("fast.csv"), "t,x,y,z\n0,0.5,0.3,0.3\n0.3,0.5,0.3,0.4\n").unwrap();
    fs::write(folder.path().join("arc.nc"), "G0 X500 Y300 Z300\nG2 X510 I5 J0\n").unwrap();
    let four = "t,x,y,z\n0,0.5,0.3,0.3\n2,0.5,0.3,0.4\n4,0.5,0.2,0.4\n6,0.5,0.2,0.3\n";
    fs::write(folder.path().join("four.csv"), four).unwrap();
    fs::write(folder.path().join("comma.nc"), "G1 X500,5 Y300 Z300\nX510\n").unwrap();
    fs::write(folder.path().join("way.xlsx"), b"PK\x03\x04\xff").unwrap();
    let wide = "x,y,z\n0.5,0.3,0.3\n".encode_utf16().flat_map(u16::to_le_bytes);
    fs::write(folder.path().join("wide.csv"), wide.collect::<Vec<u8>>()).unwrap();
    fs::write(folder.path().join("inch.nc"), "G20\nG0 X500 Y300 Z300\nX510\n").unwrap();
    fs::write(folder.path().join("up.nc"), "G0 X500 Y300 Z300\nG1 Z3000 F60\n").unwrap();
    for (path, more, named) in [
        (
            "comma.nc",
            &[][..],
            "comma.nc:1: ',' begins no word: a letter and a number with a decimal",
        ),
        ("way.xlsx", &[], "way.xlsx: is a spreadsheet (.xlsx, .ods) or another ZIP archive"),
        ("arc.nc", &[], "arc.nc:2: G2 is not read"),
        ("inch.nc", &[], "inch.nc:2: [12.7000, 7.6200, 7.6200] m: that is outside the"),
        ("up.nc", &[], "up.nc:2: [0.5000, 0.3000, 3.0000] m: that is outside the"),
        ("run.csv", &[], "run.csv:1: `frame` is wrong: no such column; columns are x, y, z"),
        ("bad.csv", &[], "bad.csv:3: `y = o.3` is wrong: must be a number"),
        ("one.csv", &[], "one.csv: the path needs 2 places or more, but has 1"),
        ("fast.csv", &[], "fast.csv: the path is not possible at"),
        ("none.csv", &[], "'none.csv' is no shape; shapes are circle, line, eight, square and"),
        ("wide.csv", &[], "wide.csv: is text in UTF-16 (\"Unicode text\" of Excel)"),
        ("zigzag", &[], "'zigzag' is no shape"),
        ("circle", &["--size", "0.5"], "that is outside the workspace of the rig file"),
        ("circle", &["--centre", "0.2,0.2,0.3"], "outside the triangle of the motors"),
        ("line", &["--centre", "2,2,2"], "that is outside the workspace of the rig file"),
        ("circle", &["--speed", "0.5"], "above 0.3 m/s, which is `path.max_speed` of"),
        ("circle", &["--tolerance", "0.01"], "--tolerance has no effect on circle"),
        ("square", &["--path-seed", "2"], "--path-seed has no effect on square"),
        ("up.nc", &["--size", "0.1"], "--size has no effect on places of a file"),
        ("fast.csv", &["--loop"], "but has 2: add places of the way back to the first one, with"),
        ("four.csv", &["--loop"], "away from it: add the first one again at the end, with its"),
        ("fast.csv", &["--speed", "0.1"], "--speed has no effect on a file with times"),
        ("circle", &["--speed", "0"], "--speed"),
        ("square", &["--tolerance", "-1"], "--tolerance"),
    ] {
        // No board is at this port: the path is refused before it is opened.
        let run = ["follow", "--rig", &rig, "--port", "/dev/null", "--out", "run", path];
        let output = plumb(&[&run as &[&str], more].concat(), folder.path());
        assert_eq!(output.status.code(), Some(2), "{path}: {}", stderr(&output));
        assert!(stderr(&output).contains(named), "{path} {more:?}: {}", stderr(&output));
        assert!(!folder.path().join("run").exists(), "{path}: nothing was run");
    }
    let run = |path: &str| {
        let run = ["follow", "--rig", &rig, "--port", "/dev/no-such-port", path];
        stderr(&plumb(&run, folder.path()))
    };
    // Nobody has given the usual --speed, and a file with times does not need it.
    let text = fs::read_to_string(folder.path().join(&rig)).unwrap();
    fs::write(folder.path().join(&rig), format!("{text}\n[path]\nmax_speed = 0.03\n")).unwrap();
    assert!(run("circle").contains("there is no such serial port"), "{}", run("circle"));
    let minute = "t,x,y,z\n0,0.5,0.3,0.3\n60,0.5,0.3,0.4\n";
    fs::write(folder.path().join("minute.csv"), minute).unwrap();
    assert!(run("minute.csv").contains("there is no such serial port"), "{}", run("minute.csv"));
    assert!(run("minute.csv").contains(" m, 60.0 s (is its `t` in milliseconds? It must be in"));
    // Places that are no path have no speed, shape and time.
    fs::write(folder.path().join("stops.csv"), "x,y,z,dwell\n0.5,0.3,0.3,1\n").unwrap();
    for (what, options) in [
        ("stops.csv", &["--speed", "0.02"][..]),
        ("stops.csv", &["--centre", "0.5,0.2,0.3"]),
        ("stops.csv", &["--upright"]),
        ("-", &["--no-wait"]),
        ("-", &["--path-seed", "2"]),
        ("-", &["--loop"]),
    ] {
        let run = [&["follow", "--rig", &rig, "--port", "/dev/null", what], options].concat();
        let output = plumb(&run, folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        let says = format!("{} has no effect on", options[0]);
        assert!(stderr(&output).contains(&says), "{}", stderr(&output));
    }
}
