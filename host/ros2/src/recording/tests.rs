//! Recordings as `rosbag2` and Foxglove write them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeMap;
use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::CameraSource;

use super::*;

const WITH_DEPTH: Intrinsics =
    Intrinsics { fx: 1.0, fy: 1.0, cx: 1.5, cy: 0.5, depth_scale: 5000.0, distortion: None };
const COLOUR: &str = "/camera/camera/color/image_raw";
const DEPTH: &str = "/camera/camera/aligned_depth_to_color/image_raw";
const INFO: &str = "/camera/camera/color/camera_info";
const IMAGE: &str = "sensor_msgs/msg/Image";

/// Fields of a message in CDR, low bytes first (OMG DDS-XTypes, plain CDR).
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    fn align(&mut self, size: usize) {
        while !(self.0.len() - 4).is_multiple_of(size) {
            self.0.push(0);
        }
    }

    fn number(mut self, number: u32) -> Self {
        self.align(4);
        self.0.extend(number.to_le_bytes());
        self
    }

    fn byte(mut self, byte: u8) -> Self {
        self.0.push(byte);
        self
    }

    fn text(self, text: &str) -> Self {
        let mut cdr = self.number(text.len() as u32 + 1);
        cdr.0.extend(text.as_bytes());
        cdr.byte(0)
    }

    fn bytes(self, bytes: &[u8]) -> Self {
        let mut cdr = self.number(bytes.len() as u32);
        cdr.0.extend(bytes);
        cdr
    }

    fn floats(mut self, floats: &[f64]) -> Self {
        for float in floats {
            self.align(8);
            self.0.extend(float.to_le_bytes());
        }
        self
    }

    fn header(self, [sec, nanosec]: [u32; 2], frame: &str) -> Self {
        self.number(sec).number(nanosec).text(frame)
    }
}

/// Returns a picture of 4 x 2 pixels with this stamp: colour of one grey level.
fn colour(stamp: [u32; 2], grey: u8) -> Vec<u8> {
    let cdr = Cdr::new().header(stamp, "optical").number(2).number(4).text("rgb8");
    cdr.byte(0).number(12).bytes(&[grey; 24]).0
}

/// Returns a depth picture of 4 x 2 pixels, millimetres.
fn depth(stamp: [u32; 2], frame: &str, millimetres: u16) -> Vec<u8> {
    let cdr = Cdr::new().header(stamp, frame).number(2).number(4).text("16UC1");
    cdr.byte(0).number(8).bytes(&millimetres.to_le_bytes().repeat(8)).0
}

/// Returns a description of the camera.
fn info() -> Vec<u8> {
    info_of("optical")
}

/// Returns a description of the camera with this frame.
fn info_of(frame: &str) -> Vec<u8> {
    let cdr = Cdr::new().header([1, 0], frame).number(2).number(4).text("plumb_bob");
    let k = [3.0, 0.0, 1.5, 0.0, 3.25, 0.5, 0.0, 0.0, 1.0];
    let cdr = cdr.number(5).floats(&[0.0; 5]).floats(&k).floats(&[0.0; 9]).floats(&[0.0; 12]);
    cdr.number(0).number(0).number(0).number(0).number(0).number(0).byte(0).0
}

/// A message: its topic, its type, its encoding and its bytes.
type Written<'a> = (&'a str, &'a str, &'a str, Vec<u8>);

