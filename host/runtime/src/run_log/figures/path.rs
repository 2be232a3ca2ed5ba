//! Figure 5: the ball's path in space, with motors, start and target.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{
    DrawError, FAINT, FONT, FigureSettings, INK, MEASURED, START, Sample, TARGET, round_step,
    shown_at_half_size, stretches, stroke,
};
use crate::rig::MotorPoints;

const SIZE: (u32, u32) = (2000, 1640);
const CAPTION: i32 = 46;
const LABEL: i32 = 40;
const TICK: i32 = 34;
const TRIANGLE: RGBColor = RGBColor(120, 124, 132);
/// Greatest number of targets that are drawn.
const MOST_TARGETS: usize = 20;
/// Greatest number of numbers at one target.
const MOST_NUMBERS: usize = 4;
const SHADOW: RGBColor = RGBColor(180, 190, 205);

/// Drawing, and projection of space onto it.
struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
    view: Projection,
    bounds: Bounds,
}

/// Place of a target, and the numbers in the order of the run, from 1, of the legs that lead there.
struct NumberedTarget {
    place: Point3<f64>,
    numbers: Vec<usize>,
}

impl NumberedTarget {
    /// Returns the numbers for people; of many the first ones.
    fn name(&self) -> String {
        let shown: Vec<String> =
            self.numbers.iter().take(MOST_NUMBERS).map(usize::to_string).collect();
        let more = if self.numbers.len() > MOST_NUMBERS { ", ..." } else { "" };
        shown.join(", ") + more
    }
}

/// Returns the targets of a run, each place once, without the places on a path.
fn numbered_targets(samples: &[Sample]) -> Vec<NumberedTarget> {
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

/// Returns the figure as SVG.
pub(crate) fn in_space(samples: &[Sample], scene: &FigureSettings) -> Result<String, DrawError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let bold = (FONT, CAPTION).into_font().style(FontStyle::Bold).color(&INK);
        area.draw_text(&scene.title, &bold, (80, 32))?;
        let seen = samples.iter().filter_map(|s| s.position.as_ref());
        let wanted = samples.iter().filter_map(|s| s.target.as_ref());
        match Bounds::around(
            seen.chain(wanted).chain(scene.motors.iter().flat_map(|motors| &motors.places)),
        ) {
            Some(bounds) => {
                let corner = (f64::from(SIZE.0) - 140.0, f64::from(SIZE.1) - 150.0);
                let view = Projection::fit(&bounds, (180.0, 120.0), corner);
                Canvas { area, view, bounds }.draw(samples, scene)?;
            }
            None => area.draw_text(
                "no position was measured",
                &(FONT, LABEL).into_font().color(&INK),
                (80, 120),
            )?,
        }
    }
    Ok(shown_at_half_size(&svg, SIZE))
}

