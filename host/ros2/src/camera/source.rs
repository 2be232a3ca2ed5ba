//! Camera of another node as a source of frames.

use std::thread;
use std::time::{Duration, Instant};

use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_frame::camera::Intrinsics;
use plumb_frame::clock::LiveClock;
use plumb_frame::driver::IntrinsicsFrom;
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{Image, ImageSize};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};

use super::error::Ros2CameraError;
use super::intake::{Intake, Pictures, check_description, check_size};
use super::lens;
use super::picture::DEPTH_SCALE;
use super::rate::{ClockRate, ExposureClock, Finding};
use super::reception::Description;
use crate::message::sensor::CameraInfo;
use crate::network::Network;

/// Longest wait for the first picture.
pub const FIRST_PICTURE: Duration = Duration::from_secs(30);

/// Longest wait for a further picture, below that of a capture.
const SILENCE: Duration = Duration::from_secs(1);

/// Longest wait for messages before the publishers and the DDS library are checked.
const CHECK: Duration = Duration::from_millis(100);

/// Time after the first picture in which a second publisher on a topic is heard, before anything
/// moves.
const HEARING: Duration = Duration::from_secs(1);

/// Time from exposure to arrival of the fastest picture where nothing else is set, seconds.
const LATENCY: f64 = 0.045;

/// Camera of another node in ROS 2, with depth aligned to colour.
///
/// Time stamps are in seconds on the host's clock since the camera was opened. A camera that
/// vanishes is an error each second, but not the end: it may come again. Where the DDS library has
/// ended after an interruption of the program, the subscriptions are made anew.
pub struct Ros2Camera {
    settings: Ros2CameraSettings,
    network: Network,
    intake: Intake,
    exposures: ExposureClock,
    clock: LiveClock,
    size: ImageSize,
    intrinsics: Intrinsics,
    /// The camera's description that the intrinsics come from; `None` where they are the file's.
    description: Option<Box<CameraInfo>>,
    /// The first frame, until it is taken.
    first: Option<RgbdFrame>,
    last_frame: Instant,
}

/// Where the intrinsics come from.
enum Lens {
    /// The camera file.
    Calibrated(FileIntrinsics),
    /// The camera's node.
    Published(Box<CameraInfo>),
}

impl Ros2Camera {
    /// Subscribes to the topics of `settings` and waits for the first picture, for `limit` at most.
    /// The frames have the intrinsics that the node publishes, or `calibrated` where the settings
    /// choose the camera file.
    ///
    /// # Errors
    /// Where ROS 2 cannot be joined, a topic has another type or several publishers, no picture
    /// comes, the first one is refused, the intrinsics are wrong, or the settings exclude each
    /// other.
    pub fn open(
        settings: &Ros2CameraSettings,
        network: &Network,
        calibrated: impl Into<FileIntrinsics>,
        limit: Duration,
    ) -> Result<Self, Ros2CameraError> {
        if settings.rectified && settings.intrinsics == IntrinsicsFrom::File {
            return Err(Ros2CameraError::RectifiedFile);
        }
        let settings = &settings.with_absolute_topics()?;
        let begin = Instant::now();
        let mut intake = Intake::start(settings, network)?;
        let (lens, pictures) = first_pictures(&mut intake, settings, calibrated.into(), limit)?;
        let (size, names) = (pictures.colour.size(), &intake.reception);
        let depth_scale = if pictures.depth.is_some() { DEPTH_SCALE } else { 0.0 };
        let (intrinsics, description) = match lens {
            Lens::Calibrated(intrinsics) => {
                let intrinsics = intrinsics.of_pictures(size, names.colour_name())?;
                (Intrinsics { depth_scale, ..intrinsics }, None)
            }
            Lens::Published(info) => {
                (lens::intrinsics(&info, size, depth_scale, settings)?, Some(info))
            }
        };
        let latency = settings.latency.map_or(LATENCY, |latency| latency.get());
        let mut camera = Self {
            settings: settings.clone(),
            network: *network,
            intake,
            exposures: ExposureClock::new(latency, begin),
            clock: LiveClock::since(begin),
            size,
            intrinsics,
            description,
            first: None,
            last_frame: Instant::now(),
        };
        camera.first = Some(camera.frame(pictures).map_err(Ros2CameraError::First)?);
        Ok(camera)
    }

    /// Returns the topic and the size of the pictures, for a person.
    pub fn description(&self) -> String {
        let colour = self.intake.reception.colour_name();
        let depth = self.intake.reception.depth_name().unwrap_or("no depth");
        format!("{colour}, {depth}, {}", self.size)
    }

    /// Returns the intrinsics of the frames.
    pub fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    /// Subscribes anew if the DDS library has ended. A failure takes as long as a silence.
    fn stay_in_ros2(&mut self) -> Result<(), Ros2CameraError> {
        if !self.intake.reception.is_alive() {
            self.intake = Intake::start(&self.settings, &self.network)
                .inspect_err(|_| thread::sleep(SILENCE))?;
        }
        Ok(())
    }

