//! Labels of the space figure: numbers of targets, and places where they hide neither each other
//! nor the rings.

use std::collections::HashMap;

use nalgebra::Point3;

use crate::samples::Sample;

/// Greatest number of numbers at one target.
const MOST_NUMBERS: usize = 4;

/// Width of a character and height of a line, in parts of the font's size.
const WIDTH: f64 = 0.56;
const HEIGHT: f64 = 0.9;

/// Room between a label and what is beside it, pixels.
const ROOM: f64 = 5.0;

/// Directions from a point in which its label may be, in the order of preference: degrees from the
/// right, clockwise.
const DIRECTIONS_DEG: [f64; 12] =
    [30.0, -30.0, 0.0, 150.0, -150.0, 180.0, 60.0, -60.0, 120.0, -120.0, 90.0, -90.0];

/// Distances of a label from its ring, pixels.
const DISTANCES: [f64; 8] = [4.0, 20.0, 40.0, 60.0, 85.0, 110.0, 140.0, 170.0];

/// Distance from which a line joins a label and its ring, pixels.
const JOINED_FROM: f64 = 15.0;

/// Cost of a label on a point of the ball's path, pixels of distance.
const PATH_COST: f64 = 1.5;

/// Place of a target, and the numbers in the order of the run, from 1, of the legs that lead there.
pub(super) struct NumberedTarget {
    pub(super) place: Point3<f64>,
    numbers: Vec<usize>,
}

impl NumberedTarget {
    /// Returns the numbers for people; of many the first ones.
    pub(super) fn name(&self) -> String {
        let shown: Vec<String> =
            self.numbers.iter().take(MOST_NUMBERS).map(usize::to_string).collect();
        let more = if self.numbers.len() > MOST_NUMBERS { ", ..." } else { "" };
        shown.join(", ") + more
    }
}

/// Returns the targets of a run, each place once, without the places on a path.
pub(super) fn numbered_targets(samples: &[Sample]) -> Vec<NumberedTarget> {
    let resting = samples.iter().filter(|s| s.deviation.is_none());
    let mut legs: Vec<Point3<f64>> = resting.filter_map(|s| s.target).collect();
    legs.dedup();
    let mut targets: Vec<NumberedTarget> = Vec::new();
    let mut places: HashMap<[u64; 3], usize> = HashMap::new();
    for (leg, place) in legs.into_iter().enumerate() {
        let key = <[f64; 3]>::from(place).map(f64::to_bits);
        let index = *places.entry(key).or_insert(targets.len());
        if index == targets.len() {
            targets.push(NumberedTarget { place, numbers: Vec::new() });
        }
        targets[index].numbers.push(leg + 1);
    }
    targets
}

/// Rectangle on the drawing, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Area {
    /// Returns the square around a point.
    fn around((x, y): (i32, i32), half: f64) -> Self {
        let (x, y) = (f64::from(x), f64::from(y));
        Self { left: x - half, top: y - half, right: x + half, bottom: y + half }
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    fn contains(&self, (x, y): (i32, i32)) -> bool {
        let (x, y) = (f64::from(x), f64::from(y));
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    fn corners(&self) -> [(i32, i32); 2] {
        let pixel = |x: f64, y: f64| (x.round() as i32, y.round() as i32);
        [pixel(self.left, self.top), pixel(self.right, self.bottom)]
    }

    fn middle(&self) -> (i32, i32) {
        let half = |a: f64, b: f64| ((a + b) / 2.0).round() as i32;
        (half(self.left, self.right), half(self.top, self.bottom))
    }
}

/// Place of a label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Middle of the text, pixels.
    pub(super) middle: (i32, i32),
    /// Upper left and lower right corner, pixels.
    pub(super) corners: [(i32, i32); 2],
    /// Ends of the line to the ring, where the label is not beside it.
    pub(super) line: Option<[(i32, i32); 2]>,
}

/// Labels of a figure.
pub(super) struct Labels {
    size: (u32, u32),
    taken: Vec<Area>,
    /// Points of the ball's path, which labels avoid where they can.
    path: Vec<(i32, i32)>,
}

impl Labels {
    /// Returns the labels, none so far, of a figure of this size with this path, pixels.
    pub(super) fn new(size: (u32, u32), path: Vec<(i32, i32)>) -> Self {
        Self { size, taken: Vec::new(), path }
    }

    /// Keeps a ring or a dot free of labels: its middle and radius, pixels.
    pub(super) fn keep_free(&mut self, middle: (i32, i32), radius: i32) {
        self.taken.push(Area::around(middle, f64::from(radius)));
    }

