//! Software device with a depth and a colour sensor.

use core::ffi::CStr;
use std::ffi::CString;
use std::sync::atomic::{AtomicI32, Ordering};

use plumb_openni_driver::render::{View, colour, depth};
use plumb_openni_driver::{Control, FOCAL_LENGTH};
use plumb_realsense::RealSense;
use plumb_realsense::sys::{self, Handle, RawIntrinsics};

use crate::api::{Api, Extrinsics, VideoFrame, VideoStream, check};
use crate::pixels::{give_back, lend};

/// Distance of the depth sensor to the left of the colour sensor, metres.
pub const BASELINE: f64 = 0.05;

/// Length of a unit of depth, metres.
pub const UNIT: f64 = 0.001;

/// Size of the pictures.
const VIEW: View = View { width: 640, height: 480, mirrored: false, registered: true };

/// Time stamp of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamp {
    /// Seconds.
    pub time: f64,
    /// Number of the clock, [`sys::DOMAIN_HARDWARE`] for the camera's.
    pub domain: i32,
}

impl Stamp {
    /// Returns a time stamp of the camera's clock, seconds.
    pub fn at(time: f64) -> Self {
        Self { time, domain: sys::DOMAIN_HARDWARE }
    }
}

/// What a software camera has of its own.
#[derive(Debug, Clone, Copy)]
pub struct Model {
    /// Unit of depth that the depth sensor states, metres.
    pub unit: f64,
    /// Distortion of the colour sensor's lens.
    pub coefficients: [f32; 5],
    /// Whether the depth sensor delivers colour too, as that of a D405.
    pub has_one_sensor: bool,
}

impl Default for Model {
    /// Returns a camera without distortion whose depths are in millimetres.
    fn default() -> Self {
        Self { unit: UNIT, coefficients: [0.0; 5], has_one_sensor: false }
    }
}

/// Stream of a software sensor.
struct SoftwareStream {
    sensor: Handle,
    profile: Handle,
    bytes_per_pixel: i32,
}

/// Camera that is plugged into the library's context as long as the process runs.
pub struct SoftwareCamera {
    api: Api,
    device: Handle,
    colour: SoftwareStream,
    depth: SoftwareStream,
    frames: AtomicI32,
}

// SAFETY: librealsense2 locks its objects itself; handles may be used in any thread.
unsafe impl Send for SoftwareCamera {}
// SAFETY: as above.
unsafe impl Sync for SoftwareCamera {}

impl SoftwareCamera {
    /// Plugs in a camera with the serial number `serial`.
    ///
    /// # Errors
    /// Where the library refuses a part.
    pub fn plug_in(library: &RealSense, serial: &str, model: Model) -> Result<Self, String> {
        let api = Api::of(library)?;
        // SAFETY: the call has no arguments but the place of its error.
        let device = check("a device", |error| unsafe { (api.create_device)(error) })?;
        register(&api, device, sys::INFO_NAME, "Plumb software camera")?;
        register(&api, device, sys::INFO_SERIAL_NUMBER, serial)?;
        let stereo = add_sensor(&api, device, c"Stereo Module")?;
        let rgb = match model.has_one_sensor {
            true => stereo,
            false => add_sensor(&api, device, c"RGB Camera")?,
        };
        let depth = add_stream(&api, stereo, &depth_stream())?;
        let colour = add_stream(&api, rgb, &colour_stream(model.coefficients))?;
        let options = [
            (colour.sensor, sys::OPTION_EXPOSURE, 10_000.0),
            (colour.sensor, sys::OPTION_AUTO_EXPOSURE, 1.0),
            (depth.sensor, sys::OPTION_EMITTER, 1.0),
        ];
        for (sensor, option, most) in options {
            // SAFETY: the sensor lives.
            check("an option", |error| unsafe {
                (api.add_option)(sensor, option, 0.0, most, 1.0, 1.0, 1, error)
            })?;
        }
        let units = sys::OPTION_DEPTH_UNITS;
        // SAFETY: the sensor lives.
        check("a unit of depth", |error| unsafe {
            (api.add_constant)(depth.sensor, units, model.unit as f32, error)
        })?;
        let rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let pose = Extrinsics { rotation, translation: [-BASELINE as f32, 0.0, 0.0] };
        // SAFETY: both streams live.
        check("the extrinsics", |error| unsafe {
            (api.register_extrinsics)(depth.profile, colour.profile, pose, error)
        })?;
        let context = library.context();
        // SAFETY: the context and the device live.
        check("the device", |error| unsafe { (api.plug_in)(context, device, error) })?;
        Ok(Self { api, device, colour, depth, frames: AtomicI32::new(0) })
    }

    /// Sends the colour picture of a scene.
    ///
    /// # Errors
    /// Where the library refuses it.
    pub fn send_colour(&self, scene: &Control, stamp: Stamp) -> Result<(), String> {
        let mut pixels = vec![0; 3 * VIEW.width * VIEW.height];
        colour(scene, &VIEW, &mut pixels);
        self.send(&self.colour, pixels, stamp, 0.0)
    }

