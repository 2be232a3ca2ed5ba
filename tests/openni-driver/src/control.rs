//! Control of the camera by a test, through a file.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Numbers in a record, without the first and last, which detect an incomplete write.
const NUMBERS: usize = 15;
const BYTES: usize = 8 * (NUMBERS + 2);

/// Scene and faults of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Centre of the ball in camera axes (x right, y down, z forward), m; `None` for no ball.
    pub ball: Option<[f64; 3]>,
    /// Diameter of the ball, m.
    pub diameter: f64,
    /// Frame rate, 1/s.
    pub rate: f64,
    /// Whether the camera is plugged in. The library is informed of a change.
    pub plugged: bool,
    /// Whether there are no frames, without an error.
    pub silent: bool,
    /// Whether there are no depth frames.
    pub blind: bool,
    /// Offset of the depth timestamps after the colour timestamps, s.
    pub depth_late: f64,
    /// Number of rows missing in colour frames.
    pub rows_missing: u16,
    /// Whether registration is unsupported.
    pub no_registration: bool,
    /// Whether a new mode is accepted without effect.
    pub keeps_mode: bool,
    /// Whether mirroring cannot be switched off.
    pub keeps_mirroring: bool,
    /// Whether frame synchronisation is unsupported.
    pub no_sync: bool,
    /// Duration of opening, s.
    pub slow: f64,
}

impl Default for Control {
    /// Returns a camera without faults at 30 Hz, and a ball of 80 mm at 1.2 m on its axis.
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

/// File with a [`Control`]. The driver may read it during a write.
#[derive(Debug)]
pub struct ControlFile {
    path: PathBuf,
    file: File,
    written: u64,
}

impl ControlFile {
    /// Creates the file with `control`.
    ///
    /// # Errors
    /// [`io::Error`] if it cannot be written.
    pub fn create(path: &Path, control: &Control) -> io::Result<Self> {
        let file =
            OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path)?;
        let mut this = Self { path: path.to_owned(), file, written: 0 };
        this.write(control)?;
        Ok(this)
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the URI of the camera with this file.
    pub fn uri(&self) -> String {
        format!("{}{}", crate::SCHEME, self.path.display())
    }

    /// Sets `control` from the next frame on.
    ///
    /// # Errors
    /// [`io::Error`] if the file cannot be written.
    pub fn write(&mut self, control: &Control) -> io::Result<()> {
        self.written += 1;
        let mut bytes = Vec::with_capacity(BYTES);
        bytes.extend(self.written.to_le_bytes());
        bytes.extend(control.numbers().iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend(self.written.to_le_bytes());
        self.file.write_all_at(&bytes, 0)
    }
}

/// Reads the file; `None` if it cannot be read or is incomplete.
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
    fn a_record_survives_writing_and_reading() {
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
