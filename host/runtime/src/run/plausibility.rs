//! Whether the measured positions can be those of the ball on the cables: its two depths, jumps, a
//! second ball, and its answer to the motors.
//!
//! A drift that is slower than the ball can move has no doubt, nor a jump within the noise.

use nalgebra::{Point3, Vector3};
use plumb_frame::observation::{Gaussian3, TwoDepths};

use crate::doubt::{DepthComparison, Doubt};
use crate::stop_reason::StopReason;

/// What one picture says.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sight {
    /// Position of the ball.
    pub(super) position: Option<Gaussian3>,
    /// Its depth by its outline and by its pixels.
    pub(super) depths: Option<TwoDepths>,
    /// The same of what looks like the ball by its colours alone, where no ball was found.
    pub(super) rejected: Option<TwoDepths>,
    /// Whether the picture shows another ball.
    pub(super) has_rival: bool,
}

/// Largest speed of the ball, and the motors' rate with it.
#[derive(Debug, Clone, Copy)]
pub(super) struct BallSpeed {
    /// The speed, m/s.
    pub(super) max: f64,
    /// Highest rate of a motor, Q4 steps/s.
    pub(super) motor_rate: f64,
}

/// Plausibility of the positions of a run.
#[derive(Debug)]
pub(super) struct Plausibility {
    depths: DepthComparison,
    jumps: JumpDetector,
    /// Jump that was found last and has ended no drive.
    jump: Option<Doubt>,
    response: MotorResponse,
    /// Number of pictures that show another ball.
    rivals: u32,
}

/// Pictures with another ball after which a person is told.
const RIVALS: u32 = 2;

impl Plausibility {
    /// Returns the state before the first picture. The ball moves at most at `speed`, and answers
    /// motors that have turned by `turn`, Q4 steps.
    pub(super) fn new(speed: BallSpeed, turn: i32) -> Self {
        Self {
            depths: DepthComparison::default(),
            jumps: JumpDetector {
                speed,
                turn,
                last: None,
                still: None,
                motors_before: None,
                away: None,
            },
            jump: None,
            response: MotorResponse { turn, ..MotorResponse::default() },
            rivals: 0,
        }
    }

    /// Takes in what a picture taken at `time` says, and the newest motor positions, Q4 steps.
    /// Returns the doubts to tell, each once.
    pub(super) fn update(
        &mut self,
        time: f64,
        sight: &Sight,
        motors: Option<[i32; 3]>,
    ) -> Vec<Doubt> {
        let mut doubts = Vec::from_iter(self.depths.update(sight.depths, sight.rejected));
        if let Some(position) = sight.position {
            if let Some(motors) = motors {
                self.response.update(motors, &position);
            }
            if let Some(distance) = self.jumps.update(Seen { time, position, motors }) {
                self.jump = Some(Doubt::Jump(distance));
                // What stands there now has answered no motor.
                self.response.restart();
                doubts.extend(self.jump);
            }
        }
        self.rivals += u32::from(sight.has_rival);
        if sight.has_rival && self.rivals == RIVALS {
            doubts.push(Doubt::TwoBalls);
        }
        doubts
    }

    /// Notes that the ball has answered the motors.
    #[cfg(test)]
    pub(super) fn note_answer(&mut self) {
        self.response.has_answered = true;
    }

    /// Returns whether the ball has answered the motors.
    pub(super) fn has_answered(&self) -> bool {
        self.response.has_answered
    }

    /// Returns the doubt that ends a drive. A jump ends one drive.
    pub(super) fn take_doubt(&mut self) -> Option<Doubt> {
        self.jump.take().or_else(|| self.depths.lasting_refusal())
    }

    /// Returns the reason to end a drive whose ball is at its target; `None` as long as that is in
    /// doubt.
    pub(super) fn arrival(&self) -> Option<StopReason> {
        if self.jumps.is_in_doubt() || self.depths.refusal().is_some() {
            None
        } else if self.has_answered() {
            Some(StopReason::Reached)
        } else if self.rivals >= RIVALS {
            Some(StopReason::Doubt(Doubt::TwoBalls))
        } else {
            self.response.is_at_rest().then_some(StopReason::AlreadyThere)
        }
    }
}

/// Distance by which the ball may seem to move beyond its speed and the noise, metres.
const SWING_M: f64 = 0.03;
/// Standard deviations of the noise of a move that count.
const SIGMAS: f64 = 5.0;
/// Time for which the ball must stay where it jumped to, seconds, and least number of pictures: a
/// false detection returns before.
const STAY_S: f64 = 0.5;
const STAY_PICTURES: u32 = 5;

/// Detector of a ball that jumps farther than the cables can move it, and stays there.
///
/// Pictures whose times are wrong are no jump, such as those that stand still and then go on: the
/// motors have turned in the meantime.
#[derive(Debug)]
struct JumpDetector {
    speed: BallSpeed,
    /// Turn of a motor that a ball on the cables answers, Q4 steps.
    turn: i32,
    /// Last position that the cables can have moved the ball to.
    last: Option<Seen>,
    /// First of the positions at which the ball stands still, with the motor positions of the
    /// picture before it: after a pause their news may be newer than a picture.
    still: Option<Seen>,
    /// Motor positions of the picture before, Q4 steps.
    motors_before: Option<[i32; 3]>,
    /// Positions since the ball has jumped.
    away: Option<Away>,
}

/// A position, when the picture was taken, and the newest motor positions then, Q4 steps.
#[derive(Debug, Clone, Copy)]
struct Seen {
    time: f64,
    position: Gaussian3,
    motors: Option<[i32; 3]>,
}