/// Writes messages into a file `bag.mcap`, in chunks that are not compressed.
fn write(folder: &Path, messages: &[Written<'_>]) -> PathBuf {
    let path = folder.join("bag.mcap");
    let file = BufWriter::new(fs::File::create(&path).unwrap());
    let options = WriteOptions::new().compression(None).chunk_size(Some(200));
    let mut writer = Writer::with_options(file, options).unwrap();
    let mut channels = BTreeMap::new();
    for (sequence, (topic, schema, encoding, data)) in messages.iter().enumerate() {
        let channel = *channels.entry(*topic).or_insert_with(|| {
            let schema = writer.add_schema(schema, "", &[]).unwrap();
            writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap()
        });
        let (sequence, time) = (sequence as u32, sequence as u64);
        let header =
            MessageHeader { channel_id: channel, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    path
}

fn cdr<'a>(topic: &'a str, schema: &'a str, data: Vec<u8>) -> Written<'a> {
    (topic, schema, "cdr", data)
}

fn open(path: &Path) -> McapRecording {
    McapRecording::open(path, WITH_DEPTH, &Ros2CameraSettings::default())
        .unwrap_or_else(|error| panic!("{}", ErrorChain(&error)))
}

fn refusal(path: &Path, settings: &Ros2CameraSettings) -> String {
    let error = McapRecording::open(path, WITH_DEPTH, settings).err().unwrap();
    ErrorChain(&error).to_string()
}

/// Returns stamp, grey level and depth of each frame.
fn frames(mut recording: McapRecording) -> Vec<(f64, u8, u16)> {
    let mut found = Vec::new();
    while let Some(frame) = recording.next_frame().unwrap() {
        found.push(summary(&frame));
    }
    found
}

fn summary(frame: &RgbdFrame) -> (f64, u8, u16) {
    (frame.time(), frame.colour().pixels()[0][0], frame.depth().pixels()[0])
}

#[test]
fn a_recording_of_ros_gives_every_picture_with_the_depth_nearest_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(
        folder.path(),
        &[
            cdr("/tf", "tf2_msgs/msg/TFMessage", vec![0; 40]),
            cdr(COLOUR, IMAGE, colour([1, 0], 10)),
            cdr(COLOUR, IMAGE, colour([1, 33_000_000], 20)),
            cdr(INFO, "sensor_msgs/msg/CameraInfo", info()),
            cdr(DEPTH, IMAGE, depth([1, 2_000_000], "optical", 1500)),
            cdr(DEPTH, IMAGE, depth([1, 34_000_000], "optical", 1600)),
            cdr("/camera/camera/infra1/image_rect_raw", IMAGE, colour([1, 0], 99)),
            // Its depth was lost.
            cdr(COLOUR, IMAGE, colour([1, 66_000_000], 30)),
            cdr(DEPTH, IMAGE, depth([1, 99_000_000], "optical", 1700)),
        ],
    );
    let recording = open(&path);
    let lens = *recording.intrinsics();
    assert_eq!((lens.fx, lens.fy, lens.depth_scale), (3.0, 3.25, 1000.0));
    assert_eq!(frames(recording), [(1.0, 10, 1500), (1.033, 20, 1600), (1.066, 30, 0)]);
    // The stamp of the first colour picture, to the nanosecond.
    let first = open(&path).next_frame().unwrap().unwrap();
    assert_eq!(first.sender_stamp().map(|stamp| (stamp.seconds, stamp.nanoseconds)), Some((1, 0)));
}

#[test]
fn depth_that_is_not_aligned_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let other = "/camera/camera/depth/image_rect_raw";
    let messages = [
        cdr(COLOUR, IMAGE, colour([1, 0], 10)),
        cdr(other, IMAGE, depth([1, 0], "depth_optical", 1500)),
    ];
    let path = write(folder.path(), &messages);
    let settings = Ros2CameraSettings::default();
    assert!(refusal(&path, &settings).contains("depth_scale"), "{}", refusal(&path, &settings));
    let named = [
        cdr(COLOUR, IMAGE, colour([1, 0], 10)),
        cdr(DEPTH, IMAGE, depth([1, 0], "depth_optical", 1500)),
    ];
    let path = write(folder.path(), &named);
    let error = ErrorChain(&open(&path).next_frame().unwrap_err()).to_string();
    assert!(error.contains("depth_optical"), "{error}");
}

/// As realsense-ros names the frames of its cameras.
#[test]
fn the_description_of_another_camera_is_refused_with_both_names() {
    let folder = tempfile::tempdir().unwrap();
    let of = |frame| {
        let messages = [
            cdr(INFO, "sensor_msgs/msg/CameraInfo", info_of(frame)),
            cdr(COLOUR, IMAGE, colour([1, 0], 10)),
            cdr(DEPTH, IMAGE, depth([1, 0], "optical", 1500)),
        ];
        open(&write(folder.path(), &messages)).next_frame()
    };
    let error = ErrorChain(&of("camera_infra1_optical_frame").unwrap_err()).to_string();
    assert!(error.contains("`camera_infra1_optical_frame`"), "{error}");
    assert!(error.contains("`optical`") && error.contains(INFO), "{error}");
    // Old drivers write a slash, or nothing.
    assert!(["/optical", ""].into_iter().all(|frame| of(frame).unwrap().is_some()));
}

/// As `mcap merge` and converters write it: one topic after the other.
#[test]
fn topics_that_are_not_interleaved_keep_their_depth() {
    let folder = tempfile::tempdir().unwrap();
    let stamp = |k: u32| [1 + k / 30, k % 30 * 33_000_000];
    let colours = || (0..80).map(|k| cdr(COLOUR, IMAGE, colour(stamp(k), k as u8)));
    let depths = || (0..80).map(|k| cdr(DEPTH, IMAGE, depth(stamp(k), "optical", 1000 + k as u16)));
    let halves = colours().take(40).chain(depths().take(40));
    for messages in [
        colours().chain(depths()).collect::<Vec<_>>(),
        depths().chain(colours()).collect(),
        halves.chain(colours().skip(40)).chain(depths().skip(40)).collect(),
    ] {
        let found = frames(open(&write(folder.path(), &messages)));
        assert_eq!(found.len(), 80);
        let mut depths = (0..80).zip(&found);
        assert!(depths.all(|(k, it)| (it.1, it.2) == (k as u8, 1000 + k)), "{found:?}");
    }
}

#[test]
fn a_file_with_as_many_topics_as_there_can_be_is_read_and_not_listed_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("many.mcap");
    let file = BufWriter::new(fs::File::create(&path).unwrap());
    let mut writer = Writer::with_options(file, WriteOptions::new().compression(None)).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/Imu", "", &[]).unwrap();
    for number in 0..65_000 {
        writer.add_channel(schema, &format!("/{number}"), "cdr", &BTreeMap::new()).unwrap();
    }
    writer.finish().unwrap();
    let refusal = refusal(&path, &Ros2CameraSettings::default());
    assert!(refusal.contains("and 64980 more") && refusal.len() < 2000, "{}", refusal.len());
}

