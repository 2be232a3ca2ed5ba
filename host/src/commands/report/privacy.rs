//! Removal of private words from the texts of a report: names of the computer and its user, folders
//! of paths, web addresses, tokens.

use std::fs;
use std::path::Path;

use plumb_cameras::camera_file;
use plumb_config::reference::{Key, keys};
use plumb_runtime::rig;

/// Parts of the names of keys whose values are secrets.
const SECRETS: [&str; 4] = ["token", "password", "passwd", "secret"];

/// Names that many computers share, or the program's own.
const COMMON: [&str; 4] = ["root", "localhost", "plumb", ""];

/// Pages with the keys of the files in a report. A user who is called like a key stays in them: a
/// file with another word in its place would be another file.
const KEYS: [&str; 2] = [rig::REFERENCE, camera_file::REFERENCE];

/// Folder that a report keeps: the devices.
const DEVICES: &str = "/dev/";

/// Private words, with what stands in their place.
pub(super) struct Privacy(Vec<(String, &'static str)>);

impl Privacy {
    /// Returns the private words of this computer.
    pub(super) fn of_this_computer() -> Self {
        let computer = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let variable = |name| std::env::var(name).unwrap_or_default();
        // The last folder of the home folder is the user's name, also where no variable has it.
        let home = variable("HOME");
        let at_home = Path::new(&home).file_name().unwrap_or_default().to_string_lossy();
        Self::new(computer.trim(), &[&variable("USER"), &at_home])
    }

    fn new(computer: &str, users: &[&str]) -> Self {
        // The name of a computer may have a domain.
        let short = computer.split('.').next().unwrap_or_default();
        let names = [(computer, "COMPUTER"), (short, "COMPUTER")];
        let all = names.into_iter().chain(users.iter().map(|user| (*user, "USER")));
        let keys: Vec<Key> = KEYS.into_iter().flat_map(keys).collect();
        let is_of_key = |name| keys.iter().any(|key| key.name.split('.').any(|part| part == name));
        let private = all.filter(|(name, _)| !COMMON.contains(name) && !is_of_key(*name));
        Self(private.map(|(name, place)| (name.to_owned(), place)).collect())
    }

    /// Returns `text` without private words.
    pub(super) fn applied_to(&self, text: &str) -> String {
        let lines = text.split_inclusive('\n').map(|line| without_secrets(&without_places(line)));
        self.without_names(&lines.collect::<String>())
    }

    /// Returns `text` without the names of the computer and of its user.
    pub(super) fn without_names(&self, text: &str) -> String {
        let mut text = text.to_owned();
        for (name, place) in &self.0 {
            text = replace_word(&text, name, place);
        }
        text
    }
}

/// Returns whether a character may be a part of a name.
fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '-'
}

/// Replaces `word` where it is no part of a longer one.
fn replace_word(text: &str, word: &str, place: &str) -> String {
    let mut result = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(word) {
        let end = at + word.len();
        let before = rest[..at].chars().next_back().or(result.chars().next_back());
        let is_part = before.is_some_and(is_of_name) || rest[end..].starts_with(is_of_name);
        result.push_str(&rest[..at]);
        result.push_str(if is_part { word } else { place });
        rest = &rest[end..];
    }
    result + rest
}

/// Removes the values of keys that are secrets from a line of TOML or JSON.
fn without_secrets(line: &str) -> String {
    let mut result = String::with_capacity(line.len());
    let mut rest = line;
    while let Some(at) = rest.find(['=', ':']) {
        let (key, after) = rest.split_at(at + 1);
        result.push_str(key);
        let value = after.trim_start_matches(' ');
        let name = key[..at].trim_end().trim_end_matches('"').rsplit(|c| !is_of_name(c)).next();
        rest = if is_secret(name.unwrap_or_default()) {
            result.push_str(&after[..after.len() - value.len()]);
            result.push_str("\"REMOVED\"");
            &value[value_length(value)..]
        } else {
            after
        };
    }
    result + rest
}

/// Returns whether the value of a key is a secret.
fn is_secret(key: &str) -> bool {
    let key = key.to_lowercase();
    SECRETS.iter().any(|secret| key.contains(secret))
}

/// Returns the bytes of the value at the beginning of `text`: a string or a word.
fn value_length(text: &str) -> usize {
    match text.chars().next() {
        Some(quote @ ('"' | '\'')) => text[1..].find(quote).map_or(text.len(), |end| end + 2),
        _ => text.find([',', '}', ']', ' ', '\n']).unwrap_or(text.len()),
    }
}

/// Removes the folders of absolute paths and what follows the scheme of a web address from a line.
fn without_places(line: &str) -> String {
    let mut result = String::with_capacity(line.len());
    let mut rest = line;
    let mut before = ' ';
    while let Some(first) = rest.chars().next() {
        let token = if is_of_name(before) { "" } else { token(rest, before) };
        match shortened(token) {
            Some(short) => {
                result.push_str(&short);
                rest = &rest[token.len()..];
                before = 'x';
            }
            None => {
                result.push(first);
                rest = &rest[first.len_utf8()..];
                before = first;
            }
        }
    }
    result
}

/// Returns the beginning of `text` up to the next quote, or to the end of its first word where no
/// quote stands before it.
fn token(text: &str, before: char) -> &str {
    let is_end = |c: char| match before {
        '"' | '\'' | '`' => c == before || c == '\n',
        _ => c.is_whitespace() || "\"'`,;()[]{}<>".contains(c),
    };
    text.split(is_end).next().unwrap_or_default()
}

/// Returns what stands in the place of a path or an address; `None` for another token.
fn shortened(token: &str) -> Option<String> {
    if let Some((scheme, _)) = token.split_once("://")
        && !scheme.is_empty()
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    {
        return Some(format!("{scheme}://REMOVED"));
    }
    let (root, name) = (token.strip_prefix('/').or(token.strip_prefix("~/"))?, token);
    let top = root.split('/').next().unwrap_or_default();
    // A name of ROS begins with a slash, too.
    let is_path = token.starts_with('~') || (!top.is_empty() && Path::new("/").join(top).exists());
    if !is_path || token.starts_with(DEVICES) {
        return None;
    }
    let last = name.trim_end_matches('/').rsplit('/').next().unwrap_or_default();
    Some(format!("…/{last}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(text: &str) -> String {
        Privacy::new("anvil.example.org", &["alice"]).applied_to(text)
    }

    #[test]
    fn names_of_the_computer_and_its_user_are_removed() {
        assert_eq!(applied("alice@anvil: done"), "USER@COMPUTER: done");
        assert_eq!(applied("anvil.example.org"), "COMPUTER");
        // Longer words stay.
        assert_eq!(applied("malice anvils"), "malice anvils");
        // A user who is called like a key of the files.
        let keys = "[ball]\nradius = 0.02 # the ball";
        assert_eq!(Privacy::new("camera", &["ball"]).applied_to(keys), keys);
        assert_eq!(
            Privacy::new("localhost", &["root"]).applied_to("root localhost"),
            "root localhost"
        );
    }

    #[test]
    fn folders_of_paths_are_removed_and_devices_stay() {
        for (text, short) in [
            ("file = \"/home/bob/my rig/camera.toml\"", "file = \"…/camera.toml\""),
            ("/tmp/a/rig.toml:3: error", "…/rig.toml:3: error"),
            ("see ~/lab/rig.toml, line 3", "see …/rig.toml, line 3"),
            ("listen = \"unix:/tmp/lab/x.sock\"", "listen = \"unix:…/x.sock\""),
            ("port = \"/dev/ttyACM0\"", "port = \"/dev/ttyACM0\""),
            ("max = 400.0  # steps/s", "max = 400.0  # steps/s"),
            ("topic = \"/no-folder/color\"", "topic = \"/no-folder/color\""),
            ("a / b // c", "a / b // c"),
        ] {
            assert_eq!(applied(text), short);
        }
    }

    #[test]
    fn addresses_and_secrets_are_removed() {
        for (text, short) in [
            ("page: http://10.0.0.7:8080/?token=abc.", "page: http://REMOVED"),
            ("uri = \"rtsp://bob:pass word@camera/1\"", "uri = \"rtsp://REMOVED\""),
            ("token = \"abc\"\n", "token = \"REMOVED\"\n"),
            ("  \"page_token\": \"a,b\",\n", "  \"page_token\": \"REMOVED\",\n"),
            ("{\"a\":1,\"secret\":7,\"b\":2}", "{\"a\":1,\"secret\":\"REMOVED\",\"b\":2}"),
            ("password='x y' z", "password=\"REMOVED\" z"),
            ("max = 3", "max = 3"),
        ] {
            assert_eq!(applied(text), short);
        }
    }
}
