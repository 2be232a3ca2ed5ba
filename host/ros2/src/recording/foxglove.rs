//! Messages of Foxglove in protobuf, field by field as in its `.proto` files (foxglove-sdk,
//! `schemas/proto/foxglove`). They become those of ROS 2.

use prost::Message;

use crate::message::sensor::{CameraInfo, CompressedImage, Image, RegionOfInterest};
use crate::message::{Header, Time};

/// `google.protobuf.Timestamp`.
#[derive(Clone, PartialEq, Message)]
struct Timestamp {
    #[prost(int64, tag = "1")]
    seconds: i64,
    #[prost(int32, tag = "2")]
    nanos: i32,
}

/// `foxglove.RawImage`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct RawImage {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    #[prost(fixed32, tag = "2")]
    width: u32,
    #[prost(fixed32, tag = "3")]
    height: u32,
    #[prost(string, tag = "4")]
    encoding: String,
    #[prost(fixed32, tag = "5")]
    step: u32,
    #[prost(bytes = "vec", tag = "6")]
    data: Vec<u8>,
    #[prost(string, tag = "7")]
    frame_id: String,
}

/// `foxglove.CompressedImage`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct CompressedPicture {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    #[prost(bytes = "vec", tag = "2")]
    data: Vec<u8>,
    #[prost(string, tag = "3")]
    format: String,
    #[prost(string, tag = "4")]
    frame_id: String,
}

/// `foxglove.CameraCalibration`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct CameraCalibration {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    #[prost(fixed32, tag = "2")]
    width: u32,
    #[prost(fixed32, tag = "3")]
    height: u32,
    #[prost(string, tag = "4")]
    distortion_model: String,
    #[prost(double, repeated, tag = "5")]
    d: Vec<f64>,
    #[prost(double, repeated, tag = "6")]
    k: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    r: Vec<f64>,
    #[prost(double, repeated, tag = "8")]
    p: Vec<f64>,
    #[prost(string, tag = "9")]
    frame_id: String,
}

impl From<RawImage> for Image {
    fn from(image: RawImage) -> Self {
        Self {
            header: header(image.timestamp, image.frame_id),
            height: image.height,
            width: image.width,
            encoding: image.encoding,
            is_bigendian: 0,
            step: image.step,
            data: image.data,
        }
    }
}

impl From<CompressedPicture> for CompressedImage {
    fn from(file: CompressedPicture) -> Self {
        let header = header(file.timestamp, file.frame_id);
        Self { header, format: file.format, data: file.data }
    }
}

impl From<CameraCalibration> for CameraInfo {
    /// Converts a description. Matrices of other sizes than theirs are those of a camera that is
    /// not calibrated.
    fn from(camera: CameraCalibration) -> Self {
        let whole =
            RegionOfInterest { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false };
        Self {
            header: header(camera.timestamp, camera.frame_id),
            height: camera.height,
            width: camera.width,
            distortion_model: camera.distortion_model,
            d: camera.d,
            k: camera.k.try_into().unwrap_or([0.0; 9]),
            r: camera.r.try_into().unwrap_or([0.0; 9]),
            p: camera.p.try_into().unwrap_or([0.0; 12]),
            binning_x: 0,
            binning_y: 0,
            roi: whole,
        }
    }
}

fn header(stamp: Option<Timestamp>, frame_id: String) -> Header {
    let Timestamp { seconds, nanos } = stamp.unwrap_or_default();
    let sec = i32::try_from(seconds).unwrap_or(i32::MAX);
    Header { stamp: Time { sec, nanosec: u32::try_from(nanos).unwrap_or(0) }, frame_id }
}
