//! Body of a reply: as it comes, or in chunks; and the pictures in it.

use std::io::{self, BufRead, ErrorKind, Read};

use super::error::HttpError;
use super::limits::MAX_PICTURE_BYTES;

/// Most bytes of a line of a head.
const MAX_LINE_BYTES: u64 = 8 << 10;

/// Most bytes that are reserved for a picture before they have come.
const MAX_RESERVED: u64 = 1 << 20;

/// Bytes behind a picture from which on a newer one is there: more than the head of a part.
const MAX_HEAD_BYTES: usize = 1024;

/// Body of a reply.
pub(super) struct Body<R> {
    pub(super) input: R,
    /// Bytes that are left of the chunk; `None` of a body without chunks.
    pub(super) left: Option<u64>,
}

impl<R: BufRead> Body<R> {
    /// Reads the size of the next chunk (RFC 9112, section 7.1). The last one, of size 0, is the
    /// end.
    fn next_chunk(&mut self) -> io::Result<u64> {
        let mut line = read_line(&mut self.input)?;
        if line.is_empty() {
            // The end of the chunk before.
            line = read_line(&mut self.input)?;
        }
        line.extend(b"\r\n");
        match httparse::parse_chunk_size(&line) {
            Ok(httparse::Status::Complete((_, 0))) => Err(ErrorKind::UnexpectedEof.into()),
            Ok(httparse::Status::Complete((_, size))) => Ok(size),
            _ => Err(ErrorKind::InvalidData.into()),
        }
    }
}

impl<R: BufRead> BufRead for Body<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.left == Some(0) {
            self.left = Some(self.next_chunk()?);
        }
        let bytes = self.input.fill_buf()?;
        let count = self.left.map_or(bytes.len(), |left| left.min(bytes.len() as u64) as usize);
        Ok(&bytes[..count])
    }

    fn consume(&mut self, count: usize) {
        self.input.consume(count);
        self.left = self.left.map(|left| left.saturating_sub(count as u64));
    }
}

impl<R: BufRead> Read for Body<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

/// Reads a line, without its end.
pub(super) fn read_line(input: &mut impl BufRead) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    input.take(MAX_LINE_BYTES).read_until(b'\n', &mut line)?;
    match line.last() {
        Some(b'\n') => Ok(line.trim_ascii_end().to_vec()),
        _ if line.len() as u64 == MAX_LINE_BYTES => Err(ErrorKind::InvalidData.into()),
        _ => Err(ErrorKind::UnexpectedEof.into()),
    }
}

/// Reader of the parts of a body of the type `multipart/x-mixed-replace` (RFC 2046, section 5.1).
pub(super) struct Parts {
    /// What stands between the parts, without the dashes before it: cameras state it with them, or
    /// without.
    boundary: Vec<u8>,
    /// Whether the boundary before the next part has been read.
    is_past_boundary: bool,
}

impl Parts {
    /// Returns the reader of a body whose type states this boundary.
    pub(super) fn new(boundary: &str) -> Self {
        let boundary = boundary.trim_matches('"').trim_start_matches('-').as_bytes().to_vec();
        Self { boundary, is_past_boundary: false }
    }

    /// Reads the next part: as many bytes as its head states, or up to the next boundary.
    ///
    /// # Errors
    /// Where the connection ends, or the part is too large.
    pub(super) fn next(&mut self, input: &mut impl BufRead) -> Result<Vec<u8>, HttpError> {
        if !self.is_past_boundary {
            self.read_to_boundary(input)?;
        }
        self.is_past_boundary = false;
        let mut length: Option<u64> = None;
        loop {
            let line = read_line(input)?;
            let line = String::from_utf8_lossy(&line);
            match line.split_once(':') {
                _ if line.is_empty() => break,
                Some((name, value)) if name.eq_ignore_ascii_case("content-length") => {
                    length = value.trim().parse().ok();
                }
                _ => {}
            }
        }
        let Some(length) = length else {
            self.is_past_boundary = true;
            return self.read_to_boundary(input);
        };
        if length > MAX_PICTURE_BYTES {
            return Err(HttpError::TooLarge);
        }
        let mut bytes = Vec::with_capacity(length.min(MAX_RESERVED) as usize);
        match input.take(length).read_to_end(&mut bytes)? as u64 {
            count if count == length => Ok(bytes),
            _ => Err(HttpError::Ended),
        }
    }

    /// Returns how many bytes may wait behind the part that was read last, `bytes`, unless a newer
    /// one is there: the begin of the next one ends a part without a length.
    pub(super) fn backlog(&self, bytes: &[u8]) -> usize {
        if self.is_past_boundary { 2 * bytes.len() } else { MAX_HEAD_BYTES }
    }

    /// Reads up to the next boundary. Returns the bytes before it.
    fn read_to_boundary(&self, input: &mut impl BufRead) -> Result<Vec<u8>, HttpError> {
        let mut input = input.take(MAX_PICTURE_BYTES);
        let mut bytes = Vec::new();
        loop {
            let begin = bytes.len();
            if input.read_until(b'\n', &mut bytes)? == 0 {
                let is_large = input.limit() == 0;
                return Err(if is_large { HttpError::TooLarge } else { HttpError::Ended });
            }
            let before = bytes[begin..].trim_ascii_end().strip_suffix(&*self.boundary);
            if let Some(before) = before
                && (before.is_empty() || before.ends_with(b"--"))
            {
                let dashes = before.iter().rev().take_while(|byte| **byte == b'-').count();
                bytes.truncate(begin + before.len() - dashes);
                let picture = bytes.strip_suffix(b"\n").unwrap_or(&bytes);
                let count = picture.strip_suffix(b"\r").unwrap_or(picture).len();
                bytes.truncate(count);
                return Ok(bytes);
            }
        }
    }
}
