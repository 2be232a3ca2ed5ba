//! The camera and its streams.

use core::ffi::{c_char, c_int, c_void};
use std::fs::File;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_openni::sys::*;

use crate::control::{self, Control};
use crate::render::{self, View};

/// Services of the library for a stream (`OniStreamServices`).
#[repr(C)]
pub(crate) struct StreamServices {
    cookie: *mut c_void,
    default_size: unsafe extern "C" fn(*mut c_void) -> c_int,
    acquire: unsafe extern "C" fn(*mut c_void) -> *mut OniFrame,
    add_reference: unsafe extern "C" fn(*mut c_void, *mut OniFrame),
    release: unsafe extern "C" fn(*mut c_void, *mut OniFrame),
}

/// Callback for a new frame of a stream.
pub(crate) type FrameCallback =
    unsafe extern "C" fn(stream: *mut c_void, frame: *mut OniFrame, cookie: *mut c_void);

/// Callbacks of the library.
#[derive(Clone, Copy)]
pub(crate) struct Library {
    pub(crate) connected: DeviceCallback,
    pub(crate) disconnected: DeviceCallback,
    pub(crate) cookie: *mut c_void,
}

// SAFETY: the pointers are the library's, which accepts calls from any thread of a driver.
unsafe impl Send for Library {}

/// Modes of both sensors.
const MODES: [(c_int, c_int); 2] = [(320, 240), (640, 480)];

fn mode(sensor: c_int, (resolution_x, resolution_y): (c_int, c_int)) -> OniVideoMode {
    let pixel_format = if sensor == SENSOR_DEPTH { FORMAT_DEPTH_1_MM } else { FORMAT_RGB888 };
    OniVideoMode { pixel_format, resolution_x, resolution_y, fps: 30 }
}

/// A stream. Its address is the library's handle.
pub(crate) struct Stream {
    sensor: c_int,
    services: *const StreamServices,
    callback: Option<FrameCallback>,
    cookie: *mut c_void,
    started: bool,
    mode: OniVideoMode,
    mirrored: bool,
    device: Arc<Shared>,
}

/// Streams of a camera. Each lives until the library destroys it, which waits for this lock.
#[derive(Default)]
struct Streams(Vec<*mut Stream>);

// SAFETY: every access is under the mutex that contains this.
unsafe impl Send for Streams {}

/// State that the camera's thread shares with the library's.
struct Shared {
    streams: Mutex<Streams>,
    registration: AtomicI32,
    closed: AtomicBool,
    file: File,
}

/// A camera.
pub(crate) struct Device {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    infos: [OniSensorInfo; 2],
    /// Modes of both sensors; `infos` points to them.
    _modes: Box<[[OniVideoMode; 2]; 2]>,
}

/// Returns the description of the camera with `uri`.
pub(crate) fn describe(uri: &str) -> OniDeviceInfo {
    let field = |text: &str| {
        let mut field = [0 as c_char; MAX_STR];
        for (to, from) in field[..MAX_STR - 1].iter_mut().zip(text.bytes()) {
            *to = c_char::from_ne_bytes([from]);
        }
        field
    };
    OniDeviceInfo {
        uri: field(uri),
        vendor: field("Plumb"),
        name: field("test camera"),
        usb_vendor: 0x1d27,
        usb_product: 0x0609,
    }
}

