//! `plumb calibrate` on the simulated rig: the three ways, the files, refusals.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::{folder, json, plumb, rig_file, stderr};
use serde_json::Value;

/// Places of the ball inside the paper's rig.
const PLACES: [&str; 6] =
    ["0.2,0.2,0.1", "0.7,0.1,0.1", "0.7,0.5,0.1", "0.4,0.3,0.4", "0.6,0.2,0.35", "0.5,0.4,0.2"];

/// The paper's camera file with a pose that is 20 mm and 3 degrees off.
const WRONG_POSE: [(&str, &str); 2] = [
    ("[1.737, 0.286, 0.225]", "[1.757, 0.286, 0.225]"),
    ("[-0.5, -0.5, 0.5, 0.5]", "[-0.513, -0.4866, 0.513, 0.4866]"),
];

/// Writes the paper's rig file, whose camera is off against its camera file.
fn askew_rig(folder: &Path) -> String {
    let rig = rig_file(folder, |text| {
        let camera = "camera = { translation = [1.737, 0.286, 0.225], \
                      quaternion = [-0.5, -0.5, 0.5, 0.5] }";
        format!("{text}\n{camera}\n")
    });
    let camera = folder.join("camera.toml");
    let text = fs::read_to_string(&camera).unwrap();
    let wrong = WRONG_POSE.iter().fold(text, |text, (from, to)| text.replace(from, to));
    fs::write(&camera, wrong).unwrap();
    rig
}

