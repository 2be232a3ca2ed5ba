//! What two jogs have measured, kept in a file beside the rig file for the next run.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use nalgebra::Matrix2;
use plumb_config::bounded_read::{ReadError, read_text};
use plumb_config::toml_file::{MAX_BYTES, TomlFileError, parse_toml};
use plumb_frame::image::ImageSize;
use serde::Deserialize;

/// Largest distance of the ball from where the last run left it, pixels: that of a jog.
const SAME_PLACE_PX: f64 = super::AIM_PX;

/// Frame of a run that ended with the ball at rest.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptFrame {
    /// Jacobian, pixels a step: rows column and row of the picture, columns motors A and B.
    pub jacobian_px: [[f64; 2]; 2],
    /// Time by which the pictures are later than their time stamps, seconds.
    pub latency_s: f64,
    /// Width and height of the pictures, pixels.
    pub size_px: [usize; 2],
    /// Where the ball hung at the end of the run: column and row, pixels.
    pub ball_px: [f64; 2],
}

impl KeptFrame {
    /// Returns the path of the frame that is kept for a rig file: `rig.frame.toml` for `rig.toml`.
    pub fn path(rig_file: &Path) -> PathBuf {
        rig_file.with_extension("frame.toml")
    }

    /// Reads the frame at `path`; `None` where there is no such file.
    ///
    /// # Errors
    /// Where the file cannot be read, or is not as [`text`](Self::text) writes it.
    pub fn read(path: &Path) -> Result<Option<Self>, TomlFileError> {
        match read_text(path, MAX_BYTES) {
            Ok(text) => parse_toml(path, &text).map(Some),
            Err(ReadError::Io { error, .. }) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Returns the text of the file.
    pub fn text(&self) -> String {
        let Self { jacobian_px, latency_s, size_px, ball_px } = self;
        format!(
            "# Measured by two jogs and kept by `plumb run`. Without this file the next run jogs \
             again.\n\
             jacobian_px = {jacobian_px:?}\n\
             latency_s = {latency_s:?}\n\
             size_px = {size_px:?}\n\
             ball_px = {ball_px:?}\n"
        )
    }

    /// Returns the Jacobian, pixels a step.
    pub fn jacobian_px(&self) -> Matrix2<f64> {
        let [[a, b], [c, d]] = self.jacobian_px;
        Matrix2::new(a, b, c, d)
    }

    /// Returns whether pictures of this `size` show the ball at `ball_px` where the run left it.
    /// Otherwise the camera or the rig may have moved.
    pub fn is_of(&self, size: ImageSize, ball_px: [f64; 2]) -> bool {
        let [u, v] = [0, 1].map(|axis| ball_px[axis] - self.ball_px[axis]);
        self.size_px == [size.width, size.height] && u.hypot(v) <= SAME_PLACE_PX
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const FRAME: KeptFrame = KeptFrame {
        jacobian_px: [[-0.25, 1e-9], [0.125, 3.0]],
        latency_s: 0.07,
        size_px: [640, 480],
        ball_px: [412.0, 233.5],
    };

    #[test]
    fn a_frame_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = KeptFrame::path(&folder.path().join("rig.toml"));
        assert!(path.ends_with("rig.frame.toml"));
        assert_eq!(KeptFrame::read(&path).unwrap(), None);
        fs::write(&path, FRAME.text()).unwrap();
        assert_eq!(KeptFrame::read(&path).unwrap(), Some(FRAME));
        fs::write(&path, "jacobian_px = 3\n").unwrap();
        assert!(KeptFrame::read(&path).unwrap_err().to_string().contains("rig.frame.toml"));
    }

    #[test]
    fn a_frame_is_of_the_place_where_the_ball_was_left() {
        let size = ImageSize { width: 640, height: 480 };
        assert!(FRAME.is_of(size, [415.0, 230.0]));
        assert!(!FRAME.is_of(size, [412.0, 240.0]));
        assert!(!FRAME.is_of(size, [f64::NAN, 233.5]));
        assert!(!FRAME.is_of(ImageSize { width: 480, height: 640 }, FRAME.ball_px));
    }
}
