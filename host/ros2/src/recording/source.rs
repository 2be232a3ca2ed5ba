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
use crate::camera::intake::{check_description, check_frames, check_size};
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
    colours: Reader,
    /// A reader of its own: recorders and converters write the topics in any order. `None` for a
    /// camera without depth, and at the end.
    depths: Option<Reader>,
    /// Depth pictures that wait for their colour.
    waiting: VecDeque<Picture>,
    /// Whether damage has ended the file.
    is_damaged: bool,
    topics: Topics,
    intrinsics: Intrinsics,
    /// Size of the pictures; `None` before the first one where the file has no description.
    size: Option<ImageSize>,
    /// Description of the camera in the recording.
    info: Option<CameraInfo>,
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
        let (colours, waiting) = (Reader::open(path)?, VecDeque::new());
        let depths = topics.depth.as_ref().map(|_| Reader::open(path)).transpose()?;
        let of_file = info.is_none().then_some(of_file);
        let path = path.to_owned();
        Ok(Self {
            path,
            colours,
            depths,
            waiting,
            is_damaged: false,
            topics,
            intrinsics,
            size,
            info,
            of_file,
            now: 0.0,
        })
    }

    /// Returns the intrinsics of the frames.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Reads the next colour picture and its depth; `None` at the end.
    fn next_pair(&mut self) -> Result<Option<Pair>, McapError> {
        let topic = &*self.topics.colour;
        if self.is_damaged {
            return Ok(None);
        }
        let message = self.colours.next(|it| it == topic);
        self.is_damaged = message.is_err();
        let Some(message) = message? else { return Ok(None) };
        let colour = message.picture()?;
        let stamp = colour.header().seconds();
        while let Some((reader, topic)) = self.depths.as_mut().zip(self.topics.depth.as_deref())
            && self.waiting.back().is_none_or(|last| last.header().seconds() < stamp)
        {
            // The reader of colour tells about damage.
            let Ok(Some(message)) = reader.next(|it| it == topic) else {
                self.depths = None;
                break;
            };
            self.waiting.push_back(message.picture()?);
        }
        Ok(Some((colour, nearest(&mut self.waiting, stamp))))
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
        if let (Some(info), Some(channel)) = (&self.info, &self.topics.info) {
            check_description(info, &colour.header().frame_id, &channel.topic)?;
        }
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

/// Most depth pictures that wait for their colour: two seconds at 30 Hz.
const WAITING: usize = 60;

/// Colour picture with its depth; `None` where there is none within [`MAX_TIME_DIFFERENCE`].
type Pair = (Picture, Option<Picture>);

/// Removes the depth picture that is nearest to the colour picture of this `stamp` (seconds), and
/// the oldest ones where many wait.
fn nearest(waiting: &mut VecDeque<Picture>, stamp: f64) -> Option<Picture> {
    let apart = |depth: &Picture| (depth.header().seconds() - stamp).abs();
    let nearest = (0..waiting.len())
        .min_by(|&a, &b| apart(&waiting[a]).total_cmp(&apart(&waiting[b])))
        .filter(|&index| apart(&waiting[index]) <= MAX_TIME_DIFFERENCE);
    let depth = nearest.and_then(|index| waiting.remove(index));
    let many = waiting.len().saturating_sub(WAITING);
    waiting.drain(..many);
    depth
}
