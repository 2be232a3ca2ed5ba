//! Tests of recordings.

use std::os::unix::fs::symlink;

use plumb_frame::camera::{Camera, Distortion, DistortionCoefficients};
use plumb_frame::image::Image;
use plumb_frame::source::CameraSource;

use plumb_config::error_chain::ErrorChain;

use super::*;
use crate::camera_file;
use crate::tum::TumFolder;

const CAMERA: &str = include_str!("../../../rigs/camera.toml");

fn frame(time: f64, depth_scale: f64, values: &[u16]) -> RgbdFrame {
    let intrinsics = camera_file::paper().unwrap().intrinsics;
    let colour = Image::filled(4, 4, [time as u8, 20, 30]);
    let depth = Image::new(4, 4, values.to_vec()).unwrap();
    let intrinsics = Intrinsics { cx: 1.5, cy: 1.5, depth_scale, ..intrinsics };
    RgbdFrame::new(time, colour, depth, intrinsics).unwrap()
}

/// Records `frames` and reads the folder back with its own camera file.
fn recorded_and_read(frames: &[RgbdFrame]) -> (Camera, Vec<RgbdFrame>) {
    let folder = tempfile::tempdir().unwrap();
    let record = RecordFolder::create(folder.path()).unwrap();
    let mut recorder = record.begin(CAMERA, frames[0].intrinsics(), Overflow::Block).unwrap();
    frames.iter().for_each(|frame| recorder.add(frame));
    let recording = recorder.finish().unwrap();
    assert_eq!((recording.frames, recording.dropped), (frames.len() as u64, 0));
    let camera = camera_file::read(&folder.path().join(CAMERA_FILE)).unwrap();
    let mut source = TumFolder::open(folder.path(), camera.intrinsics).unwrap();
    let mut read = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        read.push(frame);
    }
    (camera, read)
}

fn depths(frame: &RgbdFrame) -> Vec<Option<f64>> {
    (0..16).map(|i| frame.depth_at(i % 4, i / 4)).collect()
}

#[test]
fn recorded_frames_are_read_back_exactly() {
    // Millimetres, TUM units, tenths of a millimetre. 5000 in a metre are no multiple of the last.
    for (own, written) in [(1000.0, 5000.0), (5000.0, 5000.0), (10_000.0, 10_000.0)] {
        let values: Vec<u16> = (0..16).map(|i| i * 777).collect();
        let frames: Vec<RgbdFrame> =
            (0..70).map(|i| frame(f64::from(i) / 30.0, own, &values)).collect();
        let (camera, read) = recorded_and_read(&frames);
        assert_eq!(camera.intrinsics.depth_scale, written);
        assert_eq!(read.len(), frames.len());
        for (read, frame) in read.iter().zip(&frames) {
            assert!((read.time() - frame.time()).abs() < 1e-6);
            assert_eq!(depths(read), depths(frame));
            assert_eq!(read.colour(), frame.colour());
        }
    }
}

#[test]
fn frames_of_a_camera_without_depth_are_read_back_without_depth() {
    let (camera, read) = recorded_and_read(&[frame(0.0, 0.0, &[7; 16])]);
    assert!(!camera.intrinsics.has_depth());
    assert_eq!(depths(&read[0]), [None; 16]);
}

#[test]
fn depth_out_of_the_formats_range_is_unknown() {
    let mut values = [1000; 16];
    (values[0], values[1]) = (13_106, 13_107);
    let (_, read) = recorded_and_read(&[frame(0.0, 1000.0, &values)]);
    assert_eq!(depths(&read[0])[..3], [Some(13.106), None, Some(1.0)]);
}

#[test]
fn a_recording_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rgb.txt"), "kept").unwrap();
    let error = RecordFolder::create(folder.path()).unwrap_err();
    assert!(matches!(error, RecordError::Exists(_)), "{error}");
    let error = RecordFolder::create(&folder.path().join("rgb.txt")).unwrap_err();
    assert!(matches!(error, RecordError::Exists(_)), "{error}");
}

#[test]
fn a_link_to_an_empty_folder_is_that_folder() {
    let folder = tempfile::tempdir().unwrap();
    let [empty, full, link] = ["empty", "full", "link"].map(|name| folder.path().join(name));
    fs::create_dir(&empty).unwrap();
    fs::create_dir_all(full.join("kept")).unwrap();
    symlink(&empty, &link).unwrap();
    assert_eq!(RecordFolder::create(&link).unwrap().oni(), link.join("recording.oni"));
    for elsewhere in [full, folder.path().join("absent")] {
        fs::remove_file(&link).unwrap();
        symlink(elsewhere, &link).unwrap();
        let error = RecordFolder::create(&link).unwrap_err();
        assert!(matches!(error, RecordError::Exists(_)), "{error}");
    }
}

#[test]
fn a_write_error_is_returned_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record");
    let one = frame(0.0, 1000.0, &[0; 16]);
    let mut recorder = RecordFolder::create(&path)
        .unwrap()
        .begin(CAMERA, one.intrinsics(), Overflow::Block)
        .unwrap();
    fs::remove_dir_all(path.join("depth")).unwrap();
    recorder.add(&one);
    let error = recorder.finish().unwrap_err();
    let text = ErrorChain(&error).to_string();
    assert!(
        text.starts_with("no picture is kept: ") && text.contains("depth/000001.png"),
        "{text}"
    );
}

#[test]
fn a_recording_that_ends_early_tells_how_much_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record");
    let frames = [0.0, 0.25, 0.5, 0.75].map(|time| frame(time, 1000.0, &[0; 16]));
    let mut recorder = RecordFolder::create(&path)
        .unwrap()
        .begin(CAMERA, frames[0].intrinsics(), Overflow::Block)
        .unwrap();
    // No file has this name any more.
    fs::create_dir_all(path.join("depth/000004.png")).unwrap();
    frames.iter().for_each(|frame| recorder.add(frame));
    let text = ErrorChain(&recorder.finish().unwrap_err()).to_string();
    assert!(
        text.starts_with("only the first 3 pictures are kept, 0.5 s: the recording: "),
        "{text}"
    );
}

#[test]
fn the_distortion_of_the_lens_is_recorded() {
    let (k1, k2, p1, p2, k3) = (-0.28, 0.1, 0.0, 0.001, 0.0);
    let distortion = Distortion::new(DistortionCoefficients { k1, k2, p1, p2, k3 });
    let paper = camera_file::paper().unwrap().intrinsics;
    let intrinsics = Intrinsics { distortion, depth_scale: 5000.0, ..paper };
    let (colour, depth) = (Image::filled(640, 480, [10; 3]), Image::filled(640, 480, 5000));
    let frame = RgbdFrame::new(0.0, colour, depth, intrinsics).unwrap();
    let (camera, read) = recorded_and_read(&[frame]);
    assert_eq!(camera.intrinsics, intrinsics);
    assert_eq!(read[0].intrinsics(), &intrinsics);
}
