//! Webcams on a device in memory that answers as V4L2 does. No camera is needed.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::sync::{Arc, Mutex};

use plumb_config::toml_file::parse_toml;
use plumb_frame::camera::Intrinsics;
use plumb_frame::source::CameraSource;
use plumb_pictures::jpeg;

use super::*;
use crate::controls;
use crate::source::WebcamSource;

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };
const PATH: &str = "/dev/video0";
const EXPOSURE_AUTO: u32 = 0x009a_0901;
const EXPOSURE_ABSOLUTE: u32 = 0x009a_0902;

/// Values that a control takes.
enum Takes {
    /// All of them, each as the nearest one of the range.
    Number(i32, i32),
    /// These; it refuses others.
    Menu(&'static [i32]),
}

/// Device in memory.
#[derive(Default)]
struct Device {
    formats: Vec<PixelFormat>,
    sizes: Vec<ImageSize>,
    /// Bytes between rows, beyond those of the pixels.
    padding: usize,
    rate: Option<f64>,
    /// Value of each control, and the values that it takes.
    controls: BTreeMap<u32, (i32, Takes)>,
    /// What each control was set to, in order.
    set: Vec<(u32, i32)>,
    start: Option<Errno>,
    /// What the next buffers are. Afterwards they are whole, 30 a second.
    buffers: VecDeque<Result<(Filled, Vec<u8>), Errno>>,
    count: u32,
}

impl Device {
    /// Returns a camera as the Logitech C920 is: `v4l2-ctl --list-ctrls` of other people.
    fn usual() -> Self {
        let usual = [
            (controls::AUTO_WHITE_BALANCE, 1, 0..=1),
            (controls::GAIN, 64, 0..=255),
            (controls::POWER_LINE_FREQUENCY, 2, 0..=2),
            (controls::WHITE_BALANCE_TEMPERATURE, 4000, 2000..=6500),
            (controls::EXPOSURE_ABSOLUTE, 250, 3..=2047),
            (controls::EXPOSURE_AUTO_PRIORITY, 1, 0..=1),
            (controls::FOCUS_ABSOLUTE, 30, 0..=250),
            (controls::FOCUS_AUTO, 1, 0..=1),
        ];
        let mut controls: BTreeMap<_, _> = usual
            .into_iter()
            .map(|(control, value, range)| {
                (control.id, (value, Takes::Number(*range.start(), *range.end())))
            })
            .collect();
        controls.insert(EXPOSURE_AUTO, (3, Takes::Menu(&[1, 3])));
        let formats = vec![PixelFormat::Yuyv, PixelFormat::Mjpg];
        Self { formats, sizes: vec![SIZE], rate: Some(30.0), controls, ..Self::default() }
    }

    fn value(&self, control: controls::Control) -> i32 {
        self.controls[&control.id].0
    }
}

/// Handle of a device in memory.
#[derive(Clone)]
struct Fake(Arc<Mutex<Device>>);

impl Node for Fake {
    fn set_format(&mut self, format: PixelFormat, size: ImageSize) -> io::Result<Format> {
        let device = self.0.lock().unwrap();
        let format = device.formats.iter().find(|it| **it == format).or(device.formats.first());
        let size = device.sizes.iter().find(|it| **it == size).unwrap_or(&device.sizes[0]);
        let stride = 2 * size.width + device.padding;
        Ok(Format { pixels: format.copied(), size: *size, stride })
    }

    fn set_rate(&mut self, _: u16) -> io::Result<f64> {
        Ok(self.0.lock().unwrap().rate.ok_or(Errno::ENOTTY)?)
    }

    fn control(&self, id: u32) -> io::Result<i32> {
        Ok(self.0.lock().unwrap().controls.get(&id).ok_or(Errno::EINVAL)?.0)
    }

    fn set_control(&self, id: u32, value: i32) -> io::Result<()> {
        let mut device = self.0.lock().unwrap();
        device.set.push((id, value));
        let (now, takes) = device.controls.get_mut(&id).ok_or(Errno::EINVAL)?;
        *now = match takes {
            Takes::Number(least, most) => value.clamp(*least, *most),
            Takes::Menu(values) if values.contains(&value) => value,
            Takes::Menu(_) => return Err(Errno::EINVAL.into()),
        };
        Ok(())
    }

    fn start(&mut self) -> io::Result<()> {
        self.0.lock().unwrap().start.map_or(Ok(()), |error| Err(error.into()))
    }

