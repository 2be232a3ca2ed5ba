//! Pictures of a camera: colour with the depth of the same moment.

use std::time::{Duration, Instant};

use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_frame::image::{ColourImage, DepthImage, ImageSize};

use super::error::Ros2CameraError;
use super::pairs::{Pairs, Stamped};
use super::picture::Picture;
use super::reception::{Description, Received, Reception};
use crate::message::sensor::CameraInfo;
use crate::message::{Header, Time};
use crate::network::Network;

/// Parts of the names of topics with aligned depth: those of realsense-ros, and of image_pipeline
/// and the drivers that follow it.
const ALIGNED: [&str; 2] = ["aligned_depth_to_color", "depth_registered"];

/// Decoded pictures of one moment.
#[derive(Debug)]
pub(crate) struct Pictures {
    /// Stamp of the colour picture, on the clock of the camera's computer.
    pub(crate) stamp: Time,
    /// When the colour picture arrived.
    pub(crate) arrival: Instant,
    /// Coordinate frame of the colour picture.
    pub(crate) frame: String,
    /// Colour.
    pub(crate) colour: ColourImage,
    /// Depth aligned to colour; `None` for a camera without depth.
    pub(crate) depth: Option<DepthImage>,
}

/// Pictures of a camera as they come.
pub(crate) struct Intake {
    pub(crate) reception: Reception,
    pairs: Pairs<Picture, Picture>,
    /// The newest colour picture of a camera without depth.
    newest: Option<Stamped<Picture>>,
}

impl Intake {
    /// Subscribes to the topics.
    ///
    /// # Errors
    /// As [`Reception::start`].
    pub(crate) fn start(
        settings: &Ros2CameraSettings,
        network: &Network,
    ) -> Result<Self, Ros2CameraError> {
        let reception = Reception::start(settings, network)?;
        Ok(Self { reception, pairs: Pairs::default(), newest: None })
    }

    /// Waits for messages, for `limit` at most. Descriptions of the camera go to `describe`.
    ///
    /// # Errors
    /// Where the operating system refuses.
    pub(crate) fn receive(
        &mut self,
        limit: Duration,
        mut describe: impl FnMut(Description),
    ) -> Result<(), Ros2CameraError> {
        let (pairs, newest) = (&mut self.pairs, &mut self.newest);
        let has_depth = self.reception.depth_name().is_some();
        self.reception.receive(limit, |received| match received {
            Received::Colour(colour) if has_depth => pairs.add_colour(colour),
            Received::Colour(colour) => *newest = Some(colour),
            Received::Depth(depth) => pairs.add_depth(depth),
            Received::Info(info) => describe(info),
        })
    }

    /// Checks that one node publishes each topic. Returns whether that is certain. While it is not,
    /// pictures are dropped: they may be another camera's.
    ///
    /// # Errors
    /// As [`Reception::check_senders`].
    pub(crate) fn check_senders(&mut self) -> Result<bool, Ros2CameraError> {
        let is_certain = self.reception.check_senders()?;
        if !is_certain {
            (self.pairs, self.newest) = (Pairs::default(), None);
        }
        Ok(is_certain)
    }

    /// Removes and decodes the newest pictures; `None` where there are none.
    ///
    /// # Errors
    /// Where they cannot be decoded, or colour and depth differ in size.
    pub(crate) fn take(&mut self) -> Result<Option<Pictures>, Ros2CameraError> {
        let name = self.reception.colour_name();
        let Some(depth_name) = self.reception.depth_name() else {
            let Some(Stamped { arrival, picture, .. }) = self.newest.take() else {
                return Ok(None);
            };
            let Header { stamp, frame_id: frame } = picture.header().clone();
            let colour = picture.colour(name)?;
            return Ok(Some(Pictures { stamp, arrival, frame, colour, depth: None }));
        };
        let Some((colour, depth)) = self.pairs.take_newest() else { return Ok(None) };
        let topics = || self.reception.image_topics();
        check_frames(colour.picture.header(), depth.picture.header(), depth_name, topics)?;
        let Stamped { arrival, picture, .. } = colour;
        let Header { stamp, frame_id: frame } = picture.header().clone();
        let colour = picture.colour(name)?;
        let depth = depth.picture.depth(depth_name)?;
        check_size(depth_name, depth.size(), colour.size())?;
        Ok(Some(Pictures { stamp, arrival, frame, colour, depth: Some(depth) }))
    }

    /// Returns, for a person, what may be missing where no pictures come.
    pub(crate) fn missing(&self) -> String {
        self.reception.missing(self.pairs.apart())
    }
}

/// Returns whether a topic has the name of one with depth that is aligned to colour.
pub(crate) fn is_aligned(topic: &str) -> bool {
    ALIGNED.iter().any(|part| topic.contains(part))
}

/// Checks that colour and depth are in one coordinate frame, as depth is that is aligned to colour.
/// A picture without a frame passes. `topic` is that of depth, and `topics` returns all with
/// pictures.
///
/// # Errors
/// [`Ros2CameraError::NotAligned`].
pub(crate) fn check_frames(
    colour: &Header,
    depth: &Header,
    topic: &str,
    topics: impl FnOnce() -> Vec<String>,
) -> Result<(), Ros2CameraError> {
    if is_one_frame(&colour.frame_id, &depth.frame_id) {
        return Ok(());
    }
    Err(Ros2CameraError::NotAligned {
        topic: topic.to_owned(),
        depth: depth.frame_id.clone(),
        colour: colour.frame_id.clone(),
        aligned: topics().into_iter().filter(|topic| is_aligned(topic)).collect(),
    })
}

/// Returns whether two names are those of one coordinate frame, or one of them is not stated.
pub(crate) fn is_one_frame(a: &str, b: &str) -> bool {
    let [a, b] = [a, b].map(|name| name.trim_matches('/'));
    a.is_empty() || b.is_empty() || a == b
}

/// Checks that a description, which came on `topic`, is that of the camera whose colour pictures
/// are in the coordinate frame `colour`.
///
/// # Errors
/// [`Ros2CameraError::OtherCamera`].
pub(crate) fn check_description(
    info: &CameraInfo,
    colour: &str,
    topic: &str,
) -> Result<(), Ros2CameraError> {
    let described = &info.header.frame_id;
    if is_one_frame(described, colour) {
        return Ok(());
    }
    let (topic, described) = (topic.to_owned(), described.clone());
    Err(Ros2CameraError::OtherCamera { topic, described, colour: colour.to_owned() })
}

/// Checks the size of a picture of `topic`.
///
/// # Errors
/// [`Ros2CameraError::OtherSize`] where it is not `expected`.
pub(crate) fn check_size(
    topic: &str,
    size: ImageSize,
    expected: ImageSize,
) -> Result<(), Ros2CameraError> {
    if size == expected {
        return Ok(());
    }
    Err(Ros2CameraError::OtherSize { topic: topic.to_owned(), size, expected })
}