impl Seen {
    /// Returns the distance between two positions, metres.
    fn distance(&self, other: &Self) -> f64 {
        (self.position.mean - other.position.mean).norm()
    }

    /// Returns the farthest turn of a motor between two positions, Q4 steps.
    fn turned(&self, other: &Self) -> i32 {
        let motors = self.motors.into_iter().flatten().zip(other.motors.into_iter().flatten());
        motors.map(|(from, to)| (to - from).abs()).max().unwrap_or_default()
    }

    /// Returns whether a ball of at most `max_speed` can have moved from here to the other place in
    /// this time, seconds.
    fn reaches(&self, other: &Self, max_speed: f64, time: f64) -> bool {
        let moved = other.position.mean - self.position.mean;
        let covariance = self.position.covariance + other.position.covariance;
        let direction = moved.try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
        let noise = SIGMAS * direction.dot(&(covariance * direction)).max(0.0).sqrt();
        moved.norm() <= max_speed * time.max(0.0) + SWING_M + noise
    }
}

/// Positions after a jump.
#[derive(Debug, Clone, Copy)]
struct Away {
    first: Seen,
    distance: f64,
    pictures: u32,
    last: Seen,
}

impl JumpDetector {
    /// Takes in a position. Returns the distance of a jump after which the ball has stayed.
    fn update(&mut self, seen: Seen) -> Option<f64> {
        let motors_before = std::mem::replace(&mut self.motors_before, seen.motors);
        let max = self.speed.max;
        let reaches = |from: &Seen| from.reaches(&seen, max, seen.time - from.time);
        let jump = match (&mut self.away, self.last) {
            (Some(away), _) if reaches(&away.last) => {
                (away.last, away.pictures) = (seen, away.pictures + 1);
                let has_stayed =
                    away.pictures >= STAY_PICTURES && seen.time - away.first.time >= STAY_S;
                if !has_stayed && !self.motors_have_turned() {
                    return None;
                }
                self.away.filter(|_| has_stayed).map(|away| away.distance)
            }
            (_, Some(last)) if !reaches(&last) => {
                let distance = last.distance(&seen);
                self.away = Some(Away { first: seen, distance, pictures: 1, last: seen });
                return None;
            }
            _ => None,
        };
        (self.last, self.away) = (Some(seen), None);
        if self.still.is_none_or(|still| still.distance(&seen) > ANSWER_M) {
            self.still = Some(Seen { motors: motors_before.or(seen.motors), ..seen });
        }
        jump
    }

    /// Returns whether the motors have turned so far since the ball moved last that it can be where
    /// it is now. The motor positions are those of the picture after the jump: they may come later
    /// than the first one, and those of later ones answer the jump.
    fn motors_have_turned(&self) -> bool {
        let (Some(still), Some(away)) = (self.still, self.away) else { return false };
        let turned = still.turned(&away.last);
        // The time that the turn takes at least, where those of the pictures are wrong.
        let least = f64::from(turned) / self.speed.motor_rate;
        let time = least.max(away.first.time - still.time);
        away.pictures == 2
            && turned >= self.turn
            && still.reaches(&away.first, self.speed.max, time)
    }

    /// Returns whether the last position is one after a jump.
    fn is_in_doubt(&self) -> bool {
        self.away.is_some()
    }
}

/// Least distance by which the ball has moved where it answers a motor, metres.
const ANSWER_M: f64 = 0.005;
/// Square of the standard deviations of a position that it must have moved, too.
const SQUARE_SIGMAS: f64 = 16.0;
/// Turn of a motor from which on the ball may answer, Q4 steps.
const FIRST_TURN: i32 = 16;
/// Share of a new position in the running mean.
const GAIN: f64 = 0.25;

/// Whether the ball has moved since the motors turn.
#[derive(Debug, Default)]
struct MotorResponse {
    /// Turn of a motor that a ball on the cables answers, Q4 steps.
    turn: i32,
    /// Motor positions at the first position of the ball, Q4 steps.
    start: Option<[i32; 3]>,
    /// Farthest turn of a motor since then, Q4 steps.
    turned: i32,
    /// Mean position while no motor had turned, and the number of positions.
    before: (Point3<f64>, u32),
    /// Running mean of the positions.
    now: Point3<f64>,
    has_answered: bool,
}

impl MotorResponse {
    /// Begins anew.
    fn restart(&mut self) {
        *self = Self { turn: self.turn, ..Self::default() };
    }

    /// Takes in a position and the motor positions.
    fn update(&mut self, motors: [i32; 3], position: &Gaussian3) {
        let start = *self.start.get_or_insert(motors);
        let turned = start.iter().zip(motors).map(|(from, to)| (to - from).abs()).max();
        self.turned = self.turned.max(turned.unwrap_or(0));
        if self.turned < FIRST_TURN {
            let (mean, count) = &mut self.before;
            *count += 1;
            *mean += (position.mean - *mean) / f64::from(*count);
            self.now = *mean;
            return;
        }
        self.now += GAIN * (position.mean - self.now);
        let moved = self.now - self.before.0;
        let weight = position.covariance.try_inverse().unwrap_or_default();
        let is_sure = moved.dot(&(weight * moved)) > SQUARE_SIGMAS;
        self.has_answered |= is_sure && moved.norm() > ANSWER_M;
    }

    /// Returns whether no motor has turned so far that the ball must have moved.
    fn is_at_rest(&self) -> bool {
        self.turned < self.turn
    }
}
