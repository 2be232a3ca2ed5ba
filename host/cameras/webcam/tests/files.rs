//! Video files that the tests write, and what is refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::{Path, PathBuf};

use opencv::core::{Mat, Scalar, Size, Vec3b};
use opencv::prelude::*;
use opencv::videoio::{CAP_FFMPEG, CAP_OPENCV_MJPEG, VideoWriter};
use plumb_frame::image::ImageSize;
use plumb_webcam::{VideoFile, VideoFileError};

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };

/// Writes a video of `count` grey pictures, each brighter than the one before.
fn write(path: &Path, count: u32, size: (i32, i32), rate: f64) {
    write_with(CAP_OPENCV_MJPEG, "MJPG", path, count, size, rate);
}

/// As [`write`], with one of OpenCV's writers and a codec of four letters.
fn write_with(
    writer: i32,
    codec: &str,
    path: &Path,
    count: u32,
    (width, height): (i32, i32),
    rate: f64,
) {
    let codec: Vec<char> = codec.chars().collect();
    let codec = VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]).unwrap();
    let (size, in_colour) = (Size::new(width, height), true);
    let mut writer =
        VideoWriter::new_with_backend(path, writer, codec, rate, size, in_colour).unwrap();
    assert!(writer.is_opened().unwrap());
    for k in 0..count {
        let grey = Scalar::all(f64::from(20 * k + 10));
        let picture =
            Mat::new_rows_cols_with_default(height, width, Vec3b::opencv_type(), grey).unwrap();
        writer.write(&picture).unwrap();
    }
    writer.release().unwrap();
}

fn folder_with(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

#[test]
fn a_video_file_is_read_to_its_end() {
    let (_folder, path) = folder_with("one.avi");
    write(&path, 8, (64, 48), 20.0);
    let mut file = VideoFile::open(&path).unwrap();
    let mode = file.mode();
    assert_eq!((mode.size, mode.rate), (SIZE, 20.0));
    for k in 0..8_u32 {
        let picture = file.next_picture().unwrap().unwrap();
        assert!((picture.time - f64::from(k) / 20.0).abs() < 1e-6, "{k}: {}", picture.time);
        assert_eq!(picture.colour.size(), SIZE);
        let grey = i32::from(picture.colour.pixels()[1000][1]);
        assert!((grey - 20 * k as i32 - 10).abs() < 5, "{k}: {grey}");
    }
    assert_eq!(file.next_picture().unwrap(), None);
    assert_eq!(file.next_picture().unwrap(), None);
}

/// Offset of the matrix in the box `tkhd`, version 0, from its name (ISO 14496-12, section 8.3.2).
const MATRIX: usize = 44;

#[test]
fn the_pixels_of_a_video_are_as_they_are_stored() {
    let (_folder, path) = folder_with("turned.mp4");
    write_with(CAP_FFMPEG, "mp4v", &path, 3, (64, 48), 25.0);
    let mut bytes = fs::read(&path).unwrap();
    let name = bytes.windows(4).position(|window| window == b"tkhd").unwrap();
    // A quarter turn to the right, as a telephone writes it.
    let turned: [i32; 9] = [0, 1 << 16, 0, -(1 << 16), 0, 0, 48 << 16, 0, 1 << 30];
    let turned: Vec<u8> = turned.into_iter().flat_map(i32::to_be_bytes).collect();
    bytes[name + MATRIX..][..turned.len()].copy_from_slice(&turned);
    fs::write(&path, bytes).unwrap();
    let mut file = VideoFile::open(&path).unwrap();
    assert_eq!(file.mode().size, SIZE);
    let pictures = std::iter::from_fn(|| file.next_picture().unwrap());
    assert!(pictures.map(|picture| picture.colour.size()).eq([SIZE; 3]));
}

/// Returns an element of a Matroska file (RFC 8794).
fn element(id: &[u8], content: &[u8]) -> Vec<u8> {
    let mut size = (content.len() as u64).to_be_bytes();
    size[0] = 1;
    [id, &size, content].concat()
}

/// Returns a track of JPEG pictures of 64x48, which are shown twice as wide.
fn track(number: u8) -> Vec<u8> {
    let sizes = [(&[0xB0][..], 64), (&[0xBA], 48), (&[0x54, 0xB0], 128), (&[0x54, 0xBA], 48)];
    let video: Vec<u8> = sizes.iter().flat_map(|(id, size)| element(id, &[*size])).collect();
    let entry = [
        element(&[0xD7], &[number]),
        element(&[0x73, 0xC5], &[number]),
        element(&[0x83], &[1]),
        element(&[0x86], b"V_MJPEG"),
        element(&[0xE0], &video),
    ];
    element(&[0xAE], &entry.concat())
}

/// Returns the first picture of an AVI file, JPEG.
fn first_jpeg(avi: &[u8]) -> &[u8] {
    let name = avi.windows(4).position(|window| window == b"00dc").unwrap();
    let size = u32::from_le_bytes(avi[name + 4..name + 8].try_into().unwrap()) as usize;
    &avi[name + 8..][..size]
}

#[test]
fn further_tracks_and_pixels_that_are_not_square_are_told() {
    let (folder, path) = folder_with("one.avi");
    write(&path, 1, (64, 48), 20.0);
    assert_eq!(VideoFile::open(&path).unwrap().notes(), [] as [String; 0]);
    let avi = fs::read(&path).unwrap();
    let blocks = [1, 2].map(|number| {
        let block = [&[0x80 | number, 0, 0, 0x80], first_jpeg(&avi)].concat();
        element(&[0xA3], &block)
    });
    let scale = element(&[0x2A, 0xD7, 0xB1], &1_000_000_u32.to_be_bytes());
    let segment = [
        element(&[0x15, 0x49, 0xA9, 0x66], &scale),
        element(&[0x16, 0x54, 0xAE, 0x6B], &[track(1), track(2)].concat()),
        element(&[0x1F, 0x43, 0xB6, 0x75], &[element(&[0xE7], &[0]), blocks.concat()].concat()),
    ];
    let bytes = [
        element(&[0x1A, 0x45, 0xDF, 0xA3], &element(&[0x42, 0x82], b"matroska")),
        element(&[0x18, 0x53, 0x80, 0x67], &segment.concat()),
    ];
    let path = folder.path().join("two.mkv");
    fs::write(&path, bytes.concat()).unwrap();
    let file = VideoFile::open(&path).unwrap();
    assert_eq!(file.mode().size, SIZE);
    let [tracks, shape] = file.notes() else { panic!("{:?}", file.notes()) };
    assert!(tracks.contains("2 video tracks, and only the first one is read"), "{tracks}");
    assert!(shape.contains("2:1 as wide as high"), "{shape}");
}

#[test]
fn a_file_that_is_no_video_is_refused() {
    let (_folder, path) = folder_with("text.avi");
    let absent = VideoFile::open(&path).unwrap_err();
    assert!(matches!(absent, VideoFileError::Open { .. }), "{absent:?}");
    fs::write(&path, "this is no video").unwrap();
    let text = VideoFile::open(&path).unwrap_err();
    assert!(matches!(text, VideoFileError::Refused { .. }), "{text:?}");
    fs::write(&path, "").unwrap();
    assert!(VideoFile::open(&path).is_err());
}

#[test]
fn a_video_that_was_cut_off_ends_early() {
    let (_folder, path) = folder_with("cut.avi");
    write(&path, 20, (64, 48), 20.0);
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let mut file = VideoFile::open(&path).unwrap();
    let mut count = 0;
    while let Ok(Some(_)) = file.next_picture() {
        count += 1;
    }
    assert!((1..20).contains(&count), "{count}");
}
