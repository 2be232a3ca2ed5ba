//! Library that stands before librealsense2 and replaces one of its functions. `Fault::library`
//! compiles it with `fault` set to the fault.

use core::ffi::{c_int, c_void};

/// Says that every camera is unplugged.
#[cfg(fault = "unplugged")]
#[unsafe(no_mangle)]
pub extern "C" fn rs2_device_hub_is_device_connected(
    _hub: *const c_void,
    _device: *const c_void,
    _error: *mut *mut c_void,
) -> c_int {
    0
}

/// Does not return, as the library with a camera that does not answer.
#[cfg(fault = "hangs")]
#[unsafe(no_mangle)]
pub extern "C" fn rs2_open(
    _sensor: *const c_void,
    _profile: *const c_void,
    _error: *mut *mut c_void,
) {
    loop {
        std::thread::park();
    }
}
