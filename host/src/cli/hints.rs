//! What to do next after an error that does not say it: a fact, and a command or a page.

use std::error::Error;
use std::io::ErrorKind;

use plumb_config::bounded_read::ReadError;
use plumb_config::error_chain::ErrorChain;
use plumb_config::toml_file::TomlFileError;
use plumb_protocol::message::Refusal;
use plumb_runtime::board_fault::after_fault;
use plumb_runtime::link::LinkError;
use plumb_runtime::run::RunError;
use plumb_setup::watch::WatchError;

/// A mistake in a rig file or a camera file.
const CHECK: &str = "`plumb check --file-only` lists every mistake with its line";

/// No rig file.
pub(crate) const INIT: &str = "`plumb init` writes a rig file and its camera file";

/// Returns what to do after an error; `None` where a message says it, or it is not known.
pub(crate) fn hint(error: &(dyn Error + 'static)) -> Option<&'static str> {
    ErrorChain(error).errors().find_map(of_fact)
}

/// Returns what to do after the fact that an error is, without its causes.
fn of_fact(error: &(dyn Error + 'static)) -> Option<&'static str> {
    if let Some(TomlFileError::Read(ReadError::Io { error, .. })) = error.downcast_ref() {
        (error.kind() == ErrorKind::NotFound).then_some(INIT)
    } else if let Some(TomlFileError::Content { .. }) = error.downcast_ref() {
        Some(CHECK)
    } else if let Some(RunError::NoPlace(_)) = error.downcast_ref() {
        Some(CHECK)
    } else if let Some(LinkError::Refused { refusal: Refusal::Config(_), .. }) =
        error.downcast_ref()
    {
        Some(CHECK)
    } else if let Some(LinkError::Fault(fault)) = error.downcast_ref() {
        Some(after_fault(*fault))
    } else if let Some(WatchError::Stopped(fault)) = error.downcast_ref() {
        Some(fault.advice())
    } else {
        None
    }
}
