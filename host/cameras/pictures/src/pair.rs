//! Pairs of a colour and a depth picture as frames.

use plumb_frame::camera::Intrinsics;
use plumb_frame::clock::{DeviceClock, LiveClock};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{Image, ImageSize};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};

use crate::raw;

/// Colour picture and its depth picture, of the same size.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Time stamp of the colour picture, seconds: of a camera on the host's clock since it was
    /// opened, of a recording on its own clock.
    pub time: f64,
    /// Red, green, blue, row by row from the top left.
    pub colour: Vec<u8>,
    /// Depths, row by row from the top left, in the unit of the open camera; 0 = unknown.
    pub depth: Vec<u16>,
}

/// Source of frames of a camera or recording that delivers pairs. Time stamps are those of the
/// pairs.
#[derive(Debug)]
pub struct PairSource<C> {
    /// The camera or recording.
    pub camera: C,
    /// Function that returns the next pair; `None` at the end of a recording.
    pub next_pair: fn(&mut C) -> Result<Option<Pair>, SourceError>,
    /// Name of the camera or recording, for messages.
    pub name: String,
    /// Size of the pictures.
    pub size: ImageSize,
    /// Intrinsics of the frames.
    pub intrinsics: Intrinsics,
    /// Clock of the pairs.
    pub clock: DeviceClock,
}

impl<C> CameraSource for PairSource<C> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(pair) = (self.next_pair)(&mut self.camera)? else { return Ok(None) };
        self.clock.follow(pair.time);
        let ImageSize { width, height } = self.size;
        let colour = Image::new(width, height, raw::bgr_of_rgb(&pair.colour));
        let depth = Image::new(width, height, pair.depth).map_err(SourceError::new)?;
        let colour = colour.map_err(SourceError::new)?;
        let frame = RgbdFrame::new(pair.time, colour, depth, self.intrinsics);
        Ok(Some(frame.map_err(InvalidFrame::of(&self.name))?))
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        self.clock.live().cloned()
    }
}
