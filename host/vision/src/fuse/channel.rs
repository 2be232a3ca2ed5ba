//! The pictures of one camera until they are used.

use super::view::View;

/// Greatest age of a picture on arrival, seconds.
const MAX_AGE_S: f64 = 1.0;

/// Periods after the last picture from which on a camera is given up.
const MAX_PERIODS: f64 = 1.5;

/// Pictures of one camera.
#[derive(Debug, Clone, Default)]
pub(super) struct Channel {
    /// Stamp of the last picture, seconds.
    stamp: Option<f64>,
    /// Arrival of the last picture, or when it was first awaited, seconds.
    arrival: Option<f64>,
    /// Newest picture that no position contains yet: the ball in it.
    fresh: Option<Option<View>>,
    is_lost: bool,
}

/// Content of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Content {
    /// A picture that is not used yet.
    Fresh,
    /// A picture will come.
    Waiting,
    /// The camera is lost or late.
    Gone,
}

impl Channel {
    /// Takes a picture, unless its stamp or `now` cannot be. All times in seconds.
    pub(super) fn take(&mut self, stamp: f64, view: Option<View>, now: f64, period: f64) {
        // False for what is not a number, too.
        if !(now - MAX_AGE_S..=now + period).contains(&stamp) || !now.is_finite() {
            return;
        }
        // A clock that was set back by more than a picture may be old starts again.
        let is_old = |last: f64| stamp <= last && last <= now + MAX_AGE_S;
        if self.stamp.is_some_and(is_old) {
            return;
        }
        (self.stamp, self.arrival) = (Some(stamp), Some(now));
        (self.fresh, self.is_lost) = (Some(view), false);
    }

    /// Awaits the first picture from `now` on.
    pub(super) fn expect_from(&mut self, now: f64) {
        if now.is_finite() {
            self.arrival.get_or_insert(now);
        }
    }

    /// Notes that the camera was unplugged.
    pub(super) fn lose(&mut self) {
        (self.fresh, self.is_lost) = (None, true);
    }

    /// Marks the newest picture as used. Returns the ball in it.
    pub(super) fn clear(&mut self) -> Option<View> {
        self.fresh.take().flatten()
    }

    /// Returns what there is at `now`.
    pub(super) fn content(&self, now: f64, period: f64) -> Content {
        let is_late = |arrival: f64| now - arrival > MAX_PERIODS * period;
        if self.is_lost {
            Content::Gone
        } else if self.fresh.is_some() {
            Content::Fresh
        } else if self.arrival.is_some_and(is_late) {
            Content::Gone
        } else {
            Content::Waiting
        }
    }
}
