//! The rig file of a command: that of its option, that of a variable, or `rig.toml` in the folder.

use std::env;
use std::path::{Path, PathBuf};

use clap::Args;
use plumb_runtime::rig::Rig;

use crate::cli::exit::{Failure, failed};

/// Environment variable with the rig file of a command line that names none.
const RIG_VARIABLE: &str = "PLUMB_RIG";

/// Rig file in the present folder where neither an option nor a variable names one.
const USUAL: &str = "rig.toml";

/// The rig file of a command.
#[derive(Args)]
pub(crate) struct RigArg {
    /// Rig file (TOML, SI units) [default: that of PLUMB_RIG, or rig.toml in this folder]
    #[arg(short, long, value_name = "FILE")]
    rig: Option<PathBuf>,
}

impl RigArg {
    /// Returns the option with this file.
    #[cfg(test)]
    pub(crate) fn named(file: PathBuf) -> Self {
        Self { rig: Some(file) }
    }

    /// Returns the rig file of a command that needs one.
    ///
    /// # Errors
    /// Where nothing names one, and there is no `rig.toml` in the present folder; or where the
    /// variable names a file that does not exist.
    pub(crate) fn needed(&self) -> Result<PathBuf, Failure> {
        let file = self.found().ok_or_else(|| {
            failed(format!(
                "there is no {USUAL} in this folder: `plumb init` writes one, and --rig FILE names \
                 another"
            ))
        })?;
        if self.rig.is_none() && matches!(file.try_exists(), Ok(false)) {
            return Err(failed(format!("{}: no such file ({RIG_VARIABLE})", file.display())));
        }
        Ok(file)
    }

    /// Reads the rig file of a command that needs one. Returns its path too.
    pub(crate) fn read(&self) -> Result<(PathBuf, Rig), Failure> {
        let file = self.needed()?;
        let rig = Rig::read(&file)?;
        Ok((file, rig))
    }

    /// Returns the rig file of a command that can do without one; `None` where there is none.
    pub(crate) fn found(&self) -> Option<PathBuf> {
        // In a folder that may not be looked into, the reading of the file tells why.
        let is_absent = || matches!(Path::new(USUAL).try_exists(), Ok(false));
        let usual = || (!is_absent()).then(|| USUAL.into());
        self.rig.clone().or_else(of_variable).or_else(usual)
    }
}

/// Returns the rig file of the variable. An empty variable names none.
fn of_variable() -> Option<PathBuf> {
    env::var_os(RIG_VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from)
}

/// Returns whether a command takes the rig file at `path` also without the option.
pub(crate) fn is_default(path: &Path) -> bool {
    path == of_variable().unwrap_or_else(|| USUAL.into())
}

/// Returns the option for the rig file at `path`, with a space before it, for a command that a
/// person types; nothing where the command takes this file without it.
pub(crate) fn rig_option(path: &Path) -> String {
    if is_default(path) { String::new() } else { format!(" --rig {}", quoted(path)) }
}

/// Returns a path as a word of a command line.
pub(crate) fn quoted(path: &Path) -> String {
    let path = path.display().to_string();
    if path.contains(' ') { format!("\"{path}\"") } else { path }
}
