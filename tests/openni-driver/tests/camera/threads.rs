//! Threads that have called the library, and end.

use std::thread;

use plumb_openni::{OpenNi, Settings};
use plumb_openni_driver::Control;

use crate::fixture::{TestCamera, next, openni};

/// Runs `f` on a thread with a stack of `kilobytes`, to the thread's end.
fn on_thread(kilobytes: usize, f: impl FnOnce() + Send) {
    thread::scope(|scope| {
        let thread = thread::Builder::new().stack_size(kilobytes << 10);
        thread.spawn_scoped(scope, f).unwrap();
    });
}

/// Lists the cameras on a thread with a stack of `kilobytes`, and ends it. The C library keeps the
/// stacks of ended threads up to 40 MiB: a larger one makes it return the memory of all of them.
fn list_and_end(openni: &OpenNi, kilobytes: usize) {
    on_thread(kilobytes, || drop(openni.devices().unwrap()));
    on_thread(64 << 10, || {});
}

/// The library keeps the number of each thread that called it. At the call of a new one it asks the
/// system whether those threads exist; where the memory of an ended one was returned, that is a
/// crash. Each thread here needs more memory than the one before it has left free, so that it is a
/// new one to the library.
#[test]
fn calls_work_after_the_threads_of_earlier_calls_have_ended() {
    let Some(openni) = openni() else { return };
    list_and_end(openni, 256);
    let device = TestCamera::new(&Control::default());
    let mut camera = device.open(Settings::default()).unwrap();
    next(&mut camera);
    camera.close().unwrap();
    for kilobytes in [4096, 6144, 8192] {
        list_and_end(openni, kilobytes);
    }
}
