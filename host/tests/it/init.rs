//! `plumb init`: the files that it writes are right for every combination of options.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use plumb_calibrate::camera_text::{with_lens, with_pose};
use plumb_cameras::camera_file;
use plumb_frame::image::ImageSize;

use crate::common::{Emulator, folder, json, patient, plumb, stderr};

/// Drivers and their microsteps.
const DRIVERS: [(&str, &[&str]); 8] = [
    ("a4988", &["1", "2", "4", "8", "16"]),
    ("drv8825", &["1", "2", "4", "8", "16"]),
    ("tmc2209", &["8", "16"]),
    ("tb6600", &["1", "2", "4", "8", "16"]),
    ("dm542", &["2", "4", "8", "16"]),
    ("coils", &["1", "2", "4", "8", "16"]),
    ("motor-hats", &["1", "2", "4", "8", "16"]),
    ("tmc2209-uart", &["1", "2", "4", "8", "16"]),
];

/// Runs `plumb init NAME --yes` with these options, and checks the files.
fn init_and_check(folder: &Path, name: &str, options: &[&str]) {
    let output = plumb(&[&["init", name, "--yes"], options].concat(), folder);
    assert_eq!(output.status.code(), Some(0), "{options:?}: {}", stderr(&output));
    let rig = format!("{name}/rig.toml");
    let output = plumb(&["check", "--rig", &rig, "--file-only"], folder);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{options:?}: {text}");
    assert!(text.contains("0 errors, 0 warnings"), "{options:?}: {text}");
}

