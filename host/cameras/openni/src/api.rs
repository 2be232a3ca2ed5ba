//! Functions of the library, found at run time.

use core::ffi::{c_char, c_int, c_void};
use std::path::{Path, PathBuf};

use libloading::Library;

use crate::error::OpenniError;
use crate::sys::*;

/// Declares the table of functions and its loader, each function by its name in the library.
macro_rules! functions {
    ($($field:ident = $symbol:literal: fn($($argument:ty),*) $(-> $answer:ty)?;)*) => {
        /// Functions of the library. It stays loaded, because its drivers have threads of their
        /// own.
        pub(crate) struct Api {
            pub(crate) path: PathBuf,
            $(pub(crate) $field: unsafe extern "C" fn($($argument),*) $(-> $answer)?,)*
            _library: Library,
        }

        impl Api {
            /// Finds every function in `library`, which was loaded from `path`.
            fn find(library: Library, path: &Path) -> Result<Self, OpenniError> {
                $(
                    // SAFETY: the symbol has this type in OpenNI 2.2 (OniCAPI.h), whose ABI is
                    // unchanged since 2013. The pointer lives no longer than the library.
                    let $field = unsafe {
                        library.get::<unsafe extern "C" fn($($argument),*) $(-> $answer)?>($symbol)
                    };
                    let $field = *$field.map_err(|error| OpenniError::NotOpenni {
                        path: path.to_owned(),
                        error: error.to_string(),
                    })?;
                )*
                Ok(Self { path: path.to_owned(), $($field,)* _library: library })
            }
        }
    };
}

functions! {
    initialize = b"oniInitialize\0": fn(c_int) -> OniStatus;
    version = b"oniGetVersion\0": fn() -> OniVersion;
    extended_error = b"oniGetExtendedError\0": fn() -> *const c_char;
    device_list = b"oniGetDeviceList\0": fn(*mut *mut OniDeviceInfo, *mut c_int) -> OniStatus;
    release_device_list = b"oniReleaseDeviceList\0": fn(*mut OniDeviceInfo) -> OniStatus;
    register_callbacks = b"oniRegisterDeviceCallbacks\0":
        fn(*mut OniDeviceCallbacks, *mut c_void, *mut *mut c_void) -> OniStatus;
    device_open = b"oniDeviceOpen\0": fn(*const c_char, *mut OniDeviceHandle) -> OniStatus;
    device_close = b"oniDeviceClose\0": fn(OniDeviceHandle) -> OniStatus;
    device_info = b"oniDeviceGetInfo\0": fn(OniDeviceHandle, *mut OniDeviceInfo) -> OniStatus;
    sensor_info = b"oniDeviceGetSensorInfo\0": fn(OniDeviceHandle, c_int) -> *const OniSensorInfo;
    create_stream = b"oniDeviceCreateStream\0":
        fn(OniDeviceHandle, c_int, *mut OniStreamHandle) -> OniStatus;
    registration_supported = b"oniDeviceIsImageRegistrationModeSupported\0":
        fn(OniDeviceHandle, c_int) -> c_int;
    enable_sync = b"oniDeviceEnableDepthColorSync\0": fn(OniDeviceHandle) -> OniStatus;
    disable_sync = b"oniDeviceDisableDepthColorSync\0": fn(OniDeviceHandle);
    device_set = b"oniDeviceSetProperty\0":
        fn(OniDeviceHandle, c_int, *const c_void, c_int) -> OniStatus;
    device_get = b"oniDeviceGetProperty\0":
        fn(OniDeviceHandle, c_int, *mut c_void, *mut c_int) -> OniStatus;
    stream_set = b"oniStreamSetProperty\0":
        fn(OniStreamHandle, c_int, *const c_void, c_int) -> OniStatus;
    stream_get = b"oniStreamGetProperty\0":
        fn(OniStreamHandle, c_int, *mut c_void, *mut c_int) -> OniStatus;
    stream_start = b"oniStreamStart\0": fn(OniStreamHandle) -> OniStatus;
    stream_stop = b"oniStreamStop\0": fn(OniStreamHandle);
    stream_destroy = b"oniStreamDestroy\0": fn(OniStreamHandle);
    wait = b"oniWaitForAnyStream\0":
        fn(*mut OniStreamHandle, c_int, *mut c_int, c_int) -> OniStatus;
    read_frame = b"oniStreamReadFrame\0": fn(OniStreamHandle, *mut *mut OniFrame) -> OniStatus;
    release_frame = b"oniFrameRelease\0": fn(*mut OniFrame);
    create_recorder = b"oniCreateRecorder\0":
        fn(*const c_char, *mut OniRecorderHandle) -> OniStatus;
    recorder_attach = b"oniRecorderAttachStream\0":
        fn(OniRecorderHandle, OniStreamHandle, c_int) -> OniStatus;
    recorder_start = b"oniRecorderStart\0": fn(OniRecorderHandle) -> OniStatus;
    recorder_stop = b"oniRecorderStop\0": fn(OniRecorderHandle);
    recorder_destroy = b"oniRecorderDestroy\0": fn(*mut OniRecorderHandle) -> OniStatus;
}

impl Api {
    /// Loads the library at `path`; a file name alone is searched among the system's libraries.
    pub(crate) fn load(path: &Path) -> Result<Self, OpenniError> {
        // SAFETY: loading runs the library's initialisers, as linking would. Those of OpenNI2 are
        // C++ statics that start nothing. The user guarantees that the file is OpenNI2, as with
        // every plug-in.
        let library = unsafe { Library::new(path) };
        let library = library.map_err(|error| OpenniError::NoLibrary {
            path: path.to_owned(),
            error: error.to_string(),
        })?;
        Self::find(library, path)
    }
}
