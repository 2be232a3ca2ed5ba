//! Speed along a curve: as fast as the limits allow.
//!
//! At each node of a grid over the arc length, curvature and its change bound the speed and the
//! acceleration along the curve. A backward and a forward pass bring the speed within the
//! acceleration (Bobrow, Dubowsky, Gibson, "Time-optimal control of robotic manipulators along
//! specified paths", Int. J. Robotics Research 4 (1985), for a bound that does not depend on the
//! speed). [`crate::time_law`] smooths the result over a window of time; therefore each bound also
//! holds over the distance that the ball travels within that window.
//!
//! With the arc length s, the tangent t and the curvature vector k, the derivatives of the place
//! are v = ṡ t, a = s̈ t + ṡ² k and j = s⃛ t + 3 ṡ s̈ k + ṡ³ k'. The limits are shared as follows:
//! s̈ and ṡ² k each get 1/√2 of the acceleration, s⃛ gets half of the jerk, and 3 ṡ s̈ k and ṡ³ k'
//! get a quarter of it each.

use crate::curve::{Curve, CurvePoint, Interval};
use crate::motion::MotionLimits;

/// Largest cell of the grid, metres.
const CELL_M: f64 = 0.001;
/// Least number of cells of an interval.
const LEAST_CELLS: f64 = 2.0;
/// Largest number of cells of a curve: beyond it, the cells grow.
const MOST_CELLS: f64 = 100_000.0;

/// Speed along a curve at the nodes of a grid; from node to node the acceleration is constant.
#[derive(Debug, Clone)]
pub(crate) struct Profile {
    /// Nodes by arc length, from 0 to the length of the curve.
    pub(crate) nodes: Vec<Node>,
    /// Length of the time window for which the profile has room, seconds.
    pub(crate) window: f64,
}

/// Node of a grid over the arc length.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    /// Arc length, metres.
    pub(crate) s: f64,
    /// Whether the ball stops there.
    pub(crate) stops: bool,
    /// Speed, m/s.
    pub(crate) speed: f64,
    /// Largest acceleration along the curve, m/s².
    pub(crate) acceleration: f64,
}

/// Shares of the limits.
#[derive(Debug, Clone, Copy)]
struct Shares {
    speed: f64,
    /// Acceleration along the curve, and across it, m/s².
    acceleration: f64,
    /// Jerk of 3 ṡ s̈ k, and of ṡ³ k', m/s³.
    jerk: f64,
}

impl Profile {
    /// Returns the profile along a curve within `limits`. It begins at rest and ends at rest; that
    /// of a closed curve goes round for ever.
    pub(crate) fn new(curve: &Curve, limits: &MotionLimits) -> Self {
        let shares = Shares {
            speed: limits.speed,
            acceleration: limits.acceleration * std::f64::consts::FRAC_1_SQRT_2,
            jerk: limits.jerk / 4.0,
        };
        // A moving average over the window changes an acceleration of ±a by 2a within it.
        let window = 2.0 * shares.acceleration / (limits.jerk / 2.0);
        let mut grid = Grid { nodes: bounds(curve, &shares), is_closed: curve.is_closed };
        let mut rough = grid.clone();
        rough.relax();
        let gain = shares.acceleration * window;
        let reach = |node: &Node| window * shares.speed.min(node.speed + gain);
        grid.erode(&rough.nodes.iter().map(reach).collect::<Vec<_>>());
        grid.relax();
        Self { nodes: grid.nodes, window }
    }
}

/// Returns the nodes of the grid with the bounds of speed and acceleration.
fn bounds(curve: &Curve, shares: &Shares) -> Vec<Node> {
    let largest = CELL_M.max(curve.length() / MOST_CELLS);
    let mut nodes = Vec::new();
    for interval in curve.intervals() {
        nodes.extend(interval_bounds(curve, &interval, largest, shares));
    }
    if let Some(last) = nodes.last().copied() {
        let stops = if curve.is_closed { nodes[0].stops } else { true };
        nodes[0].stops = stops;
        nodes.push(Node { s: curve.length(), stops, ..last });
    }
    nodes
}

/// Returns the nodes of an interval without its end.
fn interval_bounds(
    curve: &Curve,
    interval: &Interval,
    largest_cell: f64,
    shares: &Shares,
) -> impl Iterator<Item = Node> {
    let Interval { from, to, stops, speed } = *interval;
    let shares = Shares { speed: shares.speed.min(speed), ..*shares };
    let cells = ((to - from) / largest_cell).ceil().max(LEAST_CELLS);
    let half = (to - from) / cells / 2.0;
    (0..cells as usize).map(move |i| {
        let s = from + 2.0 * half * i as f64;
        let points = [0.0, 1.0, 2.0].map(|n| curve.at(s + n * half));
        let (speed, acceleration) = bound(&points, half, &shares);
        Node { s, stops: stops && i == 0, speed, acceleration }
    })
}

