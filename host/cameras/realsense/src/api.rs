//! Functions of the library, found at run time.

use core::ffi::{c_char, c_double, c_float, c_int, c_longlong, c_uint, c_void};
use std::ffi::CStr;
use std::path::{Path, PathBuf};

use libloading::Library;

use crate::error::RealsenseError;
use crate::sys::{ErrorOut, Handle, ProcessFrame, RawIntrinsics};

/// Declares the table of functions and its loader, each function by its name in the library.
macro_rules! functions {
    ($($field:ident = $symbol:literal: fn($($argument:ty),*) $(-> $answer:ty)?;)*) => {
        /// Functions of the library, which stays loaded: it has threads of its own.
        pub(crate) struct Api {
            pub(crate) path: PathBuf,
            $(pub(crate) $field: unsafe extern "C" fn($($argument),*) $(-> $answer)?,)*
            _library: Library,
        }

        impl Api {
            /// Finds every function in `library`, which was loaded from `path`.
            pub(crate) fn find(library: Library, path: &Path) -> Result<Self, RealsenseError> {
                $(
                    // SAFETY: the symbol has this type in the headers of librealsense 2.50 to
                    // 2.59. The pointer lives no longer than the library.
                    let $field = unsafe {
                        library.get::<unsafe extern "C" fn($($argument),*) $(-> $answer)?>($symbol)
                    };
                    let $field = *$field.map_err(|_| RealsenseError::NotRealsense {
                        path: path.to_owned(),
                        function: String::from_utf8_lossy($symbol).replace('\0', ""),
                    })?;
                )*
                Ok(Self { path: path.to_owned(), $($field,)* _library: library })
            }
        }
    };
}

