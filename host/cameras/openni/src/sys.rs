//! OpenNI 2.2's C interface as far as it is used here: types and numbers of `OniCTypes.h`,
//! `OniCEnums.h` and `OniCProperties.h`. Also what a driver for OpenNI2 is written with.

use core::ffi::{c_char, c_int, c_void};

/// What [`Initialize`](crate::OpenNi) is told: version 2.2.
pub const API_VERSION: c_int = 2002;

/// Length of the strings in [`OniDeviceInfo`], with the closing zero.
pub const MAX_STR: usize = 256;

/// Every call's answer; 0 is success.
pub type OniStatus = c_int;
/// Success.
pub const STATUS_OK: OniStatus = 0;
/// Whatever went wrong.
pub const STATUS_ERROR: OniStatus = 1;
/// The driver has no such thing.
pub const STATUS_NOT_IMPLEMENTED: OniStatus = 2;
/// The device cannot do that.
pub const STATUS_NOT_SUPPORTED: OniStatus = 3;
/// A value or its size is wrong.
pub const STATUS_BAD_PARAMETER: OniStatus = 4;
/// The device is gone.
pub const STATUS_NO_DEVICE: OniStatus = 6;
/// Nothing came in time.
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
/// Recording: how fast it is played, `f32`; [`PLAYBACK_MANUAL`] frame by frame.
pub const DEVICE_PROPERTY_PLAYBACK_SPEED: c_int = 100;
/// Recording: whether it begins again at its end (it does, unless told).
pub const DEVICE_PROPERTY_PLAYBACK_REPEAT: c_int = 101;

/// Depth as the depth camera sees it.
pub const REGISTRATION_OFF: c_int = 0;
/// Depth as the colour camera would see it.
pub const REGISTRATION_DEPTH_TO_COLOUR: c_int = 1;
/// Playback speed: a frame whenever one is waited for.
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

/// A device.
pub type OniDeviceHandle = *mut c_void;
/// A stream of a device.
pub type OniStreamHandle = *mut c_void;
/// A recorder to a file.
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
    /// Pictures a second.
    pub fps: c_int,
}

/// What a sensor can do.
#[repr(C)]
#[derive(Debug)]
pub struct OniSensorInfo {
    /// `SENSOR_*`.
    pub sensor_type: c_int,
    /// Length of `modes`.
    pub mode_count: c_int,
    /// Its modes.
    pub modes: *mut OniVideoMode,
}

/// What a device is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct OniDeviceInfo {
    /// How it is opened.
    pub uri: [c_char; MAX_STR],
    /// Who made it.
    pub vendor: [c_char; MAX_STR],
    /// What it is called.
    pub name: [c_char; MAX_STR],
    /// USB vendor.
    pub usb_vendor: u16,
    /// USB product.
    pub usb_product: u16,
}

/// A part of a sensor's picture.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OniCropping {
    /// Whether only a part comes.
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

/// A picture, in memory of the library.
#[repr(C)]
#[derive(Debug)]
pub struct OniFrame {
    /// Bytes at `data`.
    pub data_size: c_int,
    /// The pixels.
    pub data: *mut c_void,
    /// `SENSOR_*`.
    pub sensor_type: c_int,
    /// µs on the device's clock.
    pub timestamp: u64,
    /// Counts up.
    pub frame_index: c_int,
    /// Columns.
    pub width: c_int,
    /// Rows.
    pub height: c_int,
    /// Of the stream.
    pub mode: OniVideoMode,
    /// Whether it is a part of the sensor's picture.
    pub cropping_enabled: c_int,
    /// First column.
    pub crop_origin_x: c_int,
    /// First row.
    pub crop_origin_y: c_int,
    /// Bytes from one row to the next.
    pub stride: c_int,
}

/// A version of the library.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OniVersion {
    /// 2.
    pub major: c_int,
    /// New with each set of new functions.
    pub minor: c_int,
    /// New with each set of repairs.
    pub maintenance: c_int,
    /// New with each build.
    pub build: c_int,
}

/// Hears of a device.
pub type DeviceCallback = unsafe extern "C" fn(info: *const OniDeviceInfo, cookie: *mut c_void);
/// Hears of a device's new state.
pub type DeviceStateCallback =
    unsafe extern "C" fn(info: *const OniDeviceInfo, state: c_int, cookie: *mut c_void);

/// Who hears of devices.
#[repr(C)]
pub struct OniDeviceCallbacks {
    /// One is there.
    pub connected: DeviceCallback,
    /// One is gone.
    pub disconnected: DeviceCallback,
    /// One is in another state (`DEVICE_STATE_*`).
    pub state_changed: DeviceStateCallback,
}
