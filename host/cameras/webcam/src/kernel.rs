//! The kernel's V4L2 (linux/videodev2.h), and the only `unsafe` code of this crate.
//!
//! No released crate fits: `v4l` panics where a device answers unexpectedly, and takes 30 s of
//! processor time to build; `linuxvideo` hides the time stamps of the buffers.

#![allow(unsafe_code, reason = "system calls")]

use std::ffi::c_void;
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind};
use std::num::NonZeroUsize;
use std::os::fd::{AsFd, AsRawFd};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::ptr::NonNull;
use std::time::Duration;

use nix::errno::Errno;
use nix::libc::{O_NONBLOCK, c_int, c_long};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::mman::{MapFlags, ProtFlags, mmap, munmap};
use nix::time::{ClockId, clock_gettime};
use plumb_frame::image::ImageSize;

use crate::node::{Filled, Format, Node};
use crate::settings::PixelFormat;

/// V4L2_BUF_TYPE_VIDEO_CAPTURE.
const VIDEO_CAPTURE: u32 = 1;
/// V4L2_MEMORY_MMAP.
const MMAP: u32 = 1;
/// V4L2_FIELD_NONE: whole pictures.
const WHOLE: u32 = 1;
/// V4L2_CAP_VIDEO_CAPTURE and V4L2_CAP_STREAMING.
const CAPTURE: u32 = 0x0400_0001;
/// V4L2_BUF_FLAG_ERROR.
const ERROR: u32 = 0x40;
/// V4L2_BUF_FLAG_TIMESTAMP_MASK and V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC.
const CLOCK_MASK: u32 = 0xe000;
const MONOTONIC: u32 = 0x2000;
/// Buffers of the driver. It fills one while another waits.
const BUFFERS: u32 = 4;

/// struct v4l2_capability.
#[repr(C)]
#[derive(Default)]
struct Capability {
    names: [[u8; 16]; 5],
    version: u32,
    capabilities: u32,
    device_caps: u32,
    reserved: [u32; 3],
}

/// struct v4l2_format with a struct v4l2_pix_format.
#[repr(C)]
#[derive(Default)]
struct PictureFormat {
    kind: u32,
    /// The union has pointers, too.
    align: [usize; 0],
    width: u32,
    height: u32,
    pixels: [u8; 4],
    field: u32,
    bytes_per_line: u32,
    size_image: u32,
    rest: [[u32; 22]; 2],
}

/// struct v4l2_streamparm with a struct v4l2_captureparm.
#[repr(C)]
#[derive(Default)]
struct StreamParameters {
    kind: u32,
    capability: u32,
    mode: u32,
    /// Time of a picture, seconds.
    numerator: u32,
    denominator: u32,
    rest: [[u32; 23]; 2],
}

/// struct v4l2_requestbuffers.
#[repr(C)]
#[derive(Default)]
struct RequestBuffers {
    count: u32,
    kind: u32,
    memory: u32,
    reserved: [u32; 2],
}

/// struct v4l2_buffer.
#[repr(C)]
#[derive(Default)]
struct Buffer {
    index: u32,
    kind: u32,
    bytes_used: u32,
    flags: u32,
    field: u32,
    /// Seconds and microseconds.
    timestamp: [c_long; 2],
    timecode: [u32; 4],
    sequence: u32,
    memory: u32,
    /// The union has pointers, too.
    align: [usize; 0],
    offset: u32,
    align_end: [usize; 0],
    length: u32,
    reserved: [u32; 2],
}

/// struct v4l2_control.
#[repr(C)]
struct Control {
    id: u32,
    value: i32,
}

nix::ioctl_read!(querycap, b'V', 0, Capability);
nix::ioctl_readwrite!(s_fmt, b'V', 5, PictureFormat);
nix::ioctl_readwrite!(reqbufs, b'V', 8, RequestBuffers);
nix::ioctl_readwrite!(querybuf, b'V', 9, Buffer);
nix::ioctl_readwrite!(qbuf, b'V', 15, Buffer);
nix::ioctl_readwrite!(dqbuf, b'V', 17, Buffer);
nix::ioctl_write_ptr!(streamon, b'V', 18, c_int);
nix::ioctl_readwrite!(s_parm, b'V', 22, StreamParameters);
nix::ioctl_readwrite!(g_ctrl, b'V', 27, Control);
nix::ioctl_readwrite!(s_ctrl, b'V', 28, Control);

