//! The book against the program.

mod commands;
mod tutorial;
