//! Two jogs: what a picture of two motors' ball tells of the rig and of the camera.
//!
//! Each motor in turn is turned until the ball has moved some pixels. The displacements give the
//! Jacobian in pixels, and the pictures taken meanwhile the latency of the camera. The motors stay
//! where the jogs have left them: the Jacobian is that of this place.

mod board;
mod kept;
mod latency;

use std::fmt;

use nalgebra::{Matrix2, Vector2};
use thiserror::Error;

pub use board::BoardHand;
pub use kept::KeptFrame;
pub use latency::{Moving, latency_s};

/// Rate of the jogs, full steps/s.
pub const RATE: f64 = 50.0;

/// First jog of a motor, full steps.
const FIRST_STEPS: f64 = 2.0;

/// Farthest turn of a motor, full steps.
const MAX_STEPS: f64 = 512.0;

/// Displacement that the jogs aim at, pixels. 4 px give the Jacobian best, and 8 px the latency.
const AIM_PX: f64 = 6.0;

/// Displacement that is enough, pixels.
const ENOUGH_PX: f64 = 5.0;

/// Least displacement, pixels: a motor that moves the ball less has no column.
const LEAST_PX: f64 = 3.0;

/// Least sine of the angle between the two displacements. 1 % of healthy rigs have less than 0.51.
const LEAST_SINE: f64 = 0.3;

/// Largest standard deviation of the pixels of a ball at rest.
const MAX_SCATTER_PX: f64 = 1.0;

/// Number of pictures before the first jog and after each motor's last.
const PICTURES: usize = 10;

/// Number of pictures between two jogs of a motor.
const QUICK_PICTURES: usize = 5;

/// Number of pictures that show whether the ball swings: a second at 30 Hz.
const SWING_PICTURES: usize = 30;

/// Most looks at a ball that swings, before the jogs.
const MAX_LOOKS: usize = 30;

/// Names of the motors.
const MOTORS: [char; 2] = ['A', 'B'];

/// A rig of two motors and the picture of its ball.
pub trait TwoMotors {
    /// Error of the link, the board or the camera.
    type Error;

    /// Takes this number of pictures of the ball with the motors at rest. Returns where it is seen,
    /// pixels; pictures without it are left out.
    ///
    /// # Errors
    /// Where the board or the camera fails.
    fn look(&mut self, pictures: usize) -> Result<Vec<Vector2<f64>>, Self::Error>;

    /// Turns a motor (0 for A) by `steps` full steps at [`RATE`], + pays out, and waits until it
    /// stands. Returns what was seen meanwhile.
    ///
    /// # Errors
    /// Where the board or the camera fails.
    fn jog(&mut self, motor: usize, steps: f64) -> Result<Moving, Self::Error>;
}

/// What two jogs have measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Jacobian, pixels a step: rows column and row of the picture, columns motors A and B.
    pub jacobian_px: Matrix2<f64>,
    /// Time by which the pictures are later than their time stamps, seconds.
    pub latency_s: f64,
    /// Where the ball hangs after the jogs, pixels.
    pub ball_px: Vector2<f64>,
    /// Turns of the motors, full steps.
    pub steps: [f64; 2],
}

/// Reason that the jogs give no frame.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Refusal {
    /// The ball is not seen in most pictures.
    #[error("the ball is seen in {seen} of {pictures} pictures: hang it into the picture")]
    NotSeen {
        /// Pictures with the ball.
        seen: usize,
        /// Pictures.
        pictures: usize,
    },
    /// The ball does not come to rest.
    #[error(
        "the ball does not hang still: it scatters by {scatter_px:.1} pixels, of at most \
         {MAX_SCATTER_PX}; stop its swing, and remove what else has its colour"
    )]
    Unsteady {
        /// Standard deviation, pixels.
        scatter_px: f64,
    },
    /// A motor does not move the ball.
    #[error(
        "motor {motor} moved the ball by {moved_px:.1} pixels with {steps:.0} steps: its motor is \
         not connected, its cable is slack, or another thing is seen"
    )]
    Still {
        /// Name of the motor.
        motor: char,
        /// Displacement, pixels.
        moved_px: f64,
        /// Turn of the motor, full steps.
        steps: f64,
    },
    /// Both motors move the ball along the same line.
    #[error(
        "both motors move the ball along one line (sine of the angle {sine:.2}, of at least \
         {LEAST_SINE}): the cables are nearly flat, or one of them carries nothing"
    )]
    Alike {
        /// Sine of the angle between the displacements.
        sine: f64,
    },
}

/// End of jogs without a result.
#[derive(Debug, Error)]
pub enum JogsError<E: fmt::Debug> {
    /// The rig or the picture is not as it must be.
    #[error(transparent)]
    Refused(Refusal),
    /// The board or the camera failed.
    #[error(transparent)]
    Rig(E),
}

