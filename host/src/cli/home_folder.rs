//! The home folder at the begin of a path that no shell has expanded: `--out=~/runs/x`, and words
//! in quotes.

use std::env::home_dir;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use nix::unistd::User;

/// Returns the words of the command line as the parser takes them.
pub(crate) fn command_line() -> Vec<OsString> {
    std::env::args_os().map(expanded).collect()
}

/// Replaces `~` and `~USER` at the begin of the path that `word` of the command line is or has
/// behind `--option=` or `unix:`, as a shell does: that of an unknown user stays.
fn expanded(word: OsString) -> OsString {
    expanded_with(&word, home_of).unwrap_or(word)
}

/// Returns the home folder of a user; an empty name is that of the present one.
fn home_of(user: &str) -> Option<PathBuf> {
    match user {
        "" => home_dir().filter(|home| !home.as_os_str().is_empty()),
        user => User::from_name(user).ok().flatten().map(|user| user.dir),
    }
}

/// Expands a word with the home folders that `home_of` knows; `None` where it has none.
fn expanded_with(word: &OsStr, home_of: impl Fn(&str) -> Option<PathBuf>) -> Option<OsString> {
    let word = word.to_str()?;
    let option = word.strip_prefix("--").and_then(|option| option.split_once('='));
    let value = option.map_or(word, |(_, value)| value);
    let path = value.strip_prefix("unix:").unwrap_or(value);
    let after = path.strip_prefix('~')?;
    let (user, rest) = after.split_at(after.find('/').unwrap_or(after.len()));
    let mut expanded = OsString::from(&word[..word.len() - path.len()]);
    expanded.push(home_of(user)?);
    expanded.push(rest);
    Some(expanded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilde_that_begins_a_path_is_the_home_folder() {
        let home_of = |user: &str| match user {
            "" => Some("/home/a".into()),
            "root" => Some("/root".into()),
            _ => None,
        };
        for (word, expected) in [
            ("~/r", Some("/home/a/r")),
            ("~", Some("/home/a")),
            ("--out=~/runs/x", Some("--out=/home/a/runs/x")),
            ("--rig=~root/x~", Some("--rig=/root/x~")),
            ("--x=unix:~/t.sock", Some("--x=unix:/home/a/t.sock")),
            ("unix:~/t.sock", Some("unix:/home/a/t.sock")),
            ("~nobody/r", None),
            ("./~/r", None),
            ("rig.toml~", None),
            ("a=~/r", None),
            ("--out", None),
            ("", None),
        ] {
            let found = expanded_with(OsStr::new(word), home_of);
            assert_eq!(found, expected.map(OsString::from), "{word}");
        }
    }
}
