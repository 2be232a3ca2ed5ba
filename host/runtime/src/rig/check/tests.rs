mod mistakes;

use std::fs;

use plumb_config::toml_file::place;
use plumb_protocol::config::{Config, Workspace};
use plumb_protocol::message::{ConfigField, Refusal};
use plumb_protocol::wiring::Wiring;

use super::*;
use crate::rig::PAPER;
use crate::rig::document::HIDDEN;

/// Board that refuses more than 16 microsteps, a travel without 0, and 1000 full steps/s.
fn board(wiring: &Wiring, config: &Config) -> Vec<Refusal> {
    let mut fields = Vec::new();
    wiring.each_error(None, |error| fields.push(Refusal::Wiring(error)));
    if config.microsteps > 16 {
        fields.push(Refusal::Config(ConfigField::Microsteps));
    }
    for motor in &config.motors {
        if motor.max_rate.to_si() > 1000.0 {
            fields.push(Refusal::Config(ConfigField::MaxRate));
        }
        if motor.travel_min.0 > 0 || motor.travel_max.0 < 0 {
            fields.push(Refusal::Config(ConfigField::Travel));
        }
    }
    fields
}

/// Checks the paper's rig file with these replacements, beside its camera file.
fn findings(replacements: &[(&str, &str)]) -> Vec<Finding> {
    let folder = tempfile::tempdir().unwrap();
    let mut text = PAPER.to_owned();
    for (old, new) in replacements {
        assert!(text.contains(old), "{old}");
        text = text.replacen(old, new, 1);
    }
    let path = folder.path().join("rig.toml");
    fs::write(&path, text).unwrap();
    fs::write(folder.path().join("camera.toml"), camera_file::PAPER).unwrap();
    check(&path, &board, &|_, _, _| Ok(()))
}

/// Returns the first key of each error, and of each warning.
fn keys(findings: &[Finding]) -> [Vec<&str>; 2] {
    [Severity::Error, Severity::Warning].map(|severity| {
        let of_severity = findings.iter().filter(|finding| finding.severity == severity);
        of_severity.map(|finding| finding.values[0].0.as_str()).collect()
    })
}

#[test]
fn the_papers_file_has_no_error_and_its_workspace_a_warning() {
    assert_eq!(keys(&findings(&[])), [vec![], vec!["workspace.min"]]);
}

#[test]
fn mistakes_of_every_kind_are_reported_together_and_once() {
    let found = findings(&[
        ("max_rate = 400.0", "max_rate = 4000.0"),
        ("max_acceleration = 2000.0", "max_acceleration = 1e300"),
        ("microsteps = 16", "microsteps = 17"),
        ("travel = [-1000, 1500]", "travel = [10, 1500]"),
        ("driver = \"a4988\"", "drivr = \"a4988\""),
        ("radius = 0.010", "radius = \"10 mm\""),
        ("max_age = 0.25", "max_age = 0.75"),
        ("margin = 0.04", "margin = -1"),
        ("file = \"camera.toml\"", "file = \"camera.toml\"\nsource = \"recording\""),
        ("targets = [[0.400, 0.400, 0.150]]", "targets = [[0.4, 0.4, 0.15], [0.4, -0.1, 0.3]]"),
    ]);
    let [mut errors, _] = keys(&found);
    errors.sort_unstable();
    let expected = [
        "camera.source",
        "deadlines.max_age",
        "growth.margin",
        "motors.drivr",
        "motors.max_acceleration",
        "motors.max_rate",
        "motors.microsteps",
        "motors.travel",
        "reached.radius",
        "targets",
    ];
    assert_eq!(errors, expected, "{found:#?}");
}

#[test]
fn a_message_names_file_line_key_value_range_and_an_example() {
    let texts: Vec<String> = findings(&[
        ("max_rate = 400.0", "max_rate = 4000.0"),
        ("microsteps = 16", "microsteps = 17"),
    ])
    .iter()
    .map(ToString::to_string)
    .collect();
    let line = "rig.toml:16: error: `motors.microsteps = 17` is out of range; \
                allowed: 1, 2, 4, 8, 16, for example 16";
    assert!(texts.iter().any(|text| text.ends_with(line)), "{texts:#?}");
    let rate = "`motors.max_rate = 4000.0`";
    assert!(texts.iter().any(|t| t.contains(rate) && t.contains("at most 1000 ")), "{texts:#?}");
}

