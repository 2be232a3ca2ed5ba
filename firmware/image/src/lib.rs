//! Conversion of the linked firmware to a UF2 file for the Pico, and checks of its size budgets.
//!
//! ```text
//! ELF -> Image::read -> { uf2::blocks -> plumb.uf2;  Usage -> the budgets' table }
//! ```
#![deny(missing_docs)]

pub mod budget;
pub mod image;
pub mod uf2;

pub use budget::{Budgets, Usage};
pub use image::{Image, ImageError};