/// Returns the largest speed, m/s, and the largest acceleration along the curve, m/s², in a cell.
/// `points` are its ends and its middle, at the distance `half`, metres.
fn bound(points: &[CurvePoint; 3], half: f64, shares: &Shares) -> (f64, f64) {
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let curvature = largest(&points.map(|point| point.curvature.norm()));
    let change = |i: usize| (points[i + 1].curvature - points[i].curvature).norm() / half;
    let change = largest(&[change(0), change(1)]);
    let speed = shares.speed;
    let speed = speed.min((shares.acceleration / curvature).sqrt());
    let speed = speed.min((shares.jerk / change).cbrt());
    let acceleration = shares.acceleration.min(shares.jerk / (3.0 * speed * curvature));
    (speed, acceleration)
}

/// Grid over the arc length. The last node of a closed curve is its first one.
#[derive(Clone)]
struct Grid {
    nodes: Vec<Node>,
    is_closed: bool,
}

/// Bounds of speed and acceleration.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    /// Speed, m/s.
    speed: f64,
    /// Acceleration along the curve, m/s².
    acceleration: f64,
}

impl Bounds {
    /// Returns the lower of each of the bounds.
    fn min(self, other: Self) -> Self {
        let speed = self.speed.min(other.speed);
        Self { speed, acceleration: self.acceleration.min(other.acceleration) }
    }
}

impl Node {
    /// Brings the node within `bounds`.
    fn keep_below(&mut self, bounds: Bounds) {
        self.speed = self.speed.min(bounds.speed);
        self.acceleration = self.acceleration.min(bounds.acceleration);
    }
}

/// Least bounds of the nodes between any two, from a table of those of 1, 2, 4, ... neighbours.
struct LeastBounds(Vec<Vec<Bounds>>);

impl LeastBounds {
    /// Makes the table of at least one node.
    fn new(nodes: &[Node]) -> Self {
        let single = |node: &Node| Bounds { speed: node.speed, acceleration: node.acceleration };
        let mut table = vec![nodes.iter().map(single).collect::<Vec<_>>()];
        let mut width = 1;
        while 2 * width <= nodes.len() {
            let before = &table[table.len() - 1];
            let pairs = before.iter().zip(&before[width..]);
            let next = pairs.map(|(left, right)| left.min(*right)).collect();
            table.push(next);
            width *= 2;
        }
        Self(table)
    }

    /// Returns the least bounds of the nodes from `first` to `last`, both included.
    fn within(&self, first: usize, last: usize) -> Bounds {
        let last = last.max(first);
        let level = (last - first + 1).ilog2() as usize;
        let row = &self.0[level];
        row[first].min(row[last + 1 - (1 << level)])
    }
}

impl Grid {
    /// Replaces the bounds of each node by the least ones within the distance `reach` of it,
    /// metres.
    fn erode(&mut self, reach: &[f64]) {
        let Some(last) = self.nodes.last().copied() else { return };
        let least = LeastBounds::new(&self.nodes);
        let places: Vec<f64> = self.nodes.iter().map(|node| node.s).collect();
        let end = places.len() - 1;
        // The first node beyond a distance counts: its cell begins within it.
        let before = |s: f64| places.partition_point(|place| *place < s).saturating_sub(1);
        let after = |s: f64| places.partition_point(|place| *place <= s).min(end);
        for (i, node) in self.nodes.iter_mut().enumerate() {
            let (from, to) = (places[i] - reach[i], places[i] + reach[i]);
            node.keep_below(least.within(before(from), after(to)));
            if self.is_closed && from < 0.0 {
                node.keep_below(least.within(before(from + last.s), end));
            }
            if self.is_closed && to > last.s {
                node.keep_below(least.within(0, after(to - last.s)));
            }
        }
    }

    /// Brings the speeds within the accelerations, by a backward and a forward pass. A closed grid
    /// needs two rounds of each.
    fn relax(&mut self) {
        for node in self.nodes.iter_mut().filter(|node| node.stops) {
            node.speed = 0.0;
        }
        let last = self.nodes.len() - 1;
        for _ in 0..if self.is_closed { 2 } else { 1 } {
            for i in (0..last).rev() {
                self.limit(i, i + 1);
            }
            self.join();
        }
        for _ in 0..if self.is_closed { 2 } else { 1 } {
            for i in 0..last {
                self.limit(i + 1, i);
            }
            self.join();
        }
    }

    /// Limits the speed of the node `i` to what the neighbour `from` allows.
    fn limit(&mut self, i: usize, from: usize) {
        let reachable = reachable(&self.nodes[from], &self.nodes[i]);
        self.nodes[i].speed = self.nodes[i].speed.min(reachable);
    }

    /// Gives the first and the last node of a closed grid the lower of their speeds.
    fn join(&mut self) {
        let last = self.nodes.len() - 1;
        if self.is_closed {
            let speed = self.nodes[0].speed.min(self.nodes[last].speed);
            (self.nodes[0].speed, self.nodes[last].speed) = (speed, speed);
        }
    }
}

/// Returns the largest speed at the node `to` after the speed of its neighbour `from`, m/s.
pub(crate) fn reachable(from: &Node, to: &Node) -> f64 {
    let acceleration = from.acceleration.min(to.acceleration);
    (from.speed * from.speed + 2.0 * acceleration * (to.s - from.s).abs()).sqrt()
}
