//! Addresses to listen at, as options.

use std::ffi::OsString;
use std::net::{IpAddr, SocketAddr};

/// Options with an address that may be left out.
const OPTIONS: [&str; 2] = ["--page", "--foxglove"];

/// Least number that is a port, and no coordinate or other value that follows an option.
const LEAST_PORT: u64 = 1024;

/// Joins an address to its option where they are two words, `--page 7811`: since the address may
/// be left out, the parser takes the second word for another argument.
pub(super) fn joined(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    let mut are_options = true;
    for word in words {
        are_options &= word != "--";
        match joined.last_mut() {
            Some(option) if are_options && OPTIONS.iter().any(|it| option == it) => {
                if word.to_str().is_some_and(is_address) {
                    option.push("=");
                    option.push(word);
                } else {
                    joined.push(word);
                }
            }
            _ => joined.push(word),
        }
    }
    joined
}

/// Returns whether a word can only be an address or a port.
fn is_address(word: &str) -> bool {
    word.parse::<SocketAddr>().is_ok()
        || word.parse::<IpAddr>().is_ok()
        // A greater number is no port: the message about it must name the option.
        || word.parse().is_ok_and(|port: u64| port >= LEAST_PORT)
}

/// Reads an address with a port, or a part of it, which gets the other part of `default`.
///
/// # Errors
/// An explanation where the text is no address.
pub(super) fn with_port(text: &str, default: &str) -> Result<SocketAddr, String> {
    let default: SocketAddr = default.parse().map_err(|_| format!("{default} is no address"))?;
    let address = text.parse().ok();
    let of_ip = || text.parse().ok().map(|ip: IpAddr| SocketAddr::new(ip, default.port()));
    let of_port = || text.parse().ok().map(|port: u16| SocketAddr::new(default.ip(), port));
    address.or_else(of_ip).or_else(of_port).ok_or_else(|| {
        let port = default.port();
        format!("give an IP address, a port or both, such as 0.0.0.0, {port} or {default}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_and_its_port_may_be_left_out() {
        let read = |text| with_port(text, "127.0.0.1:7586").map(|address| address.to_string());
        assert_eq!(read("0.0.0.0"), Ok("0.0.0.0:7586".to_owned()));
        assert_eq!(read("::1"), Ok("[::1]:7586".to_owned()));
        assert_eq!(read("127.0.0.1:0"), Ok("127.0.0.1:0".to_owned()));
        assert_eq!(read("7811"), Ok("127.0.0.1:7811".to_owned()));
        assert!(read("localhost").is_err() && read("70000").is_err());
    }

    #[test]
    fn an_address_in_a_word_of_its_own_is_joined_to_its_option_and_nothing_else() {
        for (line, expected) in [
            ("run --page 7811 --json", "run --page=7811 --json"),
            ("run --page 0.0.0.0:7586 --loop", "run --page=0.0.0.0:7586 --loop"),
            ("demo --page 99999", "demo --page=99999"),
            ("run --foxglove ::1", "run --foxglove=::1"),
            ("run --page -r rig.toml", "run --page -r rig.toml"),
            ("run --page --foxglove", "run --page --foxglove"),
            // A coordinate.
            ("goto --page 1 0.3 0.2", "goto --page 1 0.3 0.2"),
            ("jog -- --page 7811", "jog -- --page 7811"),
        ] {
            let words = joined(line.split(' ').map(OsString::from));
            let words: Vec<_> = words.iter().filter_map(|word| word.to_str()).collect();
            assert_eq!(words.join(" "), expected);
        }
    }
}