impl Canvas<'_> {
    fn draw(&self, samples: &[Sample], scene: &FigureSettings) -> Result<(), DrawError> {
        self.walls()?;
        self.axes()?;
        let ball = samples.iter().rev().find_map(|s| s.position);
        if let Some(motors) = &scene.motors {
            self.motors(motors, ball)?;
        }
        let first_of = |part: &[Point3<f64>]| part.first().copied().into_iter().collect();
        for line in stretches(samples, |s| s.position, first_of) {
            let floor = line.iter().map(|p| self.on_floor(p)).collect::<Vec<_>>();
            self.line(&floor, stroke(SHADOW, 4))?;
            self.line(&line, stroke(MEASURED, 5))?;
        }
        let on_path = |s: &Sample| s.target.filter(|_| s.deviation.is_some());
        for line in stretches(samples, on_path, first_of) {
            self.line(&line, stroke(TARGET, 3))?;
        }
        self.targets(samples)?;
        if let Some(start) = samples.iter().find_map(|s| s.position) {
            self.drop_line(&start)?;
            self.area.draw(&Circle::new(self.view.pixel(&start), 12, START.filled()))?;
            self.text("start", &start, (24, 38), HPos::Left, START)?;
        }
        if let Some(ball) = ball {
            self.area.draw(&Circle::new(self.view.pixel(&ball), 9, MEASURED.filled()))?;
        }
        self.area.present()
    }

    /// Draws a grid on the floor and on the two walls behind.
    fn walls(&self) -> Result<(), DrawError> {
        let (low, high) = (self.bounds.least, self.bounds.greatest);
        let at = Point3::new;
        for x in self.bounds.ticks(0) {
            let behind = [at(x, low.y, low.z), at(x, high.y, low.z), at(x, high.y, high.z)];
            self.line(&behind, stroke(FAINT, 2))?;
        }
        for y in self.bounds.ticks(1) {
            let behind = [at(high.x, y, low.z), at(low.x, y, low.z), at(low.x, y, high.z)];
            self.line(&behind, stroke(FAINT, 2))?;
        }
        for z in self.bounds.ticks(2) {
            let behind = [at(low.x, low.y, z), at(low.x, high.y, z), at(high.x, high.y, z)];
            self.line(&behind, stroke(FAINT, 2))?;
        }
        Ok(())
    }

    /// Draws the three edges in front with their numbers and names.
    fn axes(&self) -> Result<(), DrawError> {
        let (low, high, far) =
            (self.bounds.least, self.bounds.greatest, self.bounds.corner([true, false, false]));
        // Axis, its two ends, where its numbers stand beside it, how far its name is from its
        // middle.
        let edges = [
            (0, low, far, (-12, 30), HPos::Right, (-110, 84), "x (m)"),
            (1, far, Point3::new(high.x, high.y, low.z), (14, 24), HPos::Left, (70, 100), "y (m)"),
            (2, low, Point3::new(low.x, low.y, high.z), (-20, 0), HPos::Right, (-130, 0), "z (m)"),
        ];
        for (axis, from, to, beside, side, name_beside, name) in edges {
            self.line(&[from, to], stroke(INK, 4))?;
            for tick in self.bounds.ticks(axis) {
                let mut p = from;
                p[axis] = tick;
                let digits = if self.bounds.step < 0.1 { 2 } else { 1 };
                // No "-0.0".
                self.number(&format!("{:.digits$}", tick + 0.0), &p, beside, side)?;
            }
            let middle = nalgebra::center(&from, &to);
            self.text(name, &middle, name_beside, HPos::Center, INK)?;
        }
        Ok(())
    }

    /// Draws the triangle of motors, and the cables from there to the ball.
    fn motors(&self, points: &MotorPoints, ball: Option<Point3<f64>>) -> Result<(), DrawError> {
        let motors = &points.places;
        let corners = motors.map(|m| self.view.pixel(&m)).to_vec();
        self.area.draw(&Polygon::new(corners, TRIANGLE.mix(0.10)))?;
        self.line(&[motors[0], motors[1], motors[2], motors[0]], stroke(TRIANGLE, 4))?;
        for (motor, name) in motors.iter().zip(points.names()) {
            self.drop_line(motor)?;
            if let Some(ball) = ball {
                self.line(&[*motor, ball], stroke(TRIANGLE, 2))?;
            }
            let (x, y) = self.view.pixel(motor);
            self.area.draw(&Rectangle::new([(x - 9, y - 9), (x + 9, y + 9)], INK.filled()))?;
            self.text(name, motor, (0, -36), HPos::Center, INK)?;
        }
        Ok(())
    }

    /// Draws a ring at each target: one with the name "target", several with their numbers.
    fn targets(&self, samples: &[Sample]) -> Result<(), DrawError> {
        let targets = numbered_targets(samples);
        // A target that moves along a path is not a place of its own at every frame.
        let apart = targets.len().div_ceil(MOST_TARGETS).max(1);
        for target in targets.iter().rev().step_by(apart) {
            self.drop_line(&target.place)?;
            let ring = Circle::new(self.view.pixel(&target.place), 18, stroke(TARGET, 6));
            self.area.draw(&ring)?;
            let name = if targets.len() == 1 { "target" } else { &target.name() };
            self.text(name, &target.place, (32, 20), HPos::Left, TARGET)?;
        }
        Ok(())
    }

    fn on_floor(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::new(p.x, p.y, self.bounds.least.z)
    }

    /// Draws a dashed line straight down to the floor.
    fn drop_line(&self, p: &Point3<f64>) -> Result<(), DrawError> {
        let ends = [self.view.pixel(p), self.view.pixel(&self.on_floor(p))];
        self.area.draw(&DashedPathElement::new(ends, 6, 8, stroke(TRIANGLE, 2)))?;
        self.area.draw(&Circle::new(ends[1], 5, TRIANGLE.filled()))
    }

    fn line(&self, points: &[Point3<f64>], style: ShapeStyle) -> Result<(), DrawError> {
        let pixels: Vec<(i32, i32)> = points.iter().map(|p| self.view.pixel(p)).collect();
        self.area.draw(&PathElement::new(pixels, style))
    }

    fn text(
        &self,
        text: &str,
        at: &Point3<f64>,
        beside: (i32, i32),
        side: HPos,
        colour: RGBColor,
    ) -> Result<(), DrawError> {
        let style = (FONT, LABEL).into_font().color(&colour).pos(Pos::new(side, VPos::Center));
        let (x, y) = self.view.pixel(at);
        self.area.draw_text(text, &style, (x + beside.0, y + beside.1))
    }

    fn number(
        &self,
        text: &str,
        at: &Point3<f64>,
        beside: (i32, i32),
        side: HPos,
    ) -> Result<(), DrawError> {
        let style = (FONT, TICK).into_font().color(&INK).pos(Pos::new(side, VPos::Center));
        let (x, y) = self.view.pixel(at);
        self.area.draw_text(text, &style, (x + beside.0, y + beside.1))
    }
}