functions! {
    api_version = b"rs2_get_api_version\0": fn(ErrorOut) -> c_int;
    error_message = b"rs2_get_error_message\0": fn(Handle) -> *const c_char;
    free_error = b"rs2_free_error\0": fn(Handle);
    create_context = b"rs2_create_context\0": fn(c_int, ErrorOut) -> Handle;
    create_hub = b"rs2_create_device_hub\0": fn(Handle, ErrorOut) -> Handle;
    is_connected = b"rs2_device_hub_is_device_connected\0":
        fn(Handle, Handle, ErrorOut) -> c_int;
    query_devices = b"rs2_query_devices\0": fn(Handle, ErrorOut) -> Handle;
    device_count = b"rs2_get_device_count\0": fn(Handle, ErrorOut) -> c_int;
    delete_device_list = b"rs2_delete_device_list\0": fn(Handle);
    create_device = b"rs2_create_device\0": fn(Handle, c_int, ErrorOut) -> Handle;
    delete_device = b"rs2_delete_device\0": fn(Handle);
    device_info = b"rs2_get_device_info\0": fn(Handle, c_int, ErrorOut) -> *const c_char;
    supports_info = b"rs2_supports_device_info\0": fn(Handle, c_int, ErrorOut) -> c_int;
    add_recording = b"rs2_context_add_device\0": fn(Handle, *const c_char, ErrorOut) -> Handle;
    remove_recording = b"rs2_context_remove_device\0": fn(Handle, *const c_char, ErrorOut);
    playback_real_time = b"rs2_playback_device_set_real_time\0": fn(Handle, c_int, ErrorOut);
    playback_pause = b"rs2_playback_device_pause\0": fn(Handle, ErrorOut);
    playback_resume = b"rs2_playback_device_resume\0": fn(Handle, ErrorOut);
    playback_seek = b"rs2_playback_seek\0": fn(Handle, c_longlong, ErrorOut);
    playback_status = b"rs2_playback_device_get_current_status\0":
        fn(Handle, ErrorOut) -> c_int;
    create_recorder = b"rs2_create_record_device\0":
        fn(Handle, *const c_char, ErrorOut) -> Handle;
    query_sensors = b"rs2_query_sensors\0": fn(Handle, ErrorOut) -> Handle;
    sensor_count = b"rs2_get_sensors_count\0": fn(Handle, ErrorOut) -> c_int;
    delete_sensor_list = b"rs2_delete_sensor_list\0": fn(Handle);
    create_sensor = b"rs2_create_sensor\0": fn(Handle, c_int, ErrorOut) -> Handle;
    delete_sensor = b"rs2_delete_sensor\0": fn(Handle);
    profiles = b"rs2_get_stream_profiles\0": fn(Handle, ErrorOut) -> Handle;
    profile_count = b"rs2_get_stream_profiles_count\0": fn(Handle, ErrorOut) -> c_int;
    profile_at = b"rs2_get_stream_profile\0": fn(Handle, c_int, ErrorOut) -> Handle;
    delete_profiles = b"rs2_delete_stream_profiles_list\0": fn(Handle);
    profile_data = b"rs2_get_stream_profile_data\0":
        fn(Handle, *mut c_int, *mut c_int, *mut c_int, *mut c_int, *mut c_int, ErrorOut);
    profile_size = b"rs2_get_video_stream_resolution\0":
        fn(Handle, *mut c_int, *mut c_int, ErrorOut);
    profile_intrinsics = b"rs2_get_video_stream_intrinsics\0":
        fn(Handle, *mut RawIntrinsics, ErrorOut);
    supports_option = b"rs2_supports_option\0": fn(Handle, c_int, ErrorOut) -> c_int;
    get_option = b"rs2_get_option\0": fn(Handle, c_int, ErrorOut) -> c_float;
    set_option = b"rs2_set_option\0": fn(Handle, c_int, c_float, ErrorOut);
    option_range = b"rs2_get_option_range\0": fn(
        Handle, c_int, *mut c_float, *mut c_float, *mut c_float, *mut c_float, ErrorOut);
    open = b"rs2_open_multiple\0": fn(Handle, *mut Handle, c_int, ErrorOut);
    close = b"rs2_close\0": fn(Handle, ErrorOut);
    start_queue = b"rs2_start_queue\0": fn(Handle, Handle, ErrorOut);
    stop = b"rs2_stop\0": fn(Handle, ErrorOut);
    create_queue = b"rs2_create_frame_queue\0": fn(c_int, ErrorOut) -> Handle;
    delete_queue = b"rs2_delete_frame_queue\0": fn(Handle);
    try_wait = b"rs2_try_wait_for_frame\0":
        fn(Handle, c_uint, *mut Handle, ErrorOut) -> c_int;
    release_frame = b"rs2_release_frame\0": fn(Handle);
    frame_profile = b"rs2_get_frame_stream_profile\0": fn(Handle, ErrorOut) -> Handle;
    frame_time = b"rs2_get_frame_timestamp\0": fn(Handle, ErrorOut) -> c_double;
    frame_domain = b"rs2_get_frame_timestamp_domain\0": fn(Handle, ErrorOut) -> c_int;
    frame_width = b"rs2_get_frame_width\0": fn(Handle, ErrorOut) -> c_int;
    frame_height = b"rs2_get_frame_height\0": fn(Handle, ErrorOut) -> c_int;
    frame_stride = b"rs2_get_frame_stride_in_bytes\0": fn(Handle, ErrorOut) -> c_int;
    frame_data = b"rs2_get_frame_data\0": fn(Handle, ErrorOut) -> *const c_void;
    depth_units = b"rs2_depth_frame_get_units\0": fn(Handle, ErrorOut) -> c_float;
    embedded_count = b"rs2_embedded_frames_count\0": fn(Handle, ErrorOut) -> c_int;
    extract_frame = b"rs2_extract_frame\0": fn(Handle, c_int, ErrorOut) -> Handle;
    create_block = b"rs2_create_processing_block_fptr\0":
        fn(ProcessFrame, *mut c_void, ErrorOut) -> Handle;
    create_align = b"rs2_create_align\0": fn(c_int, ErrorOut) -> Handle;
    delete_block = b"rs2_delete_processing_block\0": fn(Handle);
    start_block = b"rs2_start_processing_queue\0": fn(Handle, Handle, ErrorOut);
    process = b"rs2_process_frame\0": fn(Handle, Handle, ErrorOut);
    compose = b"rs2_allocate_composite_frame\0":
        fn(Handle, *mut Handle, c_int, ErrorOut) -> Handle;
    deliver = b"rs2_synthetic_frame_ready\0": fn(Handle, Handle, ErrorOut);
}

impl Api {
    /// Makes a call, which gets the place of its error. Returns its answer, or the error's message.
    pub(crate) fn check<T>(&self, call: impl FnOnce(ErrorOut) -> T) -> Result<T, String> {
        let mut error = std::ptr::null_mut();
        let answer = call(&raw mut error);
        if error.is_null() {
            return Ok(answer);
        }
        // SAFETY: the error lives until it is freed below.
        let message = unsafe { (self.error_message)(error) };
        // SAFETY: the message belongs to the error, which lives.
        let text = unsafe { text(message) };
        // SAFETY: the error is freed once, and not used after this.
        unsafe { (self.free_error)(error) };
        Err(text)
    }
}

/// Returns the string at `pointer`; empty for a null pointer.
///
/// # Safety
/// `pointer` is null or points to a string with a final zero that does not change during this call.
pub(crate) unsafe fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: the caller guarantees it.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().trim().to_owned()
}