    /// Waits for messages, for [`CHECK`] at most.
    ///
    /// # Errors
    /// Where the operating system refuses, or the camera is described otherwise than at the
    /// beginning.
    fn receive(&mut self) -> Result<(), Ros2CameraError> {
        let (known, mut has_changed) = (self.description.as_deref(), false);
        let is_other = |info: &CameraInfo| known.is_some_and(|known| !lens::is_same(known, info));
        self.intake.receive(CHECK, |it| has_changed |= is_other(&it.info))?;
        if has_changed {
            let topic = self.intake.reception.info_name().to_owned();
            return Err(Ros2CameraError::Described { topic });
        }
        Ok(())
    }

    /// Makes a frame of pictures.
    fn frame(&mut self, pictures: Pictures) -> Result<RgbdFrame, SourceError> {
        let Pictures { stamp, arrival, frame, colour, depth } = pictures;
        let topic = self.intake.reception.colour_name();
        check_size(topic, colour.size(), self.size).map_err(SourceError::new)?;
        if let Some(info) = &self.description {
            let topic = self.intake.reception.info_name();
            check_description(info, &frame, topic).map_err(SourceError::new)?;
        }
        let invalid = InvalidFrame::of(topic);
        let time = self
            .exposures
            .taken(stamp.seconds(), arrival)
            .map_err(|error| SourceError::new(Ros2CameraError::Time(error)))?;
        let ImageSize { width, height } = self.size;
        let depth = depth.unwrap_or_else(|| Image::filled(width, height, 0));
        let frame = RgbdFrame::new(time, colour, depth, self.intrinsics).map_err(invalid)?;
        self.last_frame = Instant::now();
        Ok(frame.with_sender_stamp(Some(stamp.into())))
    }
}

/// What has come before the camera is open.
#[derive(Default)]
struct Opening {
    pictures: Option<Pictures>,
    /// The newest description: the camera may begin again with another mode.
    published: Option<Box<CameraInfo>>,
    /// The newest description that its publisher keeps. It may come only once.
    kept: Option<Box<CameraInfo>>,
    clock: ClockRate,
    /// When the first pictures were decoded.
    first: Option<Instant>,
}

impl Opening {
    /// Notes a description of the camera.
    fn describe(&mut self, Description { info, is_kept }: Description) {
        if is_kept {
            self.kept = Some(info.clone());
        }
        self.published = Some(info);
    }

    /// Notes decoded pictures.
    fn add(&mut self, pictures: Pictures) {
        self.clock.add(pictures.stamp.seconds(), pictures.arrival);
        self.first.get_or_insert_with(Instant::now);
        self.pictures = Some(pictures);
    }

    /// Drops what may be another camera's.
    fn forget(&mut self) {
        (self.pictures, self.clock) = (None, ClockRate::default());
        self.published = self.kept.clone();
    }

    /// Returns the intrinsics' origin and the newest pictures, once they are certain.
    fn take(&mut self, settings: &Ros2CameraSettings, file: &FileIntrinsics) -> Option<Opened> {
        let is_heard = self.first.is_some_and(|first| first.elapsed() >= HEARING);
        if !is_heard || self.clock.finding() != Finding::Right {
            return None;
        }
        let lens = match settings.intrinsics {
            IntrinsicsFrom::File => Lens::Calibrated(*file),
            IntrinsicsFrom::Device => Lens::Published(self.published.clone()?),
        };
        Some((lens, self.pictures.take()?))
    }

    /// Returns, for a person, what is missing.
    fn missing(&self, intake: &Intake, settings: &Ros2CameraSettings) -> String {
        let needs_description = settings.intrinsics == IntrinsicsFrom::Device;
        if needs_description && self.pictures.is_some() && self.published.is_none() {
            return intake.reception.missing_description();
        }
        intake.missing()
    }
}

/// Origin of the intrinsics, and the first pictures.
type Opened = (Lens, Pictures);

/// Waits for the first pictures and the origin of their intrinsics.
fn first_pictures(
    intake: &mut Intake,
    settings: &Ros2CameraSettings,
    calibrated: FileIntrinsics,
    limit: Duration,
) -> Result<Opened, Ros2CameraError> {
    let (begin, mut opening) = (Instant::now(), Opening::default());
    while begin.elapsed() < limit {
        intake.receive(CHECK, |description| opening.describe(description))?;
        intake.reception.check_types()?;
        if !intake.check_senders()? {
            opening.forget();
        } else if let Some(pictures) = intake.take()? {
            opening.add(pictures);
        }
        if let Finding::Wrong(rate) = opening.clock.finding() {
            let topic = intake.reception.colour_name().to_owned();
            return Err(Ros2CameraError::ClockRate { topic, rate });
        }
        if let Some(opened) = opening.take(settings, &calibrated) {
            return Ok(opened);
        }
    }
    Err(Ros2CameraError::NoPicture { waited: limit, missing: opening.missing(intake, settings) })
}

impl CameraSource for Ros2Camera {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        let begin = Instant::now();
        while begin.elapsed() < SILENCE {
            self.stay_in_ros2().map_err(SourceError::new)?;
            self.receive().map_err(SourceError::over)?;
            self.intake.check_senders().map_err(SourceError::new)?;
            if let Some(pictures) = self.intake.take().map_err(SourceError::new)? {
                return self.frame(pictures).map(Some);
            }
        }
        let (silent, missing) = (self.last_frame.elapsed(), self.intake.missing());
        Err(SourceError::new(Ros2CameraError::Silent { silent, missing }))
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }
}
