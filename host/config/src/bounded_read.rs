//! Reading of files that a user names: regular files only, up to a limit of bytes.
//!
//! Reading a named pipe can block, reading a device such as `/dev/zero` never ends, and a large
//! file fills the memory.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use nix::fcntl::OFlag;
use thiserror::Error;

/// Failure to read a file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system reports an error.
    #[error("{}: cannot be read", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        #[source]
        error: io::Error,
    },
    /// The path is not that of a regular file.
    #[error("{}: is {kind}, but must be a regular file", .path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// Kind of the file.
        kind: FileKind,
    },
    /// The file is larger than its limit.
    #[error(
        "{}: is too large: it has {} bytes, and at most {limit} are read",
        .path.display(),
        at_least(*.found, *.limit)
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Length of the file when it was opened, bytes.
        found: u64,
        /// The limit, bytes.
        limit: u64,
    },
    /// The file is not UTF-8 text.
    #[error("{}:{line}: is not UTF-8 text; {SAVE_AS_UTF_8}", .path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Line, from 1, of the first invalid byte.
        line: usize,
    },
    /// The file is that of a spreadsheet, or text that a spreadsheet has saved as UTF-16.
    #[error("{}: is {format}, and not UTF-8 text; {}", .path.display(), .format.advice())]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: OtherFormat,
    },
}

/// What to do with a text that is not UTF-8, for a person.
const SAVE_AS_UTF_8: &str = "save it as UTF-8, from a spreadsheet as \"CSV UTF-8\"";

/// Format of a file that a person takes for text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherFormat {
    /// Text in UTF-16, with or without a byte order mark.
    Utf16,
    /// A ZIP archive: .xlsx, .ods.
    Zip,
    /// A compound file of older office programs: .xls.
    Compound,
}

impl OtherFormat {
    /// Returns the format of a file with these bytes; `None` for any other one.
    fn of(bytes: &[u8]) -> Option<Self> {
        let beginnings: [(&[u8], Self); 4] = [
            (b"\xff\xfe", Self::Utf16),
            (b"\xfe\xff", Self::Utf16),
            (b"PK\x03\x04", Self::Zip),
            (b"\xd0\xcf\x11\xe0", Self::Compound),
        ];
        let begun = beginnings.into_iter().find(|(first, _)| bytes.starts_with(first));
        begun.map(|(_, it)| it).or_else(|| has_many_nuls(bytes).then_some(Self::Utf16))
    }

    /// Returns what to do with such a file, for a person.
    fn advice(self) -> &'static str {
        match self {
            Self::Utf16 => SAVE_AS_UTF_8,
            Self::Zip | Self::Compound => "save the sheet as \"CSV UTF-8\"",
        }
    }
}

/// Returns whether a quarter of the first bytes is 0, as in UTF-16 without a byte order mark.
/// Text in UTF-8 has none.
fn has_many_nuls(bytes: &[u8]) -> bool {
    let beginning = &bytes[..bytes.len().min(1000)];
    let nuls = beginning.iter().filter(|&&byte| byte == 0).count();
    nuls > 0 && 4 * nuls >= beginning.len()
}

impl fmt::Display for OtherFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Utf16 => "text in UTF-16 (\"Unicode text\" of Excel)",
            Self::Zip => "a spreadsheet (.xlsx, .ods) or another ZIP archive",
            Self::Compound => "a spreadsheet (.xls) or another file of an office program",
        })
    }
}

/// Formats the length of a file. The length of a file that grew while it was read is unknown.
fn at_least(found: u64, limit: u64) -> String {
    if found > limit { found.to_string() } else { format!("more than {limit}") }
}

/// Kind of a file that is not regular.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A folder.
    Folder,
    /// A named pipe.
    Pipe,
    /// A socket.
    Socket,
    /// A device.
    Device,
    /// Any other kind.
    Other,
}

impl fmt::Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Folder => "a folder",
            Self::Pipe => "a named pipe",
            Self::Socket => "a socket",
            Self::Device => "a device",
            Self::Other => "of another kind",
        })
    }
}

