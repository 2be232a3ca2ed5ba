//! Video files, as a user meets them: a video is replayed, and what cannot be opened is refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_pictures::jpeg;
use plumb_vision::render::{Ball, Scene};

use crate::common::{self, folder, plumb, rig_file, stderr};

/// Pictures of the video.
const COUNT: usize = 5;

/// Returns a chunk of a RIFF file.
fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let size = u32::try_from(content.len()).unwrap();
    let padding = vec![0; content.len() % 2];
    [&name[..], &size.to_le_bytes(), content, &padding].concat()
}

/// Returns a list of chunks of a RIFF file.
fn list(name: &[u8; 4], kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    chunk(name, &[&kind[..], content].concat())
}

fn words(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// Returns an AVI file of JPEG pictures of 640x480, 30 a second.
fn avi(pictures: &[Vec<u8>]) -> Vec<u8> {
    let (count, codec) = (pictures.len() as u32, u32::from_le_bytes(*b"MJPG"));
    let avih = words(&[33_333, 0, 0, 0, count, 0, 1, 0, 640, 480, 0, 0, 0, 0]);
    let video = u32::from_le_bytes(*b"vids");
    let strh = words(&[video, codec, 0, 0, 0, 1, 30, 0, count, 0, u32::MAX, 0, 0, 0]);
    let strf = words(&[40, 640, 480, 1 | 24 << 16, codec, 640 * 480 * 3, 0, 0, 0, 0]);
    let stream = [chunk(b"strh", &strh), chunk(b"strf", &strf)].concat();
    let header = [chunk(b"avih", &avih), list(b"LIST", b"strl", &stream)].concat();
    let movi: Vec<u8> = pictures.iter().flat_map(|jpeg| chunk(b"00dc", jpeg)).collect();
    let lists = [list(b"LIST", b"hdrl", &header), list(b"LIST", b"movi", &movi)].concat();
    list(b"RIFF", b"AVI ", &lists)
}

#[test]
fn a_video_file_is_replayed_without_depth() {
    let folder = folder();
    rig_file(folder.path(), |text| text);
    let camera = camera_file::paper().unwrap();
    let centre = Point3::new(0.1, -0.05, 0.8);
    let mut scene = Scene::wall(640, 480, camera.intrinsics, 2.2);
    scene.add(&Ball::red(centre, camera.ball_diameter / 2.0));
    let picture = jpeg::encode(&scene.colour, 95).unwrap();
    fs::write(folder.path().join("clip.avi"), avi(&vec![picture; COUNT])).unwrap();
    let replay = ["replay", "clip.avi", "--camera", "camera.toml", "--json"];
    let output = plumb(&replay, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let counts = common::json(&output);
    assert_eq!((&counts["frames"], &counts["located"]), (&COUNT.into(), &COUNT.into()));
    // The rows have the depth along the optical axis at the end.
    let text = String::from_utf8_lossy(&output.stdout);
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let column = |name: &str| heads.iter().position(|head| *head == name).unwrap();
    let axes = ["position_m_x", "position_m_y", "position_m_z"].map(column);
    let truth = camera.pose * centre;
    for row in lines.take(COUNT) {
        let found = Point3::from(axes.map(|column| row[column].parse::<f64>().unwrap()));
        assert!((found - truth).norm() < 0.02, "{found} for {truth}");
    }
}

#[test]
fn a_video_of_another_size_than_the_camera_files_is_refused() {
    let folder = folder();
    rig_file(folder.path(), |text| text);
    let camera = folder.path().join("camera.toml");
    let text = fs::read_to_string(&camera).unwrap().replace("cx = 319.5", "cx = 959.5");
    fs::write(&camera, text).unwrap();
    let scene = Scene::wall(640, 480, camera_file::paper().unwrap().intrinsics, 2.2);
    let picture = jpeg::encode(&scene.colour, 95).unwrap();
    fs::write(folder.path().join("clip.avi"), avi(&[picture])).unwrap();
    let output = plumb(&["replay", "clip.avi", "--camera", "camera.toml"], folder.path());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("clip.avi") && text.contains("calibrated at another"), "{text}");
}

#[test]
fn what_is_no_video_is_refused() {
    let folder = folder();
    rig_file(folder.path(), |text| text);
    fs::write(folder.path().join("clip.avi"), "no video").unwrap();
    let output = plumb(&["replay", "clip.avi", "--camera", "camera.toml"], folder.path());
    assert!(stderr(&output).contains("damaged, or of a format"), "{}", stderr(&output));
}