    /// Sends the depth picture of a scene, whose unit of depth is said to be `unit` metres.
    ///
    /// # Errors
    /// Where the library refuses it.
    pub fn send_depth(&self, scene: &Control, stamp: Stamp, unit: f64) -> Result<(), String> {
        let mut pixels = vec![0; 2 * VIEW.width * VIEW.height];
        let ball = scene.ball.map(|[x, y, z]| [x + BASELINE, y, z]);
        depth(&Control { ball, ..*scene }, &VIEW, &mut pixels);
        self.send(&self.depth, pixels, stamp, unit)
    }

    /// Returns the exposure of the sensor of colour (units of 0.1 ms, of a camera with one sensor
    /// 1 µs), and whether the projector is on.
    ///
    /// # Errors
    /// Where the library does not tell them.
    pub fn options(&self) -> Result<(f32, bool), String> {
        let get = |sensor: Handle, option| {
            // SAFETY: the sensor lives.
            check("an option", |error| unsafe { (self.api.get_option)(sensor, option, error) })
        };
        let exposure = get(self.colour.sensor, sys::OPTION_EXPOSURE)?;
        Ok((exposure, get(self.depth.sensor, sys::OPTION_EMITTER)? != 0.0))
    }

    fn send(
        &self,
        stream: &SoftwareStream,
        pixels: Vec<u8>,
        stamp: Stamp,
        unit: f64,
    ) -> Result<(), String> {
        let frame = VideoFrame {
            pixels: lend(pixels),
            deleter: give_back,
            stride: stream.bytes_per_pixel * VIEW.width as i32,
            bytes_per_pixel: stream.bytes_per_pixel,
            timestamp: stamp.time * 1e3,
            domain: stamp.domain,
            number: self.frames.fetch_add(1, Ordering::Relaxed),
            profile: stream.profile,
            depth_units: unit as f32,
        };
        // SAFETY: the sensor and its stream live; the pixels live until they are given back.
        check("a frame", |error| unsafe { (self.api.send)(stream.sensor, frame, error) })
    }
}

impl Drop for SoftwareCamera {
    fn drop(&mut self) {
        let (depth, colour) = (self.depth.sensor, self.colour.sensor);
        for sensor in std::iter::once(depth).chain((colour != depth).then_some(colour)) {
            // SAFETY: the sensor is deleted once, and not used after this.
            unsafe { (self.api.delete_sensor)(sensor) };
        }
        // SAFETY: as above.
        unsafe { (self.api.delete_device)(self.device) };
    }
}

/// States information about the device.
fn register(api: &Api, device: Handle, kind: i32, text: &str) -> Result<(), String> {
    let text = CString::new(text).map_err(|error| error.to_string())?;
    // SAFETY: the device lives, and copies the text.
    check("information", |error| unsafe { (api.register_info)(device, kind, text.as_ptr(), error) })
}

/// Adds a sensor.
fn add_sensor(api: &Api, device: Handle, name: &CStr) -> Result<Handle, String> {
    // SAFETY: the device lives, and copies the name.
    check("a sensor", |error| unsafe { (api.add_sensor)(device, name.as_ptr(), error) })
}

/// Adds a stream to a sensor.
fn add_stream(api: &Api, sensor: Handle, stream: &VideoStream) -> Result<SoftwareStream, String> {
    // SAFETY: the sensor lives.
    let profile =
        check("a stream", |error| unsafe { (api.add_stream)(sensor, *stream, 1, error) })?;
    Ok(SoftwareStream { sensor, profile, bytes_per_pixel: stream.bytes_per_pixel })
}

/// Returns the intrinsics of both sensors, the pictures of which `plumb-openni-driver` renders.
fn intrinsics(model: i32, coefficients: [f32; 5]) -> RawIntrinsics {
    let (width, height) = (VIEW.width as i32, VIEW.height as i32);
    let focal = FOCAL_LENGTH as f32;
    RawIntrinsics {
        width,
        height,
        ppx: (VIEW.width as f32 - 1.0) / 2.0,
        ppy: (VIEW.height as f32 - 1.0) / 2.0,
        fx: focal,
        fy: focal,
        model,
        coefficients,
    }
}

/// Returns the colour stream, with an inverse Brown-Conrady model as a D435 has it.
fn colour_stream(coefficients: [f32; 5]) -> VideoStream {
    VideoStream {
        kind: sys::STREAM_COLOUR,
        index: 0,
        id: 2,
        width: VIEW.width as i32,
        height: VIEW.height as i32,
        rate: 30,
        bytes_per_pixel: 3,
        format: sys::FORMAT_RGB8,
        intrinsics: intrinsics(2, coefficients),
    }
}

/// Returns the depth stream, which is rectified.
fn depth_stream() -> VideoStream {
    VideoStream {
        kind: sys::STREAM_DEPTH,
        id: 1,
        bytes_per_pixel: 2,
        format: sys::FORMAT_Z16,
        intrinsics: intrinsics(4, [0.0; 5]),
        ..colour_stream([0.0; 5])
    }
}