impl FileKind {
    /// Returns the kind of a file; `None` for a regular one.
    fn of(file_type: fs::FileType) -> Option<Self> {
        if file_type.is_file() {
            None
        } else if file_type.is_dir() {
            Some(Self::Folder)
        } else if file_type.is_fifo() {
            Some(Self::Pipe)
        } else if file_type.is_socket() {
            Some(Self::Socket)
        } else if file_type.is_char_device() || file_type.is_block_device() {
            Some(Self::Device)
        } else {
            Some(Self::Other)
        }
    }
}

/// Reads the regular file at `path`, of at most `limit` bytes.
///
/// # Errors
/// Where the file cannot be read, is not regular, or is larger.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let io_error = |error| ReadError::Io { path: path.to_owned(), error };
    let (file, found) = open(path)?;
    let too_large = |found| ReadError::TooLarge { path: path.to_owned(), found, limit };
    if found > limit {
        return Err(too_large(found));
    }
    let mut bytes = Vec::new();
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(io_error)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(found));
    }
    Ok(bytes)
}

/// Reads the regular file at `path`, UTF-8 text of at most `limit` bytes.
///
/// # Errors
/// As [`read`]; where the file is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> Result<String, ReadError> {
    let bytes = read(path, limit)?;
    if let Some(format) = OtherFormat::of(&bytes) {
        return Err(ReadError::OtherFormat { path: path.to_owned(), format });
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes().iter().take(good).filter(|&&byte| byte == b'\n').count();
        ReadError::NotText { path: path.to_owned(), line }
    })
}

/// Opens the regular file at `path`. Returns it with its length, bytes.
fn open(path: &Path) -> Result<(File, u64), ReadError> {
    let io_error = |error| ReadError::Io { path: path.to_owned(), error };
    let regular = |data: &fs::Metadata| match FileKind::of(data.file_type()) {
        None => Ok(()),
        Some(kind) => Err(ReadError::NotAFile { path: path.to_owned(), kind }),
    };
    // The first check avoids opening a device, which may have an effect. The second one checks the
    // file that was opened.
    regular(&fs::metadata(path).map_err(io_error)?)?;
    let flags = (OFlag::O_NONBLOCK | OFlag::O_NOCTTY).bits();
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path).map_err(io_error)?;
    let data = file.metadata().map_err(io_error)?;
    regular(&data)?;
    Ok((file, data.len()))
}

/// Failure to read a line.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LineError {
    /// The operating system reports an error.
    #[error("cannot be read")]
    Io(#[from] io::Error),
    /// The line is longer than its limit.
    #[error("is too long: at most {limit} bytes are read")]
    TooLong {
        /// The limit, bytes.
        limit: u64,
    },
    /// The line is not UTF-8 text.
    #[error("is not UTF-8 text")]
    NotText,
}

/// Reads the next line of `input`, of at most `limit` bytes including its end. Returns `None` at
/// the end of the input.
///
/// # Errors
/// Where the line cannot be read, is longer, or is not UTF-8. The rest of a line that is too long
/// remains in `input`.
pub fn read_line(input: &mut impl BufRead, limit: u64) -> Result<Option<String>, LineError> {
    let mut bytes = Vec::new();
    input.by_ref().take(limit.saturating_add(1)).read_until(b'\n', &mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(LineError::TooLong { limit });
    }
    if bytes.is_empty() {
        return Ok(None);
    }
    String::from_utf8(bytes).map(Some).map_err(|_| LineError::NotText)
}

/// Most characters of an excerpt.
const MAX_EXCERPT: usize = 80;

/// Returns the beginning of a line, to be quoted in a message.
pub fn excerpt(line: &str) -> String {
    match line.char_indices().nth(MAX_EXCERPT) {
        None => line.to_owned(),
        Some((end, _)) => format!("{}...", &line[..end]),
    }
}

#[cfg(test)]
mod tests {
    use nix::sys::stat::Mode;
    use nix::unistd::mkfifo;

