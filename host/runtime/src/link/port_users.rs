//! Programs that have a serial port open, for the message that it is in use.

use std::fmt;
use std::fs;
use std::path::Path;

/// Folder of the running processes.
const PROC: &str = "/proc";

/// A process that has the port open.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct PortUser {
    /// Number of the process.
    pub pid: u32,
    /// Name of its program, as the kernel keeps it: 15 bytes at most.
    pub name: String,
}

/// Programs that have a port open, as far as this user may see. Displayed as the part of a message
/// that names them and says what to do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PortUsers(Vec<PortUser>);

impl PortUsers {
    /// Finds the programs that have `port` open. Those of other users are found by root only.
    pub(super) fn of(port: &str) -> Self {
        Self::within(Path::new(PROC), Path::new(port))
    }

    fn within(processes: &Path, port: &Path) -> Self {
        let (Ok(entries), Ok(port)) = (fs::read_dir(processes), port.canonicalize()) else {
            return Self::default();
        };
        let user = |folder: &Path| {
            let pid = folder.file_name()?.to_str()?.parse().ok()?;
            let mut files = fs::read_dir(folder.join("fd")).ok()?.flatten();
            let is_port = |path: &Path| fs::read_link(path).is_ok_and(|target| target == port);
            files.find(|file| is_port(&file.path()))?;
            let name = fs::read_to_string(folder.join("comm")).unwrap_or_default();
            Some(PortUser { pid, name: name.trim_end().to_owned() })
        };
        let mut users: Vec<_> = entries.flatten().filter_map(|entry| user(&entry.path())).collect();
        users.sort();
        Self(users)
    }

    fn has(&self, name: &str) -> bool {
        self.0.iter().any(|user| user.name == name)
    }
}

impl fmt::Display for PortUsers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str(
                ", of another user: `sudo fuser -v` with the port's name shows which. Close it; \
                 ModemManager lets go by itself after some seconds, and leaves the board alone \
                 where its udev rule is installed (docs/use/board.md, \"The port\")",
            );
        }
        let names: Vec<_> =
            self.0.iter().map(|PortUser { pid, name }| format!("{name}, process {pid}")).collect();
        write!(f, " ({})", names.join("; "))?;
        f.write_str(if self.has("ModemManager") {
            ": it asks whether the board is a modem. Wait some seconds, and install the board's \
             udev rule (docs/use/board.md, \"The port\")"
        } else {
            "; close it first"
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

    use std::os::unix::fs::symlink;

    use super::*;

    /// Adds a process that has `file` open.
    fn add(processes: &Path, pid: &str, name: &str, file: &Path) {
        let folder = processes.join(pid);
        fs::create_dir_all(folder.join("fd")).unwrap();
        fs::write(folder.join("comm"), format!("{name}\n")).unwrap();
        symlink("/dev/null", folder.join("fd/0")).unwrap();
        symlink(file, folder.join("fd/3")).unwrap();
    }

    #[test]
    fn the_programs_that_have_the_port_open_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().canonicalize().unwrap();
        let (processes, port, by_id) = (path.join("proc"), path.join("tty"), path.join("by-id"));
        fs::write(&port, "").unwrap();
        symlink(&port, &by_id).unwrap();
        add(&processes, "70", "minicom", &port);
        add(&processes, "8", "plumb", &port);
        add(&processes, "9", "editor", &path.join("other"));
        add(&processes, "self", "plumb", &port);
        fs::create_dir_all(processes.join("10")).unwrap();
        for name in [&port, &by_id] {
            let users = PortUsers::within(&processes, name).to_string();
            assert_eq!(users, " (plumb, process 8; minicom, process 70); close it first");
        }
        add(&processes, "71", "ModemManager", &port);
        let users = PortUsers::within(&processes, &port).to_string();
        assert!(users.contains("whether the board is a modem"), "{users}");
    }

    #[test]
    fn of_programs_of_other_users_the_message_says_how_to_see_them() {
        let folder = tempfile::tempdir().unwrap();
        let users = PortUsers::within(folder.path(), Path::new("/dev/null")).to_string();
        assert!(users.contains("sudo fuser"), "{users}");
        let users = PortUsers::within(&folder.path().join("absent"), Path::new("/dev/null"));
        assert_eq!(users, PortUsers::default());
    }

    #[test]
    fn this_process_is_found_by_the_file_that_it_has_open() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let users = PortUsers::of(file.path().to_str().unwrap());
        assert_eq!(users.0.iter().map(|user| user.pid).collect::<Vec<_>>(), [std::process::id()]);
    }
}
