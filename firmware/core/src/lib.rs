#![no_std]
//! Everything the board thinks, with no hardware in it.