/// Checks the paper's rig with a Pico 2, this line of `[board]`, and these lines of `[motors]` in
/// place of its driver. Returns the errors, and the refusal before a run.
fn on_a_pico_2(board: &str, motors: &str) -> (Vec<String>, Option<String>) {
    let board = &format!("[board]\nkind = \"pico2\"\n{board}");
    let found = findings(&[("[board]", board), ("driver = \"a4988\"", motors)]);
    let errors = found.iter().filter(|finding| finding.severity == Severity::Error);
    let errors = errors.map(|finding| finding.to_string().split_once("error: ").unwrap().1.into());
    let text = PAPER.replacen("[board]", board, 1).replacen("driver = \"a4988\"", motors, 1);
    let refused = Rig::parse(Path::new("rig.toml"), &text).unwrap().wiring().err();
    (errors.collect(), refused.map(|refused| refused.to_string()))
}

#[test]
fn pulses_that_the_chip_cannot_make_are_refused_with_their_key() {
    let step_dir = |high: &str| {
        format!("driver = {{ step-dir = {{ high = {high}, low = 2.5e-6, setup = 5e-6 }} }}")
    };
    let timing = |high: &str| format!("driver = \"dm542\"\ntiming.high = {high}");
    for text in [step_dir("3.42e-6"), timing("3.42e-6")] {
        assert_eq!(on_a_pico_2("", &text), (vec![], None), "{text}");
    }
    let why = "is above 3.42e-6 s, the widest pulse that a Raspberry Pi Pico 2 makes";
    for (text, key) in [
        (step_dir("3.43e-6"), "motors.driver.step-dir.high"),
        (timing("3.43e-6"), "motors.timing.high"),
        (format!("{}\ntiming.high = 3.43e-6", step_dir("2e-6")), "motors.timing.high"),
    ] {
        let (errors, refused) = on_a_pico_2("", &text);
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert!(errors[0].starts_with(&format!("`{key} = 3.43e-6` {why}")), "{errors:?}");
        assert!(refused.unwrap().starts_with(&format!("`{key}` {why}")), "before a run");
    }
    // On a Pico the chip makes them.
    let found = findings(&[("driver = \"a4988\"", &timing("4.1e-6"))]);
    assert_eq!(keys(&found)[0], [""; 0], "{found:#?}");
}

#[test]
fn an_inverted_emergency_input_is_refused_on_a_pico_2_with_what_to_do() {
    let inverted = "inverted.emergency = true";
    let (errors, refused) = on_a_pico_2(inverted, "driver = \"a4988\"");
    let (key, why) = ("`board.inverted.emergency", "is unsafe on a Raspberry Pi Pico 2: ");
    assert!(errors.len() == 1 && errors[0].starts_with(&format!("{key} = true` {why}")));
    assert!(errors[0].contains("put the contact between the pin and ground"), "{errors:?}");
    assert!(refused.unwrap().starts_with(&format!("{key}` {why}")), "before a run");
    let found = findings(&[("[board]", &format!("[board]\n{inverted}"))]);
    assert_eq!(keys(&found)[0], [""; 0], "on a Pico: {found:#?}");
}

#[test]
fn a_mistake_of_syntax_says_that_others_are_hidden() {
    let rate = ("max_rate = 400.0", "max_rate = fast");
    let travel = ("travel = [-1000, 1500]", "travel = [-1000, 1500 steps]");
    for (wrong, count) in [(&[rate][..], 1), (&[rate, travel], 2)] {
        let found = findings(wrong);
        assert_eq!(found.len(), count, "{found:#?}");
        assert!(found[count - 1].problem.ends_with(HIDDEN), "{found:#?}");
    }
    let wrong = [("max_rate = 400.0", "max_rate = -1"), ("microsteps = 16", "microsteps = 3")];
    let found = findings(&wrong);
    assert!(found.iter().all(|it| !it.problem.ends_with(HIDDEN)), "{found:#?}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    fs::write(&path, PAPER).unwrap();
    let camera = camera_file::PAPER.replace("fx = 525.0", "fx = 525 px");
    fs::write(folder.path().join("camera.toml"), camera).unwrap();
    let found = check(&path, &board, &|_, _, _| Ok(()));
    assert!(found.iter().any(|it| it.problem.ends_with(HIDDEN)), "{found:#?}");
}

#[test]
fn intrinsics_for_pictures_of_another_size_are_a_warning_where_a_run_takes_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    let size = "[intrinsics]\nwidth = 640\nheight = 480\n";
    let camera = camera_file::PAPER.replacen("[intrinsics]\n", size, 1);
    fs::write(folder.path().join("camera.toml"), camera).unwrap();
    for (camera, is_told) in [
        ("source = \"openni\"", false),
        ("source = \"openni\"\nopenni.width = 320\nopenni.height = 240", true),
        ("source = \"webcam\"\nwebcam.width = 1280\nwebcam.height = 720", true),
        ("source = \"realsense\"\nrealsense.width = 1280\nrealsense.height = 720", false),
    ] {
        let text = PAPER.replacen("[camera]\n", &format!("[camera]\n{camera}\n"), 1);
        fs::write(&path, text).unwrap();
        let found = check(&path, &board, &|_, _, _| Ok(()));
        let is_it = |it: &Finding| it.to_string().contains("are the size of other pictures");
        assert_eq!(found.iter().any(is_it), is_told, "{camera}: {found:#?}");
    }
}

