//! ROS 2 messages that Plumb sends and receives, field by field as in their `.msg` files.

pub(crate) mod diagnostic;
pub(crate) mod geometry;
pub(crate) mod sensor;

use plumb_frame::frame::SenderStamp;
use ros2_client::MessageTypeName;
use rustdds::RepresentationIdentifier;
use rustdds::serialization::deserialize_from_cdr_with_rep_id;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Message with the name of its type.
pub(crate) trait TypedMessage {
    /// Package of the type.
    const PACKAGE: &'static str;
    /// Name of the type in its package.
    const NAME: &'static str;

    /// Returns the name of the type in ROS 2.
    fn type_name() -> MessageTypeName {
        MessageTypeName::new(Self::PACKAGE, Self::NAME)
    }
}

/// Names the types of messages: the package and the name in it.
macro_rules! types {
    ($($message:ty: $package:literal $name:literal;)+) => {$(
        impl TypedMessage for $message {
            const PACKAGE: &'static str = $package;
            const NAME: &'static str = $name;
        }
    )+};
}

types! {
    diagnostic::DiagnosticArray: "diagnostic_msgs" "DiagnosticArray";
    diagnostic::DiagnosticStatus: "diagnostic_msgs" "DiagnosticStatus";
    geometry::PointStamped: "geometry_msgs" "PointStamped";
    geometry::PoseWithCovarianceStamped: "geometry_msgs" "PoseWithCovarianceStamped";
    geometry::TfMessage: "tf2_msgs" "TFMessage";
    sensor::CameraInfo: "sensor_msgs" "CameraInfo";
    sensor::CompressedImage: "sensor_msgs" "CompressedImage";
    sensor::Image: "sensor_msgs" "Image";
}

/// Reads a message from the CDR of its fields; `None` where it is none. `is_little` says that the
/// lower byte of a number comes first.
pub(crate) fn from_cdr<M: DeserializeOwned>(fields: &[u8], is_little: bool) -> Option<M> {
    let order = match is_little {
        true => RepresentationIdentifier::CDR_LE,
        false => RepresentationIdentifier::CDR_BE,
    };
    deserialize_from_cdr_with_rep_id(fields, order).ok().map(|(message, _)| message)
}

/// `builtin_interfaces/Time`: time on the system clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Time {
    /// Seconds since 1970.
    pub(crate) sec: i32,
    /// Nanoseconds of the second.
    pub(crate) nanosec: u32,
}

impl Time {
    /// Converts nanoseconds since 1970. A time after 2038 is the last one that the type holds.
    pub(crate) fn from_nanoseconds(time: u64) -> Self {
        let sec = i32::try_from(time / NANOSECONDS).unwrap_or(i32::MAX);
        Self { sec, nanosec: (time % NANOSECONDS) as u32 }
    }

    /// Returns the seconds since 1970.
    pub(crate) fn seconds(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

impl From<SenderStamp> for Time {
    fn from(stamp: SenderStamp) -> Self {
        Self { sec: stamp.seconds, nanosec: stamp.nanoseconds }
    }
}

impl From<Time> for SenderStamp {
    fn from(time: Time) -> Self {
        Self { seconds: time.sec, nanoseconds: time.nanosec }
    }
}

/// Nanoseconds of a second.
const NANOSECONDS: u64 = 1_000_000_000;

/// `std_msgs/Header`: time and frame of a message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Header {
    /// Time of the measurement.
    pub(crate) stamp: Time,
    /// Name of the coordinate frame.
    pub(crate) frame_id: String,
}

impl Header {
    /// Returns the time, seconds since 1970.
    pub(crate) fn seconds(&self) -> f64 {
        self.stamp.seconds()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_keeps_its_nanoseconds() {
        let time = Time::from_nanoseconds(1_800_000_000_123_456_789);
        assert_eq!((time.sec, time.nanosec), (1_800_000_000, 123_456_789));
        assert_eq!(Time::from_nanoseconds(u64::MAX).sec, i32::MAX);
    }
}
