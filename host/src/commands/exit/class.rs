//! The exit code of each error that can end a command. An error that is not classified here, or
//! beside its type, does not compile.

use std::error::Error;
use std::io::{self, ErrorKind};

use plumb_calibrate::calibration::CalibrationError;
use plumb_calibrate::camera_text::{NoIntrinsics, NoPose};
use plumb_calibrate::corners::{ProcessingError, SheetError};
use plumb_calibrate::lens::LensError;
use plumb_cameras::capture::StartCaptureError;
use plumb_cameras::open::OpenError;
use plumb_cameras::png::PngError;
use plumb_cameras::record::RecordError;
use plumb_cameras::recording::OpenRecordingError;
use plumb_cameras::settings::SettingsError;
use plumb_cameras::tum::TumError;
use plumb_config::bounded_read::ReadError;
use plumb_config::quantity::NumberError;
use plumb_config::toml_file::TomlFileError;

#[cfg(feature = "foxglove")]
use plumb_foxglove::FoxgloveError;
use plumb_frame::source::SourceError;
use plumb_log::RunLogError;
use plumb_log::replay::{DebugError, ReplayError};
use plumb_page::PageError;
use plumb_path::trajectory::PathError;
use plumb_protocol::message::Refusal;
#[cfg(feature = "ros2")]
use plumb_ros2::{McapError, Ros2Error};
use plumb_runtime::board_fault::after_fault;
use plumb_runtime::link::LinkError;
use plumb_runtime::rig::OutOfRange;
use plumb_runtime::run::{FollowFileError, RunError};
use plumb_runtime::targets::TargetStreamError;
use plumb_setup::commission::ExaminationError;
use plumb_setup::new_rig::{NewRigError, SizeError};
use plumb_sim::cosim::CosimError;
use plumb_sim::emulator::plant::RigError;
use plumb_sim::emulator::serve::ServeError;
use plumb_sim::simulated::SimulationError;
use plumb_sim::synthetic::SyntheticError;
use plumb_vision::detect::DetectError;
use plumb_vision::frame::FrameError;
use tracing::subscriber::SetGlobalDefaultError;

/// Exit code of a command that did its work and did not succeed, and of a command that failed: a
/// target is not reached, a board is silent, a disk is full.
pub(crate) const FAILED: u8 = 1;

/// Exit code of a command that cannot begin because of its input: an option, a file or a port.
pub(crate) const BAD_INPUT: u8 = 2;

/// Error that can end a command.
pub(crate) trait ExitClass: Error {
    /// Returns the exit code of the command: [`FAILED`] or [`BAD_INPUT`].
    fn exit_code(&self) -> u8;

    /// Returns what to do next, where the message of the error does not say it.
    fn advice(&self) -> Option<&'static str> {
        None
    }
}

/// Gives all errors of some types one exit code.
macro_rules! exit_code_of {
    ($code:ident: $($error:ty),+ $(,)?) => {
        $(impl crate::commands::exit::ExitClass for $error {
            fn exit_code(&self) -> u8 {
                crate::commands::exit::$code
            }
        })+
    };
}
pub(crate) use exit_code_of;

// Files, options and cameras are read and checked before the work begins.
exit_code_of! { BAD_INPUT:
    DebugError, DetectError, FrameError, NewRigError, NoIntrinsics, NoPose, NumberError, OpenError,
    OpenRecordingError, OutOfRange, PathError, PngError, ProcessingError, ReadError, RigError,
    SetGlobalDefaultError, SettingsError, SimulationError, SizeError, SourceError,
    StartCaptureError, SyntheticError, TumError, FollowFileError, CosimError,
}
#[cfg(feature = "ros2")]
exit_code_of! { BAD_INPUT: McapError }

exit_code_of! { FAILED:
    SheetError, CalibrationError, LensError, ServeError, io::Error, serde_json::Error,
}

/// What to do about a mistake in a rig file or a camera file.
const CHECK: &str = "`plumb check --file-only` lists every mistake with its line";

/// What to do where there is no rig file.
pub(crate) const INIT: &str = "`plumb init` writes a rig file and its camera file";