/// One of the requests above.
type Request<T> = unsafe fn(c_int, *mut T) -> nix::Result<c_int>;

/// Video device of the kernel.
pub(crate) struct KernelNode {
    buffers: Vec<Mapping>,
    file: File,
}

impl KernelNode {
    /// Opens the device at `path`.
    ///
    /// # Errors
    /// ENOTTY where it is no video device that delivers pictures.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).custom_flags(O_NONBLOCK).open(path)?;
        let node = Self { buffers: Vec::new(), file };
        let mut found = Capability::default();
        node.call(querycap, &mut found)?;
        if found.device_caps & CAPTURE == CAPTURE { Ok(node) } else { Err(Errno::ENOTTY.into()) }
    }

    fn call<T>(&self, request: Request<T>, value: &mut T) -> io::Result<()> {
        // SAFETY: the kernel reads and writes a `T`, whose layout the tests compare with the
        // request's number. It keeps no pointer.
        unsafe { request(self.file.as_raw_fd(), value) }?;
        Ok(())
    }

    /// Gives the driver a buffer to fill.
    fn queue(&self, index: u32) -> io::Result<()> {
        self.call(qbuf, &mut Buffer::new(index))
    }
}

impl Buffer {
    fn new(index: u32) -> Self {
        Self { index, kind: VIDEO_CAPTURE, memory: MMAP, ..Self::default() }
    }
}

impl Node for KernelNode {
    fn set_format(&mut self, format: PixelFormat, size: ImageSize) -> io::Result<Format> {
        let [width, height] = [size.width as u32, size.height as u32];
        let rest = PictureFormat { kind: VIDEO_CAPTURE, field: WHOLE, ..PictureFormat::default() };
        let pixels = format.code();
        let mut found = PictureFormat { width, height, pixels, ..rest };
        self.call(s_fmt, &mut found)?;
        let size = ImageSize { width: found.width as usize, height: found.height as usize };
        let pixels = PixelFormat::of_code(found.pixels);
        Ok(Format { pixels, size, stride: found.bytes_per_line as usize })
    }

    fn set_rate(&mut self, rate: u16) -> io::Result<f64> {
        let (kind, numerator, denominator) = (VIDEO_CAPTURE, 1, rate.into());
        let rest = StreamParameters::default();
        let mut found = StreamParameters { kind, numerator, denominator, ..rest };
        self.call(s_parm, &mut found)?;
        let rate = f64::from(found.denominator) / f64::from(found.numerator);
        Ok(if rate.is_finite() { rate } else { 0.0 })
    }

    fn control(&self, id: u32) -> io::Result<i32> {
        let mut control = Control { id, value: 0 };
        self.call(g_ctrl, &mut control)?;
        Ok(control.value)
    }

    fn set_control(&self, id: u32, value: i32) -> io::Result<()> {
        self.call(s_ctrl, &mut Control { id, value })
    }

    fn start(&mut self) -> io::Result<()> {
        let (kind, memory) = (VIDEO_CAPTURE, MMAP);
        let mut asked = RequestBuffers { count: BUFFERS, kind, memory, reserved: [0; 2] };
        self.call(reqbufs, &mut asked)?;
        for index in 0..asked.count {
            let mut buffer = Buffer::new(index);
            self.call(querybuf, &mut buffer)?;
            self.buffers.push(Mapping::new(&self.file, buffer.offset, buffer.length)?);
            self.queue(index)?;
        }
        // SAFETY: the kernel reads a number.
        unsafe { streamon(self.file.as_raw_fd(), &(VIDEO_CAPTURE as c_int)) }?;
        Ok(())
    }

