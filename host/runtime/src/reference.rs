//! References on the wire, from motions in SI units.

use nalgebra::Vector3;
use plumb_path::trajectory::Moment;
use plumb_protocol::config::Workspace;
use plumb_protocol::message::{KNOTS, Knot, Reference};
use plumb_protocol::units::{Micros, Point, Speed};

/// Time between two knots, seconds. Six knots then reach 0.6 s beyond the board's report, which is
/// enough for the board's look-ahead, its braking and a lost message. Cubic polynomials between
/// the knots are within 0.1 mm of the path.
pub const INTERVAL_S: f64 = 0.15;

/// Returns the message `sequence` with knots from the path's time `first` on, sent at the path's
/// time `now`; both in seconds, not negative. A motion beyond the range of the wire becomes the
/// origin at rest, which the board refuses where it is outside the workspace.
pub fn reference(
    sequence: u16,
    waits: bool,
    now: f64,
    first: f64,
    motion: impl Fn(f64) -> Moment,
) -> Reference {
    Reference {
        sequence,
        now: micros(now),
        waits,
        first: micros(first),
        interval_us: (INTERVAL_S * 1e6) as u32,
        knots: std::array::from_fn::<_, KNOTS, _>(|k| knot(&motion(first + k as f64 * INTERVAL_S))),
    }
}

/// Has a reference rest at the border of `workspace` where its extrapolation leaves it. A first
/// knot outside stays, and the board refuses it.
pub fn keep_inside(reference: &mut Reference, workspace: &Workspace) {
    let [_, ahead @ ..] = &mut reference.knots;
    let outside = ahead.iter().position(|knot| !workspace.contains(knot.position));
    for knot in ahead.iter_mut().skip(outside.unwrap_or(KNOTS)) {
        let Workspace { min, max } = workspace;
        for (axis, at) in knot.position.0.iter_mut().enumerate() {
            *at = (*at).clamp(min.0[axis], max.0[axis]);
        }
        knot.velocity = Default::default();
    }
}

fn knot(moment: &Moment) -> Knot {
    let position = Point::from_metres(moment.position.into()).unwrap_or_default();
    Knot { position, velocity: speeds(moment.velocity) }
}

fn speeds(velocity: Vector3<f64>) -> [Speed; 3] {
    let velocity: [f64; 3] = velocity.into();
    velocity.map(|speed| Speed::from_si(speed).unwrap_or_default())
}

fn micros(seconds: f64) -> Micros {
    // The cast saturates.
    Micros((seconds * 1e6).round() as u64)
}