    fn next_buffer(&mut self, _: Duration, bytes: &mut Vec<u8>) -> io::Result<Filled> {
        let mut device = self.0.lock().unwrap();
        device.count += 1;
        let stamp = 5000.0 + f64::from(device.count) / 30.0;
        let whole = || (filled(stamp), picture(SIZE));
        let (filled, picture) = device.buffers.pop_front().unwrap_or_else(|| Ok(whole()))?;
        *bytes = picture;
        Ok(filled)
    }
}

/// Returns a buffer that was stamped 20 ms ago on the monotonic clock.
fn filled(stamp: f64) -> Filled {
    Filled { stamp: Some(stamp), age: Some(0.02), is_damaged: false }
}

fn picture(size: ImageSize) -> Vec<u8> {
    let image = Image::filled(size.width, size.height, [10, 200, 90]);
    jpeg::encode(&image, 95).unwrap()
}

fn settings(text: &str) -> WebcamSettings {
    parse_toml(Path::new("rig.toml"), &format!("width = 64\nheight = 48\n{text}")).unwrap()
}

fn open(device: Device, text: &str) -> (Result<Webcam, WebcamError>, Fake) {
    let fake = Fake(Arc::new(Mutex::new(device)));
    let webcam = Webcam::with_node(PATH.into(), Box::new(fake.clone()), &settings(text));
    (webcam, fake)
}

fn message(result: Result<Webcam, WebcamError>) -> String {
    result.err().unwrap().to_string()
}

#[test]
fn mjpg_is_the_first_choice_and_yuyv_the_second() {
    for (formats, text, expected) in [
        (vec![PixelFormat::Yuyv, PixelFormat::Mjpg], "", Some(PixelFormat::Mjpg)),
        (vec![PixelFormat::Yuyv], "", Some(PixelFormat::Yuyv)),
        (vec![PixelFormat::Yuyv, PixelFormat::Mjpg], "format = 'YUYV'", Some(PixelFormat::Yuyv)),
        (vec![PixelFormat::Yuyv], "format = 'MJPG'", None),
        (vec![], "", None),
    ] {
        let yuyv = vec![128; 2 * SIZE.width * SIZE.height];
        let count = if expected == Some(PixelFormat::Yuyv) { 80 } else { 0 };
        let buffers = (0..count).map(|k| Ok((filled(k.into()), yuyv.clone()))).collect();
        let device = Device { formats, buffers, ..Device::usual() };
        match (open(device, text).0, expected) {
            (Ok(webcam), _) => assert_eq!(webcam.format.pixels, expected),
            (Err(error), None) => assert!(error.to_string().contains("as MJPG"), "{error}"),
            (Err(error), Some(_)) => panic!("{error}"),
        }
    }
}

#[test]
fn another_size_is_refused_and_another_rate_is_a_note() {
    let sizes = vec![ImageSize { width: 1280, height: 720 }];
    let text = message(open(Device { sizes, ..Device::usual() }, "").0);
    assert!(text.contains("1280x720 at 30 Hz where 64x48 at 30 Hz was set"), "{text}");
    let notes = |rate| {
        let (webcam, _) = open(Device { rate, ..Device::usual() }, "");
        webcam.unwrap().notes().to_vec()
    };
    assert_eq!(notes(None), [] as [String; 0]);
    let [slow] = &notes(Some(7.5))[..] else { panic!() };
    assert!(slow.contains("7.5") && slow.contains("MJPG"), "{slow}");
}

#[test]
fn controls_are_set_at_every_open() {
    let text = "exposure = 0.008\nfocus = 40\nwhite_balance = 4500\npower_line = '50 Hz'\n\
                gain = 20";
    let (webcam, fake) = open(Device::usual(), text);
    assert_eq!(webcam.unwrap().notes(), [] as [String; 0]);
    let device = fake.0.lock().unwrap();
    for (control, value) in [
        (controls::EXPOSURE_AUTO, 1),
        (controls::EXPOSURE_ABSOLUTE, 80),
        (controls::EXPOSURE_AUTO_PRIORITY, 0),
        (controls::FOCUS_AUTO, 0),
        (controls::FOCUS_ABSOLUTE, 40),
        (controls::AUTO_WHITE_BALANCE, 0),
        (controls::WHITE_BALANCE_TEMPERATURE, 4500),
        (controls::POWER_LINE_FREQUENCY, 1),
        (controls::GAIN, 20),
    ] {
        assert_eq!(device.value(control), value, "{control:?}");
    }
    // The values that are automatic otherwise are set after the automatic is off.
    let place = |id| device.set.iter().position(|(set, _)| *set == id).unwrap();
    assert!(place(EXPOSURE_AUTO) < place(EXPOSURE_ABSOLUTE));
    // A single picture was read.
    assert_eq!(device.count, 1);
}

#[test]
fn without_keys_the_exposure_is_automatic_and_the_white_balance_is_fixed_after_two_seconds() {
    let mut device = Device::usual();
    device.controls.insert(EXPOSURE_AUTO, (1, Takes::Menu(&[1, 3])));
    let (webcam, fake) = open(device, "");
    assert_eq!(webcam.unwrap().notes(), [] as [String; 0]);
    let device = fake.0.lock().unwrap();
    assert_eq!(device.value(controls::EXPOSURE_AUTO), 3);
    assert_eq!(device.value(controls::EXPOSURE_AUTO_PRIORITY), 0);
    assert_eq!(device.value(controls::FOCUS_AUTO), 0);
    assert_eq!(device.value(controls::AUTO_WHITE_BALANCE), 0);
    assert_eq!(device.count, 61);
    // What has no key stays.
    assert_eq!(device.value(controls::GAIN), 64);
    assert_eq!(device.value(controls::FOCUS_ABSOLUTE), 30);
    drop(device);
    // Cameras whose automatic has the other value, and no automatic.
    let opened = |values| {
        let mut device = Device::usual();
        device.controls.insert(EXPOSURE_AUTO, (1, Takes::Menu(values)));
        let (webcam, fake) = open(device, "");
        let value = fake.0.lock().unwrap().value(controls::EXPOSURE_AUTO);
        (value, webcam.unwrap().notes().to_vec())
    };
    assert_eq!(opened(&[0, 1]), (0, Vec::new()));
    let (_, notes) = opened(&[1]);
    assert!(notes[0].contains("EXPOSURE_AUTO is not 3 (Invalid"), "{notes:?}");
}

#[test]
fn absent_controls_and_other_values_are_a_line_each() {
    let mut device = Device::usual();
    device.controls.remove(&controls::FOCUS_AUTO.id);
    device.controls.remove(&controls::EXPOSURE_AUTO_PRIORITY.id);
    let (webcam, _) = open(device, "exposure = 0.5\ngain = 900");
    let notes = webcam.unwrap().notes().to_vec();
    let [absent, other] = &notes[..] else { panic!("{notes:?}") };
    assert!(absent.ends_with("no control for: EXPOSURE_AUTO_PRIORITY, FOCUS_AUTO"), "{absent}");
    let says = "EXPOSURE_ABSOLUTE is 2047 where 5000 was set; GAIN is 255 where 900 was set";
    assert!(other.ends_with(says), "{other}");
    // One that has none at all.
    let device = Device { controls: BTreeMap::new(), ..Device::usual() };
    let (webcam, fake) = open(device, "exposure = 0.008");
    let notes = webcam.unwrap().notes().to_vec();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(fake.0.lock().unwrap().set.is_empty());
}

#[test]
fn the_time_of_a_picture_is_its_time_stamp() {
    let take = |text: &str, buffer: Filled| {
        let (webcam, fake) = open(Device::usual(), text);
        fake.0.lock().unwrap().buffers.push_back(Ok((buffer, picture(SIZE))));
        webcam.unwrap().next_picture(|| 7.0).unwrap().0
    };
    let close = |time: f64, expected: f64| assert!((time - expected).abs() < 1e-9, "{time}");
    close(take("", filled(9000.0)), 6.98);
    // A clock that is ahead, and one that is not the computer's.
    close(take("", Filled { age: Some(-0.1), ..filled(9000.0) }), 7.0);
    close(take("", Filled { age: None, ..filled(9000.0) }), 6.95);
    close(take("", Filled::default()), 6.95);
    // The fastest picture is as old as the settings say.
    close(take("latency = 0.1", filled(9000.0)), 6.9);
}

#[test]
fn a_picture_that_is_not_newer_is_dropped() {
    let (webcam, fake) = open(Device::usual(), "");
    let stamps = [9000.0, 9000.0, 8999.0, 8999.1];
    fake.0.lock().unwrap().buffers.extend(stamps.map(|it| Ok((filled(it), picture(SIZE)))));
    let mut webcam = webcam.unwrap();
    webcam.next_picture(|| 1.0).unwrap();
    for _ in 0..2 {
        let error = webcam.next_picture(|| 1.0).unwrap_err();
        assert!(matches!(error, WebcamError::NotNewer { .. }), "{error}");
    }
    // A clock that was set back costs no more.
    webcam.next_picture(|| 1.1).unwrap();
}

#[test]
fn rows_of_yuyv_may_be_padded() {
    let (padding, buffers) = (6, VecDeque::new());
    let device = Device { formats: vec![PixelFormat::Yuyv], padding, buffers, ..Device::usual() };
    let row = |level: u8| [[level, 128].repeat(SIZE.width), vec![0; padding]].concat();
    let bytes: Vec<u8> = (0..48).flat_map(|k| row(16 + 4 * k)).collect();
    let device = {
        let buffers = (1..80).map(|k| Ok((filled(k.into()), bytes.clone()))).collect();
        Device { buffers, ..device }
    };
    let (webcam, _) = open(device, "");
    let (_, image) = webcam.unwrap().next_picture(|| 0.0).unwrap();
    assert_eq!(image.get(63, 0), Some([0; 3]));
    assert!(image.get(0, 47).unwrap().iter().all(|value| value.abs_diff(219) < 2));
}

/// Returns the source of the frames of `webcam`.
fn source(webcam: Webcam) -> WebcamSource {
    let (fx, fy, cx, cy) = (60.0, 60.0, 31.5, 23.5);
    let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale: 1000.0, distortion: None };
    WebcamSource::of(webcam, intrinsics.into()).unwrap()
}

