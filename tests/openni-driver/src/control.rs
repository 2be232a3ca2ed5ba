//! What the camera is to do, in a file between a test and the driver.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Numbers in a record, without the two that frame it.
const NUMBERS: usize = 15;
const BYTES: usize = 8 * (NUMBERS + 2);

/// What the camera is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// The ball's centre in camera axes (x right, y down, z forward), metres; `None` for no ball.
    pub ball: Option<[f64; 3]>,
    /// The ball's diameter, metres.
    pub diameter: f64,
    /// Pictures a second.
    pub rate: f64,
    /// Whether it is plugged in; pulling the plug is told to the library.
    pub plugged: bool,
    /// Gives no pictures, and does not say why.
    pub silent: bool,
    /// Gives no depth pictures.
    pub blind: bool,
    /// Depth pictures are stamped so much later than colour, seconds.
    pub depth_late: f64,
    /// Colour pictures have so many rows less than were set.
    pub rows_missing: u16,
    /// Registration is not among what it can do.
    pub no_registration: bool,
    /// Accepts a mode and keeps another.
    pub keeps_mode: bool,
    /// Stays mirrored.
    pub keeps_mirroring: bool,
    /// Cannot take colour and depth at one moment.
    pub no_sync: bool,
    /// Opening takes so long, seconds.
    pub slow: f64,
}

impl Default for Control {
    /// A well-behaved camera at 30 Hz, a ball of 80 mm at 1.2 m before its middle.
    fn default() -> Self {
        Self {
            ball: Some([0.0, 0.0, 1.2]),
            diameter: 0.08,
            rate: 30.0,
            plugged: true,
            silent: false,
            blind: false,
            depth_late: 0.0,
            rows_missing: 0,
            no_registration: false,
            keeps_mode: false,
            keeps_mirroring: false,
            no_sync: false,
            slow: 0.0,
        }
    }
}

impl Control {
    fn numbers(&self) -> [f64; NUMBERS] {
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        let [x, y, z] = self.ball.unwrap_or([f64::NAN; 3]);
        [
            x,
            y,
            z,
            self.diameter,
            self.rate,
            flag(self.plugged),
            flag(self.silent),
            flag(self.blind),
            self.depth_late,
            self.rows_missing.into(),
            flag(self.no_registration),
            flag(self.keeps_mode),
            flag(self.keeps_mirroring),
            flag(self.no_sync),
            self.slow,
        ]
    }

    fn from_numbers(numbers: &[f64; NUMBERS]) -> Self {
        let [x, y, z, diameter, rate, plugged, silent, blind, depth_late, rows, flags @ ..] =
            *numbers;
        let [no_registration, keeps_mode, keeps_mirroring, no_sync, slow] = flags;
        Self {
            ball: (!x.is_nan()).then_some([x, y, z]),
            diameter,
            rate,
            plugged: plugged != 0.0,
            silent: silent != 0.0,
            blind: blind != 0.0,
            depth_late,
            rows_missing: rows as u16,
            no_registration: no_registration != 0.0,
            keeps_mode: keeps_mode != 0.0,
            keeps_mirroring: keeps_mirroring != 0.0,
            no_sync: no_sync != 0.0,
            slow,
        }
    }
}

/// The file with a [`Control`]: written by one, read by others while it is.
#[derive(Debug)]
pub struct ControlFile {
    path: PathBuf,
    file: File,
    written: u64,
}

impl ControlFile {
    /// Makes the file, with `control` in it.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn create(path: &Path, control: &Control) -> io::Result<Self> {
        let file =
            OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path)?;
        let mut this = Self { path: path.to_owned(), file, written: 0 };
        this.write(control)?;
        Ok(this)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The URI of the camera that does what this file says.
    pub fn uri(&self) -> String {
        format!("{}{}", crate::SCHEME, self.path.display())
    }

    /// Has the camera do as `control` says from its next picture on.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write(&mut self, control: &Control) -> io::Result<()> {
        self.written += 1;
        let mut bytes = Vec::with_capacity(BYTES);
        bytes.extend(self.written.to_le_bytes());
        bytes.extend(control.numbers().iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend(self.written.to_le_bytes());
        self.file.write_all_at(&bytes, 0)
    }
}

/// What the file says now; `None` where it cannot be read or is just being written.
pub(crate) fn read(file: &File) -> Option<Control> {
    let mut bytes = [0; BYTES];
    file.read_exact_at(&mut bytes, 0).ok()?;
    let (words, _) = bytes.as_chunks::<8>();
    let [first, middle @ .., last] = words else { return None };
    let mut numbers = [0.0; NUMBERS];
    for (number, word) in numbers.iter_mut().zip(middle) {
        *number = f64::from_le_bytes(*word);
    }
    (first == last).then(|| Control::from_numbers(&numbers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let mut control = Control::default();
        let mut file = ControlFile::create(&folder.path().join("control"), &control).unwrap();
        let reader = File::open(file.path()).unwrap();
        assert_eq!(read(&reader), Some(control));
        control = Control {
            ball: None,
            plugged: false,
            rows_missing: 7,
            keeps_mode: true,
            slow: 0.5,
            ..control
        };
        file.write(&control).unwrap();
        assert_eq!(read(&reader), Some(control));
        std::fs::write(file.path(), [1; BYTES - 1]).unwrap();
        assert_eq!(read(&reader), None);
    }
}