/// Runs `plumb init` with these lines as answers.
fn answer(folder: &Path, options: &[&str], answers: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args([&["init"], options].concat())
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A program that ends early closes its input.
    let _ = child.stdin.take().unwrap().write_all(answers.as_bytes());
    child.wait_with_output().unwrap()
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

#[test]
fn the_files_are_right_for_every_driver_and_camera() {
    let folder = folder();
    fs::create_dir(folder.path().join("recording")).unwrap();
    fs::write(folder.path().join("recording/rgb.txt"), "").unwrap();
    let cameras: [&[&str]; 7] = [
        &["--camera", "openni"],
        &["--camera", "realsense"],
        &["--camera", "webcam"],
        &["--camera", "ros2"],
        &["--recording", "recording"],
        &["--stream", "tcp:127.0.0.1:5600"],
        &["--simulated"],
    ];
    // The answers about drivers and those about cameras do not depend on each other.
    let drivers = DRIVERS.iter().flat_map(|(driver, all)| all.iter().map(move |it| (driver, it)));
    let drivers: Vec<_> = drivers.collect();
    assert!(drivers.len() >= cameras.len());
    for ((driver, microsteps), camera) in drivers.iter().zip(cameras.iter().cycle()) {
        let name = format!("{driver}-{microsteps}");
        let motors = ["--driver", driver, "--microsteps", microsteps];
        init_and_check(folder.path(), &name, &[&motors, *camera].concat());
    }
}

#[test]
fn the_camera_file_of_a_recording_is_taken_and_other_units_of_depth_are_warned_about() {
    let folder = folder();
    let recording = folder.path().join("recording");
    fs::create_dir(&recording).unwrap();
    fs::write(recording.join("rgb.txt"), "0.0 absent.png\n").unwrap();
    fs::write(recording.join("depth.txt"), "0.0 absent.png\n").unwrap();
    let text = camera_file::PAPER.replace("fx = 525.0", "fx = 531.25\nk1 = -0.01");
    fs::write(
        recording.join("camera.toml"),
        text.replace("diameter_m = 0.08", "diameter_m = 0.0655\nhue = 120.0"),
    )
    .unwrap();
    let output = plumb(&["init", "new", "--recording", "recording", "--yes"], folder.path());
    let says = "camera: intrinsics, pose and ball are those of ";
    assert!(stderr(&output).contains(says), "{}", stderr(&output));
    let path = folder.path().join("new/camera.toml");
    let recorded = camera_file::read(&recording.join("camera.toml")).unwrap();
    assert_eq!(camera_file::read(&path).unwrap(), recorded);
    let other = fs::read_to_string(&path).unwrap();
    assert!(!other.contains("# a guess"), "{other}");
    fs::write(&path, other.replace("depth_scale = 5000.0", "depth_scale = 1000.0")).unwrap();
    let end = "the file of the recording has 5000: no ball is found where the depth is wrong";
    for (command, says) in [
        (
            &["check", "--rig", "new/rig.toml", "--file-only"][..],
            "`intrinsics.depth_scale = 1000.0` is written here, but ",
        ),
        (
            &["calibrate", "--rig", "new/rig.toml", "--board"],
            "camera.toml: depth_scale = 1000, but ",
        ),
    ] {
        let text = stderr(&plumb(command, folder.path()));
        assert!(text.contains(says) && text.contains(end), "{text}");
    }
}

#[test]
fn the_files_are_right_for_every_size() {
    let folder = folder();
    let mut state = 1_u64;
    let mut random = |min: f64, max: f64| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        min + (max - min) * (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for number in 0..20 {
        // A triangle with acute angles at A and B.
        let (side, depth, share) = (random(0.3, 2.5), random(0.3, 2.0), random(0.1, 0.9));
        let bc = (depth * depth + (share * side) * (share * side)).sqrt();
        let ca = (depth * depth + ((1.0 - share) * side) * ((1.0 - share) * side)).sqrt();
        let sides = [side, bc, ca].map(|length| format!("{length:.3}")).join(",");
        let height = format!("{:.3}", random(0.5, 3.5));
        let cable = format!("{:.4}", random(0.02, 0.5));
        let ball = format!("{:.3}", random(0.03, 0.15));
        let options = [
            "--sides",
            &sides,
            "--height",
            &height,
            "--cable-per-turn",
            &cable,
            "--ball",
            &ball,
            "--simulated",
        ];
        init_and_check(folder.path(), &number.to_string(), &options);
    }
}

#[test]
fn a_file_is_never_overwritten() {
    for (kept, other) in [("rig.toml", "camera.toml"), ("camera.toml", "rig.toml")] {
        let folder = folder();
        fs::write(folder.path().join(kept), "mine").unwrap();
        let output = plumb(&["init", "--yes"], folder.path());
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(&format!("{kept}: exists")), "{}", stderr(&output));
        assert_eq!(fs::read_to_string(folder.path().join(kept)).unwrap(), "mine");
        assert!(!folder.path().join(other).exists());
    }
}

#[test]
fn the_default_answers_give_the_files_of_the_defaults() {
    let folder = folder();
    let output = plumb(&["init", "options", "--yes", "--json"], folder.path());
    assert_eq!(json(&output)["straps"], "MS1 high, MS2 high");
    let output = answer(folder.path(), &["answers"], &"\n".repeat(20));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for name in ["rig.toml", "camera.toml"] {
        let text = |part: &str| fs::read_to_string(folder.path().join(part).join(name)).unwrap();
        assert_eq!(text("options"), text("answers"), "{name}");
    }
}

#[test]
fn the_address_of_a_stream_is_told() {
    let folder = folder();
    for (name, more, told) in [
        ("usual", &[][..], "pictures: another program sends them to unix:usual/camera.sock, where"),
        ("tcp", &["--stream", "tcp:127.0.0.1:5600"], "sends them to tcp:127.0.0.1:5600, where"),
        ("input", &["--stream", "-"], "another program writes them to standard input"),
    ] {
        let init = [&["init", name, "--yes", "--camera", "stream"], more].concat();
        let output = plumb(&init, folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).contains(told), "{}", stderr(&output));
    }
}