#[test]
fn files_without_a_camera_or_with_several_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Ros2CameraSettings::default();
    let path = write(folder.path(), &[cdr("/imu", "sensor_msgs/msg/Imu", vec![0; 8])]);
    assert!(refusal(&path, &settings).contains("/imu (sensor_msgs/msg/Imu)"));
    let two = [
        cdr("/left/image", IMAGE, colour([1, 0], 10)),
        cdr("/right/image", IMAGE, colour([1, 0], 20)),
        cdr("/x/depth_registered", IMAGE, depth([1, 0], "optical", 1500)),
    ];
    let path = write(folder.path(), &two);
    let several = refusal(&path, &settings);
    assert!(several.contains("/left/image, /right/image") && several.contains("`colour`"));
    let right = Ros2CameraSettings { colour: "/right/image".to_owned(), ..settings.clone() };
    let recording = McapRecording::open(&path, WITH_DEPTH, &right).unwrap();
    // There is no description: the intrinsics are the camera file's, with depth in millimetres.
    assert_eq!(recording.intrinsics(), &Intrinsics { depth_scale: 1000.0, ..WITH_DEPTH });
    assert_eq!(frames(recording), [(1.0, 20, 1500)]);
    fs::write(&path, "no mcap").unwrap();
    assert!(refusal(&path, &settings).contains("MCAP"), "{}", refusal(&path, &settings));
}

#[test]
fn a_file_that_was_cut_gives_its_frames_and_then_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let pictures = (0..40).flat_map(|k| {
        let stamp = [1, k * 20_000_000];
        [
            cdr(COLOUR, IMAGE, colour(stamp, k as u8)),
            cdr(DEPTH, IMAGE, depth(stamp, "optical", 1500)),
        ]
    });
    let path = write(folder.path(), &pictures.collect::<Vec<_>>());
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 3]).unwrap();
    let mut recording = open(&path);
    let (mut count, mut errors) = (0, Vec::new());
    loop {
        match recording.next_frame() {
            Ok(Some(_)) => count += 1,
            Ok(None) => break,
            Err(error) => errors.push(ErrorChain(&error).to_string()),
        }
    }
    assert!((5..40).contains(&count), "{count}");
    assert!(errors.len() == 1 && errors[0].contains("mcap recover"), "{errors:?}");
}

#[test]
fn messages_that_are_none_are_lost_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(
        folder.path(),
        &[
            cdr(COLOUR, IMAGE, vec![0, 1, 0, 0, 9]),
            cdr(COLOUR, IMAGE, colour([1, 0], 10)),
            cdr(DEPTH, IMAGE, depth([1, 0], "optical", 1500)),
        ],
    );
    let mut recording = open(&path);
    let error = ErrorChain(&recording.next_frame().unwrap_err()).to_string();
    assert!(error.contains(COLOUR) && error.contains(IMAGE), "{error}");
    assert_eq!(frames(recording), [(1.0, 10, 1500)]);
}
