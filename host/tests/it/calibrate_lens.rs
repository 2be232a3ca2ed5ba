//! `plumb calibrate --lens`: pictures of a folder, the simulated camera, the files, refusals.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;

use crate::common::{folder, json, plumb, rig_file, stderr};
use plumb_calibrate::board::CharucoSheet;
use plumb_calibrate::render::{draw_board, shown_pose};
use plumb_cameras::{camera_file, png};
use plumb_vision::camera::{CalibratedFor, Distortion, DistortionCoefficients, Intrinsics};
use plumb_vision::image::ImageSize;
use plumb_vision::render::Scene;
use serde_json::Value;

/// Pictures of a folder.
const PICTURES: u32 = 14;

/// Returns a lens that differs from the paper's.
fn lens() -> Intrinsics {
    let (k1, k2, p1, p2, k3) = (-0.28, 0.1, 0.001, -0.001, 0.0);
    let distortion = Distortion::new(DistortionCoefficients { k1, k2, p1, p2, k3 });
    let (fx, fy, cx, cy) = (560.0, 562.0, 325.0, 235.0);
    Intrinsics { fx, fy, cx, cy, depth_scale: 1000.0, distortion }
}

/// Renders pictures of the board into the folder "photos".
fn take_pictures(folder: &Path) {
    let photos = folder.join("photos");
    fs::create_dir(&photos).unwrap();
    let (lens, size) = (lens(), ImageSize { width: 640, height: 480 });
    for number in 0..PICTURES {
        let mut scene = Scene::wall(size.width, size.height, lens, 3.0);
        let pose = shown_pose(&lens, size, &CharucoSheet::SHEET, number);
        draw_board((&mut scene.colour, &mut scene.depth), &lens, &CharucoSheet::SHEET, &pose);
        png::save(&photos.join(format!("{number:02}.png")), &scene.colour).unwrap();
    }
}