#[test]
fn damaged_pictures_are_lost_alone() {
    let (webcam, fake) = open(Device::usual(), "");
    let mut source = source(webcam.unwrap());
    let whole = picture(SIZE);
    let damaged = [
        Ok((Filled { is_damaged: true, ..filled(9000.1) }, whole.clone())),
        Ok((filled(9000.2), whole[..whole.len() / 2].to_vec())),
        Ok((filled(9000.3), Vec::new())),
        Ok((filled(9000.4), picture(ImageSize { width: 640, height: 480 }))),
        Err(Errno::EIO),
    ];
    let count = damaged.len();
    fake.0.lock().unwrap().buffers.extend(damaged);
    fake.0.lock().unwrap().buffers.push_back(Err(Errno::EAGAIN));
    fake.0.lock().unwrap().buffers.push_back(Ok((filled(9001.0), whole)));
    for _ in 0..count {
        assert!(!source.next_frame().unwrap_err().is_over());
    }
    let frame = source.next_frame().unwrap().unwrap();
    assert_eq!((frame.colour().size(), frame.intrinsics().depth_scale), (SIZE, 0.0));
}

#[test]
fn a_camera_that_begins_with_damaged_pictures_opens() {
    let text = "white_balance = 4000";
    let damaged = |count| {
        let stamps = (1..=count).map(f64::from);
        stamps.map(|stamp| Ok((filled(stamp), vec![0xff; 9]))).collect()
    };
    open(Device { buffers: damaged(4), ..Device::usual() }, text).0.unwrap();
    let error = open(Device { buffers: damaged(5), ..Device::usual() }, text).0.err().unwrap();
    assert!(matches!(error, WebcamError::Damaged { source: Some(_), .. }), "{error}");
}

#[test]
fn an_unplugged_or_silent_camera_is_over() {
    for error in [Errno::ENODEV, Errno::ETIMEDOUT] {
        let (webcam, fake) = open(Device::usual(), "");
        let mut source = source(webcam.unwrap());
        source.next_frame().unwrap();
        fake.0.lock().unwrap().buffers.push_back(Err(error));
        assert!(source.next_frame().unwrap_err().is_over());
        // While it is opened, too.
        let buffers = [Err(error)].into();
        let text = message(open(Device { buffers, ..Device::usual() }, "").0);
        assert!(text.contains("unplugged"), "{text}");
    }
}

#[test]
fn what_the_kernel_refuses_has_a_hint() {
    for (error, hint) in [
        (Errno::ENOSPC, "another socket of the computer"),
        (Errno::EBUSY, "another program uses the camera"),
        (Errno::ENOMEM, "cannot be set up"),
    ] {
        let text = message(open(Device { start: Some(error), ..Device::usual() }, "").0);
        assert!(text.starts_with(PATH) && text.contains(hint), "{text}");
    }
}
