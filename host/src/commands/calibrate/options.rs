//! Options of the three ways.

use clap::Args;
use nalgebra::{Point2, Point3};
use plumb_calibrate::board::{CharucoSheet, Placement};
use plumb_calibrate::motors::MotorMeasures;
use plumb_calibrate::places::{MAX_PLACES, MIN_PLACES, PLACE_SD_M};

use crate::cli::exit::{Failure, failed};
use crate::cli::numbers;
use crate::cli::numbers::{list, point};
use crate::session::options::PageAddress;

// The ways that exclude an option. With `requires` clap accepts the option: it waives a requirement
// that conflicts with another argument.
const NOT_BOARD: [&str; 5] = ["motors", "ball", "lens", "import", "print_board"];
const NOT_MOTORS: [&str; 5] = ["board", "ball", "lens", "import", "print_board"];
const NOT_BALL: [&str; 5] = ["board", "motors", "lens", "import", "print_board"];

/// Parses a pixel, "U,V".
fn pixel(text: &str) -> Result<Point2<f64>, String> {
    list(text, &numbers::PIXEL).map(Point2::from)
}

/// Parses the side of a square, millimetres.
fn square(text: &str) -> Result<CharucoSheet, String> {
    let side = numbers::SQUARE.parse(text)?;
    CharucoSheet::with_square(side * 1e-3).ok_or_else(|| format!("must be {}", numbers::SQUARE))
}

/// Where the board is.
#[derive(Args)]
#[command(next_help_heading = "With --board")]
pub(super) struct BoardOptions {
    /// Side of the board's squares as measured on the print, 1 to 1000 mm [default: 36]
    #[arg(long, value_name = "MM", value_parser = square, conflicts_with_all = NOT_BOARD)]
    square: Option<CharucoSheet>,
    /// Place of the board's origin (its lower left corner) in the rig frame, each -100 to 100 m
    #[arg(long, value_name = "X,Y,Z", value_parser = point, conflicts_with_all = NOT_BOARD)]
    #[arg(allow_hyphen_values = true)]
    origin: Option<Point3<f64>>,
    /// Turn of the board about the rig's z axis, -360 to 360 degrees, counter-clockwise from above
    #[arg(long, value_name = "DEGREES", value_parser = numbers::within(numbers::ANGLE))]
    #[arg(conflicts_with_all = NOT_BOARD)]
    turn: Option<f64>,
    /// The board stands on its lower edge instead of lying
    #[arg(long, conflicts_with_all = NOT_BOARD)]
    upright: bool,
}

impl BoardOptions {
    pub(super) fn board(&self) -> CharucoSheet {
        self.square.unwrap_or(CharucoSheet::SHEET)
    }

    pub(super) fn placement(&self) -> Placement {
        Placement {
            origin: self.origin.unwrap_or_else(Point3::origin),
            turn: self.turn.unwrap_or(0.0).to_radians(),
            is_upright: self.upright,
        }
    }
}

/// Where the motors are.
#[derive(Args)]
#[command(next_help_heading = "With --motors")]
pub(super) struct MotorOptions {
    /// Column and row where the cable leaves a motor, each -65535 to 65535 pixels; three times, in
    /// the order A, B, C (with [plane] twice, and at least 0). Without it the picture is kept, so
    /// that they can be read there
    #[arg(long = "pixel", value_name = "U,V", value_parser = pixel)]
    #[arg(conflicts_with_all = NOT_MOTORS)]
    pub(super) pixels: Vec<Point2<f64>>,
    /// Choose the pixels in the live picture in a browser, look at the pose and accept it there
    #[arg(long, conflicts_with_all = NOT_MOTORS, conflicts_with_all = ["pixels", "yes"])]
    pub(super) page: bool,
    #[command(flatten)]
    pub(super) address: PageAddress,
    /// Height of the motors above the origin, -100 to 100 m. The origin is then below motor C in x
    /// and below motor B in y
    #[arg(long, value_name = "M", value_parser = numbers::within(numbers::COORDINATE))]
    #[arg(conflicts_with_all = NOT_MOTORS)]
    height: Option<f64>,
    /// Measured place of a motor in the rig frame, each -100 to 100 m, instead of --height; three
    /// times, in the order A, B, C
    #[arg(long = "motor", value_name = "X,Y,Z", value_parser = point)]
    #[arg(allow_hyphen_values = true)]
    #[arg(conflicts_with_all = NOT_MOTORS)]
    #[arg(conflicts_with = "height")]
    measured: Vec<Point3<f64>>,
}

