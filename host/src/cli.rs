//! The command line: arguments, numbers, printing, exit codes, hints, files that are changed.

// Its macros are for all modules below.
#[macro_use]
pub(crate) mod print;

pub(crate) mod choices;
pub(crate) mod exit;
pub(crate) mod hints;
pub(crate) mod home_folder;
pub(crate) mod interrupt;
pub(crate) mod numbers;
pub(crate) mod old_file;
pub(crate) mod port;
pub(crate) mod port_args;
pub(crate) mod rig_path;
pub(crate) mod verbose;
