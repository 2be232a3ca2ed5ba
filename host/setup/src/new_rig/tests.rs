use std::fs;
use std::path::Path;

use plumb_cameras::camera_file;
use plumb_config::reference::keys;
use plumb_runtime::rig::Stiffness;
use plumb_runtime::rig::check::{Finding, check};
use plumb_runtime::rig::quantity::Corner;
use plumb_runtime::rig::{LawName, REFERENCE, Rig};

use super::*;

/// Writes the files of `rig` and returns what the check finds, and the rig that is read.
fn written(rig: &NewRig) -> (Vec<Finding>, Rig) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    let files = rig.files().unwrap_or_else(|error| panic!("{rig:?}: {error}"));
    fs::write(&path, files.rig).unwrap();
    fs::write(folder.path().join("camera.toml"), files.camera).unwrap();
    (check(&path, &|_, _| Vec::new(), &|_, _, _| Ok(())), Rig::read(&path).unwrap())
}

#[test]
fn the_default_files_have_no_finding_and_the_default_law() {
    let (findings, rig) = written(&NewRig::default());
    assert_eq!(findings, []);
    assert_eq!(rig.law, LawName::Taut.into());
}

/// Every angle and size of the triangle that is accepted gives files without an error or a warning:
/// the workspace is inside the triangle, above the floor, and the travel fits it.
#[test]
fn limits_fit_every_size() {
    let sizes = [0.2, 0.5, 0.61, 1.0, 2.0, 3.5];
    let (mut accepted, mut refused) = (0, 0);
    for sides in sizes.into_iter().flat_map(|ab| {
        sizes.into_iter().flat_map(move |bc| sizes.into_iter().map(move |ca| [ab, bc, ca]))
    }) {
        for height in [0.4, 1.0, 3.5] {
            let rig = NewRig { sides, height, ..NewRig::default() };
            if let Err(error) = rig.files() {
                assert!(matches!(error, NewRigError::Size(_)), "{error}");
                refused += 1;
                continue;
            }
            let (findings, _) = written(&rig);
            assert_eq!(findings, [], "{rig:?}");
            accepted += 1;
        }
    }
    assert!(accepted > 100 && refused > 100, "{accepted} {refused}");
}

#[test]
fn the_stiffness_of_the_cables_is_that_of_the_answer() {
    for stiffness in Stiffness::ALL {
        let (findings, rig) = written(&NewRig { stiffness, ..NewRig::default() });
        assert_eq!((findings, rig.cables.stiffness), (Vec::new(), stiffness));
    }
}

#[test]
fn a_motor_winds_a_fifth_of_a_metre_while_its_ball_may_stand() {
    for (cable_per_turn, turn) in [(0.047, 810.0), (0.094, 400.0), (0.188, 200.0)] {
        let (findings, rig) = written(&NewRig { cable_per_turn, ..NewRig::default() });
        assert_eq!((findings, rig.following.turn.get()), (Vec::new(), turn));
    }
}

#[test]
fn the_guessed_camera_sees_the_whole_workspace_of_a_large_rig() {
    let rig = NewRig { sides: [3.5; 3], height: 3.5, ..NewRig::default() };
    let file = camera_file::parse(Path::new("camera.toml"), &rig.files().unwrap().camera).unwrap();
    let (_, rig) = written(&rig);
    let (min, max) = (rig.workspace.min.map(Corner::get), rig.workspace.max.map(Corner::get));
    for corner in 0..8 {
        let at = [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] });
        let seen = file.pose.inverse_transform_point(&at.into());
        let (u, v) = file.intrinsics.project(&seen).unwrap();
        assert!((0.0..640.0).contains(&u) && (0.0..480.0).contains(&v), "{at:?}: {u} {v}");
    }
}

#[test]
fn sizes_of_no_rig_are_refused_with_a_reason() {
    let refused = |sides: [f64; 3], height: f64| {
        NewRig { sides, height, ..NewRig::default() }.files().unwrap_err().to_string()
    };
    assert!(refused([1.0, 0.4, 0.4], 1.0).starts_with("no triangle has the sides"));
    assert!(refused([0.5, 1.2, 1.0], 1.0).contains("C must lie between A and B"));
    assert!(refused([f64::NAN, 1.0, 1.0], 1.0).starts_with("side AB is NaN m"));
    assert!(refused([0.6, 0.9, 0.9], 0.1).contains("must be from 0.4 to 3.5 m"));
    let ball = NewRig { ball_diameter: 0.3, height: 0.4, ..NewRig::default() };
    assert!(ball.files().unwrap_err().to_string().contains("no room"));
}

#[test]
fn the_straps_are_those_of_the_data_sheets() {
    let straps = |driver: DriverKind, microsteps| {
        driver.straps(microsteps).unwrap().map(|straps| straps.to_string())
    };
    let expected = |text: &str| Some(text.to_owned());
    assert_eq!(straps(DriverKind::Tmc2209, 8), expected("MS1 low, MS2 low"));
    assert_eq!(straps(DriverKind::Tmc2209, 16), expected("MS1 high, MS2 high"));
    assert_eq!(straps(DriverKind::A4988, 16), expected("MS1 high, MS2 high, MS3 high"));
    assert_eq!(straps(DriverKind::A4988, 2), expected("MS1 high, MS2 low, MS3 low"));
    assert_eq!(straps(DriverKind::Drv8825, 16), expected("M0 low, M1 low, M2 high"));
    assert_eq!(straps(DriverKind::Drv8825, 8), expected("M0 high, M1 high, M2 low"));
    assert_eq!(straps(DriverKind::Coils, 4), None);
    let error = DriverKind::Tmc2209.straps(4).unwrap_err().to_string();
    let text = "the board cannot drive a TMC2209 without UART at 4 microsteps: choose one of 8, 16";
    assert_eq!(error, text);
}

/// Each line with a key follows a line of comment.
#[test]
fn each_key_has_a_comment() {
    let rig = NewRig { camera: NewCamera::Simulated, ..NewRig::default() };
    let files = rig.files().unwrap();
    for text in [&files.rig, &files.camera] {
        let lines: Vec<&str> = text.lines().collect();
        for pair in lines.windows(2).filter(|pair| pair[1].contains(" = ")) {
            assert!(pair[0].starts_with("# "), "{pair:?}");
        }
    }
    let guards = ["reached.radius", "deadlines.host", "growth.margin"];
    for name in guards {
        let key = keys(REFERENCE).into_iter().find(|key| key.name == name).unwrap();
        assert!(files.rig.contains(&key.meaning[1..]), "{name}");
    }
}

#[test]
fn the_files_of_two_motors_are_right_and_ask_for_jogs() {
    for is_simulated in [false, true] {
        let new = NewPlanarRig { is_simulated, ..NewPlanarRig::default() };
        let NewFiles { rig, camera, .. } = new.files().unwrap();
        let rig = Rig::parse("rig.toml".as_ref(), &rig).unwrap();
        assert!(rig.plane.is_some() && rig.simulation.is_some() == is_simulated);
        rig.config().unwrap();
        let camera = camera_file::parse("camera.toml".as_ref(), &camera).unwrap();
        assert!(!camera.intrinsics.has_depth());
    }
}