/// Returns the distance of the translation in a result from the simulated camera's, metres.
fn error(result: &Value) -> f64 {
    let found = [0, 1, 2].map(|k| result["translation"][k].as_f64().unwrap());
    let true_one = [1.737, 0.286, 0.225];
    found.iter().zip(true_one).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Runs `plumb` with text on its standard input.
fn typed(arguments: &[&str], input: &str, folder: &Path) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn a_board_gives_the_pose_and_the_former_file_is_kept() {
    let folder = folder();
    let rig = askew_rig(folder.path());
    let before = fs::read_to_string(folder.path().join("camera.toml")).unwrap();
    let place = ["--upright", "--turn", "90", "--origin", "0.5,0.15,0.1"];
    let arguments =
        [&["calibrate", "--rig", &rig, "--board", "--yes", "--json"][..], &place].concat();
    let output = plumb(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let result = json(&output);
    assert_eq!((&result["grade"], &result["written"]), (&"good".into(), &true.into()), "{result}");
    assert!(error(&result) < 0.010, "{result}");
    assert!((result["turned_deg"].as_f64().unwrap() - 3.0).abs() < 0.5, "{result}");
    let after = fs::read_to_string(folder.path().join("camera.toml")).unwrap();
    assert!(after.contains("# plumb calibrate --board"), "{after}");
    assert_eq!(after.lines().next(), before.lines().next());
    let backup = fs::read_to_string(folder.path().join("camera.toml.bak")).unwrap();
    assert_eq!(backup, before);
    assert!(folder.path().join("camera.calibration.png").exists());
    // The second calibration starts from the first one's file.
    let again = json(&plumb(&arguments, folder.path()));
    assert!(again["turned_deg"].as_f64().unwrap() < 0.5, "{again}");
}

#[test]
fn typed_places_of_the_ball_give_the_pose() {
    let folder = folder();
    let rig = askew_rig(folder.path());
    // A word that is no place is asked again; an empty line ends.
    let lines = format!("here\n{}\n\n", PLACES.join("\n"));
    let arguments = ["calibrate", "--rig", &rig, "--ball", "--frames", "3", "--json"];
    let output = typed(&arguments, &lines, folder.path());
    // Nobody can be asked on a pipe, so that nothing is written.
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let result = json(&output);
    assert_eq!((&result["samples"], &result["written"]), (&6.into(), &false.into()));
    assert!(error(&result) < 0.010, "{result}");
    let text = stderr(&output);
    assert!(text.contains("a place is three numbers"), "{text}");
    let nobody = "camera.toml? Nobody can be asked on this input: say yes with --yes\n";
    assert!(text.ends_with(nobody), "{text}");
    assert!(!folder.path().join("camera.toml.bak").exists());
}

#[test]
fn motors_give_the_pose_from_pixels_that_are_read_in_the_kept_picture() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    // From here the camera sees all motors.
    let file = folder.path().join("camera.toml");
    let text = fs::read_to_string(&file).unwrap();
    let place = "[2.6, 0.3, 0.45]";
    fs::write(&file, text.replace("[1.737, 0.286, 0.225]", place)).unwrap();
    let output = plumb(&["calibrate", "--rig", &rig, "--motors"], folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("Or choose them in a browser: --page"), "{}", stderr(&output));
    assert!(folder.path().join("camera.motors.png").exists());
    let says = "--pixel U,V. Give also --height M, the height of the motors above the origin";
    assert!(stderr(&output).contains(says), "{}", stderr(&output));

    // u = 319.5 + 525 (y - 0.3) / (2.6 - x), v = 239.5 + 525 (0.45 - z) / (2.6 - x)
    let measure = |pixels: [&str; 3]| {
        let pixels = pixels.map(|pixel| ["--pixel", pixel]).concat();
        let options =
            ["calibrate", "--rig", &rig, "--motors", "--height", "0.665", "--yes", "--json"];
        plumb(&[&options[..], &pixels].concat(), folder.path())
    };
    let output = measure(["412.5,175", "229.5,175", "307.4,196.1"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let result = json(&output);
    assert!(result["turned_deg"].as_f64().unwrap() < 1.0, "{result}");
    assert!(result["moved_m"].as_f64().unwrap() < 0.03, "{result}");
    assert_eq!(result["held_out_m"], Value::Null);

    let swapped = measure(["229.5,175", "412.5,175", "307.4,196.1"]);
    assert_eq!(swapped.status.code(), Some(1));
    assert!(stderr(&swapped).contains("which motor is A, B and C"), "{}", stderr(&swapped));
    let outside = measure(["412.5,-20", "229.5,175", "307.4,196.1"]);
    let says = "no depth at motor A (column 412, row -20): that is outside the picture";
    assert!(stderr(&outside).contains(says), "{}", stderr(&outside));
}

#[test]
fn places_that_do_not_determine_a_pose_are_refused_and_nothing_is_written() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let refusal = |places: &[&str]| {
        let places: Vec<&str> = places.iter().flat_map(|place| ["--place", place]).collect();
        let arguments = ["calibrate", "--rig", &rig, "--ball", "--yes", "--frames", "2"];
        let output = plumb(&[&arguments[..], &places].concat(), folder.path());
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        stderr(&output)
    };
    let plane = ["0.2,0.2,0.1", "0.7,0.1,0.1", "0.7,0.5,0.1", "0.4,0.4,0.1"];
    assert!(refusal(&plane).contains("lie in a plane"));
    // Outside the picture.
    let outside = ["0.4,0.3,0.2", "0.4,3.0,0.2", PLACES[2], PLACES[3]];
    assert!(refusal(&outside).contains("not seen at place 2"));
    assert!(!folder.path().join("camera.toml.bak").exists());
}

/// As in a container that mounts the camera file: it cannot be replaced by another file.
#[test]
fn a_camera_file_that_is_a_mount_point_is_written_in_place() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    fs::copy(folder.path().join("camera.toml"), folder.path().join("outside.toml")).unwrap();
    let mounted = |options: &str| {
        let script = format!(
            "mount --bind {options} outside.toml camera.toml && exec {} calibrate --rig {rig} \
             --yes --board --upright --turn 90 --origin 0.5,0.15,0.1",
            env!("CARGO_BIN_EXE_plumb")
        );
        let namespace = ["--user", "--map-root-user", "--mount", "sh", "-c", &script];
        let mut unshare = Command::new("unshare");
        unshare.args(namespace).current_dir(folder.path()).output().ok()
    };
    let read = |file: &str| fs::read_to_string(folder.path().join(file)).unwrap();
    let Some(output) = mounted("").filter(|output| output.status.code() != Some(32)) else {
        println!("skipped: nothing can be mounted here");
        return;
    };
    // Where a namespace or a mount is refused, the program never begins.
    if stderr(&output).contains("unshare: ") || stderr(&output).contains("mount: ") {
        println!("skipped: nothing can be mounted here: {}", stderr(&output));
        return;
    }
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let new = read("outside.toml");
    assert!(new.contains("# plumb calibrate --board"), "{new}");
    assert_eq!(read("camera.toml.bak"), read("camera.toml"));
    assert!(!folder.path().join("camera.toml.new").exists());
    // One that is mounted for reading only is told before the measurement.
    let output = mounted("-o ro").unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(!stderr(&output).contains("the board is seen"), "{}", stderr(&output));
    assert!(stderr(&output).contains("Read-only file system"), "{}", stderr(&output));
}

#[test]
fn the_board_is_printed_and_never_over_another_file() {
    let folder = folder();
    let arguments = ["calibrate", "--print-board", "board.pdf", "--paper", "letter"];
    assert_eq!(plumb(&arguments, folder.path()).status.code(), Some(0));
    assert!(fs::metadata(folder.path().join("board.pdf")).unwrap().len() > 2000);
    let again = plumb(&arguments, folder.path());
    assert_eq!(again.status.code(), Some(2));
    assert!(stderr(&again).contains("exists already, and is not overwritten"));
    let output = plumb(&["calibrate", "--print-board", "none/board.pdf"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let output = plumb(&["calibrate", "--print-board", "board.jpg"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("must end in .pdf"), "{}", stderr(&output));
}

#[test]
fn options_of_another_way_are_refused() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    for arguments in [
        &["calibrate", "--rig", &rig][..],
        &["calibrate", "--rig", &rig, "--board", "--ball"],
        &["calibrate", "--rig", &rig, "--ball", "--origin", "0,0,0"],
        &["calibrate", "--rig", &rig, "--board", "--origin", "0,0"],
        &["calibrate", "--rig", &rig, "--board", "--square", "-1"],
        &["calibrate", "--rig", &rig, "--motors", "--pixel", "1,2"],
    ] {
        let output = plumb(arguments, folder.path());
        assert_eq!(output.status.code(), Some(2), "{arguments:?} {}", stderr(&output));
    }
}

#[test]
fn too_few_places_are_refused_before_the_pictures() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let output =
        plumb(&["calibrate", "--rig", &rig, "--ball", "--place", "0.5,0.2,0.1"], folder.path());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert_eq!(text, "plumb: --place: 4 to 40 are needed; given: 1\n");
}

#[test]
fn motors_without_a_measured_place_are_refused_before_the_pictures() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let pixels = ["--pixel", "1,2", "--pixel", "3,4", "--pixel", "5,6"];
    let output =
        plumb(&[&["calibrate", "--rig", &rig, "--motors"], &pixels[..]].concat(), folder.path());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.starts_with("plumb: give --height"), "{text}");
    let two = ["--motor", "0,0,1", "--motor", "1,0,1"];
    let output =
        plumb(&[&["calibrate", "--rig", &rig, "--motors"], &two[..]].concat(), folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(stderr(&output), "plumb: --motor: 3 are needed; given: 2\n");
}

#[test]
fn without_depth_motors_give_a_picture_and_no_pose() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let camera = folder.path().join("camera.toml");
    let text = fs::read_to_string(&camera).unwrap();
    fs::write(&camera, text.replace("depth_scale = 5000.0", "depth_scale = \"none\"")).unwrap();
    let motors = ["calibrate", "--rig", &rig, "--motors", "--height", "0.665"];
    let pixels = ["--pixel", "1,2", "--pixel", "3,4", "--pixel", "5,6"];
    for more in [&pixels[..], &["--page", "--page-address=127.0.0.1:0"]] {
        let output = plumb(&[&motors[..], more].concat(), folder.path());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.starts_with("plumb: --motors needs depth"), "{text}");
    }
    let output = plumb(&["calibrate", "--rig", &rig, "--motors"], folder.path());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("take --board or --ball for the pose"), "{text}");
    assert!(folder.path().join("camera.motors.png").exists());
}

#[test]
fn a_page_needs_a_measure_and_takes_no_pixels() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let refusal = |options: &[&str]| {
        let arguments =
            [&["calibrate", "--rig", &rig, "--page", "--page-address=127.0.0.1:0"], options]
                .concat();
        let output = plumb(&arguments, folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        stderr(&output)
    };
    assert!(refusal(&["--motors"]).contains("give --height"));
    assert!(refusal(&["--motors", "--height", "0.6", "--pixel", "1,2"]).contains("--pixel"));
    assert!(refusal(&["--motors", "--height", "0.6", "--yes"]).contains("--yes"));
    assert!(refusal(&["--ball"]).contains("--ball"));
}