/// Measures the rig in `hand` by two jogs.
///
/// # Errors
/// Where the ball is not seen or does not hang still, a motor does not move it, both move it alike,
/// or the board or the camera fails.
pub fn two_jogs<H: TwoMotors>(hand: &mut H) -> Result<Measured, JogsError<H::Error>>
where
    H::Error: fmt::Debug,
{
    let begin = rest(hand)?;
    let (mut ball_px, mut columns, mut steps) = (begin, [Vector2::zeros(); 2], [0.0; 2]);
    let mut moving = Vec::new();
    for motor in 0..2 {
        let jogged = jog_until_moved(hand, motor, ball_px)?;
        columns[motor] = (jogged.place - ball_px) / jogged.steps;
        steps[motor] = jogged.steps;
        moving.push((columns[motor], ball_px, jogged.moving));
        ball_px = jogged.place;
    }
    let sine = columns[0].normalize().perp(&columns[1].normalize()).abs();
    if sine < LEAST_SINE {
        return Err(JogsError::Refused(Refusal::Alike { sine }));
    }
    let jacobian_px = Matrix2::from_columns(&columns);
    Ok(Measured { jacobian_px, latency_s: latency_s(&moving), ball_px, steps })
}

/// Waits until the ball hangs still, and returns its place, pixels.
///
/// # Errors
/// Where the ball is not seen or does not hang still, or the board or the camera fails.
pub fn rest<H: TwoMotors>(hand: &mut H) -> Result<Vector2<f64>, JogsError<H::Error>>
where
    H::Error: fmt::Debug,
{
    let mut scatter_px = f64::INFINITY;
    for _ in 0..MAX_LOOKS {
        let place = place(hand, SWING_PICTURES)?;
        if place.scatter <= MAX_SCATTER_PX {
            return Ok(place.mean);
        }
        scatter_px = place.scatter;
    }
    Err(JogsError::Refused(Refusal::Unsteady { scatter_px }))
}

/// Place of the ball from several pictures.
struct Place {
    /// Mean, pixels.
    mean: Vector2<f64>,
    /// Standard deviation of a picture along the axis with the larger one, pixels.
    scatter: f64,
}

/// Returns the place of the ball from this number of pictures.
fn place<H: TwoMotors>(hand: &mut H, pictures: usize) -> Result<Place, JogsError<H::Error>>
where
    H::Error: fmt::Debug,
{
    let mut seen = hand.look(pictures).map_err(JogsError::Rig)?;
    if 2 * seen.len() <= pictures {
        // Of a few pictures in a row most may be without the ball by chance.
        seen = hand.look(SWING_PICTURES).map_err(JogsError::Rig)?;
        if 2 * seen.len() <= SWING_PICTURES {
            let (seen, pictures) = (seen.len(), SWING_PICTURES);
            return Err(JogsError::Refused(Refusal::NotSeen { seen, pictures }));
        }
    }
    let count = seen.len();
    let mean = seen.iter().sum::<Vector2<f64>>() / count as f64;
    let squares = |axis: usize| seen.iter().map(|at| (at[axis] - mean[axis]).powi(2)).sum::<f64>();
    let scatter = (squares(0).max(squares(1)) / count as f64).sqrt();
    Ok(Place { mean, scatter })
}

/// What a motor has done.
struct Jogged {
    /// Turn, full steps.
    steps: f64,
    /// Place of the ball then, pixels.
    place: Vector2<f64>,
    /// What was seen on the way.
    moving: Moving,
}

/// Pays out the cable of a motor until the ball has moved far enough from `begin`.
fn jog_until_moved<H: TwoMotors>(
    hand: &mut H,
    motor: usize,
    begin: Vector2<f64>,
) -> Result<Jogged, JogsError<H::Error>>
where
    H::Error: fmt::Debug,
{
    let (mut steps, mut next, mut moving) = (0.0, FIRST_STEPS, Moving::default());
    loop {
        moving.extend(hand.jog(motor, next - steps).map_err(JogsError::Rig)?);
        steps = next;
        let moved = (place(hand, QUICK_PICTURES)?.mean - begin).norm();
        if moved >= ENOUGH_PX || steps >= MAX_STEPS {
            break;
        }
        next = (steps * AIM_PX / moved).clamp(steps + 1.0, 2.0 * steps).round().min(MAX_STEPS);
    }
    let place = place(hand, PICTURES)?.mean;
    let moved_px = (place - begin).norm();
    match moved_px < LEAST_PX {
        true => {
            let motor = MOTORS[motor];
            Err(JogsError::Refused(Refusal::Still { motor, moved_px, steps }))
        }
        false => Ok(Jogged { steps, place, moving }),
    }
}

#[cfg(test)]
mod tests;
