//! The program that a board runs, and the chip that it runs on.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Version of Plumb: major, minor, patch.
pub const RELEASE: Release = Release([
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
]);

/// Returns the number in `text`, of digits. One above 255 does not compile.
const fn number(text: &str) -> u8 {
    let (digits, mut number, mut i) = (text.as_bytes(), 0, 0);
    while i < digits.len() {
        number = 10 * number + (digits[i] - b'0');
        i += 1;
    }
    number
}

/// A version of Plumb: major, minor, patch.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Release(pub [u8; 3]);

/// Source of a build: the first four bytes of a git commit.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Commit {
    /// The first eight hexadecimal digits of the commit's name.
    pub name: [u8; 4],
    /// Whether the source differed from the commit.
    pub modified: bool,
}

impl Commit {
    /// Reads the eight hexadecimal digits of a commit, and a `+` after them where the source
    /// differed from it. Returns `None` for other texts.
    pub const fn parse(text: &str) -> Option<Self> {
        let text = text.as_bytes();
        let modified = text.len() == 9 && text[8] == b'+';
        if text.len() != 8 && !modified {
            return None;
        }
        let mut name = [0; 4];
        let mut i = 0;
        while i < 8 {
            let Some(digit) = (text[i] as char).to_digit(16) else { return None };
            name[i / 2] = name[i / 2] << 4 | digit as u8;
            i += 1;
        }
        Some(Self { name, modified })
    }
}

/// Kind of a board. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardKind {
    /// A program that behaves like a board.
    Emulated,
    /// Raspberry Pi Pico (RP2040). The firmware of the RP2040 calls itself so on every board.
    Pico,
    /// BIGTREETECH SKR Pico (RP2040 with four TMC2209).
    SkrPico,
    /// Raspberry Pi Pico 2 (RP2350).
    Pico2,
}

/// The program that a board runs, and the board. Its bytes never change, so that a host can read it
/// from a board of another version; `board` then may be a kind that the host does not know.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Provenance {
    /// Version of the program.
    pub release: Release,
    /// Source of the program; `None` where it was not built in a git repository.
    pub commit: Option<Commit>,
    /// Kind of the board.
    pub board: BoardKind,
    /// Stepping of the chip, a letter and a digit: `B2`. `None` where it is unknown, or where there
    /// is no chip.
    pub stepping: Option<[u8; 2]>,
}

impl Provenance {
    /// Provenance of a board that a program of this build emulates.
    pub const EMULATED: Self =
        Self { release: RELEASE, commit: None, board: BoardKind::Emulated, stepping: None };
}

impl fmt::Display for Release {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [major, minor, patch] = self.0;
        write!(f, "{major}.{minor}.{patch}")
    }
}

impl fmt::Display for Commit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:08x}", u32::from_be_bytes(self.name))?;
        f.write_str(if self.modified { ", modified" } else { "" })
    }
}

impl fmt::Display for BoardKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Emulated => "an emulated board",
            Self::Pico => "a Raspberry Pi Pico",
            Self::SkrPico => "a BTT SKR Pico",
            Self::Pico2 => "a Raspberry Pi Pico 2",
        })
    }
}

impl fmt::Display for Provenance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Plumb {}", self.release)?;
        if let Some(commit) = self.commit {
            write!(f, " ({commit})")?;
        }
        write!(f, " on {}", self.board)?;
        if let Some([letter, digit]) = self.stepping {
            write!(f, ", stepping {}{}", letter as char, digit as char)?;
        }
        Ok(())
    }
}
