//! Figure 5: the ball's path in space, with motors, start and target.

use std::collections::HashMap;

use nalgebra::Point3;
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::projection::{Bounds, Projection};
use super::{
    DrawError, FAINT, FONT, FigureSettings, INK, MEASURED, START, Sample, TARGET,
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
}
