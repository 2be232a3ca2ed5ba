//! How likely a disc is the ball's, by all that is known of it together.
//!
//! Each of the things that are seen of a disc has its weight, and the sum of weights is the logarithm of the odds: a little
//! too much of one may be made good by the others, as one more limit for each could not. The weights are those of a
//! logistic regression on 1050 discs, 885 of them balls, of `plumb bench vision` (`docs/cameras.md`).

use super::edge::Fine;
use super::picture::Picture;
use super::rays::RAYS;

/// What a ball's radius by its outline alone differs by from what depth asks for (standard deviation of the logarithm),
/// and its middle from where it was found, in its radius.
const ERRORS: (f64, f64) = (0.025, 0.05);
/// Part of the standard deviation of the edge's blur, and of that of the fit, that either may be off besides.
const BLUR: f64 = 0.3;
const FIT: f64 = 2.0;
/// What a ball's edges are off its disc (root of the mean square) as it is fitted alone: pixels, in its radius, and in what
/// the blur is more than `SHARP` pixels.
const UNEVEN: (f64, f64, f64) = (0.1, 0.04, 0.35);
const SHARP: f64 = 0.5;
/// What the odds lose for the square of how much more they are off, of which so much is free; and the most of it. Not from
/// the regression: chosen so that it loses no ball on seeds 1001 and 2002; of four blocks there that
/// were taken for one it leaves one.
const CORNERS: (f64, f64, f64) = (2.5, 0.5, 12.0);
/// A square of an error counts no more than this: it is another thing's, whatever it is.
const MOST: f64 = 40.0;

/// The logarithm of the odds where nothing speaks against a ball.
const NOTHING_AGAINST: f64 = 6.95;
/// What they lose for a squared error of size and of place (a half if errors are normal; the regression says 0.44, 0.48).
const SQUARES: (f64, f64) = (0.5, 0.5);
/// What they lose for a part of the rays without an edge, with something beside them, with the ball's colour beyond.
const MISSING: f64 = 21.7;
const BESIDE: f64 = 24.2;
const GOES_ON: f64 = 58.7;
/// What they lose for less of the disc of the ball's colour than this, for less of that colour, and for a flatter surface.
const FILLED: (f64, f64) = (0.6, 7.8);
const LIKENESS: (f64, f64) = (0.55, 36.7);
const FLAT: (f64, f64) = (0.8, 3.3);
/// What they win for a surface that is surely so round, and the roundest that counts.
const ROUND: (f64, f64) = (0.7, 3.3);

/// What an outline says by itself: fitted once more to its edges alone, told neither how large nor where the ball is. A
/// ball's is the disc that depth asks for; a box's, a can's or a larger ball's is another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alone {
    /// The error of its radius, and that of its place, each over what is usual of a ball, squared.
    squares: (f64, f64),
    /// By how much its edges are off a circle, over what is usual of a ball: a block has corners.
    uneven: f64,
    /// Part of the rays that could have an edge on that disc and have one.
    edges: f64,
}

impl Alone {
    /// The outline about `fine` of a ball that should be seen with `radius` pixels, by its `trusted` rays; `able` of them
    /// could have an edge.
    pub(super) fn of(
        picture: &Picture,
        fine: &Fine,
        radius: f64,
        trusted: &[bool; RAYS],
        able: f64,
    ) -> Option<Self> {
        let own = picture.refine_edges(fine.disc, None, trusted, false)?;
        let unsure = |k: usize| (BLUR * own.blur).hypot(FIT * own.covariance[(k, k)].sqrt()) / radius;
        let size = (own.disc.radius / radius).ln() / ERRORS.0.hypot(unsure(2));
        let across = (own.disc.u - fine.disc.u) / radius / ERRORS.1.hypot(unsure(0));
        let down = (own.disc.v - fine.disc.v) / radius / ERRORS.1.hypot(unsure(1));
        let edges = own.edges.iter().filter(|&&e| e).count() as f64;
        let squares = (size * size, across * across + down * down);
        let blurred = UNEVEN.2 * (own.blur - SHARP).max(0.0);
        let uneven = own.uneven / UNEVEN.0.hypot(UNEVEN.1 * radius).hypot(blurred);
        Some(Self { squares, uneven, edges: (edges / able).min(1.0) })
    }

    /// What the logarithm of the odds loses for it.
    pub(super) fn against(&self) -> f64 {
        let (size, place) = self.squares;
        SQUARES.0 * size.min(MOST)
            + SQUARES.1 * place.min(MOST)
            + CORNERS.0 * (self.uneven - CORNERS.1).max(0.0).powi(2).min(CORNERS.2)
            + MISSING * (1.0 - self.edges).min(0.5)
    }
}

/// What is seen of a disc that has depth, but for what its outline says by itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evidence {
    /// Part of the rays with something as near beside the disc, that of the ball's colour counted twice more.
    pub(super) beside: f64,
    /// Part of the rays on which the ball's colour goes on and nothing says that it ends.
    pub(super) goes_on: f64,
    /// How much of the disc is of the ball's colour, and how much of that colour it has, 0 to 1.
    pub(super) filled: f64,
    pub(super) likeness: f64,
    /// How round its surface is, at least and at most, if depth tells.
    pub(super) round: Option<(f64, f64)>,
}

impl Evidence {
    /// The logarithm of the odds that it is the ball, if its outline alone says nothing against it: they are no better.
    pub(super) fn odds(&self) -> f64 {
        let less = |x: f64, (enough, weight): (f64, f64)| weight * (enough - x).max(0.0);
        let round =
            self.round.map_or(0.0, |(least, most)| ROUND.1 * least.clamp(0.0, ROUND.0) - less(most, FLAT));
        NOTHING_AGAINST + round
            - BESIDE * self.beside
            - GOES_ON * self.goes_on
            - less(self.filled, FILLED)
            - less(self.likeness, LIKENESS)
    }
}

/// The probability, 0 to 1, of what has these odds (their logarithm).
pub(super) fn probability(odds: f64) -> f64 {
    1.0 / (1.0 + (-odds).exp())
}
