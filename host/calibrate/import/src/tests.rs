//! Files as the programs write them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use nalgebra::Point3;
use plumb_frame::image::ImageSize;

use super::*;

const VGA: Option<ImageSize> = Some(ImageSize { width: 640, height: 480 });

const CAMERA_CALIBRATION: &str = "\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [605.25, 0., 322.5, 0., 606.75, 241.5, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 0.125, 0.0005, -0.00025, 0.]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [590., 0., 323., 0., 0., 592., 242., 0., 0., 0., 1., 0.]
";

const OPENCV: &str = "\
%YAML:1.0
---
calibration_time: \"Thu Nov 26 10:00:00 2026\"
image_width: 640
image_height: 480
board_width: 9
flags: 0
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 6.0525e+02, 0., 3.225e+02, 0., 6.0675e+02,
       2.415e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.5e-01, 1.25e-01, 5.0e-04, -2.5e-04, 0. ]
avg_reprojection_error: 2.1e-01
extrinsic_parameters: !!opencv-matrix
   rows: 1
   cols: 6
   dt: d
   data: [ 0., 0., 0., 0., 0., 1. ]
";

const CHAIN: &str = "\
cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.25, 0.125, 0.0005, -0.00025]
  distortion_model: radtan
  intrinsics: [605.25, 606.75, 322.5, 241.5]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
  T_cam_imu:
  - [1.0, 0.0, 0.0, 0.1]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
cam1:
  camera_model: pinhole
  distortion_coeffs: [0.01, -0.02, 0.003, -0.004]
  distortion_model: equidistant
  intrinsics: [400.0, 401.0, 320.0, 240.0]
  resolution: [640, 480]
  rostopic: /cam1/image_raw
";

/// A camera 1.5 m in front of the origin that looks along -x: its x is the base's y, its y is -z.
const HANDEYE: &str = "\
parameters:
  eye_on_hand: false
  freehand_robot_movement: true
  namespace: /rig_eye_on_base/
  robot_base_frame: rig
  robot_effector_frame: tool0
  tracking_base_frame: camera_color_optical_frame
  tracking_marker_frame: marker
transformation:
  qw: 0.5
  qx: -0.5
  qy: -0.5
  qz: 0.5
  x: 1.5
  y: 0.25
  z: 0.75
";

const HANDEYE2: &str = "\
parameters:
  name: rig
  calibration_type: eye_on_base
  tracking_base_frame: camera_color_optical_frame
  tracking_marker_frame: marker
  robot_base_frame: rig
  robot_effector_frame: tool0
transform:
  translation:
    x: 1.5
    y: 0.25
    z: 0.75
  rotation:
    x: -0.5
    y: -0.5
    z: 0.5
    w: 0.5
";

/// Returns the lens of a file, and what was not taken.
fn lens(text: &str, choice: Choice<'_>) -> (ImportedLens, Vec<String>) {
    let imported = read(text, choice, None).unwrap_or_else(|error| panic!("{error}"));
    let Content::Lens(lens) = imported.content else { panic!("no lens in {text}") };
    (lens, imported.notes)
}

fn refusal(text: &str) -> String {
    read(text, Choice::Only, None).unwrap_err().to_string()
}

/// Checks the lens of [`CAMERA_CALIBRATION`], which the other files have too.
fn assert_lens(lens: &ImportedLens) {
    assert_eq!([lens.fx, lens.fy, lens.cx, lens.cy], [605.25, 606.75, 322.5, 241.5]);
    let coefficients = lens.distortion.unwrap().coefficients().to_array();
    assert_eq!(coefficients, [-0.25, 0.125, 0.0005, -0.00025, 0.0]);
}

#[test]
fn the_result_of_ros_is_the_lens_of_raw_pictures() {
    let (found, notes) = lens(CAMERA_CALIBRATION, Choice::Only);
    assert_lens(&found);
    assert_eq!(found.size, VGA);
    // Not the projection matrix, and it is said.
    assert!(notes[0].contains("projection matrix"), "{notes:?}");
}

