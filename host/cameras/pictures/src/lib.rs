//! Pictures as files and as bytes: PNG, JPEG, PGM and PPM, and the rows of devices and senders.
//!
//! Everything that goes through the pixels of a picture, but for the detector, is in this crate and
//! in the cameras' own: it is compiled for speed, what is around it is not.
//!
//! - [`decode`]: images of files, which are refused where they are too large.
//! - [`jpeg`], [`png`]: encoding.
//! - [`pair`]: pairs of a colour and a depth picture as frames.
//! - [`raw`]: pixels of bytes without a format, and [`bayer`]: those behind a Bayer filter.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

use std::error::Error;

pub mod bayer;
pub mod decode;
pub mod jpeg;
pub mod pair;
pub mod png;
pub mod raw;

/// Error of a library that encodes.
pub type BoxedError = Box<dyn Error + Send + Sync>;
