//! Which ports are pseudo-terminals: a program is at their other end, such as an emulated board.

use std::path::Path;

/// Returns whether the terminal at `path`, which may be a link, is a pseudo-terminal, or was one
/// until its program ended.
pub fn is_pseudo_terminal(path: &Path) -> bool {
    let target = path.canonicalize().or_else(|_| path.read_link());
    target.unwrap_or_else(|_| path.to_owned()).starts_with("/dev/pts")
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn a_pseudo_terminal_is_known_by_its_path_also_behind_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["board", "gone", "file"].map(|name| folder.path().join(name));
        let [board, gone, file] = &names;
        symlink("/dev/pts", board).unwrap();
        symlink("/dev/pts/none", gone).unwrap();
        fs::write(file, "").unwrap();
        for path in [board, gone, Path::new("/dev/pts/none")] {
            assert!(is_pseudo_terminal(path), "{}", path.display());
        }
        assert!(!is_pseudo_terminal(file) && !is_pseudo_terminal(Path::new("/dev/null")));
    }
}