impl MotorOptions {
    /// Returns the pixels of A, B, C; `None` where there are none.
    pub(super) fn pixels(&self) -> Result<Option<[Point2<f64>; 3]>, Failure> {
        if self.pixels.is_empty() {
            return Ok(None);
        }
        let n = self.pixels.len();
        let pixels = self.pixels.clone().try_into();
        pixels.map(Some).map_err(|_| failed(format!("--pixel: 3 are needed; given: {n}")))
    }

    /// Returns whether there are neither pixels nor a page: a picture is kept, and no pose found.
    pub(super) fn is_for_picture(&self) -> Result<bool, Failure> {
        Ok(self.pixels()?.is_none() && !self.page)
    }

    /// Checks that the places of the motors are measured, where their pixels are given, and that
    /// there are as many places as motors.
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.pixels()?.is_some() || !self.measured.is_empty() {
            self.measures()?;
        }
        Ok(())
    }

    /// Checks that nothing is given that a rig with `[plane]` does not have.
    pub(super) fn check_planar(&self) -> Result<(), Failure> {
        match self.height.is_none() && self.measured.is_empty() {
            true => Ok(()),
            false => Err(failed("--height and --motor go with no [plane], which has no metres")),
        }
    }

    /// Returns what to give besides the pixels, as the end of a message; empty where the places of
    /// the motors are measured.
    pub(super) fn also_needed(&self) -> &'static str {
        match self.measures() {
            Ok(_) => "",
            Err(_) => {
                ". Give also --height M, the height of the motors above the origin, or --motor \
                 X,Y,Z three times"
            }
        }
    }

    pub(super) fn measures(&self) -> Result<MotorMeasures, Failure> {
        let needed = "give --height (of the motors above the origin) or --motor three times";
        match (self.height, self.measured.len()) {
            (Some(height), _) => Ok(MotorMeasures::Height(height)),
            (None, 0) => Err(failed(needed)),
            (None, n) => {
                let places = self.measured.clone().try_into();
                let wrong = |_| failed(format!("--motor: 3 are needed; given: {n}"));
                places.map(MotorMeasures::Places).map_err(wrong)
            }
        }
    }
}

/// Where the ball is put.
#[derive(Args)]
#[command(next_help_heading = "With --ball")]
pub(super) struct PlaceOptions {
    /// Place of the ball's centre in the rig frame, each -100 to 100 m; at least four times.
    /// Without it the places are typed
    #[arg(long = "place", value_name = "X,Y,Z", value_parser = point)]
    #[arg(allow_hyphen_values = true)]
    #[arg(conflicts_with_all = NOT_BALL)]
    pub(super) places: Vec<Point3<f64>>,
    /// Standard deviation of the measured places along each axis, 0.01 to 1000 mm
    #[arg(long, value_name = "MM", value_parser = numbers::within(numbers::DEVIATION))]
    #[arg(conflicts_with_all = NOT_BALL)]
    place_error: Option<f64>,
}

impl PlaceOptions {
    /// Checks that there are enough places for a pose, and not too many; or none, to be typed.
    pub(super) fn check(&self) -> Result<(), Failure> {
        match self.places.len() {
            0 | MIN_PLACES..=MAX_PLACES => Ok(()),
            count => Err(failed(format!(
                "--place: {MIN_PLACES} to {MAX_PLACES} are needed; given: {count}"
            ))),
        }
    }

    /// Returns the standard deviation of a place, metres.
    pub(super) fn place_sd(&self) -> f64 {
        self.place_error.map_or(PLACE_SD_M, |mm| mm * 1e-3)
    }
}
