//! The board's clock as the host sees it: whether the board has restarted.

use std::time::Duration;

use plumb_protocol::units::Micros;

/// Largest lag of the board's clock behind the host's that counts as the same start: the jitter of
/// the link. A board has run for longer before a host has configured it.
const TOLERANCE: Duration = Duration::from_millis(200);

/// Time on the board's clock, and when it came, on the host's.
#[derive(Debug, Clone, Copy)]
struct Sample {
    board: Duration,
    host: Duration,
}

/// Clock of the board, from the times in its messages.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BoardClock {
    /// Newest time of a board that had this host's configuration.
    configured: Option<Sample>,
    /// Newest time of any message.
    newest: Option<Sample>,
}

impl BoardClock {
    /// Takes in the time of a message that came at `host`; `is_configured` is whether the board had
    /// this host's configuration.
    pub(super) fn update(&mut self, board: Micros, host: Duration, is_configured: bool) {
        let sample = Some(Sample { board: Duration::from_micros(board.0), host });
        self.newest = sample;
        if is_configured {
            self.configured = sample;
        }
    }

    /// Returns whether the clock has gone on since the board last had this host's configuration. A
    /// board on a chip begins at 0 when it restarts, an emulated one goes on.
    pub(super) fn has_gone_on(&self) -> bool {
        let (Some(configured), Some(newest)) = (self.configured, self.newest) else { return false };
        let expected = configured.board + newest.host.saturating_sub(configured.host);
        newest.board + TOLERANCE >= expected
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns whether the clock has gone on from 5 s to `board_ms` in 400 ms of the host's time.
    fn has_gone_on(board_ms: u64) -> bool {
        let mut clock = BoardClock::default();
        clock.update(Micros(5_000_000), Duration::from_millis(100), true);
        clock.update(Micros(board_ms * 1000), Duration::from_millis(500), false);
        clock.has_gone_on()
    }

    #[test]
    fn a_clock_that_begins_anew_is_that_of_a_restarted_board() {
        assert!(has_gone_on(5_400) && has_gone_on(5_200) && has_gone_on(6_000));
        assert!(!has_gone_on(5_199) && !has_gone_on(0) && !has_gone_on(400));
        assert!(!BoardClock::default().has_gone_on());
    }
}
