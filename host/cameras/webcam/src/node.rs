//! Video device as V4L2 has it: what the driver of webcams asks of the kernel.

use std::io;
use std::time::Duration;

use plumb_frame::image::ImageSize;

use crate::settings::PixelFormat;

/// Video device that is open. Errors are those of the kernel's calls.
pub(crate) trait Node: Send {
    /// Sets format and size (VIDIOC_S_FMT). Returns those that the device takes in their place.
    fn set_format(&mut self, format: PixelFormat, size: ImageSize) -> io::Result<Format>;

    /// Sets the rate, pictures/s (VIDIOC_S_PARM). Returns that of the device; 0 where it states
    /// none.
    fn set_rate(&mut self, rate: u16) -> io::Result<f64>;

    /// Returns the value of a control (VIDIOC_G_CTRL): EINVAL where the device does not have it.
    fn control(&self, id: u32) -> io::Result<i32>;

    /// Sets a control (VIDIOC_S_CTRL).
    fn set_control(&self, id: u32, value: i32) -> io::Result<()>;

    /// Starts to fill buffers (VIDIOC_STREAMON).
    fn start(&mut self) -> io::Result<()>;

    /// Waits for a filled buffer for `limit` at most, copies it to `bytes` and gives it back.
    fn next_buffer(&mut self, limit: Duration, bytes: &mut Vec<u8>) -> io::Result<Filled>;
}

/// Format of a device's pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Format {
    /// Pixel format; `None` where it is none that is read.
    pub(crate) pixels: Option<PixelFormat>,
    /// Size.
    pub(crate) size: ImageSize,
    /// Bytes from one row to the next, of formats with rows.
    pub(crate) stride: usize,
}

/// Filled buffer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Filled {
    /// Time stamp, seconds; `None` where the driver states none.
    pub(crate) stamp: Option<f64>,
    /// Time since the time stamp, seconds, where the stamp is on the clock CLOCK_MONOTONIC.
    pub(crate) age: Option<f64>,
    /// Whether the driver says that data is missing (V4L2_BUF_FLAG_ERROR).
    pub(crate) is_damaged: bool,
}
