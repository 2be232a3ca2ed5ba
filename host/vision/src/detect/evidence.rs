//! How likely a disc is the ball's, by all that is known of it together.
//!
//! Each of the things that are seen of a disc has its weight, and the sum of weights is the
//! logarithm of the odds: a little too much of one may be made good by the others, as one more
//! limit for each could not. The weights are those of two logistic regressions (Newton's method,
//! squared weights penalised by 0.1, signs held) on what the detector looked at in pictures with a
//! ball and without: of `plumb bench vision --suite hard` (seeds 61 to 66) and of another
//! generator, not part of this repository, with other shading, edges, depth and distractors. What
//! came of them on seeds apart is in `docs/understand/detector.md`. 12 262 discs had depth and 3726
//! had none, 136 of those balls. Both sums were then raised (0.3 and 0.9), as a ball missed costs
//! as much as another thing taken for one and most discs are none.

use super::edge::Fine;
use super::picture::Picture;
use super::rays::RAYS;

/// What a ball's radius by its outline alone differs by from what depth asks for (standard
/// deviation of the logarithm), and its middle from where it was found, in its radius.
const ERRORS: (f64, f64) = (0.025, 0.05);
/// Part of the standard deviation of the edge's blur, and of that of the fit, that either may be
/// off besides.
const BLUR: f64 = 0.3;
const FIT: f64 = 2.0;
/// What a ball's edges are off its disc (root of the mean square) as it is fitted alone: pixels, in
/// its radius, and in what the blur is more than `SHARP` pixels.
const UNEVEN: (f64, f64, f64) = (0.2, 0.012, 0.35);
const SHARP: f64 = 0.5;
/// A square of an error counts no more than this: it is another thing's, whatever it is.
const MOST: f64 = 40.0;

/// The logarithm of the odds of what has depth where nothing speaks against a ball.
const NOTHING_AGAINST: f64 = 9.7;
/// What they lose for a squared error of size and of place.
const SQUARES: (f64, f64) = (0.4, 0.05);
/// What they lose for the square of how much more uneven than this the outline is, and the most of
/// that square.
const CORNERS: (f64, f64, f64) = (2.76, 0.7, 4.0);
/// What they lose for a part of the rays without an edge; with something as near beside it, of
/// another colour and of the ball's; with the ball's colour in what covers it, and beyond it where
/// nothing says that it ends.
const MISSING: f64 = 9.4;
const ATTACHED: f64 = 19.4;
const CONTINUED: f64 = 34.5;
const ALIKE: f64 = 12.0;
const GOES_ON: f64 = 14.5;
/// The roundest that counts, where it is surely so round.
const ROUND: f64 = 0.8;
/// How much less is then lost for the square of the outline's unevenness and for what is attached,
/// at a roundness of 1.
const KEPT: (f64, f64) = (0.98, 13.9);
/// Part of what uneven and missing edges say that does not count where depth shows a sphere that
/// ends all around. Not from the regression: a ball before a red print on the wall has the print's
/// edges.
const CUT_OUT: f64 = 0.8;
/// A sphere beyond doubt is surely so round at least, so much of it is on the sphere, and no
/// farther off it than this.
const SPHERE: (f64, f64, f64) = (0.8, 0.85, 0.04);
/// What they lose for less of the ball's colour than this; for a surface surely flatter than this,
/// and the most of that; for less of it on a sphere than this; and for how far off that sphere it
/// is, and the most of that.
const LIKENESS: (f64, f64) = (0.55, 33.2);
const FLAT: (f64, f64, f64) = (0.8, 13.1, 0.5);
const ON_SPHERE: (f64, f64) = (0.6, 7.1);
const OFF_SPHERE: (f64, f64) = (40.4, 0.2);

/// The same of what has no depth: where nothing speaks against a ball; for how uneven its outline
/// is, and the most of that; for a part of all rays without an edge (out of the picture too), and
/// for one of the outline alone.
const BARE: f64 = 5.44;
const BARE_UNEVEN: (f64, f64) = (3.19, 3.5);
const BARE_MISSING: (f64, f64) = (22.9, 13.7);
/// For less of the ball's colour, less shading and less contrast than this.
const BARE_LIKENESS: (f64, f64) = (0.55, 17.6);
const BARE_SHADING: (f64, f64) = (0.3, 15.4);
const BARE_CONTRAST: (f64, f64) = (0.35, 20.3);
/// For a part of it that is farther than a ball of its size, for what covers it, and what they win
/// for what is behind it.
const BARE_THROUGH: f64 = 16.9;
const BARE_COVERED: f64 = 7.5;
const BARE_BEHIND: f64 = 8.4;