#[test]
fn a_simulated_ball_may_have_another_colour() {
    let folder = folder();
    let init = ["init", "rig", "--yes", "--simulated", "--colour", "blue"];
    let output = plumb(&init, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let camera = fs::read_to_string(folder.path().join("rig/camera.toml")).unwrap();
    assert!(camera.contains("hue = 240.0"), "{camera}");
}

#[test]
fn a_wrong_answer_is_asked_again() {
    let folder = folder();
    // No triangle, whose answers are the new defaults, then one; no board, then the default; then a
    // driver without 4 microsteps; no stiffness, then one.
    let sizes = "1\n0.3\n0.3\n\n\n0.9\n\n\npico3\n\ntmc2209\n4\n8\n\n\n";
    let answers = format!("{sizes}steel\nstiff\n\n\n\n\n");
    let output = answer(folder.path(), &[], &answers);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("must be stiff, soft or unknown"), "{text}");
    assert!(text.contains("no triangle has the sides"), "{text}");
    assert!(text.contains("motors A and B, m [1]: "), "{text}");
    assert!(text.contains("must be one of pico, pico2, skr-pico"), "{text}");
    assert!(text.contains("cannot drive a TMC2209 without UART at 4 microsteps"), "{text}");
    let rig = fs::read_to_string(folder.path().join("rig.toml")).unwrap();
    assert!(rig.contains("microsteps = 8\n"), "{rig}");
    assert!(rig.contains("stiffness = \"stiff\"\n"), "{rig}");
}

#[test]
fn the_stiffness_of_the_cables_is_an_option() {
    let folder = folder();
    for name in ["stiff", "soft", "unknown"] {
        init_and_check(folder.path(), name, &["--cables", name]);
        let rig = fs::read_to_string(folder.path().join(name).join("rig.toml")).unwrap();
        assert!(rig.contains(&format!("stiffness = {name:?}\n")), "{rig}");
    }
}

#[test]
fn a_board_with_drivers_of_its_own_has_no_others() {
    let folder = folder();
    init_and_check(folder.path(), "skr", &["--board", "skr-pico"]);
    let rig = fs::read_to_string(folder.path().join("skr/rig.toml")).unwrap();
    assert!(rig.contains("kind = \"skr-pico\"\n") && rig.contains("tmc2209-uart"), "{rig}");
    for driver in ["a4988", "tmc2209"] {
        let options = ["init", "other", "--yes", "--board", "skr-pico", "--driver", driver];
        let output = plumb(&options, folder.path());
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("has drivers of its own"), "{}", stderr(&output));
    }
}

