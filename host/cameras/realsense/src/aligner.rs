//! Alignment of depth to colour by the library.

use core::ffi::c_void;
use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;

use plumb_frame::pairing::Sensor;

use crate::handle::Owned;
use crate::library::Inner;
use crate::sensor::Frame;
use crate::sys::{self, Handle};

/// Longest time for one step of the alignment, which takes milliseconds.
const STEP: Duration = Duration::from_secs(2);

/// State that the callback of the composing block uses.
struct Composer {
    inner: Arc<Inner>,
    /// Depth frame that joins the colour frame in process.
    depth: Cell<Handle>,
}

/// Joins a pair of frames and aligns its depth to its colour.
///
/// The library's own pairing goes by arrival, so that the pair is composed here, in a processing
/// block whose callback runs inside the call that processes a frame.
pub(crate) struct Aligner {
    inner: Arc<Inner>,
    // Blocks are deleted before their queues and before the callback's state.
    compose: Owned,
    align: Owned,
    composed: Owned,
    aligned: Owned,
    composer: Box<Composer>,
}

// SAFETY: librealsense2 locks its blocks and queues. The callback runs in the thread that calls
// `align`, which borrows the aligner mutably.
unsafe impl Send for Aligner {}

impl Aligner {
    /// Creates the processing blocks.
    pub(crate) fn new(inner: &Arc<Inner>) -> Result<Self, String> {
        let api = &inner.api;
        let null = Cell::new(std::ptr::null_mut());
        let composer = Box::new(Composer { inner: Arc::clone(inner), depth: null });
        let cookie = std::ptr::from_ref(&*composer).cast_mut().cast::<c_void>();
        // SAFETY: the callback's state lives longer than the block, at the same address.
        let compose = api.check(|error| unsafe { (api.create_block)(compose, cookie, error) })?;
        let compose = Owned::new(compose, api.delete_block)?;
        // SAFETY: the number is that of a stream.
        let align = api.check(|error| unsafe { (api.create_align)(sys::STREAM_COLOUR, error) })?;
        let align = Owned::new(align, api.delete_block)?;
        let composed = queue(inner, 1)?;
        let aligned = queue(inner, 1)?;
        for (block, queue) in [(&compose, &composed), (&align, &aligned)] {
            // SAFETY: the block and its queue live.
            api.check(|error| unsafe { (api.start_block)(block.raw(), queue.raw(), error) })?;
        }
        Ok(Self { inner: Arc::clone(inner), compose, align, composed, aligned, composer })
    }

    /// Returns the depth frame of a pair in the pixels of its colour frame.
    pub(crate) fn align(&mut self, colour: Frame, depth: Frame) -> Result<Frame, String> {
        self.composer.depth.set(depth.into_raw());
        let pair = self.step(&self.compose, &self.composed, colour.into_raw())?;
        let pair = self.step(&self.align, &self.aligned, pair.into_raw())?;
        let api = &self.inner.api;
        // SAFETY: the pair lives.
        let count = api.check(|error| unsafe { (api.embedded_count)(pair.raw(), error) })?;
        for index in 0..count {
            // SAFETY: the pair lives, and has more than `index` frames.
            let extract = |error| unsafe { (api.extract_frame)(pair.raw(), index, error) };
            let frame = Frame::new(&self.inner, api.check(extract)?)?;
            if let Some(frame) = frame.filter(|frame| frame.sensor == Sensor::Depth) {
                return Ok(frame);
            }
        }
        Err("the aligned pair has no depth".to_owned())
    }

    /// Processes a frame, which the block takes over. Returns the result.
    fn step(&self, block: &Owned, queue: &Owned, frame: Handle) -> Result<Owned, String> {
        let api = &self.inner.api;
        // SAFETY: the block lives, and takes over the frame.
        api.check(|error| unsafe { (api.process)(block.raw(), frame, error) })?;
        let result = wait(&self.inner, queue, STEP)?;
        result.ok_or_else(|| "the library delivers no aligned depth".to_owned())
    }
}

/// Returns a queue for `capacity` frames.
pub(crate) fn queue(inner: &Inner, capacity: i32) -> Result<Owned, String> {
    let api = &inner.api;
    // SAFETY: the call takes a number only.
    let queue = api.check(|error| unsafe { (api.create_queue)(capacity, error) })?;
    Owned::new(queue, api.delete_queue)
}

/// Returns the next frame of `queue`; `None` where none comes within `timeout`.
pub(crate) fn wait(
    inner: &Inner,
    queue: &Owned,
    timeout: Duration,
) -> Result<Option<Owned>, String> {
    let api = &inner.api;
    let (mut frame, milliseconds) = (std::ptr::null_mut(), timeout.as_millis());
    let milliseconds = u32::try_from(milliseconds).unwrap_or(u32::MAX);
    // SAFETY: the queue lives, and the variable lives through the call.
    let call = |error| unsafe { (api.try_wait)(queue.raw(), milliseconds, &raw mut frame, error) };
    if api.check(call)? == 0 {
        return Ok(None);
    }
    Owned::new(frame, api.release_frame).map(Some)
}

/// Joins the depth frame in the cookie with the colour frame `frame`, and delivers the pair.
unsafe extern "C" fn compose(frame: Handle, source: Handle, cookie: *mut c_void) {
    // SAFETY: the cookie is the aligner's `Composer`, which outlives the block.
    let composer = unsafe { &*cookie.cast::<Composer>() };
    let mut frames = [composer.depth.replace(std::ptr::null_mut()), frame];
    let api = &composer.inner.api;
    // SAFETY: the source lives through the callback. The pair takes over both frames.
    let pair = api.check(|error| unsafe { (api.compose)(source, frames.as_mut_ptr(), 2, error) });
    // Without a pair nothing is delivered, which the wait for it reports.
    if let Ok(pair) = pair {
        // SAFETY: as above. The source takes over the pair.
        let _ = api.check(|error| unsafe { (api.deliver)(source, pair, error) });
    }
}
