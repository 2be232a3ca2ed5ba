//! A new rig file and camera file, with limits that fit the size of the rig.

mod description;
mod driver;
#[cfg(test)]
mod tests;
mod text;
mod triangle;

use plumb_runtime::rig::BoardName;
use thiserror::Error;

use self::description::Limits;

pub use self::description::{BALL_RANGE_M, NewCamera, NewRig};
pub use self::driver::{DriverKind, MicrostepsError, Straps};
pub use self::triangle::{HEIGHT_RANGE_M, SIDE_RANGE_M, SizeError, Triangle};

/// Description from which no file can be written.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NewRigError {
    /// The board has drivers of its own.
    #[error("{} has drivers of its own, TMC2209 on a UART: {driver} does not fit", board.kind())]
    Board {
        /// The board.
        board: BoardName,
        /// The driver.
        driver: DriverKind,
    },
    /// The driver cannot have so many microsteps.
    #[error(transparent)]
    Microsteps(#[from] MicrostepsError),
    /// A size is out of its range, or the sizes contradict each other.
    #[error(transparent)]
    Size(#[from] SizeError),
}

/// Texts of a new rig file and camera file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewFiles {
    /// The rig file.
    pub rig: String,
    /// The camera file, which the rig file names `camera.toml`.
    pub camera: String,
    /// Straps of the drivers; `None` for drivers without straps.
    pub straps: Option<Straps>,
}

impl NewRig {
    /// Returns the texts of the files.
    ///
    /// # Errors
    /// Where a size is out of its range, the driver cannot have these microsteps, or the board
    /// cannot have the driver.
    pub fn files(&self) -> Result<NewFiles, NewRigError> {
        let (board, driver) = (self.board, self.driver);
        if !board.board().has_free_drivers && driver != DriverKind::Tmc2209Uart {
            return Err(NewRigError::Board { board, driver });
        }
        // Nobody straps the drivers that a board has.
        let straps = driver.straps(self.microsteps)?.filter(|_| board.board().has_free_drivers);
        let limits = Limits::of(self)?;
        Ok(NewFiles {
            rig: text::rig_file(self, &limits, straps.as_ref()),
            camera: text::camera_file(self, &limits),
            straps,
        })
    }
}