#[test]
fn printed_messages_of_both_versions_of_ros_are_read() {
    let ros2 = "header:\n  frame_id: camera\nheight: 480\nwidth: 640\n\
                distortion_model: rational_polynomial\n\
                d:\n- -0.25\n- 0.125\n- 0.0005\n- -0.00025\n- 0.0\n- 0.0\n- 0.0\n- 0.0\n\
                k: [605.25, 0.0, 322.5, 0.0, 606.75, 241.5, 0.0, 0.0, 1.0]\n\
                binning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n  \
                width: 0\n  do_rectify: false\n---\n";
    let (found, _) = lens(ros2, Choice::Only);
    assert_lens(&found);
    assert_eq!(found.size, VGA);
    let ros1 = ros2.replace("\nd:", "\nD:").replace("\nk:", "\nK:");
    assert_lens(&lens(&ros1, Choice::Only).0);
    // Two messages, as `echo` prints them: the first one.
    assert_lens(&lens(&format!("{ros2}{ros2}"), Choice::Only).0);
    for (field, text) in [
        ("binning_x", ros2.replace("binning_x: 0", "binning_x: 2")),
        ("roi.x_offset", ros2.replace("x_offset: 0", "x_offset: 40")),
        ("roi.width", ros2.replace("  width: 0", "  width: 320")),
    ] {
        assert!(refusal(&text).contains(field), "{}", refusal(&text));
    }
    let whole = ros2.replace("  width: 0", "  width: 640").replace("  height: 0", "  height: 480");
    assert_lens(&lens(&whole, Choice::Only).0);
}

#[test]
fn opencv_s_file_and_other_names_are_read() {
    let (found, notes) = lens(OPENCV, Choice::Only);
    assert_lens(&found);
    assert_eq!(found.size, VGA);
    assert!(notes[0].contains("extrinsic_parameters"), "{notes:?}");

    // As Python programs keep the results of `calibrateCamera`.
    let python = "camera_matrix:\n- [605.25, 0.0, 322.5]\n- [0.0, 606.75, 241.5]\n\
                  - [0.0, 0.0, 1.0]\ndist_coeff:\n- [-0.25, 0.125, 0.0005, -0.00025, 0.0]\n";
    let (found, _) = lens(python, Choice::Only);
    assert_lens(&found);
    assert_eq!(found.size, None);
    let json = "{\"mtx\": [[605.25, 0, 322.5], [0, 606.75, 241.5], [0, 0, 1]], \
                \"dist\": [[-0.25, 0.125, 0.0005, -0.00025, 0.0]], \"image_size\": [640, 480]}";
    let (found, _) = lens(json, Choice::Only);
    assert_lens(&found);
    assert_eq!(found.size, VGA);
}

#[test]
fn a_chain_of_kalibr_has_several_cameras() {
    let (found, notes) = lens(CHAIN, Choice::Named("cam0"));
    assert_lens(&found);
    assert_eq!(found.size, VGA);
    assert!(notes[0].contains("T_cam_imu"), "{notes:?}");

    assert!(refusal(CHAIN).contains("cam0, cam1"), "{}", refusal(CHAIN));
    let error = |name| read(CHAIN, Choice::Named(name), None).unwrap_err().to_string();
    assert!(error("cam2").contains("cam0, cam1"), "{}", error("cam2"));
    assert!(error("cam1").contains("equidistant"), "{}", error("cam1"));
    let one = &CHAIN[..CHAIN.find("cam1:").unwrap()];
    assert_lens(&lens(one, Choice::Only).0);
    let omni = one.replace("camera_model: pinhole", "camera_model: omni");
    assert!(refusal(&omni).contains("omni"), "{}", refusal(&omni));
    let straight = one.replace("radtan", "none").replace("[-0.25, 0.125, 0.0005, -0.00025]", "[]");
    assert_eq!(lens(&straight, Choice::Only).0.distortion, None);
}