/// Direction of the viewer: degrees from x towards y, and above the horizon.
const AZIMUTH_DEG: f64 = -25.0;
const ELEVATION_DEG: f64 = 22.0;

/// Box along the axes with bounds on round numbers, one step for all axes; metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    /// Corner with the least coordinates.
    pub(super) least: Point3<f64>,
    /// Corner with the greatest coordinates.
    pub(super) greatest: Point3<f64>,
    /// Distance between two ticks, metres.
    pub(super) step: f64,
}

impl Bounds {
    /// Returns the box around some points; `None` if there are none.
    pub(super) fn around<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> Option<Self> {
        let (least, greatest) = points.fold(None, |bounds, p| {
            Some(bounds.map_or((*p, *p), |(a, b): (Point3<f64>, Point3<f64>)| (a.inf(p), b.sup(p))))
        })?;
        let step = round_step((greatest - least).max().max(0.1), 9.0);
        let least = least.map(|c| (c / step + 1e-9).floor() * step);
        let greatest = greatest.map(|c| (c / step - 1e-9).ceil() * step);
        // A box of no thickness has no walls.
        let greatest = greatest.sup(&(least + Vector3::repeat(step)));
        Some(Self { least, greatest, step })
    }

    /// Returns the ticks of axis `axis` (0, 1, 2 for x, y, z), metres.
    pub(super) fn ticks(&self, axis: usize) -> Vec<f64> {
        let count = ((self.greatest[axis] - self.least[axis]) / self.step).round() as i32;
        (0..=count).map(|k| self.least[axis] + f64::from(k) * self.step).collect()
    }

    /// Returns the corner with the greatest (true) or least coordinate along each axis.
    pub(super) fn corner(&self, greatest: [bool; 3]) -> Point3<f64> {
        Point3::from(std::array::from_fn(|i| {
            if greatest[i] { self.greatest[i] } else { self.least[i] }
        }))
    }
}

/// Projection from metres in space to pixels, with the same scale along all axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Projection {
    right: Vector3<f64>,
    up: Vector3<f64>,
    scale: f64,
    offset: (f64, f64),
}

