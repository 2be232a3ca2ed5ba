//! An MCAP recording as a source of frames: each colour picture with the depth of the same moment.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_cameras::tum::MAX_TIME_DIFFERENCE;
use plumb_frame::camera::Intrinsics;
use plumb_frame::driver::IntrinsicsFrom;
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{ColourImage, DepthImage, Image, ImageSize};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};

use super::error::McapError;
use super::reader::{Channel, Reader};
use super::topics::Topics;
use crate::camera::intake::{check_frames, check_size};
use crate::camera::lens;
use crate::camera::picture::Picture;
use crate::message::sensor::CameraInfo;

/// Recording of a camera in an MCAP file: a frame for each colour picture, in the order of the
/// file. Where no depth picture is within [`MAX_TIME_DIFFERENCE`], its depth is unknown (zeros).
///
/// Time stamps are those of the headers, seconds.
///
/// [`MAX_TIME_DIFFERENCE`]: plumb_cameras::tum::MAX_TIME_DIFFERENCE
pub struct McapRecording {
    path: PathBuf,
    reader: Reader,
    topics: Topics,
    frames: Frames,
    intrinsics: Intrinsics,
    /// Size of the pictures; `None` before the first one where the file has no description.
    size: Option<ImageSize>,
    /// Intrinsics of the camera file, where the recording has none.
    of_file: Option<FileIntrinsics>,
    now: f64,
}

impl McapRecording {
    /// Opens the recording at `path`. `intrinsics` are those of the camera file; a description of
    /// the camera in the recording replaces them. `settings` may name the topics.
    ///
    /// # Errors
    /// Where the file cannot be read, is no MCAP, or has no camera or several; where its lens has a
    /// distortion that Plumb has no model for.
    pub fn open(
        path: &Path,
        intrinsics: impl Into<FileIntrinsics>,
        settings: &Ros2CameraSettings,
    ) -> Result<Self, McapError> {
        let (of_file, settings) = (intrinsics.into(), &settings.with_absolute_topics()?);
        let all = Reader::open(path)?.topics()?;
        let topics = Topics::choose(path, &all, settings, of_file.intrinsics.has_depth())?;
        let info = match &topics.info {
            Some(channel) if settings.intrinsics == IntrinsicsFrom::Device => {
                first_info(path, channel)?
            }
            _ => None,
        };
        let (intrinsics, size) = match &info {
            Some(info) => {
                let (intrinsics, size) = of_description(info, &topics, settings)?;
                (intrinsics, Some(size))
            }
            None => (Intrinsics { depth_scale: topics.depth_scale(), ..of_file.intrinsics }, None),
        };
        let (reader, frames) = (Reader::open(path)?, Frames::default());
        let of_file = info.is_none().then_some(of_file);
        let path = path.to_owned();
        Ok(Self { path, reader, topics, frames, intrinsics, size, of_file, now: 0.0 })
    }

    /// Returns the intrinsics of the frames.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Reads messages until a colour picture has its depth; `None` at the end.
    fn next_pair(&mut self) -> Result<Option<Pair>, McapError> {
        let has_depth = self.topics.depth.is_some();
        loop {
            if let Some(pair) = self.frames.take(has_depth) {
                return Ok(Some(pair));
            }
            if self.frames.has_ended {
                return Ok(None);
            }
            let (colour, depth) = (&self.topics.colour, &self.topics.depth);
            let is_depth = |it: &Channel| depth.as_deref() == Some(it);
            let message = self.reader.next(|it| *it == **colour || is_depth(it));
            match message {
                Ok(Some(message)) if is_depth(&message.channel) => {
                    self.frames.add_depth(message.picture()?);
                }
                Ok(Some(message)) => self.frames.add_colour(message.picture()?),
                Ok(None) => self.frames.has_ended = true,
                Err(error) => {
                    // What came before the damage is delivered after it is told.
                    self.frames.has_ended = true;
                    return Err(error);
                }
            }
        }
    }

    /// Makes a frame of the pictures.
    fn frame(&mut self, (colour, depth): Pair) -> Result<RgbdFrame, SourceError> {
        let stamp = colour.header().stamp;
        self.now = stamp.seconds();
        let lost = |error: McapError| SourceError::new(error).with_stamp(stamp.seconds());
        let (image, depth) = self.images(&colour, depth.as_ref()).map_err(lost)?;
        let frame = RgbdFrame::new(stamp.seconds(), image, depth, self.intrinsics);
        let frame = frame.map_err(|error| {
            let origin = self.path.display().to_string();
            SourceError::new(InvalidFrame { origin, error }).with_stamp(stamp.seconds())
        })?;
        Ok(frame.with_sender_stamp(Some(stamp.into())))
    }

