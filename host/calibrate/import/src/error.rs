//! Reasons why a calibration file is not read.

use plumb_frame::camera::CoefficientsError;
use thiserror::Error;

use crate::Program;

/// Files that are read, for messages.
const KNOWN: &str = "ROS's camera_calibration (`camera_matrix`, `distortion_model`) or CameraInfo \
                     (`k`, `d`), kalibr's camchain (`cam0`), OpenCV's (`camera_matrix`, \
                     `distortion_coefficients`), and easy_handeye's (`transformation`)";

/// Reason why a calibration file is not read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ImportError {
    /// The text is too long.
    #[error("{bytes} bytes are more than a calibration has: at most {limit} are read")]
    Long {
        /// Length of the text.
        bytes: usize,
        /// Longest text.
        limit: usize,
    },
    /// The text is XML.
    #[error(
        "this is XML. Keep the calibration as YAML: give OpenCV's FileStorage the ending .yaml"
    )]
    Xml,
    /// The text is no YAML.
    #[error("no YAML: {why}. These files are read: {KNOWN}")]
    NoYaml {
        /// What is wrong, and where.
        why: String,
    },
    /// The text has no keys.
    #[error("there are no keys with values. These files are read: {KNOWN}")]
    NoKeys,
    /// The file is of no known program.
    #[error("{keys} are the keys of no known calibration. These files are read: {KNOWN}")]
    Unknown {
        /// The keys of the file.
        keys: String,
    },
    /// A key is missing, or has a value of another kind.
    #[error("not as {program} writes it: {why}")]
    Key {
        /// Program that writes such files.
        program: Program,
        /// What is missing or wrong.
        why: String,
    },
    /// A matrix has another number of values than its size says.
    #[error("`{name}` has {count} numbers instead of {wanted}")]
    Matrix {
        /// Its key.
        name: String,
        /// Its size.
        wanted: String,
        /// The number of its values.
        count: usize,
    },
    /// None of the usual keys is there.
    #[error("none of these keys is there: {names}")]
    Absent {
        /// The usual keys.
        names: String,
    },
    /// The pixels are skew.
    #[error(
        "`{name}` has a skew of {skew}: Plumb has no such pixels. Calibrate without skew, or with \
         `plumb calibrate --lens`"
    )]
    Skew {
        /// Key of the camera matrix.
        name: String,
        /// Its second number, pixels.
        skew: f64,
    },
    /// A focal length or the principal point is impossible.
    #[error(
        "the focal lengths are {fx} and {fy}, and the principal point is ({cx}, {cy}): the camera \
         is not calibrated"
    )]
    Pinhole {
        /// Focal length along the rows, pixels.
        fx: f64,
        /// Focal length along the columns, pixels.
        fy: f64,
        /// Column of the principal point, pixels.
        cx: f64,
        /// Row of the principal point, pixels.
        cy: f64,
    },
    /// The lens has a model that Plumb does not have.
    #[error(
        "the lens has the model `{model}`. Plumb has a pinhole camera with k1, k2, p1, p2, k3 \
         (ROS: plumb_bob; kalibr: pinhole-radtan): calibrate with that, or with \
         `plumb calibrate --lens`"
    )]
    Model {
        /// Name of the model.
        model: String,
    },
    /// The file has four coefficients, and does not name their model.
    #[error(
        "`{name}` has four numbers: k1, k2, p1, p2 of the model plumb_bob, or k1 to k4 of OpenCV's \
         fisheye. The file does not say which: --import-model plumb_bob, or --import-model fisheye"
    )]
    Ambiguous {
        /// Key of the coefficients.
        name: String,
    },
    /// The coefficients are none of OpenCV's model with five.
    #[error("the distortion of the lens: {0}")]
    Coefficients(#[from] CoefficientsError),
    /// A file of kalibr has several cameras.
    #[error("the file has several cameras: name one of {names} with --import-camera")]
    Several {
        /// Names of the cameras.
        names: String,
    },
    /// A file of kalibr has no camera of the name.
    #[error("the file has no camera `{name}`, but {names}")]
    NoCamera {
        /// Wanted name.
        name: String,
        /// Names of the cameras.
        names: String,
    },
    /// A camera is named in a file with one only.
    #[error("only a chain of kalibr names its cameras: leave out --import-camera {name}")]
    NoCameras {
        /// Wanted name.
        name: String,
    },
    /// A model is named for a file that needs none.
    #[error("only a lens of OpenCV has no model in its file: leave out --import-model {model}")]
    NamesModel {
        /// The model.
        model: String,
    },
    /// The file has two cameras of a stereo pair.
    #[error(
        "the file has the matrices of two cameras. Keep those of one as `camera_matrix` and \
         `distortion_coefficients`"
    )]
    Stereo,
    /// The pictures are a part of the sensor, or binned.
    #[error(
        "`{name}` is {value}: the pictures are not the whole sensor's. Print the message of a \
         camera that sends whole pictures"
    )]
    Window {
        /// Field of the message.
        name: &'static str,
        /// Its value.
        value: u32,
    },
    /// The camera moves with the robot.
    #[error(
        "the camera was calibrated on the robot's hand (eye_on_hand). Plumb's camera stands still: \
         calibrate it as eye_on_base"
    )]
    InHand,
    /// The frame of the camera has the axes of a body.
    #[error(
        "`{camera}` is the frame of a body by its name: x forward, y left, z up (REP 103). \
         Calibrate with the camera's optical frame as tracking_base_frame"
    )]
    Body {
        /// Name of the frame.
        camera: String,
    },
    /// A transform is none.
    #[error("the place is {place:?} and the rotation has the norm {norm}: this is no pose")]
    Transform {
        /// Translation, metres.
        place: [f64; 3],
        /// Norm of the rotation.
        norm: f64,
    },
}