#[test]
fn a_camera_file_and_a_rig_file_in_the_place_of_each_other_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let (rig, camera) = (folder.path().join("rig.toml"), folder.path().join("camera.toml"));
    fs::write(&camera, camera_file::PAPER).unwrap();
    let found = check(&camera, &board, &|_, _, _| Ok(()));
    let [finding] = &found[..] else { panic!("{found:#?}") };
    let text = finding.to_string();
    assert!(text.ends_with("error: this is a camera file; give the rig file"), "{text}");
    let error = Rig::read(&camera).unwrap_err().to_string();
    assert!(error.ends_with("camera.toml: this is a camera file; give the rig file"), "{error}");
    fs::write(&rig, PAPER.replace("\"camera.toml\"", "\"rig.toml\"")).unwrap();
    let found = check(&rig, &board, &|_, _, _| Ok(()));
    let of_camera = found.iter().find(|it| it.values[0].0 == "camera.file").unwrap();
    assert!(of_camera.problem.ends_with("is a rig file; give the camera file"), "{of_camera}");
    let error = camera_file::read(&rig).unwrap_err().to_string();
    assert!(error.ends_with("rig.toml: this is a rig file; give the camera file"), "{error}");
}

#[test]
fn a_file_that_does_not_exist_is_named_with_the_cause_and_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let rig = folder.path().join("rig.toml");
    let found = check(&rig, &board, &|_, _, _| Ok(()));
    assert!(found[0].to_string().contains("cannot be read: No such file"), "{}", found[0]);
    fs::write(&rig, PAPER).unwrap();
    let found = check(&rig, &board, &|_, _, _| Ok(()));
    let text = found.iter().find(|it| it.severity == Severity::Error).unwrap().to_string();
    let line = place(PAPER, "camera.file").unwrap().line;
    assert!(text.contains(&format!("rig.toml:{line}: error: `camera.file = ")), "{text}");
    assert!(text.contains("camera.toml: cannot be read: No such file"), "{text}");
}

#[test]
fn a_target_at_the_border_of_the_workspace_is_a_warning() {
    let found = findings(&[("[[0.400, 0.400, 0.150]]", "[[0.4, 0.4, 0.3], [0.4, 0.4, 0.598]]")]);
    assert_eq!(keys(&found)[0], Vec::<&str>::new());
    let warning = found.iter().find(|finding| finding.values[0].0 == "targets").unwrap();
    let problem = "put target 2 2 mm from the border of the workspace";
    assert!(warning.to_string().contains(problem), "{warning}");
    let enough = findings(&[("[[0.400, 0.400, 0.150]]", "[[0.4, 0.4, 0.59]]")]);
    assert!(!keys(&enough)[1].contains(&"targets"));
}

#[test]
fn a_port_without_its_folder_or_of_windows_is_a_warning() {
    for (port, instead) in [("ttyACM0", "write /dev/ttyACM0"), ("COM3", "of Windows")] {
        let found = findings(&[("\"/dev/ttyACM0\"", &format!("\"{port}\""))]);
        let finding = found.iter().find(|it| it.to_string().contains(instead)).unwrap();
        assert_eq!(finding.severity, Severity::Warning, "{finding}");
    }
}

#[test]
fn microsteps_that_no_strap_sets_are_a_warning() {
    let tmc2209 = ("driver = \"a4988\"", "driver = \"tmc2209\"");
    assert_eq!(keys(&findings(&[tmc2209])), keys(&findings(&[])));
    let found = findings(&[tmc2209, ("microsteps = 16", "microsteps = 4")]);
    let [errors, warnings] = keys(&found);
    assert!(errors.is_empty() && warnings.contains(&"motors.microsteps"), "{warnings:?}");
}

