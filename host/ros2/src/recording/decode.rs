//! Messages of a camera from their bytes.

use prost::Message as _;
use serde::de::DeserializeOwned;

use super::error::McapError;
use super::foxglove::{CameraCalibration, CompressedPicture, RawImage};
use super::reader::{Channel, Message};
use crate::camera::picture::Picture;
use crate::message::from_cdr;
use crate::message::sensor::CameraInfo;

/// Bytes before the fields of a message of ROS 2: the kind of CDR, and options (RTPS, section 10).
const CDR_HEADER: usize = 4;

/// What the messages of a topic are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Pictures of bytes without a format.
    Raw,
    /// Image files.
    Compressed,
    /// Descriptions of the camera.
    Info,
}

/// Program that defines the messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Family {
    Ros2,
    Foxglove,
}

/// Types that are read.
const TYPES: [(&str, Family, Kind); 6] = [
    ("sensor_msgs/msg/Image", Family::Ros2, Kind::Raw),
    ("sensor_msgs/msg/CompressedImage", Family::Ros2, Kind::Compressed),
    ("sensor_msgs/msg/CameraInfo", Family::Ros2, Kind::Info),
    ("foxglove.RawImage", Family::Foxglove, Kind::Raw),
    ("foxglove.CompressedImage", Family::Foxglove, Kind::Compressed),
    ("foxglove.CameraCalibration", Family::Foxglove, Kind::Info),
];

impl Channel {
    /// Returns what its messages are; `None` where they are none of a camera.
    pub(super) fn kind(&self) -> Option<Kind> {
        self.read_as().map(|(_, kind)| kind)
    }

    fn read_as(&self) -> Option<(Family, Kind)> {
        let (_, family, kind) = TYPES.into_iter().find(|(name, ..)| *name == self.schema)?;
        let encoding = match family {
            Family::Ros2 => "cdr",
            Family::Foxglove => "protobuf",
        };
        (self.encoding == encoding).then_some((family, kind))
    }
}

impl Message {
    /// Reads a picture.
    ///
    /// # Errors
    /// Where the message is none.
    pub(super) fn picture(&self) -> Result<Picture, McapError> {
        let picture = match self.channel.read_as() {
            Some((Family::Ros2, Kind::Raw)) => cdr(&self.data).map(Picture::Raw),
            Some((Family::Ros2, Kind::Compressed)) => cdr(&self.data).map(Picture::Compressed),
            Some((Family::Foxglove, Kind::Raw)) => {
                RawImage::decode(&*self.data).ok().map(|it| Picture::Raw(it.into()))
            }
            Some((Family::Foxglove, Kind::Compressed)) => {
                CompressedPicture::decode(&*self.data).ok().map(|it| Picture::Compressed(it.into()))
            }
            _ => None,
        };
        picture.ok_or_else(|| self.refusal())
    }

    /// Reads the description of a camera.
    ///
    /// # Errors
    /// Where the message is none.
    pub(super) fn info(&self) -> Result<CameraInfo, McapError> {
        let info = match self.channel.read_as() {
            Some((Family::Ros2, Kind::Info)) => cdr(&self.data),
            Some((Family::Foxglove, Kind::Info)) => {
                CameraCalibration::decode(&*self.data).ok().map(CameraInfo::from)
            }
            _ => None,
        };
        info.ok_or_else(|| self.refusal())
    }

    fn refusal(&self) -> McapError {
        let Channel { topic, schema, .. } = &*self.channel;
        McapError::Message { topic: topic.clone(), name: schema.clone() }
    }
}

/// Reads a message of ROS 2; `None` where the bytes are none.
fn cdr<M: DeserializeOwned>(data: &[u8]) -> Option<M> {
    let (header, fields) = data.split_at_checked(CDR_HEADER)?;
    match header[1] {
        order @ (0 | 1) => from_cdr(fields, order == 1),
        _ => None,
    }
}
