//! `plumb emulate --link`: a symbolic link to the emulated board's terminal.

use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// Symbolic link to a pseudo-terminal. Dropping it removes the link.
pub(super) struct TerminalLink {
    path: PathBuf,
    terminal: PathBuf,
}

impl TerminalLink {
    /// Creates the link `path` to `terminal`. Replaces a link that an emulation left behind.
    ///
    /// # Errors
    /// Returns an error if another file has this path, or the link cannot be created.
    pub(super) fn create(path: &Path, terminal: &Path) -> Result<Self, String> {
        let mut made = symlink(terminal, path);
        if is_taken(&made) && is_left_behind(path, terminal) {
            made = fs::remove_file(path).and_then(|()| symlink(terminal, path));
        }
        match made {
            Ok(()) => Ok(Self { path: path.to_owned(), terminal: terminal.to_owned() }),
            taken if is_taken(&taken) && is_in_use(path) => Err(format!(
                "{path}: exists already, and leads to a terminal in use: an emulated board runs \
                 there, and `--port {path}` uses it; or give another path",
                path = path.display()
            )),
            taken if is_taken(&taken) => Err(format!(
                "{}: exists already, and is no link that an emulation left behind: give another \
                 path",
                path.display()
            )),
            Err(error) => Err(format!("{}: cannot make this link: {error}", path.display())),
        }
    }
}

impl Drop for TerminalLink {
    fn drop(&mut self) {
        // Another emulation may have replaced the link with its own.
        if fs::read_link(&self.path).is_ok_and(|target| target == self.terminal)
            && let Err(error) = fs::remove_file(&self.path)
        {
            tell!("plumb: {}: cannot remove this link: {error}", self.path.display());
        }
    }
}

fn is_taken(made: &io::Result<()>) -> bool {
    made.as_ref().is_err_and(|error| error.kind() == ErrorKind::AlreadyExists)
}

/// Returns whether `link` is a symbolic link to a pseudo-terminal that no longer exists: no
/// terminal has its number, or the system has reused the number for `terminal`.
fn is_left_behind(link: &Path, terminal: &Path) -> bool {
    let Ok(target) = fs::read_link(link) else { return false };
    let gone =
        || fs::symlink_metadata(&target).is_err_and(|error| error.kind() == ErrorKind::NotFound);
    target == terminal || (is_pseudo_terminal(&target) && gone())
}

/// Returns whether `link` is a symbolic link to a pseudo-terminal that exists.
fn is_in_use(link: &Path) -> bool {
    fs::read_link(link).is_ok_and(|target| is_pseudo_terminal(&target) && target.exists())
}

/// Returns whether `path` is that of a pseudo-terminal, `/dev/pts/NUMBER`.
fn is_pseudo_terminal(path: &Path) -> bool {
    let number = path.to_str().and_then(|path| path.strip_prefix("/dev/pts/"));
    number.is_some_and(|number| number.parse::<u32>().is_ok())
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsRawFd;

    use super::*;

    #[test]
    fn a_link_is_removed_at_the_end_unless_another_emulation_replaced_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("board");
        drop(TerminalLink::create(&path, Path::new("/dev/pts/1000001")).unwrap());
        assert!(path.symlink_metadata().is_err());
        let link = TerminalLink::create(&path, Path::new("/dev/pts/1000001")).unwrap();
        let other = TerminalLink::create(&path, Path::new("/dev/pts/1000002")).unwrap();
        drop(link);
        assert_eq!(fs::read_link(&path).unwrap(), Path::new("/dev/pts/1000002"));
        drop(other);
        assert!(path.symlink_metadata().is_err());
    }

    #[test]
    fn only_a_link_to_a_pseudo_terminal_that_is_gone_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("board");
        let terminal = Path::new("/dev/pts/1000001");
        for target in ["/dev/pts/1000002", "/dev/pts/1000001"] {
            symlink(target, &path).unwrap();
            drop(TerminalLink::create(&path, terminal).unwrap());
        }
        for target in [
            "/dev/pts/ptmx",
            "/dev/null",
            "absent",
            "/dev/pts/1x",
            "/dev/pts/",
            "/dev/pts/../pts/1000002",
        ] {
            symlink(target, &path).unwrap();
            let error = TerminalLink::create(&path, terminal).err().unwrap();
            assert!(error.contains("board: exists already"), "{target}: {error}");
            assert_eq!(fs::read_link(&path).unwrap(), Path::new(target));
            fs::remove_file(&path).unwrap();
        }
        // This terminal is in use.
        let open = nix::pty::openpty(None, None).unwrap();
        let used = fs::read_link(format!("/proc/self/fd/{}", open.slave.as_raw_fd())).unwrap();
        symlink(&used, &path).unwrap();
        let error = TerminalLink::create(&path, terminal).err().unwrap();
        assert!(error.contains("an emulated board runs there"), "{error}");
        assert_eq!(fs::read_link(&path).unwrap(), used);
        fs::remove_file(&path).unwrap();
        fs::write(&path, "kept").unwrap();
        assert!(TerminalLink::create(&path, terminal).is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "kept");
        let error =
            TerminalLink::create(&folder.path().join("absent/board"), terminal).err().unwrap();
        assert!(error.contains("cannot make this link"), "{error}");
    }
}