#[test]
fn a_file_without_targets_is_wrong() {
    let found = findings(&[("targets = [[0.400, 0.400, 0.150]]", "targets = []")]);
    assert_eq!(keys(&found)[0], ["targets"]);
    assert!(found[0].to_string().contains("`targets = []` has no target"), "{}", found[0]);
}

#[test]
fn a_wrong_source_of_pictures_is_one_mistake() {
    for (lines, key) in [
        ("source = \"stream\"\nstream = \"tcp:here\"", "camera.stream"),
        ("source = \"recording\"\nrecording = 5", "camera.recording"),
    ] {
        let found = findings(&[("[camera]\n", &format!("[camera]\n{lines}\n"))]);
        assert_eq!(keys(&found)[0], [key]);
    }
}

#[test]
fn a_camera_and_a_folder_that_are_no_source_are_errors() {
    for (line, says) in [
        ("source = \"Kinect\"", "unknown variant `Kinect`, expected one of `simulated`, "),
        ("recording = \"/\"", "names no recording: /: has no rgb.txt"),
    ] {
        let found = findings(&[("[camera]\n", &format!("[camera]\n{line}\n"))]);
        assert!(found.iter().any(|it| it.to_string().contains(says)), "{found:#?}");
    }
}

#[test]
fn a_travel_that_does_not_fit_the_workspace_is_a_warning() {
    for (travel, says) in [
        ("[-5000, 5000]", "protects little: the workspace takes at most "),
        ("[-100, 100]", "is too little to cross the workspace: that takes up to "),
    ] {
        let found = findings(&[("travel = [-1000, 1500]", &format!("travel = {travel}"))]);
        let finding = found.iter().find(|it| it.values[0].0 == "motors.travel").unwrap();
        assert!(finding.problem.starts_with(says), "{finding}");
        assert_eq!(finding.severity, Severity::Warning, "{finding}");
    }
}

/// The workspace is 0.93 m from corner to corner, and a step winds 0.47 mm: 2000 steps.
#[test]
fn a_limit_that_this_rig_never_reaches_is_a_warning() {
    for (key, table) in [
        ("following.turn", "[following]\nturn = 6400"),
        ("jog.max_distance", "[jog]\nmax_distance = 50000"),
        ("path.max_speed", "[path]\nmax_speed = 2.0"),
    ] {
        let found = findings(&[("[reached]", &format!("{table}\n\n[reached]"))]);
        let finding = found.iter().find(|it| it.values[0].0 == key).unwrap();
        assert_eq!(finding.severity, Severity::Warning, "{finding}");
        assert!(keys(&findings(&[]))[1].iter().all(|other| *other != key), "not by default");
    }
}

/// The placeholder of a wrong size must not be compared with the travel.
#[test]
fn a_size_with_a_mistake_gives_no_further_warning() {
    let travel = ("travel = [-1000, 1500]", "travel = [-5000, 5000]");
    let radii = ("pulley_radii = [0.015,", "pulley_radii = [\"wide\",");
    assert!(keys(&findings(&[travel]))[1].contains(&"motors.travel"));
    assert_eq!(keys(&findings(&[travel, radii])), [vec!["simulation.pulley_radii"], vec![]]);
}

#[test]
fn a_target_that_no_cables_can_hold_is_an_error() {
    let targets = ("targets = [[0.400, 0.400, 0.150]]", "targets = [[0.2, 0.45, 0.15]]");
    let found = findings(&[targets]);
    assert_eq!(found[0].severity, Severity::Error);
    assert!(found[0].to_string().contains("put target 1, "), "{}", found[0]);
    // The triangle of motors that are a mistake is none of the rig's.
    let motors = ("motors = [[0.850, 0.610, 0.665]", "motors = [[0.850, 0.610, \"high\"]");
    let targets = (targets.0, "targets = [[0.2, 0.2, 0.15]]");
    assert_eq!(keys(&findings(&[targets])), [vec![], vec!["workspace.min"]]);
    assert_eq!(keys(&findings(&[targets, motors]))[0], ["simulation.motors"]);
}

/// Board that refuses a workspace without room.
fn with_room(_: &Wiring, config: &Config) -> Vec<Refusal> {
    let Workspace { min, max } = config.workspace;
    let is_empty = min.0.iter().zip(max.0).any(|(min, max)| *min >= max);
    is_empty.then_some(Refusal::Config(ConfigField::Workspace)).into_iter().collect()
}