    /// Decodes the pictures of a frame.
    fn images(
        &mut self,
        colour: &Picture,
        depth: Option<&Picture>,
    ) -> Result<(ColourImage, DepthImage), McapError> {
        let name = &self.topics.colour.topic;
        let image = colour.colour(name)?;
        match (self.size, &self.of_file) {
            (Some(size), _) => check_size(name, image.size(), size)?,
            (None, Some(file)) => {
                file.of_pictures(image.size(), self.path.display())?;
            }
            (None, None) => {}
        }
        self.size = Some(image.size());
        let (Some(depth), Some(channel)) = (depth, &self.topics.depth) else {
            let unknown = Image::filled(image.width(), image.height(), 0);
            return Ok((image, unknown));
        };
        let pictures = || self.topics.pictures.clone();
        check_frames(colour.header(), depth.header(), &channel.topic, pictures)?;
        let depth = depth.depth(&channel.topic)?;
        check_size(&channel.topic, depth.size(), image.size())?;
        Ok((image, depth))
    }
}

impl CameraSource for McapRecording {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        match self.next_pair().map_err(SourceError::new)? {
            Some(pair) => self.frame(pair).map(Some),
            None => Ok(None),
        }
    }

    /// Returns the time stamp of the last frame, seconds; 0 before the first one.
    fn now(&self) -> f64 {
        self.now
    }
}

/// Returns the first description of the camera on a topic; `None` where there is none.
fn first_info(path: &Path, channel: &Channel) -> Result<Option<CameraInfo>, McapError> {
    let message = Reader::open(path)?.next(|it| it == channel)?;
    message.map(|message| message.info()).transpose()
}

/// Returns the intrinsics of a description, and the size of the pictures.
fn of_description(
    info: &CameraInfo,
    topics: &Topics,
    settings: &Ros2CameraSettings,
) -> Result<(Intrinsics, ImageSize), McapError> {
    let name = topics.info.as_ref().map_or_else(String::new, |channel| channel.topic.clone());
    let colour = topics.colour.topic.clone();
    let settings = Ros2CameraSettings { colour, info: name, ..settings.clone() };
    // A window that is not on the sensor has no size, and is refused.
    let size = lens::picture_size(info).unwrap_or(ImageSize { width: 0, height: 0 });
    Ok((lens::intrinsics(info, size, topics.depth_scale(), &settings)?, size))
}

/// Most pictures of one kind that wait for the other: two seconds at 30 Hz. Recorders write depth
/// later than its colour.
const WAITING: usize = 60;

/// Colour picture with its depth; `None` where there is none within [`MAX_TIME_DIFFERENCE`].
pub(super) type Pair = (Picture, Option<Picture>);

/// Pictures that wait. Every colour picture comes out, in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Frames {
    colours: VecDeque<Picture>,
    depths: VecDeque<Picture>,
    /// Whether the recording has ended: nothing more comes.
    pub(super) has_ended: bool,
}

impl Frames {
    /// Adds a colour picture.
    pub(super) fn add_colour(&mut self, picture: Picture) {
        self.colours.push_back(picture);
    }

    /// Adds a depth picture.
    pub(super) fn add_depth(&mut self, picture: Picture) {
        self.depths.push_back(picture);
    }

    /// Removes the first colour picture, where it is certain which depth picture is nearest to it:
    /// a later one has come, or none will.
    pub(super) fn take(&mut self, has_depth: bool) -> Option<Pair> {
        let first = self.colours.front()?;
        if !has_depth {
            return self.colours.pop_front().map(|colour| (colour, None));
        }
        let stamp = first.header().seconds();
        let is_certain = self.depths.iter().any(|depth| depth.header().seconds() >= stamp)
            || self.has_ended
            || self.colours.len() > WAITING;
        if !is_certain {
            return None;
        }
        let apart = |depth: &Picture| (depth.header().seconds() - stamp).abs();
        let nearest = (0..self.depths.len())
            .min_by(|&a, &b| apart(&self.depths[a]).total_cmp(&apart(&self.depths[b])))
            .filter(|&index| apart(&self.depths[index]) <= MAX_TIME_DIFFERENCE);
        let depth = nearest.and_then(|index| self.depths.remove(index));
        while self.depths.len() > WAITING {
            self.depths.pop_front();
        }
        self.colours.pop_front().map(|colour| (colour, depth))
    }
}