/// What an outline says by itself: fitted once more to its edges alone, told neither how large nor
/// where the ball is. A ball's is the disc that depth asks for; a box's, a can's or a larger ball's
/// is another.
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
    /// The outline about `fine` of a ball that should be seen with `radius` pixels, by its
    /// `trusted` rays; `able` of them could have an edge.
    pub(super) fn of(
        picture: &Picture,
        fine: &Fine,
        radius: f64,
        trusted: &[bool; RAYS],
        able: f64,
    ) -> Option<Self> {
        let own = picture.refine_edges(fine.disc, None, trusted, false)?;
        let unsure =
            |k: usize| (BLUR * own.blur).hypot(FIT * own.covariance[(k, k)].sqrt()) / radius;
        let size = (own.disc.radius / radius).ln() / ERRORS.0.hypot(unsure(2));
        let across = (own.disc.u - fine.disc.u) / radius / ERRORS.1.hypot(unsure(0));
        let down = (own.disc.v - fine.disc.v) / radius / ERRORS.1.hypot(unsure(1));
        let edges = own.found();
        let squares = (size * size, across * across + down * down);
        let blurred = UNEVEN.2 * (own.blur - SHARP).max(0.0);
        let uneven = own.uneven / (UNEVEN.0 + UNEVEN.1 * radius).hypot(blurred);
        Some(Self { squares, uneven, edges: (edges / able).min(1.0) })
    }

    /// What the logarithm of the odds of what has depth loses for it, if that is surely so `round`,
    /// and, where it is a sphere beyond doubt, depth has what is behind it on so much of the rays:
    /// the edges may be those of something red behind then.
    pub(super) fn against(&self, round: f64, behind: f64) -> f64 {
        let (size, place) = self.squares;
        let corners = (self.uneven - CORNERS.1).max(0.0).powi(2).min(CORNERS.2);
        let edges = (CORNERS.0 - KEPT.0 * round) * corners + MISSING * (1.0 - self.edges).min(0.5);
        SQUARES.0 * size.min(MOST) + SQUARES.1 * place.min(MOST) + (1.0 - CUT_OUT * behind) * edges
    }

    /// The same of what has no depth and an edge on `edges` of all rays.
    pub(super) fn against_bare(&self, edges: f64) -> f64 {
        BARE_UNEVEN.0 * self.uneven.min(BARE_UNEVEN.1)
            + BARE_MISSING.0 * (1.0 - edges).min(0.6)
            + BARE_MISSING.1 * (1.0 - self.edges).min(0.5)
    }
}

/// What is seen of a disc that has depth, but for what its outline says by itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evidence {
    /// Part of the rays with something as near beside the disc: of another colour, and of the
    /// ball's.
    pub(super) attached: f64,
    pub(super) continued: f64,
    /// Part of the rays on which what covers it has the ball's colour.
    pub(super) alike: f64,
    /// Part of the rays on which the ball's colour goes on and nothing says that it ends.
    pub(super) goes_on: f64,
    /// How much of the ball's colour the disc has, 0 to 1.
    pub(super) likeness: f64,
    /// How round its surface is, at least and at most, if depth tells.
    pub(super) round: Option<(f64, f64)>,
    /// Part of it whose depth is about that of the ball's sphere, and how far off it is (median),
    /// in the ball's radius.
    pub(super) on_sphere: (f64, f64),
}

/// The same of a disc that has none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bare {
    /// How much of the ball's colour the disc has, by how much its parts differ in brightness, and
    /// the drop of colour at its edge.
    pub(super) likeness: f64,
    pub(super) shading: f64,
    pub(super) contrast: f64,
    /// Part of it that has the depth of what is behind a ball of its size.
    pub(super) through: f64,
    /// Part of the rays on which something covers it, and on which what is beside it is behind it.
    pub(super) covered: f64,
    pub(super) behind: f64,
}

impl Evidence {
    /// How round it surely is, as far as that counts.
    pub(super) fn roundness(&self) -> f64 {
        self.round.map_or(0.0, |(least, _)| least.clamp(0.0, ROUND))
    }

    /// Whether depth shows a sphere of the ball's size beyond doubt.
    pub(super) fn is_sphere(&self) -> bool {
        let (on, off) = self.on_sphere;
        self.round.is_some_and(|(least, _)| least > SPHERE.0) && on > SPHERE.1 && off < SPHERE.2
    }

    /// The logarithm of the odds that it is the ball, if its outline alone says nothing against it:
    /// they are no better.
    pub(super) fn odds(&self) -> f64 {
        let flat = self.round.map_or(0.0, |(_, most)| (FLAT.0 - most).clamp(0.0, FLAT.2));
        let (on, off) = self.on_sphere;
        NOTHING_AGAINST
            - (ATTACHED - KEPT.1 * self.roundness()) * self.attached
            - CONTINUED * self.continued
            - ALIKE * self.alike
            - GOES_ON * self.goes_on
            - less(self.likeness, LIKENESS)
            - FLAT.1 * flat
            - less(on, ON_SPHERE)
            - OFF_SPHERE.0 * off.min(OFF_SPHERE.1)
    }
}

impl Bare {
    /// As [`Evidence::odds`].
    pub(super) fn odds(&self) -> f64 {
        BARE - less(self.likeness, BARE_LIKENESS)
            - less(self.shading, BARE_SHADING)
            - less(self.contrast, BARE_CONTRAST)
            - BARE_THROUGH * self.through
            - BARE_COVERED * self.covered
            + BARE_BEHIND * self.behind
    }
}

/// What the odds lose where there is less of something than enough.
fn less(x: f64, (enough, weight): (f64, f64)) -> f64 {
    weight * (enough - x).max(0.0)
}

/// The probability, 0 to 1, of what has these odds (their logarithm).
pub(super) fn probability(odds: f64) -> f64 {
    1.0 / (1.0 + (-odds).exp())
}