impl ExitClass for TomlFileError {
    fn exit_code(&self) -> u8 {
        BAD_INPUT
    }

    fn advice(&self) -> Option<&'static str> {
        match self {
            Self::Content { .. } => Some(CHECK),
            Self::Read(ReadError::Io { error, .. }) if error.kind() == ErrorKind::NotFound => {
                Some(INIT)
            }
            _ => None,
        }
    }
}

impl ExitClass for LinkError {
    /// A port that cannot be opened, and a configuration that the board refuses, are mistakes in
    /// the input.
    fn exit_code(&self) -> u8 {
        match self {
            Self::Absent { .. }
            | Self::Busy { .. }
            | Self::Permission { .. }
            | Self::NotAPort { .. }
            | Self::Open { .. }
            | Self::Ports { .. }
            | Self::Refused { refusal: Refusal::Config(_), .. } => BAD_INPUT,
            _ => FAILED,
        }
    }

    fn advice(&self) -> Option<&'static str> {
        match self {
            Self::Refused { refusal: Refusal::Config(_), .. } => Some(CHECK),
            Self::Fault(fault) => Some(after_fault(*fault)),
            _ => None,
        }
    }
}

impl ExitClass for RunError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Connect(error) => error.exit_code(),
            Self::Broken { .. } => FAILED,
            _ => BAD_INPUT,
        }
    }

    fn advice(&self) -> Option<&'static str> {
        match self {
            Self::Connect(error) => error.advice(),
            Self::NoPlace(_) => Some(CHECK),
            _ => None,
        }
    }
}

impl ExitClass for ExaminationError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Link(error) => error.exit_code(),
            Self::NotLive => BAD_INPUT,
            _ => FAILED,
        }
    }

    fn advice(&self) -> Option<&'static str> {
        match self {
            Self::Stopped(fault) => Some(fault.advice()),
            Self::Link(error) => error.advice(),
            _ => None,
        }
    }
}

impl ExitClass for RunLogError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Io { source, .. } => file_exit_code(source),
            Self::Csv { .. } | Self::Json { .. } | Self::Figure { .. } | Self::Picture { .. } => {
                FAILED
            }
            _ => BAD_INPUT,
        }
    }
}

impl ExitClass for RecordError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Io { error, .. } => file_exit_code(error),
            Self::Thread => FAILED,
            Self::Ended { error, .. } => error.exit_code(),
            _ => BAD_INPUT,
        }
    }
}

impl ExitClass for ReplayError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Write(_) | Self::Debug(_) => FAILED,
            _ => BAD_INPUT,
        }
    }
}

impl ExitClass for TargetStreamError {
    fn exit_code(&self) -> u8 {
        if matches!(self, Self::Thread(_)) { FAILED } else { BAD_INPUT }
    }
}

impl ExitClass for PageError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Token(_) | Self::Serve(_) | Self::Rig(_) => FAILED,
            _ => BAD_INPUT,
        }
    }
}

#[cfg(feature = "foxglove")]
impl ExitClass for FoxgloveError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Exists(_) | Self::Listen { .. } => BAD_INPUT,
            Self::Create { source, .. } => file_exit_code(source),
            _ => FAILED,
        }
    }
}

#[cfg(feature = "ros2")]
impl ExitClass for Ros2Error {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Join { .. } | Self::Endpoint { .. } | Self::Thread(_) => FAILED,
            _ => BAD_INPUT,
        }
    }
}

/// Returns the exit code for a failed operation on an output file. A path that cannot be created is
/// a mistake in the input. Any other error is a failure of the work, such as a full disk.
pub(super) fn file_exit_code(error: &io::Error) -> u8 {
    match error.kind() {
        ErrorKind::NotFound
        | ErrorKind::PermissionDenied
        | ErrorKind::NotADirectory
        | ErrorKind::IsADirectory
        | ErrorKind::AlreadyExists
        | ErrorKind::ReadOnlyFilesystem
        | ErrorKind::InvalidFilename
        | ErrorKind::InvalidInput => BAD_INPUT,
        _ => FAILED,
    }
}
