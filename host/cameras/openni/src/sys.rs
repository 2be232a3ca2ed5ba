//! Types and constants of OpenNI 2.2's C interface (`OniCTypes.h`, `OniCEnums.h` and
//! `OniCProperties.h`), as far as this crate and a driver for OpenNI2 need them, the file names of
//! the library, and the conversion of its strings.

use core::ffi::{c_char, c_int, c_void};
use std::ffi::CStr;

/// Environment variable with the path of the library, for one that is not where the system keeps
/// its libraries.
pub const LIBRARY_VARIABLE: &str = "PLUMB_OPENNI2";

/// File names of the library, the most usual first.
pub(crate) const NAMES: [&str; 3] = ["libOpenNI2.so.0", "libOpenNI2.so", "libOpenNI2.dylib"];

/// Version of the interface for `oniInitialize`: 2.2.
pub const API_VERSION: c_int = 2002;

/// Length of the strings in [`OniDeviceInfo`], with the final zero.
pub const MAX_STR: usize = 256;

/// Status of a call.
pub type OniStatus = c_int;
/// Success.
pub const STATUS_OK: OniStatus = 0;
/// Failure without a specific reason.
pub const STATUS_ERROR: OniStatus = 1;
/// The driver does not implement it.
pub const STATUS_NOT_IMPLEMENTED: OniStatus = 2;
/// The device does not support it.
pub const STATUS_NOT_SUPPORTED: OniStatus = 3;
/// A value or its size is wrong.
pub const STATUS_BAD_PARAMETER: OniStatus = 4;
/// The device was disconnected.
pub const STATUS_NO_DEVICE: OniStatus = 6;
/// Timeout.
pub const STATUS_TIME_OUT: OniStatus = 102;

/// The colour camera.
pub const SENSOR_COLOUR: c_int = 2;
/// The depth camera.
pub const SENSOR_DEPTH: c_int = 3;

/// 16-bit depth in millimetres.
pub const FORMAT_DEPTH_1_MM: c_int = 100;
/// 16-bit depth in tenths of a millimetre.
pub const FORMAT_DEPTH_100_UM: c_int = 101;
/// 8-bit red, green, blue.
pub const FORMAT_RGB888: c_int = 200;

/// Device: [`REGISTRATION_OFF`] or [`REGISTRATION_DEPTH_TO_COLOUR`].
pub const DEVICE_PROPERTY_REGISTRATION: c_int = 5;
/// Recording: playback speed, `f32`; [`PLAYBACK_MANUAL`] for frame by frame.
pub const DEVICE_PROPERTY_PLAYBACK_SPEED: c_int = 100;
/// Recording: whether it restarts at its end (the default), `c_int`.
pub const DEVICE_PROPERTY_PLAYBACK_REPEAT: c_int = 101;

/// Depth in the pixels of the depth camera.
pub const REGISTRATION_OFF: c_int = 0;
/// Depth in the pixels of the colour camera.
pub const REGISTRATION_DEPTH_TO_COLOUR: c_int = 1;
/// Playback speed: a frame for each wait.
pub const PLAYBACK_MANUAL: f32 = -1.0;

/// Stream: [`OniCropping`].
pub const STREAM_PROPERTY_CROPPING: c_int = 0;
/// Stream: horizontal field of view, radians, `f32`.
pub const STREAM_PROPERTY_HORIZONTAL_FOV: c_int = 1;
/// Stream: vertical field of view, radians, `f32`.
pub const STREAM_PROPERTY_VERTICAL_FOV: c_int = 2;
/// Stream: [`OniVideoMode`].
pub const STREAM_PROPERTY_VIDEO_MODE: c_int = 3;
/// Depth stream: the largest value, `c_int`.
pub const STREAM_PROPERTY_MAX_VALUE: c_int = 4;
/// Depth stream: the smallest value, `c_int`.
pub const STREAM_PROPERTY_MIN_VALUE: c_int = 5;
/// Stream: bytes from one row to the next, `c_int`.
pub const STREAM_PROPERTY_STRIDE: c_int = 6;
/// Stream: whether left and right are exchanged, `c_int`.
pub const STREAM_PROPERTY_MIRRORING: c_int = 7;
/// Stream of a recording: frames in it, `c_int`.
pub const STREAM_PROPERTY_NUMBER_OF_FRAMES: c_int = 8;

