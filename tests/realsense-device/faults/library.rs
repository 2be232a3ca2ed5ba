//! Library that stands in front of librealsense2 and replaces some of its functions.
//! `Fault::library` compiles it with `fault` set to the fault.

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
pub extern "C" fn rs2_open_multiple(
    _sensor: *const c_void,
    _profiles: *const *const c_void,
    _count: c_int,
    _error: *mut *mut c_void,
) {
    loop {
        std::thread::park();
    }
}

/// States the version 3.0.1.
#[cfg(fault = "version")]
#[unsafe(no_mangle)]
pub extern "C" fn rs2_get_api_version(_error: *mut *mut c_void) -> c_int {
    30_001
}

/// A second sensor that does not start, as for want of bandwidth. The process is aborted where the
/// queue of the first one is deleted before the sensor is stopped: the library writes to it.
#[cfg(fault = "second-sensor")]
mod second_sensor {
    use core::ffi::{CStr, c_char, c_void};
    use std::sync::atomic::{AtomicPtr, Ordering};

    type Start = unsafe extern "C" fn(*mut c_void, *mut c_void, *mut *mut c_void);
    type Stop = unsafe extern "C" fn(*mut c_void, *mut *mut c_void);
    type Delete = unsafe extern "C" fn(*mut c_void);

    /// `RTLD_NEXT` of `dlfcn.h`: the libraries behind this one.
    const NEXT: *mut c_void = std::ptr::without_provenance_mut(usize::MAX);

    /// Queue of the sensor that runs; null where none runs.
    static QUEUE: AtomicPtr<c_void> = AtomicPtr::new(std::ptr::null_mut());

    unsafe extern "C" {
        fn dlsym(handle: *mut c_void, symbol: *const c_char) -> *mut c_void;
    }

    /// Returns the function of librealsense2.
    fn real(name: &CStr) -> *mut c_void {
        // SAFETY: the name has a final zero.
        unsafe { dlsym(NEXT, name.as_ptr()) }
    }

    #[unsafe(no_mangle)]
    pub unsafe extern "C" fn rs2_start_queue(
        sensor: *mut c_void,
        queue: *mut c_void,
        error: *mut *mut c_void,
    ) {
        let start: Start = unsafe { std::mem::transmute(real(c"rs2_start_queue")) };
        let is_first = QUEUE.load(Ordering::SeqCst).is_null();
        // The library reports a null pointer as an error.
        let queue = if is_first { queue } else { std::ptr::null_mut() };
        if is_first {
            QUEUE.store(queue, Ordering::SeqCst);
        }
        unsafe { start(sensor, queue, error) };
    }

    #[unsafe(no_mangle)]
    pub unsafe extern "C" fn rs2_stop(sensor: *mut c_void, error: *mut *mut c_void) {
        let stop: Stop = unsafe { std::mem::transmute(real(c"rs2_stop")) };
        unsafe { stop(sensor, error) };
        QUEUE.store(std::ptr::null_mut(), Ordering::SeqCst);
    }

    #[unsafe(no_mangle)]
    pub unsafe extern "C" fn rs2_delete_frame_queue(queue: *mut c_void) {
        if queue == QUEUE.load(Ordering::SeqCst) {
            eprintln!("the queue of a sensor that runs is deleted");
            std::process::abort();
        }
        let delete: Delete = unsafe { std::mem::transmute(real(c"rs2_delete_frame_queue")) };
        unsafe { delete(queue) };
    }
}
