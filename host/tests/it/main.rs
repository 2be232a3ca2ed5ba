//! The tests of the program `plumb`, which they run as a process.

#[cfg(not(feature = "full"))]
mod absent;
mod book;
mod calibrate;
mod calibrate_lens;
mod check;
mod client;
mod common;
mod control_characters;
mod cosim;
mod emulate;
mod errors;
mod exit_codes;
mod full_disk;
mod init;
mod inputs;
mod killed;
mod left_behind;
mod links;
mod mistaken_files;
mod mistyped;
mod motors;
mod no_ball;
mod output;
mod page;
mod path;
mod picture;
mod plot;
mod program;
mod record;
mod replay;
mod report;
// `stacks` has it with the whole program.
#[cfg(not(feature = "full"))]
mod session;
mod signals;
mod stream;
mod targets;
mod two_motors;
mod verbose;
mod webcam;
