//! Conversion of the linked firmware to a UF2 file for a Pico or a Pico 2, comparison
//! of its sizes with a record, and the places where it may panic.
//!
//! ```text
//! ELF -> Image::read -> { uf2::blocks -> plumb.uf2;  Usage -> the table of sizes }
//! ```
#![deny(missing_docs)]

pub mod chip;
pub mod image;
pub mod panics;
pub mod sizes;
pub mod uf2;

pub use image::Sizes;
pub use image::{Image, ImageError};
pub use panics::{PanicPlace, panic_places};
pub use sizes::{Usage, recorded};
