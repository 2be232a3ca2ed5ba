//! Functions of the library for software devices (`rs_internal.h`).

use core::ffi::{c_char, c_double, c_float, c_int, c_void};

use libloading::Library;
use plumb_realsense::RealSense;
use plumb_realsense::sys::{ErrorOut, Handle, RawIntrinsics};

/// Stream of a software sensor.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct VideoStream {
    pub(crate) kind: c_int,
    pub(crate) index: c_int,
    pub(crate) id: c_int,
    pub(crate) width: c_int,
    pub(crate) height: c_int,
    pub(crate) rate: c_int,
    pub(crate) bytes_per_pixel: c_int,
    pub(crate) format: c_int,
    pub(crate) intrinsics: RawIntrinsics,
}

/// Frame of a software sensor.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct VideoFrame {
    pub(crate) pixels: *mut c_void,
    pub(crate) deleter: unsafe extern "C" fn(*mut c_void),
    pub(crate) stride: c_int,
    pub(crate) bytes_per_pixel: c_int,
    /// Milliseconds.
    pub(crate) timestamp: c_double,
    pub(crate) domain: c_int,
    pub(crate) number: c_int,
    pub(crate) profile: Handle,
    pub(crate) depth_units: c_float,
}

/// Rotation (by columns) and translation (metres) from one stream's axes to another's.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Extrinsics {
    pub(crate) rotation: [c_float; 9],
    pub(crate) translation: [c_float; 3],
}

macro_rules! functions {
    ($($field:ident = $symbol:literal: fn($($argument:ty),*) $(-> $answer:ty)?;)*) => {
        /// Functions of the library.
        pub(crate) struct Api {
            $(pub(crate) $field: unsafe extern "C" fn($($argument),*) $(-> $answer)?,)*
            _library: Library,
        }

        impl Api {
            /// Finds every function in `library`.
            fn find(library: Library) -> Result<Self, String> {
                $(
                    // SAFETY: the symbol has this type in the headers of librealsense 2.59.
                    let $field = unsafe {
                        library.get::<unsafe extern "C" fn($($argument),*) $(-> $answer)?>($symbol)
                    };
                    let $field = *$field.map_err(|error| error.to_string())?;
                )*
                Ok(Self { $($field,)* _library: library })
            }
        }
    };
}

functions! {
    create_device = b"rs2_create_software_device\0": fn(ErrorOut) -> Handle;
    delete_device = b"rs2_delete_device\0": fn(Handle);
    register_info = b"rs2_software_device_register_info\0":
        fn(Handle, c_int, *const c_char, ErrorOut);
    add_sensor = b"rs2_software_device_add_sensor\0":
        fn(Handle, *const c_char, ErrorOut) -> Handle;
    add_stream = b"rs2_software_sensor_add_video_stream_ex\0":
        fn(Handle, VideoStream, c_int, ErrorOut) -> Handle;
    add_constant = b"rs2_software_sensor_add_read_only_option\0":
        fn(Handle, c_int, c_float, ErrorOut);
    add_option = b"rs2_software_sensor_add_option\0":
        fn(Handle, c_int, c_float, c_float, c_float, c_float, c_int, ErrorOut);
    register_extrinsics = b"rs2_register_extrinsics\0": fn(Handle, Handle, Extrinsics, ErrorOut);
    plug_in = b"rs2_context_add_software_device\0": fn(Handle, Handle, ErrorOut);
    send = b"rs2_software_sensor_on_video_frame\0": fn(Handle, VideoFrame, ErrorOut);
    delete_sensor = b"rs2_delete_sensor\0": fn(Handle);
    project = b"rs2_project_point_to_pixel\0":
        fn(*mut [c_float; 2], *const RawIntrinsics, *const [c_float; 3]);
    get_option = b"rs2_get_option\0": fn(Handle, c_int, ErrorOut) -> c_float;
}

impl Api {
    /// Finds the functions in the library that `library` loaded.
    pub(crate) fn of(library: &RealSense) -> Result<Self, String> {
        // SAFETY: the library is loaded already, so that no initialiser runs.
        let library = unsafe { Library::new(library.path()) };
        Self::find(library.map_err(|error| error.to_string())?)
    }
}

/// Makes a call, which gets the place of its error.
pub(crate) fn check<T>(what: &str, call: impl FnOnce(ErrorOut) -> T) -> Result<T, String> {
    let mut error = std::ptr::null_mut();
    let answer = call(&raw mut error);
    if error.is_null() { Ok(answer) } else { Err(format!("librealsense2 refuses {what}")) }
}

/// Returns column and row at which the library projects `point` (camera axes, metres).
///
/// # Errors
/// Where the library lacks a function.
pub fn project(
    library: &RealSense,
    intrinsics: &RawIntrinsics,
    point: [f32; 3],
) -> Result<[f32; 2], String> {
    let (api, mut pixel) = (Api::of(library)?, [0.0; 2]);
    // SAFETY: the function reads and writes the variables only, which live through the call.
    unsafe { (api.project)(&raw mut pixel, intrinsics, &raw const point) };
    Ok(pixel)
}
