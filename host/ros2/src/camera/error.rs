//! Failure of a camera in ROS 2.

use std::time::Duration;

use plumb_cameras::ros2::TopicNameError;
use plumb_frame::clock::SenderClockError;
use plumb_frame::file_intrinsics::UnfitIntrinsics;
use plumb_frame::image::{ImageError, ImageSize};
use plumb_frame::source::SourceError;
use plumb_pictures::decode::DecodeError;
use thiserror::Error;

use crate::error::Ros2Error;
use crate::peers::UnusablePublisher;

/// Failure of a camera in ROS 2.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Ros2CameraError {
    /// ROS 2 cannot be joined.
    #[error(transparent)]
    Join(#[from] Ros2Error),
    /// A publisher on a topic of the camera has another type.
    #[error(transparent)]
    Unusable(#[from] UnusablePublisher),
    /// Several nodes publish on a topic, so that the pictures of two cameras would mix.
    #[error(
        "{count} nodes publish on {topic}; choose the topic of one camera in [camera.ros2] of the \
         rig file"
    )]
    ManyPublishers {
        /// Name of the topic.
        topic: String,
        /// Number of publishers.
        count: usize,
    },
    /// No picture with all that belongs to it has come since the camera was opened.
    #[error("no picture came within {} s: {missing}", .waited.as_secs())]
    NoPicture {
        /// Time that was waited.
        waited: Duration,
        /// What is missing, and which topics there are.
        missing: String,
    },
    /// No picture has come for a while.
    #[error("no picture for {:.0} s: {missing}", .silent.as_secs_f64())]
    Silent {
        /// Time since the last picture.
        silent: Duration,
        /// What is missing.
        missing: String,
    },
    /// A picture has an encoding that Plumb does not read.
    #[error(
        "{topic}: the encoding is `{found}`, but {expected} is needed: set it in the camera's \
         node, or choose another topic in [camera.ros2] of the rig file"
    )]
    Encoding {
        /// Name of the topic.
        topic: String,
        /// Encoding of the picture.
        found: String,
        /// Encodings that Plumb reads.
        expected: &'static str,
    },
    /// Compressed depth has impossible parameters.
    #[error(
        "{topic}: the parameters of inverse depth are {scale} and {offset}, but the first one must \
         be above 0, and both finite: is it the `compressedDepth` of image_transport?"
    )]
    InverseDepth {
        /// Name of the topic.
        topic: String,
        /// Scale of inverse depth, metres.
        scale: f32,
        /// Offset.
        offset: f32,
    },
    /// The bytes of a picture do not fit its size.
    #[error(
        "{topic}: a picture of {size} with {bytes} bytes in rows of {step} bytes is empty or \
         damaged: look at the topic with `ros2 topic echo --no-arr`"
    )]
    Layout {
        /// Name of the topic.
        topic: String,
        /// Size that the message states.
        size: ImageSize,
        /// Bytes of a row.
        step: u32,
        /// Bytes of the picture.
        bytes: usize,
    },
    /// A picture has another size than the first one, or than the camera's description.
    #[error("{topic}: the size is {size}, but {expected} is needed")]
    OtherSize {
        /// Name of the topic.
        topic: String,
        /// Size.
        size: ImageSize,
        /// Size that is needed.
        expected: ImageSize,
    },
    /// Colour and depth are in different coordinate frames.
    #[error(
        "{topic}: the depth is in the frame `{depth}`, and colour in `{colour}`: it is not aligned \
         to colour. Set `depth` in [camera.ros2] of the rig file to a topic with aligned depth{}",
        suggestion(.aligned)
    )]
    NotAligned {
        /// Name of the depth topic.
        topic: String,
        /// Frame of the depth pictures.
        depth: String,
        /// Frame of the colour pictures.
        colour: String,
        /// Topics of the domain that have the name of one with aligned depth.
        aligned: Vec<String>,
    },
    /// The description is that of another camera than the pictures'.
    #[error(
        "{topic}: describes the camera in the frame `{described}`, and the colour pictures are in \
         `{colour}`: set `info` in [camera.ros2] of the rig file to the topic of the same camera, \
         or `intrinsics = \"file\"` there where its node names the frames otherwise"
    )]
    OtherCamera {
        /// Name of the topic with the description.
        topic: String,
        /// Frame of the description.
        described: String,
        /// Frame of the colour pictures.
        colour: String,
    },
    /// A picture is grey.
    #[error(
        "{topic}: the pictures are grey (`{found}`), and the ball is found by its colour: have the \
         camera's node publish colour"
    )]
    Grey {
        /// Name of the topic.
        topic: String,
        /// Encoding of the picture.
        found: String,
    },
    /// The camera's description has a window that is not on the sensor.
    #[error(
        "{topic}: `{name} = {offset}` with {length} pixels is beyond the {whole} of the sensor. \
         Its driver gives the window's size as that of the sensor: set `intrinsics = \"file\"` in \
         [camera.ros2] of the rig file, and run `plumb calibrate --lens`"
    )]
    Window {
        /// Name of the topic.
        topic: String,
        /// Field of the description.
        name: &'static str,
        /// First column or row of the window.
        offset: u32,
        /// Columns or rows of the window.
        length: u32,
        /// Columns or rows of the sensor.
        whole: u32,
    },
    /// A picture cannot be decoded.
    #[error("{topic}: a picture cannot be decoded")]
    Decode {
        /// Name of the topic.
        topic: String,
        /// Violated condition.
        #[source]
        error: DecodeError,
    },
    /// A picture has another number of pixels than its size.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The camera's description has no focal lengths.
    #[error("{topic}: the focal lengths are {fx} and {fy}: the camera is not calibrated")]
    NotCalibrated {
        /// Name of the topic.
        topic: String,
        /// Focal length along the rows, pixels.
        fx: f64,
        /// Focal length along the columns, pixels.
        fy: f64,
    },
    /// The camera's description has a distortion that Plumb has no model for.
    #[error(
        "{topic}: the lens has a distortion of the model `{model}`, but `plumb_bob` is needed. \
         Use a topic with rectified pictures and set `rectified = true` in [camera.ros2] of the \
         rig file; or set `intrinsics = \"file\"` there, and then run `plumb calibrate --lens`"
    )]
    DistortionModel {
        /// Name of the topic.
        topic: String,
        /// Model of the distortion.
        model: String,
    },
    /// The topic has the name of one with rectified pictures. The distortion of the lens would be
    /// taken out of them once more.
    #[error(
        "{topic}: this is the name of a topic with rectified pictures, but the camera's \
         description has a distortion: set `rectified = true` in [camera.ros2] of the rig file"
    )]
    Rectified {
        /// Name of the topic.
        topic: String,
    },
    /// The settings take the projection of rectified pictures, and the intrinsics of a file.
    #[error(
        "`rectified = true` and `intrinsics = \"file\"` in [camera.ros2] of the rig file exclude \
         each other: the camera file has the intrinsics of the pictures as they come"
    )]
    RectifiedFile,
    /// The camera's description has changed.
    #[error(
        "{topic}: the description of the camera has changed: another camera publishes, or it was \
         set anew. Start again, so that its intrinsics are taken"
    )]
    Described {
        /// Name of the topic.
        topic: String,
    },
    /// The camera's description has too few or too many coefficients of the distortion.
    #[error(
        "{topic}: the distortion has {count} coefficients, but `plumb_bob` has 4 or 5 (k1, k2, p1, \
         p2, k3)"
    )]
    DistortionCount {
        /// Name of the topic.
        topic: String,
        /// Number of coefficients.
        count: usize,
    },
    /// A coefficient of the distortion is no finite number.
    #[error("{topic}: a coefficient of the distortion is {value}: it must be a finite number")]
    DistortionNumber {
        /// Name of the topic.
        topic: String,
        /// The coefficient.
        value: f64,
    },
    /// The clock of the stamps does not run as this computer's.
    #[error(
        "{topic}: the stamps of the pictures {}, so that their age is unknown. A simulator with \
         `use_sim_time` and /clock must run in real time (real-time factor 1) and not be paused; \
         a bag must be played at its own rate (`ros2 bag play` without `--rate`, not paused); a \
         camera's node must stamp each picture",
        running(*.rate)
    )]
    ClockRate {
        /// Name of the topic.
        topic: String,
        /// Seconds of the stamps in a second of this computer; 0 where they stand still.
        rate: f64,
    },
    /// The name of a topic breaks the rules of ROS 2.
    #[error(transparent)]
    TopicName(#[from] TopicNameError),
    /// The time of a picture is unknown.
    #[error("the time of a picture is unknown")]
    Time(#[from] SenderClockError),
    /// The first picture is refused.
    #[error("the first picture is refused")]
    First(#[source] SourceError),
    /// The intrinsics do not fit the pictures.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
    /// The operating system gives no means to wait for messages.
    #[error("cannot wait for messages")]
    Wait(#[source] std::io::Error),
}

/// Returns the end of a sentence that names topics with aligned depth.
fn suggestion(aligned: &[String]) -> String {
    match aligned {
        [] => " (realsense-ros publishes it with `align_depth.enable:=true`, other drivers with \
               `depth_registration:=true`)"
            .to_owned(),
        topics => format!(", such as {}", topics.join(" or ")),
    }
}

/// Returns the words for stamps that run at `rate` times the rate of this computer's clock.
fn running(rate: f64) -> String {
    if rate.abs() < 5e-3 {
        "stand still".to_owned()
    } else if rate < 0.0 {
        "run backwards".to_owned()
    } else {
        format!("run at {rate:.2} times the rate of this computer's clock")
    }
}
