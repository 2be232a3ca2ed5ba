//! A file that a command changes when the user agrees. The former version stays beside it.

use std::fs::{self, File};
use std::io::{BufRead, IsTerminal, stdin};
use std::path::{Path, PathBuf};

use plumb_config::whole_writes::write_whole;

use crate::cli::exit::{Failure, Unwritten, bad_input};
use crate::cli::print::message;

/// File before its change.
pub(crate) struct OldFile<'a> {
    /// Its path.
    pub(crate) path: &'a Path,
    /// Its text.
    pub(crate) text: &'a str,
}

impl OldFile<'_> {
    /// Replaces the file by `text`, if the user agrees: writes `what` into it. Returns whether it
    /// is written.
    ///
    /// # Errors
    /// Where nobody can be asked, or a file cannot be written.
    pub(crate) fn offer(&self, text: &str, what: &str, is_agreed: bool) -> Result<bool, Failure> {
        let path = self.path.display();
        let is_agreed = is_agreed
            || ask(&format!("Write {what} into {path}?")).inspect_err(|_| {
                tell!("{path} is not changed");
            })?;
        if !is_agreed {
            tell!("{path} is not changed");
            return Ok(false);
        }
        let backup = backup(self.path);
        write(&backup, self.text.as_bytes())?;
        replace(self.path, text.as_bytes())?;
        tell!("{path} is written; the former one is {}", backup.display());
        Ok(true)
    }
}

/// Returns the path for the former version, where nothing is yet: "camera.toml.bak", or
/// "camera.toml.bak2" and so on.
fn backup(path: &Path) -> PathBuf {
    let mut number = 1_u64;
    loop {
        let mut name = path.as_os_str().to_owned();
        name.push(".bak");
        if number > 1 {
            name.push(number.to_string());
        }
        if Path::new(&name).symlink_metadata().is_err() {
            return name.into();
        }
        number += 1;
    }
}

/// Writes a file, whole or not at all. A file of this name becomes the former version: returns its
/// path then.
///
/// # Errors
/// Where a file cannot be written or renamed.
pub(crate) fn write_beside_former(path: &Path, bytes: &[u8]) -> Result<Option<PathBuf>, Failure> {
    let former = path.is_file().then(|| backup(path));
    if let Some(former) = &former {
        fs::rename(path, former).map_err(Unwritten::at(former))?;
    }
    write(path, bytes)?;
    Ok(former)
}

/// Asks a question on the terminal. Returns whether the answer is yes.
///
/// # Errors
/// Where the input is no terminal, or cannot be read.
pub(crate) fn ask(question: &str) -> Result<bool, Failure> {
    if !stdin().is_terminal() {
        let nobody = "Nobody can be asked on this input: say yes with --yes";
        return Err(bad_input(format!("{question} {nobody}")));
    }
    loop {
        message(format_args!("{question} [y/N] "));
        let mut line = String::new();
        stdin().lock().read_line(&mut line)?;
        match line.trim().to_lowercase().as_str() {
            "y" | "yes" => return Ok(true),
            "" | "n" | "no" => return Ok(false),
            _ => message(format_args!("Answer y or n. ")),
        }
    }
}

/// Writes a file, whole or not at all.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    Ok(write_whole(path, bytes).map_err(Unwritten::at(path))?)
}

/// Checks, before a measurement, that the file at `path` can be changed, and that its former
/// version can stay beside it. Nothing is changed.
///
/// # Errors
/// Where it cannot.
pub(crate) fn check_writable(path: &Path) -> Result<(), Failure> {
    File::options().append(true).open(path).map_err(Unwritten::at(path))?;
    let backup = backup(path);
    let created = File::create_new(&backup).and_then(|_| fs::remove_file(&backup));
    Ok(created.map_err(Unwritten::at(&backup))?)
}

/// Replaces a file in one step, so that no reader sees half of it. Its mode stays. A mount point is
/// written in place: it cannot be replaced.
fn replace(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    // A link is followed: the file that it names is replaced.
    let path = fs::canonicalize(path).map_err(Unwritten::at(path))?;
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let new = PathBuf::from(name);
    write(&new, bytes)?;
    let mode = fs::metadata(&path).map(|it| it.permissions());
    let renamed = mode.and_then(|mode| fs::set_permissions(&new, mode));
    if renamed.and_then(|()| fs::rename(&new, &path)).is_err() {
        fs::write(&path, bytes).map_err(|error| {
            let advice = format!("The new version is {}", new.display());
            Failure::from(Unwritten::at(&path)(error)).with_advice(advice)
        })?;
        let _stays = fs::remove_file(&new);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_former_version_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        fs::write(&path, "0").unwrap();
        for version in ["1", "2", "3"] {
            let text = fs::read_to_string(&path).unwrap();
            let old = OldFile { path: &path, text: &text };
            assert!(matches!(old.offer(version, "a version", true), Ok(true)));
        }
        let read = |ending: &str| fs::read_to_string(folder.path().join(ending)).unwrap();
        assert_eq!(read("camera.toml"), "3");
        let former = ["camera.toml.bak", "camera.toml.bak2", "camera.toml.bak3"].map(read);
        assert_eq!(former, ["0", "1", "2"]);
    }

    #[test]
    fn the_mode_stays_and_a_check_changes_nothing() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        fs::write(&path, "0").unwrap();
        for mode in [0o600, 0o664] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            assert!(check_writable(&path).is_ok());
            assert_eq!(fs::read_to_string(&path).unwrap(), "0");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
            replace(&path, b"0").unwrap_or_else(|_| panic!("not written"));
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
        }
        assert!(check_writable(&folder.path().join("none/camera.toml")).is_err());
    }
}