#[test]
fn a_hand_eye_calibration_is_the_camera_in_the_base() {
    for text in [HANDEYE, HANDEYE2] {
        let imported = read(text, Choice::Only, None).unwrap();
        let Content::Pose(found) = imported.content else { panic!("no pose in {text}") };
        assert_eq!(
            (found.base.as_str(), found.camera.as_str()),
            ("rig", "camera_color_optical_frame")
        );
        // 1 m in front of the lens, 0.2 m to the right and 0.1 m down in the picture.
        let seen = found.pose * Point3::new(0.2, 0.1, 1.0);
        assert!((seen - Point3::new(0.5, 0.45, 0.65)).norm() < 1e-12, "{seen}");
        assert_eq!(imported.notes, ["`rig` must be the rig frame"]);
    }
    // The first version had no table of parameters.
    let old = HANDEYE.replace("parameters:\n", "").replace("\n  ", "\n");
    let old = old.trim_start().replace("transformation:\n", "transformation:\n  ");
    let at = old.find("transformation:").unwrap();
    let old = format!(
        "{}{}",
        &old[..at],
        old[at..]
            .replace("\nq", "\n  q")
            .replace("\nx", "\n  x")
            .replace("\ny", "\n  y")
            .replace("\nz", "\n  z")
    );
    assert!(matches!(read(&old, Choice::Only, None).unwrap().content, Content::Pose(_)), "{old}");
}

#[test]
fn a_hand_eye_calibration_that_would_be_taken_wrongly_is_refused() {
    let body = HANDEYE.replace("camera_color_optical_frame", "camera_link");
    assert!(refusal(&body).contains("optical frame"), "{}", refusal(&body));
    for in_hand in [
        HANDEYE.replace("eye_on_hand: false", "eye_on_hand: true"),
        HANDEYE2.replace("eye_on_base", "eye_in_hand"),
    ] {
        assert!(refusal(&in_hand).contains("eye_on_base"), "{}", refusal(&in_hand));
    }
    let zero = HANDEYE.replace("0.5\n", "0.0\n");
    assert!(refusal(&zero).contains("norm 0"), "{}", refusal(&zero));
    let other = HANDEYE.replace("camera_color_optical_frame", "tracker");
    let notes = read(&other, Choice::Only, None).unwrap().notes;
    assert!(notes[1].contains("`tracker`") && notes[1].contains("z forward"), "{notes:?}");
}

#[test]
fn lenses_that_plumb_has_no_model_for_are_refused() {
    let of = |from: &str, to: &str| refusal(&CAMERA_CALIBRATION.replace(from, to));
    assert!(of("plumb_bob", "equidistant").contains("equidistant"));
    let eight = of("cols: 5\n  data: [-0.25,", "cols: 8\n  data: [0.1, 0.1, 0.1, -0.25,");
    assert!(eight.contains("only the first five"), "{eight}");
    let two = of(
        "cols: 5\n  data: [-0.25, 0.125, 0.0005, -0.00025, 0.]",
        "cols: 2\n  data: [-0.25, 0.125]",
    );
    assert!(two.contains("4 or 5"), "{two}");
    assert!(of("605.25, 0.,", "605.25, 3.5,").contains("skew of 3.5"));
    assert!(of("605.25", "0.").contains("not calibrated"));
    assert!(of("605.25", ".nan").contains("camera_matrix") || of("605.25", ".nan").contains("Cam"));
    assert!(of("rows: 3", "rows: 4").contains("4 x 3"));
    let fisheye = OPENCV.replace("fisheye_model: 0", "fisheye_model: 1");
    assert!(refusal(&fisheye).contains("fisheye"));
    let stereo = OPENCV.replace("avg_reprojection_error", "M2");
    assert!(refusal(&stereo).contains("two cameras"));
    let alone = OPENCV.replace("distortion_coefficients", "something");
    assert!(refusal(&alone).contains("distortion_coefficients, "), "{}", refusal(&alone));
}

/// A lens as `cv::fisheye::calibrate` returns it, without the name of its model.
const FOUR: &str = "image_size: [640, 480]\n\
                    K: [605.25, 0.0, 322.5, 0.0, 606.75, 241.5, 0.0, 0.0, 1.0]\n\
                    D: [-0.01, 0.05, -0.13, 0.09]\n";