    use super::*;
    use crate::error_chain::ErrorChain;

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "12345678").unwrap();
        assert_eq!(read(&path, 8).unwrap(), b"12345678");
        let error = read(&path, 7).unwrap_err().to_string();
        assert!(error.contains("8 bytes") && error.contains("at most 7"), "{error}");
    }

    #[test]
    fn a_file_without_a_true_length_is_read_up_to_its_limit() {
        // The kernel's files have length 0.
        let path = Path::new("/proc/self/maps");
        assert!(!read(path, 1 << 24).unwrap().is_empty());
        let error = read(path, 10).unwrap_err().to_string();
        assert!(error.contains("more than 10 bytes"), "{error}");
    }

    #[test]
    fn files_that_are_not_regular_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        mkfifo(&pipe, Mode::S_IRWXU).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("socket")).unwrap();
        for (path, kind) in [
            (pipe.as_path(), "a named pipe"),
            (&link, "a named pipe"),
            (Path::new("/dev/zero"), "a device"),
            (folder.path(), "a folder"),
            (&folder.path().join("socket"), "a socket"),
        ] {
            let error = read(path, 100).unwrap_err().to_string();
            assert!(error.contains(&path.display().to_string()) && error.contains(kind), "{error}");
        }
        let error = read(&folder.path().join("absent"), 100).unwrap_err();
        let message = ErrorChain(&error).to_string();
        assert!(message.contains("absent: cannot be read: No such file"), "{message}");
    }

    #[test]
    fn invalid_text_is_reported_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, b"a\nb\xff\nc").unwrap();
        let error = read_text(&path, 100).unwrap_err().to_string();
        let says =
            "file:2: is not UTF-8 text; save it as UTF-8, from a spreadsheet as \"CSV UTF-8\"";
        assert!(error.ends_with(says), "{error}");
        fs::write(&path, "a\nä").unwrap();
        assert_eq!(read_text(&path, 100).unwrap(), "a\nä");
    }

    #[test]
    fn a_spreadsheet_in_the_place_of_text_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let utf_16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        for (bytes, says) in [
            (utf_16("\u{feff}x\ty\tz\n"), "file: is text in UTF-16 (\"Unicode text\" of Excel)"),
            // Without a byte order mark, valid and invalid as UTF-8.
            (utf_16("x,y,z\n"), "file: is text in UTF-16 (\"Unicode text\" of Excel)"),
            (utf_16("# Höhe in m\nx,y,z\n"), "file: is text in UTF-16"),
            (b"PK\x03\x04\xff".to_vec(), "is a spreadsheet (.xlsx, .ods) or another ZIP archive"),
            (b"\xd0\xcf\x11\xe0\xa1".to_vec(), "is a spreadsheet (.xls) or another file"),
        ] {
            fs::write(&path, bytes).unwrap();
            let error = read_text(&path, 100).unwrap_err().to_string();
            assert!(error.contains(says) && error.ends_with("\"CSV UTF-8\""), "{error}");
        }
    }

    #[test]
    fn only_the_beginning_of_a_line_is_quoted() {
        assert_eq!(excerpt("ä b"), "ä b");
        assert_eq!(excerpt(&"ä".repeat(80)), "ä".repeat(80));
        assert_eq!(excerpt(&"ä".repeat(1_000_000)), format!("{}...", "ä".repeat(80)));
    }

    #[test]
    fn a_line_without_an_end_is_refused() {
        let mut input: &[u8] = b"ab\n\ncd";
        let mut next = || read_line(&mut input, 3).unwrap();
        assert_eq!(
            [next(), next(), next(), next()],
            [Some("ab\n".to_owned()), Some("\n".to_owned()), Some("cd".to_owned()), None]
        );
        let mut endless = io::BufReader::new(io::repeat(b'x'));
        let error = read_line(&mut endless, 1000).unwrap_err().to_string();
        assert!(error.contains("at most 1000 bytes"), "{error}");
        let error = read_line(&mut &b"\xff\n"[..], 1000).unwrap_err();
        assert!(matches!(error, LineError::NotText), "{error}");
    }
}