fn lock(streams: &Mutex<Streams>) -> MutexGuard<'_, Streams> {
    streams.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Device {
    /// Opens the camera of `uri`, with the control file at `path`.
    pub(crate) fn open(uri: &str, path: &str, library: Option<Library>) -> Option<Self> {
        let file = File::open(path).ok()?;
        let control = control::read(&file)?;
        std::thread::sleep(Duration::try_from_secs_f64(control.slow).unwrap_or_default());
        let shared = Arc::new(Shared {
            streams: Mutex::default(),
            registration: AtomicI32::new(REGISTRATION_OFF),
            closed: AtomicBool::new(false),
            file,
        });
        let mut modes =
            Box::new([SENSOR_DEPTH, SENSOR_COLOUR].map(|sensor| MODES.map(|m| mode(sensor, m))));
        let [depth, colour] = modes.each_mut().map(|modes| modes.as_mut_ptr());
        let info = |sensor_type, modes| OniSensorInfo { sensor_type, mode_count: 2, modes };
        let infos = [info(SENSOR_DEPTH, depth), info(SENSOR_COLOUR, colour)];
        let (in_thread, uri) = (Arc::clone(&shared), uri.to_owned());
        let thread = std::thread::spawn(move || in_thread.run(&uri, library));
        Some(Self { shared, thread: Some(thread), infos, _modes: modes })
    }

    pub(crate) fn infos(&mut self) -> &mut [OniSensorInfo; 2] {
        &mut self.infos
    }

    pub(crate) fn create_stream(&self, sensor: c_int) -> *mut Stream {
        let stream = Box::into_raw(Box::new(Stream {
            sensor,
            services: std::ptr::null(),
            callback: None,
            cookie: std::ptr::null_mut(),
            started: false,
            mode: mode(sensor, MODES[0]),
            mirrored: true,
            device: Arc::clone(&self.shared),
        }));
        lock(&self.shared.streams).0.push(stream);
        stream
    }

    /// # Safety
    /// `stream` belongs to this camera and is not used after this.
    pub(crate) unsafe fn destroy_stream(&self, stream: *mut Stream) {
        lock(&self.shared.streams).0.retain(|&other| other != stream);
        // SAFETY: the stream is from `create_stream`, and was removed from the list of the thread.
        drop(unsafe { Box::from_raw(stream) });
    }

    pub(crate) fn registration(&self) -> c_int {
        self.shared.registration.load(Ordering::Relaxed)
    }

    pub(crate) fn set_registration(&self, value: c_int) {
        self.shared.registration.store(value, Ordering::Relaxed);
    }

    pub(crate) fn control(&self) -> Control {
        self.shared.control()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.shared.closed.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was printed.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn control(&self) -> Control {
        control::read(&self.file).unwrap_or_default()
    }

    /// Captures frames until the camera is closed.
    fn run(&self, uri: &str, library: Option<Library>) {
        let begin = Instant::now();
        let (mut next, mut index, mut plugged) = (begin, 0, true);
        while !self.closed.load(Ordering::Relaxed) {
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
            let Some(control) = control::read(&self.file) else { continue };
            next = Instant::now()
                + Duration::try_from_secs_f64(1.0 / control.rate).unwrap_or_default();
            if control.plugged != plugged
                && let Some(library) = library
            {
                plugged = control.plugged;
                let (info, tell) =
                    (describe(uri), if plugged { library.connected } else { library.disconnected });
                // SAFETY: the library supplied this callback and cookie for this purpose; the
                // description lives until the call returns.
                unsafe { tell(&raw const info, library.cookie) };
            }
            if plugged && !control.silent {
                index += 1;
                self.take(&control, index, begin.elapsed());
            }
        }
    }

    /// Captures a depth and a colour frame.
    fn take(&self, control: &Control, index: c_int, time: Duration) {
        let registered = self.registration.load(Ordering::Relaxed) == REGISTRATION_DEPTH_TO_COLOUR;
        for &stream in &lock(&self.streams).0 {
            // SAFETY: streams in the list are alive, and the library changes them only before they
            // are started.
            let stream = unsafe { &*stream };
            if stream.sensor != SENSOR_DEPTH || !control.blind {
                stream.give(control, registered, index, time);
            }
        }
    }
}

impl Stream {
    pub(crate) fn control(&self) -> Control {
        self.device.control()
    }

    pub(crate) fn set_services(&mut self, services: *const StreamServices) {
        self.services = services;
    }

    pub(crate) fn set_callback(&mut self, callback: Option<FrameCallback>, cookie: *mut c_void) {
        (self.callback, self.cookie) = (callback, cookie);
    }

    pub(crate) fn set_started(&mut self, started: bool) {
        self.started = started;
    }

    /// Sets mirroring and returns whether it was accepted. With a fault it has no effect.
    pub(crate) fn set_mirrored(&mut self, mirrored: bool) -> bool {
        if !self.control().keeps_mirroring {
            self.mirrored = mirrored;
        }
        true
    }

    pub(crate) fn mirrored(&self) -> bool {
        self.mirrored
    }

    pub(crate) fn sensor(&self) -> c_int {
        self.sensor
    }

    pub(crate) fn mode(&self) -> OniVideoMode {
        self.mode
    }

    /// Sets the mode and returns whether it was accepted. With a fault it has no effect.
    pub(crate) fn set_mode(&mut self, wanted: OniVideoMode) -> bool {
        let can = MODES.iter().any(|&m| mode(self.sensor, m) == wanted);
        if can && !self.control().keeps_mode {
            self.mode = wanted;
        }
        can
    }

    fn pixel_bytes(&self) -> c_int {
        if self.sensor == SENSOR_DEPTH { 2 } else { 3 }
    }

    /// Returns the size of a frame, bytes.
    pub(crate) fn bytes(&self) -> c_int {
        self.mode.resolution_x * self.mode.resolution_y * self.pixel_bytes()
    }

    /// Renders a frame and passes it to the library.
    fn give(&self, control: &Control, registered: bool, index: c_int, time: Duration) {
        let (true, Some(callback), false) = (self.started, self.callback, self.services.is_null())
        else {
            return;
        };
        // SAFETY: the library's services live as long as the stream.
        let services = unsafe { &*self.services };
        // SAFETY: the library returns a frame with room for `bytes()`, or null.
        let frame = unsafe { (services.acquire)(services.cookie) };
        // SAFETY: this function owns the frame until it is passed on.
        let Some(filled) = (unsafe { frame.as_mut() }) else { return };
        let late = if self.sensor == SENSOR_DEPTH { control.depth_late } else { 0.0 };
        filled.timestamp = time.as_micros() as u64 + (late * 1e6) as u64;
        filled.frame_index = index;
        self.fill(filled, control, registered);
        // SAFETY: the library supplied the callback and its cookie for this stream.
        unsafe { callback(std::ptr::from_ref(self).cast_mut().cast(), frame, self.cookie) };
        // SAFETY: the reference from `acquire` is released once.
        unsafe { (services.release)(services.cookie, frame) };
    }

    fn fill(&self, frame: &mut OniFrame, control: &Control, registered: bool) {
        let missing =
            if self.sensor == SENSOR_COLOUR { c_int::from(control.rows_missing) } else { 0 };
        let (width, height) = (self.mode.resolution_x, self.mode.resolution_y - missing);
        frame.data_size = width * height * self.pixel_bytes();
        frame.sensor_type = self.sensor;
        (frame.width, frame.height, frame.mode) = (width, height, self.mode);
        (frame.cropping_enabled, frame.crop_origin_x, frame.crop_origin_y) = (0, 0, 0);
        frame.stride = width * self.pixel_bytes();
        let (width, height) = (width as usize, height as usize);
        let view = View { width, height, mirrored: self.mirrored, registered };
        let length = frame.data_size as usize;
        // SAFETY: the frame has room for `bytes()`, and `length` is at most that.
        let pixels = unsafe { std::slice::from_raw_parts_mut(frame.data.cast::<u8>(), length) };
        if self.sensor == SENSOR_DEPTH {
            render::depth(control, &view, pixels);
        } else {
            render::colour(control, &view, pixels);
        }
    }
}
