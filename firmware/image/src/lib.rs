//! From the linked firmware to the file that a Pico takes, with its size against its budgets.
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
