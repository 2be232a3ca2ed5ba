//! Mapping of a sender's time stamps to the host's clock.

use thiserror::Error;

use crate::clock::HostClock;

/// Change of the offset between a sender's clock and the host's from one frame to the next above
/// which the time of the frame is unknown, seconds.
const MAX_JUMP_S: f64 = 1.0;

/// Reason why the time of a frame is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum SenderClockError {
    /// A time stamp is not after the one before.
    #[error("the time stamp is {t} after {before}: it must grow from frame to frame")]
    NotGrowing {
        /// Time stamp, seconds.
        t: f64,
        /// Time stamp of the frame before, seconds.
        before: f64,
    },
    /// The time stamps and the arrivals do not run evenly.
    #[error(
        "the time stamp has moved by {0:+.3} s against this computer's clock since the frame \
         before: its clock was set, or the frame was held up"
    )]
    Jump(f64),
}

/// Mapping of the time stamps of one sender to the host's clock.
#[derive(Debug)]
pub struct SenderClock {
    mapping: HostClock,
    before: Option<Before>,
}

/// The frame before.
#[derive(Debug, Clone, Copy)]
struct Before {
    /// Time stamp, seconds on the sender's clock.
    t: f64,
    /// Arrival on the host's clock minus sending on the sender's clock, seconds.
    offset: f64,
}

impl Default for SenderClock {
    fn default() -> Self {
        Self::new()
    }
}

impl SenderClock {
    /// Returns the mapping of a new sender.
    pub fn new() -> Self {
        // The sender states the age of its frames, where it knows it.
        Self { mapping: HostClock::new(0.0), before: None }
    }

    /// Returns the time of a frame's exposure, seconds on the host's clock. The exposure was at
    /// `t` on the sender's clock, the frame was `age` seconds old when it was sent, and it arrived
    /// at `arrival` on the host's clock.
    ///
    /// # Errors
    /// Where the time is unknown: `t` does not grow, or the clocks have moved against each other.
    pub fn taken(&mut self, t: f64, age: f64, arrival: f64) -> Result<f64, SenderClockError> {
        let offset = arrival - age - t;
        if let Some(before) = self.before.replace(Before { t, offset }) {
            if t <= before.t {
                return Err(SenderClockError::NotGrowing { t, before: before.t });
            }
            let jump = before.offset - offset;
            if jump.abs() > MAX_JUMP_S {
                return Err(SenderClockError::Jump(jump));
            }
        }
        Ok(self.mapping.taken(t, arrival - age))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stated_age_is_subtracted_and_delays_are_not_added() {
        let mut clock = SenderClock::new();
        // The sender's clock is 500 s ahead. Frames are 30 to 50 ms old when they are sent, and
        // take 1 to 9 ms.
        for frame in 0..100 {
            let taken = f64::from(frame) / 60.0;
            let age = 0.03 + f64::from(frame % 3) * 0.01;
            let delay = if frame % 7 == 0 { 0.001 } else { 0.009 };
            let mapped = clock.taken(500.0 + taken, age, taken + age + delay).unwrap();
            assert!((mapped - taken - 0.001).abs() < 2e-4, "frame {frame}: {mapped} for {taken}");
        }
    }

    #[test]
    fn a_frame_whose_time_is_unknown_is_lost() {
        let mut clock = SenderClock::new();
        clock.taken(10.0, 0.0, 1.0).unwrap();
        let again = clock.taken(10.0, 0.0, 1.1).unwrap_err();
        assert!(matches!(again, SenderClockError::NotGrowing { .. }), "{again}");
        clock.taken(10.2, 0.0, 1.2).unwrap();
        // Held up for 3 s, then in time again.
        let late = clock.taken(10.3, 0.0, 4.3).unwrap_err();
        assert!(matches!(late, SenderClockError::Jump(jump) if jump < -2.9), "{late}");
        assert!(clock.taken(13.4, 0.0, 4.4).is_err());
        assert!((clock.taken(13.5, 0.0, 4.5).unwrap() - 4.5).abs() < 1e-9);
        // A clock that was set is followed after one frame.
        assert!(clock.taken(1000.0, 0.0, 4.6).is_err());
        assert!((clock.taken(1000.1, 0.0, 4.7).unwrap() - 4.7).abs() < 1e-9);
    }

    #[test]
    fn frames_after_one_that_was_held_up_keep_their_age() {
        let mut clock = SenderClock::new();
        // A link with a backlog: one delay falls by more than a second.
        let delays = [0.0, 0.9, 1.8, 2.7, 1.5, 1.4, 1.3];
        for (frame, delay) in (0..).zip(delays) {
            let sent = f64::from(frame) * 2.0;
            match clock.taken(500.0 + sent, 0.0, sent + delay) {
                Ok(taken) => assert!((taken - sent).abs() < 0.02, "frame {frame}: {taken}"),
                Err(error) => assert!(frame == 4, "frame {frame}: {error}"),
            }
        }
    }
}