#[test]
fn the_ball_has_the_colour_that_is_named() {
    let folder = folder();
    for (colour, hue) in [("blue", "hue = 240.0"), ("95", "hue = 95.0")] {
        init_and_check(folder.path(), colour, &["--colour", colour]);
        let camera = fs::read_to_string(folder.path().join(colour).join("camera.toml")).unwrap();
        assert!(camera.contains(hue), "{camera}");
    }
    let output = plumb(&["init", "--yes", "--colour", "grey"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("red, orange, yellow"), "{}", stderr(&output));
    let output = plumb(&["init", "--yes", "--ball", "green"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("the ball's colour is --colour"), "{}", stderr(&output));
}

#[test]
fn no_value_is_called_a_guess_after_the_calibration() {
    let folder = folder();
    init_and_check(folder.path(), "rig", &[]);
    let text = fs::read_to_string(folder.path().join("rig/camera.toml")).unwrap();
    assert_eq!(text.matches("# a guess").count(), 6, "{text}");
    let file = Path::new("camera.toml");
    let camera = camera_file::parse(file, &text).unwrap();
    let text = with_pose(&text, &camera.pose, "plumb calibrate").unwrap();
    let lens = (&camera.intrinsics, ImageSize { width: 640, height: 480 });
    let text = with_lens(&text, lens, "plumb calibrate --lens").unwrap();
    assert_eq!(text.matches("# a guess").count(), 0, "{text}");
    assert_eq!(camera_file::parse(file, &text).unwrap().pose, camera.pose);
}

#[test]
fn what_limits_the_current_of_the_drivers_is_told() {
    let folder = folder();
    for (option, name, told) in [
        ("--driver", "coils", "H-bridges limit no current"),
        ("--driver", "motor-hats", "times `duty`, divided by the resistance of a coil"),
        ("--driver", "tmc2209-uart", "for R150 add `sense_resistor = 0.15`"),
        ("--board", "skr-pico", "for R150 add `sense_resistor = 0.15`"),
    ] {
        let output = plumb(&["init", name, "--yes", option, name], folder.path());
        assert!(stderr(&output).contains(told), "{}", stderr(&output));
    }
}

#[test]
fn the_lens_of_a_camera_through_openni2_is_a_step() {
    let folder = folder();
    let text = stderr(&plumb(&["init", "--yes", "--camera", "openni"], folder.path()));
    assert!(text.contains("--lens") && text.contains("`openni.intrinsics = \"device\"`"), "{text}");
    // The line that is advised is read.
    let rig = folder.path().join("rig.toml");
    let file = fs::read_to_string(&rig).unwrap();
    fs::write(
        &rig,
        file.replacen("\n[camera]\n", "\n[camera]\nopenni.intrinsics = \"device\"\n", 1),
    )
    .unwrap();
    let checked = plumb(&["check", "--file-only"], folder.path());
    assert_eq!(checked.status.code(), Some(0), "{}", stderr(&checked));
}

#[test]
fn answers_that_name_no_camera_and_no_recording_say_what_to_write() {
    let folder = folder();
    let answers = format!("{}kinect\nrecording\n\n.\n", "\n".repeat(12));
    let text = stderr(&answer(folder.path(), &[], &answers));
    for says in ["a Kinect is read as openni", "write the path of a TUM folder", ".: has no rgb"] {
        assert!(text.contains(says), "{says}: {text}");
    }
}

#[test]
fn an_input_that_ends_early_leaves_no_file() {
    let folder = folder();
    for answers in ["", "0.6\n0.9\n", "0.6\n0.9\n0.9\n0.7\nx\n"] {
        let output = answer(folder.path(), &[], answers);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("no file was written"), "{}", stderr(&output));
        assert_eq!(entries(folder.path()), 0);
    }
}

#[test]
fn options_that_contradict_each_other_are_refused_with_a_reason() {
    let folder = folder();
    let cases: [(&[&str], &str); 14] = [
        (&["--driver", "a4988", "--microsteps", "12"], "at 12 microsteps: choose"),
        (&["--driver", "drv8825", "--microsteps", "32"], "must be 1 to 16 microsteps"),
        (&["--port", "COM3"], "that is a port of Windows"),
        (&["--port", ""], "--port '': must be a path, such as /dev/ttyACM0"),
        (&["--simulated", "--port", " "], "--port '': must be a path, such as /dev/ttyACM0"),
        (&["--port", "kinect"], "--port kinect: must be a path, such as /dev/ttyACM0"),
        (&["--driver", "tmc2209", "--microsteps", "4"], "choose one of 8, 16"),
        (&["--sides", "1,0.2,0.2"], "no triangle"),
        (&["--sides", "0.6", "0.6", "0.6"], "needs 3 numbers, each 0.2"),
        (&["--height", "0.1"], "must be 0.4 to 3.5 m"),
        (&["--camera", "recording"], "needs --recording"),
        (&["--recording", "absent"], "absent: "),
        (&["--recording", "."], ".: has no rgb.txt"),
        (&["--camera", "kinect"], "a Kinect is read as openni"),
    ];
    for (options, reason) in cases {
        let output = plumb(&[&["init", "--yes"], options].concat(), folder.path());
        assert_eq!(output.status.code(), Some(2), "{options:?}");
        assert!(stderr(&output).contains(reason), "{options:?}: {}", stderr(&output));
        assert_eq!(entries(folder.path()), 0, "{options:?}");
    }
}

/// Writes a simulated rig, adds the lines `camera` to its file, drives it, and returns the first
/// measured y of the ball, metres.
fn first_measured_y(camera: &str) -> f64 {
    let folder = folder();
    plumb(&["init", "--yes", "--simulated"], folder.path());
    let path = folder.path().join("rig.toml");
    let text = patient(fs::read_to_string(&path).unwrap());
    fs::write(&path, format!("{text}\n{camera}")).unwrap();
    let emulator = Emulator::start();
    let run = ["run", "--port", &emulator.port, "--timeout", "1.5", "--out", "run"];
    let output = plumb(&run, folder.path());
    let rows = fs::read_to_string(folder.path().join("run/run.csv")).unwrap();
    let names: Vec<&str> = rows.lines().next().unwrap().split(',').collect();
    let column = names.iter().position(|name| *name == "position_m_y").unwrap();
    let measured = rows.lines().skip(1).find_map(|row| row.split(',').nth(column)?.parse().ok());
    measured.unwrap_or_else(|| panic!("no ball is seen: {}", stderr(&output)))
}

#[test]
fn a_simulated_camera_can_stand_beside_the_place_in_the_camera_file() {
    let quaternion = "quaternion = [-0.5, -0.5, 0.5, 0.5]";
    let beside = format!("[simulation.camera]\ntranslation = [1.876, 0.32, 0.325]\n{quaternion}\n");
    // The ball is seen 50 mm farther from A than it is.
    let shift = first_measured_y(&beside) - first_measured_y("");
    assert!((shift + 0.05).abs() < 0.01, "{shift}");
}

/// Writes a simulated rig with `edit` applied to its file, and drives it.
fn simulated_run(edit: impl Fn(String) -> String) -> Output {
    let folder = folder();
    let output = plumb(&["init", "--yes", "--simulated"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let path = folder.path().join("rig.toml");
    let text = edit(patient(fs::read_to_string(&path).unwrap()));
    fs::write(&path, text).unwrap();
    let emulator = Emulator::start();
    plumb(&["run", "--port", &emulator.port, "--json"], folder.path())
}

#[test]
fn a_simulated_rig_reaches_its_target_and_a_miswired_one_does_not() {
    let output = simulated_run(|text| text);
    assert_eq!(json(&output)["reached"], true, "{}", stderr(&output));
    let wiring = ("wiring = [\"A\", \"B\", \"C\"]", "wiring = [\"B\", \"A\", \"C\"]");
    let output = simulated_run(|text| {
        assert!(text.contains(wiring.0), "{text}");
        text.replace(wiring.0, wiring.1)
    });
    let text = stderr(&output);
    assert_eq!((json(&output)["reached"].clone(), output.status.code()), (false.into(), Some(1)));
    let fault = "the board has stopped by itself: ";
    let last = text.lines().last().unwrap();
    assert!(last.starts_with(fault) && last.contains(" mm. "), "{text}");
    assert_eq!(text.matches(fault).count(), 1, "{text}");
}

#[test]
fn a_simulated_rig_at_a_board_that_another_rig_moved_is_told_before_it_moves() {
    let folder = folder();
    for (name, size) in [("big", "2"), ("small", "0.5")] {
        let sides = [size; 3].join(",");
        init_and_check(folder.path(), name, &["--simulated", "--sides", &sides, "--height", size]);
        let path = folder.path().join(name).join("rig.toml");
        let text = patient(fs::read_to_string(&path).unwrap());
        fs::write(&path, text).unwrap();
    }
    let emulator = Emulator::start();
    let run = |rig| plumb(&["run", "--rig", rig, "--port", &emulator.port], folder.path());
    let output = run("big/rig.toml");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let output = run("small/rig.toml");
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("there the ball of this simulated rig is outside its workspace"),
        "{text}"
    );
    assert!(text.ends_with("`plumb home` puts the ball of a simulated rig back at its start\n"));
    let home = plumb(&["home", "--rig", "small/rig.toml", "--port", &emulator.port], folder.path());
    assert_eq!(home.status.code(), Some(0), "{}", stderr(&home));
    let output = run("small/rig.toml");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}
