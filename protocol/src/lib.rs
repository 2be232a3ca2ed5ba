#![no_std]
//! Messages, units on the wire and framing.
