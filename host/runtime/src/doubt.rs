//! Reasons not to believe the measured positions.

use std::collections::VecDeque;
use std::fmt;

use plumb_frame::detect::BallDetector;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::observation::{BallObservation, TwoDepths};

/// Part by which the two depths of the ball may differ before a person is told. At 1.25 m it is
/// 50 mm.
const TOLD: f64 = 0.04;

/// Part by which they may differ before no target counts as reached.
const REFUSED: f64 = 0.08;

/// Observations over which the two depths are compared: 1 s at 30 Hz.
const WINDOW: usize = 30;

/// Least number of observations for a doubt.
const LEAST: usize = 5;

/// Reason not to believe the measured positions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Doubt {
    /// The ball's outline and its depth say different distances.
    Depth(TwoDepths),
    /// The ball jumped by this distance between two pictures, and stays there; metres.
    Jump(f64),
    /// The pictures show two balls.
    TwoBalls,
}

impl Doubt {
    /// Returns the doubt and what to do next, in words for people.
    pub fn with_advice(&self) -> String {
        format!("{self}. {}", self.advice())
    }

    /// Returns what to do next, in words for people.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::Depth(_) => {
                "Measure the ball (`ball.diameter_m` of the camera file), and check the unit of \
                 the depth (`depth_scale`) and that it is measured along the optical axis, not \
                 along the ray"
            }
            Self::Jump(_) => {
                "Look whether the camera or its mounting has moved: then calibrate again. If not, \
                 remove what else looks like the ball"
            }
            Self::TwoBalls => "Remove what looks like the ball but does not hang on the cables",
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Depth(depths) => write!(
                f,
                "the ball is at a depth of {:.3} m by its outline (`ball.diameter_m`), and of \
                 {:.3} m by the depth of its pixels (`depth_scale`): {:.0} % {}",
                depths.by_outline,
                depths.by_pixels,
                100.0 * depths.difference().abs(),
                if depths.difference() > 0.0 { "more" } else { "less" }
            ),
            Self::Jump(distance) => write!(
                f,
                "the ball jumped by {:.0} mm from one picture to the next, which no cable can do",
                1e3 * distance
            ),
            Self::TwoBalls => f.write_str("the pictures show two balls"),
        }
    }
}

/// Pictures in a row without a ball that are all searched by colour alone; later every tenth is.
const COLOUR_SEARCHES: u32 = 10;

/// Search by colour alone of pictures in which no ball was found.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ColourSearch {
    /// Number of pictures in a row without a ball.
    unseen: u32,
}

impl ColourSearch {
    /// Returns the two depths of what looks like the ball by its colours, in some of the frames
    /// without a ball.
    pub(crate) fn depths(
        &mut self,
        detector: &dyn BallDetector,
        frame: &RgbdFrame,
        is_found: bool,
    ) -> Option<TwoDepths> {
        self.unseen = if is_found { 0 } else { self.unseen + 1 };
        let is_searched = self.unseen <= COLOUR_SEARCHES || self.unseen.is_multiple_of(10);
        if is_found || !is_searched {
            return None;
        }
        // A frame that cannot be searched tells nothing.
        detector.compare_depths(frame).ok().flatten()
    }
}

/// Comparison of the ball's two depths over its last observations.
#[derive(Debug, Clone, Default)]
pub struct DepthComparison {
    search: ColourSearch,
    /// Of the ball.
    found: Window,
    /// Of what looks like the ball by its colours, where no ball was found.
    rejected: Window,
    is_told: bool,
}

impl DepthComparison {
    /// Takes in a frame and the ball that `detector` has found in it. Returns a doubt once.
    pub fn look(
        &mut self,
        detector: &dyn BallDetector,
        frame: &RgbdFrame,
        ball: Option<&BallObservation>,
    ) -> Option<Doubt> {
        let rejected = self.search.depths(detector, frame, ball.is_some());
        self.update(ball.and_then(|ball| ball.depths), rejected)
    }

    /// Takes in the depths of the ball, or of what was rejected. Returns a doubt once.
    pub(crate) fn update(
        &mut self,
        found: Option<TwoDepths>,
        rejected: Option<TwoDepths>,
    ) -> Option<Doubt> {
        self.found.extend(found);
        self.rejected.extend(rejected);
        let doubt = self.doubt().filter(|_| !self.is_told);
        self.is_told |= doubt.is_some();
        doubt
    }

    /// Returns the doubt that a person is told.
    pub fn doubt(&self) -> Option<Doubt> {
        self.found.median_above(TOLD).or_else(|| self.rejected.median_above(TOLD))
    }

    /// Returns the doubt with which no target counts as reached.
    pub(crate) fn refusal(&self) -> Option<Doubt> {
        self.found.median_above(REFUSED)
    }

    /// Returns that doubt once it is over a full window.
    pub(crate) fn lasting_refusal(&self) -> Option<Doubt> {
        self.refusal().filter(|_| self.found.0.len() == WINDOW)
    }
}

/// The last observations.
#[derive(Debug, Clone, Default)]
struct Window(VecDeque<TwoDepths>);

impl Window {
    fn extend(&mut self, depths: Option<TwoDepths>) {
        if depths.is_some() && self.0.len() == WINDOW {
            self.0.pop_front();
        }
        self.0.extend(depths);
    }

    /// Returns the observation with the median difference, where that is above `limit`.
    fn median_above(&self, limit: f64) -> Option<Doubt> {
        let mut sorted: Vec<TwoDepths> = self.0.iter().copied().collect();
        sorted.sort_by(|a, b| a.difference().total_cmp(&b.difference()));
        let median = sorted.get(sorted.len() / 2).filter(|_| sorted.len() >= LEAST)?;
        (median.difference().abs() > limit).then_some(Doubt::Depth(*median))
    }
}
