//! A new rig file and camera file, with limits that fit the size of the rig.

mod description;
mod driver;
mod planar;
#[cfg(test)]
mod tests;
mod text;
mod triangle;

use plumb_runtime::rig::BoardName;
use thiserror::Error;

use self::description::Limits;

pub use self::description::{BALL_RANGE_M, NewCamera, NewRig};
pub use self::driver::{DriverKind, MicrostepsError, Straps};
pub use self::planar::NewPlanarRig;
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
        let straps = self.driver.straps_on(self.board, self.microsteps)?;
        let limits = Limits::of(self)?;
        Ok(NewFiles {
            rig: text::rig_file(self, &limits, straps.as_ref()),
            camera: text::camera_file(self, &limits),
            straps,
        })
    }
}

impl DriverKind {
    /// Returns the straps of the driver on a board; `None` for drivers without straps.
    ///
    /// # Errors
    /// Where the driver cannot have these microsteps, or the board cannot have the driver.
    fn straps_on(self, board: BoardName, microsteps: u8) -> Result<Option<Straps>, NewRigError> {
        let has_free_drivers = board.board().has_free_drivers;
        if !has_free_drivers && self != Self::Tmc2209Uart {
            return Err(NewRigError::Board { board, driver: self });
        }
        // Nobody straps the drivers that a board has.
        Ok(self.straps(microsteps)?.filter(|_| has_free_drivers))
    }
}
