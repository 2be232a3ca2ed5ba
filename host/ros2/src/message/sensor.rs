//! Messages of `sensor_msgs`.

use serde::{Deserialize, Serialize};

use super::Header;

/// `sensor_msgs/Image`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct Image {
    pub(crate) header: Header,
    /// Rows.
    pub(crate) height: u32,
    /// Columns.
    pub(crate) width: u32,
    /// Meaning of the bytes: `rgb8`, `16UC1` and others.
    pub(crate) encoding: String,
    /// 1 where the higher byte of a number comes first.
    pub(crate) is_bigendian: u8,
    /// Bytes of a row.
    pub(crate) step: u32,
    /// Rows, one after the other.
    #[serde(with = "serde_bytes")]
    pub(crate) data: Vec<u8>,
}

/// `sensor_msgs/CompressedImage`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct CompressedImage {
    pub(crate) header: Header,
    /// Encoding: a text that contains `jpeg` or `png`.
    pub(crate) format: String,
    /// Contents of the image file.
    #[serde(with = "serde_bytes")]
    pub(crate) data: Vec<u8>,
}

/// `sensor_msgs/RegionOfInterest`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RegionOfInterest {
    pub(crate) x_offset: u32,
    pub(crate) y_offset: u32,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) do_rectify: bool,
}

/// `sensor_msgs/CameraInfo`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct CameraInfo {
    pub(crate) header: Header,
    /// Rows.
    pub(crate) height: u32,
    /// Columns.
    pub(crate) width: u32,
    /// Model of the distortion, such as `plumb_bob`.
    pub(crate) distortion_model: String,
    /// Coefficients of the distortion.
    pub(crate) d: Vec<f64>,
    /// Camera matrix, row by row.
    pub(crate) k: [f64; 9],
    /// Rotation of a stereo camera, row by row.
    pub(crate) r: [f64; 9],
    /// Projection of the rectified picture, row by row.
    pub(crate) p: [f64; 12],
    pub(crate) binning_x: u32,
    pub(crate) binning_y: u32,
    pub(crate) roi: RegionOfInterest,
}