#[test]
fn four_coefficients_without_a_model_are_not_guessed() {
    let text = refusal(FOUR);
    assert!(text.contains("`D`") && text.contains("--import-model fisheye"), "{text}");
    let model = |text: &str, model| read(text, Choice::Only, Some(model));
    let fisheye = model(FOUR, "fisheye").unwrap_err().to_string();
    assert!(fisheye.contains("the model `fisheye`"), "{fisheye}");
    let small = FOUR.replace("-0.13, 0.09", "0.0005, -0.00025");
    assert!(refusal(&small).contains("plumb_bob"));
    let imported = model(&small, "plumb_bob").unwrap();
    let Content::Lens(lens) = imported.content else { panic!("no lens") };
    assert_eq!(lens.distortion.unwrap().coefficients().p2, -0.00025);
    assert_eq!(imported.notes, [""; 0]);
    // Four of any number of columns and rows.
    for four in ["[[-0.01], [0.05], [-0.13], [0.09]]", "[[-0.01, 0.05, -0.13, 0.09]]"] {
        let text = FOUR.replace("[-0.01, 0.05, -0.13, 0.09]", four);
        assert!(matches!(read(&text, Choice::Only, None), Err(ImportError::Ambiguous { .. })));
    }
    // Zeros are a straight lens only in a model of tangents.
    let zeros = FOUR.replace("-0.01, 0.05, -0.13, 0.09", "0, 0, 0, 0");
    assert!(model(&zeros, "fisheye").is_err() && refusal(&zeros).contains("four numbers"));
    let equidistant = CAMERA_CALIBRATION
        .replace("plumb_bob", "equidistant")
        .replace("-0.25, 0.125, 0.0005, -0.00025, 0.", "0., 0., 0., 0., 0.");
    assert!(refusal(&equidistant).contains("equidistant"), "{}", refusal(&equidistant));
}

#[test]
fn tangential_coefficients_that_no_lens_has_are_doubted() {
    let doubt = |text: &str, model| {
        let notes = read(text, Choice::Only, model).unwrap().notes;
        notes.iter().any(|note| note.contains("p1 is -0.13 and p2 is 0.09"))
    };
    assert!(doubt(FOUR, Some("plumb_bob")));
    let of = |text: &str| text.replace("0.0005, -0.00025", "-0.13, 0.09");
    assert!(doubt(&of(CAMERA_CALIBRATION), None));
    assert!(doubt(&of(&CHAIN[..CHAIN.find("cam1:").unwrap()]), None));
    assert!(doubt(&OPENCV.replace("5.0e-04, -2.5e-04", "-0.13, 0.09"), None));
    assert!(!doubt(OPENCV, None));
}

#[test]
fn other_files_are_named() {
    assert!(refusal("<?xml version=\"1.0\"?>\n<opencv_storage>").contains(".yaml"));
    assert!(refusal("").contains("no keys"));
    assert!(refusal("- 1\n- 2\n").contains("no keys"));
    let rig = refusal("motors: [1, 2]\ncamera: 3\n");
    assert!(rig.contains("`camera`, `motors`") && rig.contains("kalibr"), "{rig}");
    let broken = refusal("camera_matrix: [1, 2\nrows: }");
    assert!(broken.contains("no YAML"), "{broken}");
    let absent = refusal(&CAMERA_CALIBRATION.replace("image_width", "width_of_the_image"));
    assert!(absent.contains("image_width"), "{absent}");
    assert!(refusal(&"a".repeat(2 << 20)).contains("bytes"));
    let name = read(OPENCV, Choice::Named("cam0"), None).unwrap_err().to_string();
    assert!(name.contains("--import-camera cam0"), "{name}");
    for text in [CAMERA_CALIBRATION, CHAIN, HANDEYE] {
        let text = text.split("cam1:").next().unwrap();
        let model = read(text, Choice::Only, Some("fisheye")).unwrap_err().to_string();
        assert!(model.contains("--import-model fisheye"), "{model}");
    }
}

/// Files that are cut, or have another byte at a place, are read or refused: nothing panics.
#[test]
fn damaged_files_are_refused() {
    for text in [CAMERA_CALIBRATION, OPENCV, CHAIN, HANDEYE, HANDEYE2] {
        for place in (0..text.len()).step_by(7) {
            let _read_or_refused = read(&text[..place], Choice::Only, None);
            let mut bytes = text.as_bytes().to_vec();
            for byte in [b' ', b'[', b'&', b'*'] {
                bytes[place] = byte;
                let damaged = String::from_utf8(bytes.clone()).unwrap();
                let _read_or_refused = read(&damaged, Choice::Only, None);
            }
        }
    }
    // Aliases that double with each line.
    let doubling: String =
        (1..40).map(|n| format!("a{n}: &a{n} [*a{0}, *a{0}]\n", n - 1)).collect();
    assert!(!refusal(&format!("a0: &a0 [1]\n{doubling}")).is_empty());
}