#[test]
fn a_rig_without_a_place_for_the_ball_is_one_mistake() {
    for (old, new, says) in [
        (
            "min = [0.10, 0.10, 0.05]",
            "min = [0.10, 0.70, 0.05]",
            "`workspace.max = [0.80, 0.50, 0.60]` leave no room along y: `min` must be below",
        ),
        ("[0.0, 0.240, 0.665]", "[0.85, 1.2, 0.665]", "` are on a line, seen from above, and"),
    ] {
        assert!(PAPER.contains(old), "{old}");
        let text = PAPER.replacen(old, new, 1);
        let path = Path::new("rig.toml");
        let (found, _) = check_text(path, &text, &with_room);
        let found: Vec<String> = found.iter().map(ToString::to_string).collect();
        assert!(found.len() == 1 && found[0].contains(says), "{found:#?}");
        let before_a_run = wrong_targets(path, &text, &Rig::parse(path, &text).unwrap());
        assert_eq!(before_a_run.iter().map(ToString::to_string).collect::<Vec<_>>(), found);
    }
}

#[test]
fn limits_that_protect_nothing_are_warnings() {
    let warnings = |replacements: &[(&str, &str)]| -> Vec<String> {
        findings(replacements).iter().map(ToString::to_string).collect()
    };
    let cases = [
        ("travel = [-1000, 1500]", "travel = [-5000, 5000]", "protects little"),
        ("radii = [0.015,", "radii = [0.080,", "1.01 m/s: above 0.75 m/s, here 298 full steps/s"),
        ("min = [0.10, 0.10, 0.05]", "min = [0.10, 0.10, -0.1]", "below the floor"),
        ("max = [0.80, 0.50, 0.60]", "max = [0.80, 0.50, 0.70]", "up to the motors"),
        ("[0.850, 0.610, 0.665], [0.850, 0.0", "[0.850, 0.0, 0.665], [0.850, 0.61", "rig frame"),
    ];
    for (old, new, expected) in cases {
        let found = warnings(&[(old, new)]);
        assert!(found.iter().any(|text| text.contains(expected)), "{new}: {found:#?}");
        assert!(found.iter().all(|text| text.contains(": warning: ")), "{new}: {found:#?}");
    }
}

#[test]
fn mistakes_of_the_camera_file_are_reported_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    fs::write(&path, PAPER).unwrap();
    let errors = |camera: &str| {
        fs::write(folder.path().join("camera.toml"), camera).unwrap();
        let found = check(&path, &board, &|_, _, _| Ok(()));
        found.into_iter().filter(|f| f.severity == Severity::Error).collect::<Vec<_>>()
    };
    let camera = camera_file::PAPER.replace("fx = 525.0", "fx = 0").replace("[ball]", "[bal]");
    let found = errors(&camera);
    assert_eq!(keys(&found)[0], ["intrinsics.fx", "bal", "ball"], "{found:#?}");
    assert!(found.iter().all(|finding| finding.file.ends_with("camera.toml")));
    // A distortion without an inverse, beside another mistake.
    let camera = camera_file::PAPER.replace("fx = 525.0", "k1 = -0.6\nfx = 525.0");
    let found = errors(&camera.replace("diameter_m = ", "diameter_m = -"));
    assert_eq!(keys(&found)[0], ["intrinsics", "ball.diameter_m"], "{found:#?}");
    let text = found[0].to_string();
    assert!(
        text.contains("`intrinsics` is wrong: the lens distortion has no inverse at column"),
        "{text}"
    );
    assert!(!text.contains("allowed"), "{text}");
    fs::remove_file(folder.path().join("camera.toml")).unwrap();
    let [finding] = &check(&path, &board, &|_, _, _| Ok(()))
        .into_iter()
        .filter(|finding| finding.severity == Severity::Error)
        .collect::<Vec<_>>()[..]
    else {
        panic!("one error")
    };
    assert!(finding.to_string().contains("camera.toml: cannot be read: No such"), "{finding}");
}

#[test]
fn placeholders_have_every_required_key() {
    let required = REFERENCE.lines().filter(|line| line.contains("| required"));
    let names: Vec<&str> = required.filter_map(|line| line.split('`').nth(1)).collect();
    assert!(names.len() > 20, "{names:?}");
    for name in names {
        assert!(place(PLACEHOLDERS, name).is_some(), "{name}");
    }
}