/// Returns the number of files and folders in a folder.
fn count(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

/// Checks the lens of a result against the true one.
fn check(result: &Value, lens: &Intrinsics) {
    let number = |key: &str| result[key].as_f64().unwrap();
    assert!((number("fx") / lens.fx - 1.0).abs() < 0.005, "{result}");
    assert!((number("fy") / lens.fy - 1.0).abs() < 0.005, "{result}");
    assert!((number("cx") - lens.cx).hypot(number("cy") - lens.cy) < 3.0, "{result}");
    let k1 = lens.distortion.unwrap().coefficients().k1;
    assert!((result["distortion"][0].as_f64().unwrap() - k1).abs() < 0.02, "{result}");
    assert!(number("rms_px") < 0.5 && number("held_out_px") < 0.5, "{result}");
    assert!(result["written"] == true && result["grade"] != "poor", "{result}");
}

#[test]
fn pictures_of_a_folder_give_the_lens_and_the_former_file_is_kept() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let before = fs::read_to_string(folder.path().join("camera.toml")).unwrap();
    take_pictures(folder.path());
    let arguments =
        ["calibrate", "--rig", &rig, "--lens", "--pictures", "photos", "--yes", "--json"];
    let output = plumb(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    check(&json(&output), &lens());
    let new = camera_file::read(&folder.path().join("camera.toml")).unwrap();
    assert!((new.intrinsics.fx / lens().fx - 1.0).abs() < 0.005, "{new:?}");
    assert!(new.intrinsics.distortion.is_some());
    assert_eq!(new.pose, camera_file::paper().unwrap().pose);
    assert_eq!(fs::read_to_string(folder.path().join("camera.toml.bak")).unwrap(), before);
    let drawn = count(&folder.path().join("camera.lens"));
    assert_eq!(json(&output)["views"], drawn);
}

#[test]
fn a_lens_that_a_run_ignores_comes_with_the_line_to_write() {
    let folder = folder();
    take_pictures(folder.path());
    for (camera, is_ignored) in [
        ("source = \"realsense\"", true),
        ("source = \"realsense\"\nrealsense.intrinsics = \"file\"", false),
        ("source = \"ros2\"", true),
        ("source = \"openni\"", false),
        ("source = \"openni\"\nopenni.intrinsics = \"device\"", true),
    ] {
        let lines = format!("[camera]\n{camera}\n");
        let rig = rig_file(folder.path(), |text| text.replacen("[camera]\n", &lines, 1));
        let arguments = ["calibrate", "--rig", &rig, "--lens", "--pictures", "photos", "--yes"];
        let text = stderr(&plumb(&arguments, folder.path()));
        let name = camera.split('"').nth(1).unwrap();
        let says = match camera.contains("intrinsics") {
            true => format!("set `intrinsics = \"file\"` in [camera.{name}] of"),
            false => format!("write `{name}.intrinsics = \"file\"` below [camera] of"),
        };
        assert_eq!(text.contains(&says), is_ignored, "{camera}: {text}");
    }
}

#[test]
fn the_simulated_camera_shows_the_board_for_its_lens() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let path = folder.path().join("camera.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("cx = ", "k1 = -0.28\nk2 = 0.1\ncx = ", 1)).unwrap();
    let truth = camera_file::read(&path).unwrap().intrinsics;
    let output = plumb(
        &["calibrate", "--rig", &rig, "--lens", "--views", "12", "--yes", "--json"],
        folder.path(),
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    check(&json(&output), &truth);
}

/// Records the board at 1280x720, held still for two pictures at each place, into the folder
/// "board". Returns the lens.
fn record_board(folder: &Path) -> Intrinsics {
    let (fx, fy, cx, cy) = (900.0, 902.0, 645.0, 355.0);
    let (lens, size) =
        (Intrinsics { fx, fy, cx, cy, ..lens() }, ImageSize { width: 1280, height: 720 });
    let board = folder.join("board");
    fs::create_dir(&board).unwrap();
    let (mut list, mut time) = (String::new(), 0.0);
    for number in 0..12 {
        let mut scene = Scene::wall(size.width, size.height, lens, 3.0);
        let pose = shown_pose(&lens, size, &CharucoSheet::SHEET, number);
        draw_board((&mut scene.colour, &mut scene.depth), &lens, &CharucoSheet::SHEET, &pose);
        png::save(&board.join(format!("{number:02}.png")), &scene.colour).unwrap();
        for _ in 0..2 {
            list += &format!("{time:.3} {number:02}.png\n");
            time += 0.02;
        }
    }
    fs::write(board.join("rgb.txt"), list).unwrap();
    fs::write(board.join("depth.txt"), "").unwrap();
    lens
}

/// Writes a rig file whose camera is the recording of [`record_board`]. Returns its path and the
/// lens.
fn recorded_rig(folder: &Path) -> (String, Intrinsics) {
    let recording = "[camera]\nrecording = \"board\"\n";
    let rig = rig_file(folder, |text| text.replacen("[camera]\n", recording, 1));
    (rig, record_board(folder))
}

#[test]
fn the_file_s_guess_may_be_for_pictures_of_another_size() {
    let folder = folder();
    let (rig, lens) = recorded_rig(folder.path());
    // The paper's intrinsics are for 640x480.
    let arguments = ["calibrate", "--rig", &rig, "--lens", "--views", "12", "--yes", "--json"];
    let output = plumb(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    check(&json(&output), &lens);
    let new = camera_file::read(&folder.path().join("camera.toml")).unwrap();
    let size = ImageSize { width: 1280, height: 720 };
    assert_eq!(new.calibrated_for, CalibratedFor::Size(size));
}

#[test]
fn pictures_that_are_taken_when_the_camera_fails_are_kept() {
    let folder = folder();
    let (rig, lens) = recorded_rig(folder.path());
    let board = folder.path().join("board");
    for number in 8..12 {
        fs::write(board.join(format!("{number:02}.png")), "no picture").unwrap();
    }
    // As many failures as a calibration bears, and more.
    let list = fs::read_to_string(board.join("rgb.txt")).unwrap();
    let failure = |k: u32| format!("{:.3} 08.png\n", 1.0 + 0.02 * f64::from(k));
    let failures: String = (0..40).map(failure).collect();
    fs::write(board.join("rgb.txt"), list + &failures).unwrap();
    let output = plumb(&["calibrate", "--rig", &rig, "--lens", "--yes"], folder.path());
    let text = stderr(&output);
    assert!(output.status.code() == Some(1) && text.contains("08.png"), "{text}");
    let taken = folder.path().join("camera.lens/taken-0001");
    assert!(text.contains(&format!("--pictures {}", taken.display())), "{text}");
    assert_eq!(count(&taken), 8);
    let pictures = ["--pictures", "camera.lens/taken-0001"];
    let arguments =
        [&["calibrate", "--rig", &rig, "--lens", "--yes", "--json"], &pictures[..]].concat();
    let output = plumb(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    check(&json(&output), &lens);
    assert_eq!(count(&taken), 8);
}

#[test]
fn pictures_that_do_not_suffice_are_refused_and_nothing_is_written() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let before = fs::read_to_string(folder.path().join("camera.toml")).unwrap();
    let photos = folder.path().join("photos");
    let run = || {
        let arguments = ["calibrate", "--rig", &rig, "--lens", "--pictures", "photos", "--yes"];
        let output = plumb(&arguments, folder.path());
        let after = fs::read_to_string(folder.path().join("camera.toml")).unwrap();
        assert_eq!(after, before);
        (output.status.code(), stderr(&output))
    };
    let (code, text) = run();
    assert!(code == Some(2) && text.contains("photos"), "{text}");
    fs::create_dir(&photos).unwrap();
    let (code, text) = run();
    assert!(code == Some(2) && text.contains("has no picture (.png, .jpg,"), "{text}");
    let scene = Scene::wall(640, 480, lens(), 3.0);
    png::save(&photos.join("wall.png"), &scene.colour).unwrap();
    let (code, text) = run();
    assert!(code == Some(1) && text.contains("no picture shows the board"), "{text}");
    // Odd files are left out, and named: an early one of another size, and a file that a computer
    // of another kind writes beside each picture.
    let small = Scene::wall(320, 240, lens(), 3.0);
    png::save(&photos.join("a.png"), &small.colour).unwrap();
    png::save(&photos.join("wall2.png"), &scene.colour).unwrap();
    fs::write(photos.join("._wall.png"), [0, 5, 22, 7, 0, 2]).unwrap();
    let (code, text) = run();
    assert!(code == Some(1) && text.contains("no picture shows the board"), "{text}");
    let summary =
        text.lines().find(|line| line.starts_with("the board is seen in 0 of 4 pictures"));
    for named in [
        "; 1 left out: 320x240, but the other pictures are 640x480 (a.png)",
        " (._wall.png)",
        "; 2 left out: the board is not seen (wall.png, wall2.png)",
    ] {
        assert!(summary.unwrap().contains(named), "{named}: {text}");
    }
    fs::remove_dir_all(&photos).unwrap();
    take_pictures(folder.path());
    for number in 4..PICTURES {
        fs::remove_file(photos.join(format!("{number:02}.png"))).unwrap();
    }
    let (code, text) = run();
    assert!(code == Some(1) && text.contains("5 are needed"), "{text}");
}