/// Device state: at the end of a recording.
pub const DEVICE_STATE_EOF: c_int = 3;

/// Handle of a device.
pub type OniDeviceHandle = *mut c_void;
/// Handle of a stream.
pub type OniStreamHandle = *mut c_void;
/// Handle of a recorder.
pub type OniRecorderHandle = *mut c_void;

/// Format, size and rate of a stream.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OniVideoMode {
    /// `FORMAT_*`.
    pub pixel_format: c_int,
    /// Columns.
    pub resolution_x: c_int,
    /// Rows.
    pub resolution_y: c_int,
    /// Frames per second.
    pub fps: c_int,
}

/// Modes of a sensor.
#[repr(C)]
#[derive(Debug)]
pub struct OniSensorInfo {
    /// `SENSOR_*`.
    pub sensor_type: c_int,
    /// Length of `modes`.
    pub mode_count: c_int,
    /// The modes.
    pub modes: *mut OniVideoMode,
}

/// Description of a device.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct OniDeviceInfo {
    /// URI, by which the device is opened.
    pub uri: [c_char; MAX_STR],
    /// Maker.
    pub vendor: [c_char; MAX_STR],
    /// Model.
    pub name: [c_char; MAX_STR],
    /// USB vendor.
    pub usb_vendor: u16,
    /// USB product.
    pub usb_product: u16,
}

/// Cropping of a sensor's picture.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OniCropping {
    /// Whether the picture is cropped.
    pub enabled: c_int,
    /// First column.
    pub origin_x: c_int,
    /// First row.
    pub origin_y: c_int,
    /// Columns.
    pub width: c_int,
    /// Rows.
    pub height: c_int,
}

/// Picture in the library's memory.
#[repr(C)]
#[derive(Debug)]
pub struct OniFrame {
    /// Bytes at `data`.
    pub data_size: c_int,
    /// The pixels.
    pub data: *mut c_void,
    /// `SENSOR_*`.
    pub sensor_type: c_int,
    /// Time stamp, µs on the device's clock.
    pub timestamp: u64,
    /// Number of the picture, counted up.
    pub frame_index: c_int,
    /// Columns.
    pub width: c_int,
    /// Rows.
    pub height: c_int,
    /// Mode of the stream.
    pub mode: OniVideoMode,
    /// Whether the picture is cropped.
    pub cropping_enabled: c_int,
    /// First column.
    pub crop_origin_x: c_int,
    /// First row.
    pub crop_origin_y: c_int,
    /// Bytes from one row to the next.
    pub stride: c_int,
}

/// Version of the library.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OniVersion {
    /// Major version: 2.
    pub major: c_int,
    /// Minor version: changes with new functions.
    pub minor: c_int,
    /// Maintenance version: changes with corrections.
    pub maintenance: c_int,
    /// Number of the build.
    pub build: c_int,
}

/// Callback about a device.
pub type DeviceCallback = unsafe extern "C" fn(info: *const OniDeviceInfo, cookie: *mut c_void);
/// Callback about a device's new state.
pub type DeviceStateCallback =
    unsafe extern "C" fn(info: *const OniDeviceInfo, state: c_int, cookie: *mut c_void);

/// Callbacks about devices.
#[repr(C)]
pub struct OniDeviceCallbacks {
    /// A device was connected.
    pub connected: DeviceCallback,
    /// A device was disconnected.
    pub disconnected: DeviceCallback,
    /// A device changed its state (`DEVICE_STATE_*`).
    pub state_changed: DeviceStateCallback,
}

/// Returns the string in a field of fixed length, which may lack its final zero.
pub(crate) fn text(field: &[c_char]) -> String {
    let bytes: Vec<u8> =
        field.iter().take_while(|&&c| c != 0).map(|&c| c.to_ne_bytes()[0]).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Returns the string at `pointer`; empty for a null pointer.
///
/// # Safety
/// `pointer` is null or points to a string with a final zero that does not change during this call.
pub(crate) unsafe fn owned(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: the caller guarantees it.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().trim().to_owned()
}
