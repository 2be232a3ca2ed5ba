//! Types and constants of librealsense2's C interface (`rs_types.h`, `rs_sensor.h`, `rs_option.h`,
//! `rs_frame.h`), as far as this crate and a software device need them. Handles are opaque.

use core::ffi::{c_float, c_int, c_void};

/// Environment variable with the path of the library, for one that is not where the system keeps
/// its libraries: `librealsense2.so`, or the extension module of the wheel `pyrealsense2`.
pub const LIBRARY_VARIABLE: &str = "PLUMB_REALSENSE2";

/// Handle of any kind: context, device, sensor, profile, frame, queue, processing block.
pub type Handle = *mut c_void;
/// Where a call puts its error: the address of a null handle.
pub type ErrorOut = *mut Handle;

/// Stream of depth pictures.
pub const STREAM_DEPTH: c_int = 1;
/// Stream of colour pictures.
pub const STREAM_COLOUR: c_int = 2;

/// 16-bit depth.
pub const FORMAT_Z16: c_int = 1;
/// 8-bit red, green, blue.
pub const FORMAT_RGB8: c_int = 5;

/// Information about a device: name.
pub const INFO_NAME: c_int = 0;
/// Information about a device: serial number.
pub const INFO_SERIAL_NUMBER: c_int = 1;

/// Option: exposure time; of a colour sensor in units of 100 µs, of a depth sensor in µs.
pub const OPTION_EXPOSURE: c_int = 3;
/// Option: automatic exposure, 0 or 1.
pub const OPTION_AUTO_EXPOSURE: c_int = 10;
/// Option: infrared projector, 0 or 1.
pub const OPTION_EMITTER: c_int = 18;
/// Option: metres in a unit of depth.
pub const OPTION_DEPTH_UNITS: c_int = 28;
/// Option: whether automatic exposure may lower the frame rate, 0 or 1.
pub const OPTION_AUTO_EXPOSURE_PRIORITY: c_int = 30;

/// Clock of a time stamp: the camera's.
pub const DOMAIN_HARDWARE: c_int = 0;

/// State of a playback that ended or has not begun.
pub const PLAYBACK_STOPPED: c_int = 3;

/// Intrinsics of a stream.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RawIntrinsics {
    /// Columns.
    pub width: c_int,
    /// Rows.
    pub height: c_int,
    /// Column of the principal point, pixels from the centre of the leftmost pixel.
    pub ppx: c_float,
    /// Row of the principal point, pixels from the centre of the topmost pixel.
    pub ppy: c_float,
    /// Focal length along the rows, pixels.
    pub fx: c_float,
    /// Focal length along the columns, pixels.
    pub fy: c_float,
    /// Number of the distortion model.
    pub model: c_int,
    /// Coefficients of the model: k1, k2, p1, p2, k3 of those after Brown and Conrady.
    pub coefficients: [c_float; 5],
}

/// Callback of a processing block: a frame, the source of its results, the block's cookie.
pub type ProcessFrame = unsafe extern "C" fn(frame: Handle, source: Handle, cookie: *mut c_void);