    fn next_buffer(&mut self, limit: Duration, bytes: &mut Vec<u8>) -> io::Result<Filled> {
        let limit = PollTimeout::try_from(limit).map_err(io::Error::other)?;
        let mut handles = [PollFd::new(self.file.as_fd(), PollFlags::POLLIN)];
        loop {
            match poll(&mut handles, limit) {
                Ok(0) => return Err(ErrorKind::TimedOut.into()),
                Ok(_) => break,
                Err(Errno::EINTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
        let mut buffer = Buffer::new(0);
        self.call(dqbuf, &mut buffer)?;
        let now = clock_gettime(ClockId::CLOCK_MONOTONIC)?;
        let filled = self.buffers.get(buffer.index as usize).ok_or(Errno::EINVAL)?;
        filled.copy_to(bytes, buffer.bytes_used as usize);
        self.queue(buffer.index)?;
        let [seconds, microseconds] = buffer.timestamp;
        let stamp = seconds as f64 + 1e-6 * microseconds as f64;
        let age = now.tv_sec() as f64 + 1e-9 * now.tv_nsec() as f64 - stamp;
        let stamp = (stamp > 0.0).then_some(stamp);
        Ok(Filled {
            stamp,
            age: stamp.filter(|_| buffer.flags & CLOCK_MASK == MONOTONIC).map(|_| age),
            is_damaged: buffer.flags & ERROR != 0,
        })
    }
}

/// Buffer of the driver in the memory of this program.
struct Mapping {
    address: NonNull<c_void>,
    length: NonZeroUsize,
}

// SAFETY: the memory belongs to the process, not to a thread.
unsafe impl Send for Mapping {}

impl Mapping {
    fn new(file: &File, offset: u32, length: u32) -> io::Result<Self> {
        let length = NonZeroUsize::new(length as usize).ok_or(Errno::EINVAL)?;
        let (access, kind) = (ProtFlags::PROT_READ, MapFlags::MAP_SHARED);
        // SAFETY: the kernel chooses an address where nothing is.
        let address = unsafe { mmap(None, length, access, kind, file, offset.into()) }?;
        Ok(Self { address, length })
    }

    /// Copies the first `count` bytes. The driver does not write to a buffer that it has handed
    /// over.
    fn copy_to(&self, bytes: &mut Vec<u8>, count: usize) {
        let count = count.min(self.length.get());
        bytes.clear();
        // SAFETY: so many bytes are mapped for reading while `self` lives.
        bytes.extend_from_slice(unsafe {
            std::slice::from_raw_parts(self.address.as_ptr().cast(), count)
        });
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: this range was mapped, and nothing refers to it any more.
        let _ = unsafe { munmap(self.address, self.length.get()) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sizes and places of linux/videodev2.h on 64 bits. The size is in a request's number.
    #[test]
    fn structures_are_laid_out_as_the_kernel_has_them() {
        assert_eq!(size_of::<Capability>(), 104);
        assert_eq!(size_of::<PictureFormat>(), 208);
        assert_eq!(std::mem::offset_of!(PictureFormat, width), 8);
        assert_eq!(size_of::<StreamParameters>(), 204);
        assert_eq!(size_of::<RequestBuffers>(), 20);
        assert_eq!(size_of::<Buffer>(), 88);
        assert_eq!(std::mem::offset_of!(Buffer, timestamp), 24);
        assert_eq!(std::mem::offset_of!(Buffer, offset), 64);
        assert_eq!(std::mem::offset_of!(Buffer, length), 72);
        assert_eq!(nix::request_code_readwrite!(b'V', 17, size_of::<Buffer>()), 0xc058_5611);
    }

    #[test]
    fn a_device_that_is_no_camera_is_refused() {
        let error = KernelNode::open(Path::new("/dev/null")).err().unwrap();
        assert_eq!(error.raw_os_error(), Some(Errno::ENOTTY as i32));
    }

    /// PLUMB_VIVID names the device of a camera that the kernel renders.
    #[test]
    #[ignore = "needs a kernel with the module vivid: scripts/test-all"]
    fn a_camera_of_the_kernel_fills_buffers() {
        let path = std::env::var_os("PLUMB_VIVID").unwrap();
        let mut node = KernelNode::open(Path::new(&path)).unwrap();
        let size = ImageSize { width: 640, height: 480 };
        let format = node.set_format(PixelFormat::Yuyv, size).unwrap();
        assert_eq!((format.pixels, format.size), (Some(PixelFormat::Yuyv), size));
        assert!(node.set_rate(30).unwrap() > 0.0);
        node.start().unwrap();
        let mut stamps = Vec::new();
        for _ in 0..8 {
            let mut bytes = Vec::new();
            let filled = node.next_buffer(Duration::from_secs(2), &mut bytes).unwrap();
            assert_eq!(bytes.len(), format.stride * size.height);
            assert!(filled.age.is_some_and(|age| (0.0..0.5).contains(&age)), "{filled:?}");
            stamps.push(filled.stamp.unwrap());
        }
        assert!(stamps.is_sorted_by(|a, b| a < b), "{stamps:?}");
    }
}