    /// Takes the place for a text of this font size (pixels) beside the ring at `middle`. Returns
    /// `None` where there is none.
    pub(super) fn place(
        &mut self,
        text: &str,
        font: i32,
        middle: (i32, i32),
        radius: i32,
    ) -> Option<Place> {
        let font = f64::from(font);
        let half = ((WIDTH * font * text.chars().count() as f64) / 2.0 + ROOM, HEIGHT * font / 2.0);
        let (x, y) = (f64::from(middle.0), f64::from(middle.1));
        let mut best: Option<(f64, f64, Area)> = None;
        for distance in DISTANCES {
            for (rank, direction) in (0..).map(f64::from).zip(DIRECTIONS_DEG) {
                let (sine, cosine) = direction.to_radians().sin_cos();
                let away = f64::from(radius) + distance;
                let (cx, cy) = (x + away * cosine, y + away * sine);
                // The edge of the label that faces the ring is at this distance.
                let (cx, cy) = (cx + half.0 * cosine, cy + half.1 * sine);
                let area = Area {
                    left: cx - half.0,
                    top: cy - half.1,
                    right: cx + half.0,
                    bottom: cy + half.1,
                };
                if !self.is_free(&area) {
                    continue;
                }
                let hidden = self.path.iter().filter(|point| area.contains(**point)).count();
                let cost = distance + rank + PATH_COST * hidden as f64;
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, distance, area));
                }
            }
        }
        let (_, distance, area) = best?;
        self.taken.push(area);
        let joined = distance >= JOINED_FROM;
        let line =
            joined.then(|| [rim(middle, f64::from(radius), area.middle()), nearest(&area, middle)]);
        Some(Place { middle: area.middle(), corners: area.corners(), line })
    }

    fn is_free(&self, area: &Area) -> bool {
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        let is_inside =
            area.left >= 0.0 && area.top >= 0.0 && area.right <= width && area.bottom <= height;
        is_inside && !self.taken.iter().any(|taken| taken.overlaps(area))
    }
}

/// Returns the point of a ring that faces `to`, pixels.
fn rim(middle: (i32, i32), radius: f64, to: (i32, i32)) -> (i32, i32) {
    let (dx, dy) = (f64::from(to.0 - middle.0), f64::from(to.1 - middle.1));
    let share = radius / dx.hypot(dy).max(1.0);
    (middle.0 + (share * dx).round() as i32, middle.1 + (share * dy).round() as i32)
}

/// Returns the point of an area that is nearest to `to`, pixels.
fn nearest(area: &Area, to: (i32, i32)) -> (i32, i32) {
    let x = f64::from(to.0).clamp(area.left, area.right);
    let y = f64::from(to.1).clamp(area.top, area.bottom);
    (x.round() as i32, y.round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_numbered_in_their_order_and_a_place_that_returns_has_both_numbers() {
        let place = |x: f64| Point3::new(x, 0.0, 0.0);
        let sample = |x: f64| Sample {
            time_s: 0.0,
            position: None,
            target: Some(place(x)),
            error_m: None,
            deviation: None,
        };
        let run: Vec<Sample> = [1.0, 1.0, 2.0, 1.0, 3.0].into_iter().map(sample).collect();
        let targets = numbered_targets(&run);
        let names: Vec<(f64, String)> = targets.iter().map(|t| (t.place.x, t.name())).collect();
        let expected = [(1.0, "1, 3"), (2.0, "2"), (3.0, "4")];
        assert_eq!(names, expected.map(|(x, name)| (x, name.to_owned())));
    }

    #[test]
    fn labels_of_a_crowd_overlap_neither_each_other_nor_the_rings() {
        let points: Vec<(i32, i32)> =
            (0..30).map(|k| (900 + 40 * (k % 6), 700 + 36 * (k / 6))).collect();
        let mut labels = Labels::new((2000, 1640), Vec::new());
        points.iter().for_each(|point| labels.keep_free(*point, 12));
        let placed: Vec<Place> = (1..)
            .zip(&points)
            .filter_map(|(number, at)| labels.place(&format!("{number}"), 32, *at, 12))
            .collect();
        assert!(placed.len() >= 20, "{}", placed.len());
        for (k, area) in labels.taken.iter().enumerate() {
            for other in &labels.taken[k + 1..] {
                let both_are_rings =
                    k < points.len() && labels.taken[..points.len()].contains(other);
                assert!(both_are_rings || !area.overlaps(other), "{area:?}, {other:?}");
            }
        }
    }

    #[test]
    fn a_label_alone_is_beside_its_ring_and_avoids_the_path() {
        let mut labels = Labels::new((2000, 1640), Vec::new());
        let alone = labels.place("target", 40, (1000, 800), 18).unwrap();
        assert!(alone.line.is_none() && alone.middle.0 > 1000, "{alone:?}");
        let path: Vec<(i32, i32)> = (1000..1300).step_by(4).map(|x| (x, 810)).collect();
        let mut labels = Labels::new((2000, 1640), path);
        let beside = labels.place("target", 40, (1000, 800), 18).unwrap();
        assert_ne!(beside.middle, alone.middle);
    }

    #[test]
    fn a_label_stays_in_the_figure() {
        let mut labels = Labels::new((2000, 1640), Vec::new());
        let corner = labels.place("target", 40, (1995, 1635), 18).unwrap();
        assert!(corner.middle.0 < 1950 && corner.middle.1 < 1630, "{corner:?}");
    }
}