impl Projection {
    /// Fits the box into the rectangle from `top_left` to `bottom_right`, pixels.
    pub(super) fn fit(bounds: &Bounds, top_left: (f64, f64), bottom_right: (f64, f64)) -> Self {
        let (azimuth, elevation) = (AZIMUTH_DEG.to_radians(), ELEVATION_DEG.to_radians());
        let right = Vector3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        let eye = Vector3::new(
            azimuth.cos() * elevation.cos(),
            azimuth.sin() * elevation.cos(),
            elevation.sin(),
        );
        let up = eye.cross(&right);
        let extent = |axis: &Vector3<f64>| {
            let at = |value: bool| -> f64 {
                let pick = |i: usize| {
                    if (axis[i] > 0.0) == value { bounds.greatest[i] } else { bounds.least[i] }
                };
                (0..3).map(|i| axis[i] * pick(i)).sum()
            };
            (at(false), at(true))
        };
        let ((left, far_right), (bottom, top)) = (extent(&right), extent(&up));
        let (width, height) = (bottom_right.0 - top_left.0, bottom_right.1 - top_left.1);
        let scale = (width / (far_right - left)).min(height / (top - bottom));
        let offset = (
            (top_left.0 + bottom_right.0 - scale * (left + far_right)) / 2.0,
            (top_left.1 + bottom_right.1 + scale * (bottom + top)) / 2.0,
        );
        Self { right, up, scale, offset }
    }

    /// Returns the position of a point on the drawing: pixels to the right and down.
    pub(super) fn pixel(&self, p: &Point3<f64>) -> (i32, i32) {
        let (x, y) = (self.right.dot(&p.coords), self.up.dot(&p.coords));
        (
            (self.offset.0 + self.scale * x).round() as i32,
            (self.offset.1 - self.scale * y).round() as i32,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_numbered_in_their_order_and_a_place_that_returns_has_both_numbers() {
        let place = |x: f64| Point3::new(x, 0.0, 0.0);
        let sample = |x: f64| Sample {
            frame: 0.0,
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
    fn the_box_is_round_and_holds_the_points() {
        let points = [Point3::new(0.85, 0.61, 0.665), Point3::new(0.0, 0.0, 0.15)];
        let bounds = Bounds::around(points.iter()).unwrap();
        assert!((bounds.step - 0.1).abs() < 1e-12, "{bounds:?}");
        assert!((bounds.greatest - Point3::new(0.9, 0.7, 0.7)).norm() < 1e-12, "{bounds:?}");
        assert!((bounds.least - Point3::new(0.0, 0.0, 0.1)).norm() < 1e-12, "{bounds:?}");
        assert_eq!(bounds.ticks(2).len(), 7);
        assert_eq!(Bounds::around([].iter()), None);
        let dot = Bounds::around([Point3::new(0.2, 0.2, 0.2)].iter()).unwrap();
        assert!((dot.greatest - dot.least).min() > 0.0, "{dot:?}");
    }

    #[test]
    fn the_projection_fits_and_has_z_upwards_and_y_to_the_right() {
        let bounds = Bounds::around([Point3::origin(), Point3::new(1.0, 0.8, 0.6)].iter()).unwrap();
        let view = Projection::fit(&bounds, (100.0, 50.0), (900.0, 700.0));
        for k in 0..8u8 {
            let (x, y) = view.pixel(&bounds.corner([k & 1 > 0, k & 2 > 0, k & 4 > 0]));
            assert!((100..=900).contains(&x) && (50..=700).contains(&y), "({x}, {y})");
        }
        let at = |x, y, z| view.pixel(&Point3::new(x, y, z));
        let origin = at(0.0, 0.0, 0.0);
        assert!(at(0.0, 0.0, 0.5).1 < origin.1 && at(0.0, 0.0, 0.5).0 == origin.0, "z is up");
        assert!(at(0.0, 0.5, 0.0).0 > origin.0, "y is to the right");
        assert!(at(0.5, 0.0, 0.0).1 > origin.1, "x comes towards the eye");
    }
}
