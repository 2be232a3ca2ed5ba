//! Conversion of the linked firmware to a UF2 file for a Pico or a Pico 2, checks of its size
//! budgets, and the places where it may panic.
//!
//! ```text
//! ELF -> Image::read -> { uf2::blocks -> plumb.uf2;  Usage -> the budgets' table }
//! ```
#![deny(missing_docs)]

pub mod budget;
pub mod chip;
pub mod image;
pub mod panics;
pub mod uf2;

pub use budget::Usage;
pub use chip::Budgets;
pub use image::{Image, ImageError};
pub use panics::{PanicPlace, panic_places};
