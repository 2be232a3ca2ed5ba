//! Marks of cables that are near slack.

/// Estimated tension over the ball's weight below which a cable counts as near slack. The estimate
/// is wrong by 0.06 in the median (docs/understand/taut.md).
pub const NEAR_SLACK: f64 = 0.15;

/// Returns which cables have an estimated tension (over the ball's weight) below [`NEAR_SLACK`].
///
/// ```
/// use plumb_runtime::tension::near_slack;
///
/// assert_eq!(near_slack([0.4, 0.1, 0.7]), [false, true, false]);
/// ```
pub fn near_slack(tensions: [f64; 3]) -> [bool; 3] {
    tensions.map(|tension| tension < NEAR_SLACK)
}
