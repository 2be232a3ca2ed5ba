//! Figure 5: the ball's path in space, with motors, start and target.

use nalgebra::Point3;
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plumb_runtime::rig::MotorPoints;

use super::labels::{Labels, NumberedTarget, numbered_targets};
use super::projection::{Bounds, Projection};
use super::{
    DrawError, FAINT, FONT, FigureSettings, HEAD_HEIGHT, HEADING_X, INK, MEASURED, START, TARGET,
    draw_heading, shown_at_half_size, stretches, stroke,
};
use crate::plot_axis::Axis;
use crate::samples::Sample;

const SIZE: (u32, u32) = (2000, 1760);
const LABEL: i32 = 40;
const TICK: i32 = 34;
/// Middle of the legend's line.
const LEGEND_Y: i32 = 1710;
const TRIANGLE: RGBColor = RGBColor(120, 124, 132);
const SHADOW: RGBColor = RGBColor(180, 190, 205);
/// Greatest number of targets that are drawn.
const MOST_TARGETS: usize = 40;
/// Greatest number of targets with large rings.
const FEW_TARGETS: usize = 8;
/// Radius of the dot at the start, pixels.
const START_RADIUS: i32 = 12;
/// Distance between two points of the ball's path that labels avoid, pixels.
const PATH_STEP: f64 = 8.0;

/// Drawing, and projection of space onto it.
struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
    view: Projection,
    bounds: Bounds,
}

/// Name of a ring.
struct Name {
    text: String,
    /// Middle of the ring, pixels.
    middle: (i32, i32),
    /// Radius of the ring, pixels.
    radius: i32,
    colour: RGBColor,
}

/// Returns the distance, in targets, between two of `count` targets that are drawn.
fn apart(count: usize) -> usize {
    count.div_ceil(MOST_TARGETS).max(1)
}

/// Returns the first of some points.
fn first_of(part: &[Point3<f64>]) -> Vec<Point3<f64>> {
    part.first().copied().into_iter().collect()
}

/// Returns the figure as SVG.
pub(crate) fn in_space(samples: &[Sample], scene: &FigureSettings) -> Result<String, DrawError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        draw_heading(&area, "Path of the ball in space", &scene.title)?;
        let seen = samples.iter().filter_map(|s| s.position.as_ref());
        let wanted = samples.iter().filter_map(|s| s.target.as_ref());
        match Bounds::around(
            seen.chain(wanted).chain(scene.motors.iter().flat_map(|motors| &motors.places[..])),
        ) {
            Some(bounds) => {
                let bounds = bounds.down_to_floor();
                let corner = (f64::from(SIZE.0) - 140.0, f64::from(SIZE.1) - 220.0);
                let view = Projection::fit(&bounds, (180.0, f64::from(HEAD_HEIGHT) + 20.0), corner);
                Canvas { area, view, bounds }.draw(samples, scene)?;
            }
            None => area.draw_text(
                "no position was measured",
                &(FONT, LABEL).into_font().color(&INK),
                (HEADING_X, HEAD_HEIGHT as i32 + 20),
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
        let mut path = Vec::new();
        for line in stretches(samples, |s| s.position, first_of) {
            let floor = line.iter().map(|p| self.on_floor(p)).collect::<Vec<_>>();
            self.line(&floor, stroke(SHADOW, 4))?;
            self.line(&line, stroke(MEASURED, 5))?;
            path.extend(self.close_pixels(&line));
        }
        let on_path = |s: &Sample| s.target.filter(|_| s.deviation.is_some());
        for line in stretches(samples, on_path, first_of) {
            self.line(&line, stroke(TARGET, 3))?;
        }
        let targets = numbered_targets(samples);
        let start = samples.iter().find_map(|s| s.position);
        self.targets(&targets, start, Labels::new(SIZE, path))?;
        if let Some(ball) = ball {
            self.area.draw(&Circle::new(self.view.pixel(&ball), 9, MEASURED.filled()))?;
        }
        let follows_path = samples.iter().any(|s| s.deviation.is_some());
        self.legend(follows_path, targets.len())?;
        self.area.present()
    }

    /// Returns the pixels of a line, with some between those that are far apart.
    fn close_pixels(&self, line: &[Point3<f64>]) -> Vec<(i32, i32)> {
        let pixels: Vec<(i32, i32)> = line.iter().map(|p| self.view.pixel(p)).collect();
        let between = |ends: &[(i32, i32)]| {
            let (from, to) = (ends[0], ends[1]);
            let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
            let parts = (dx.hypot(dy) / PATH_STEP).ceil().clamp(1.0, 1e3) as u32;
            (0..parts).map(move |k| {
                let share = f64::from(k) / f64::from(parts);
                (from.0 + (share * dx) as i32, from.1 + (share * dy) as i32)
            })
        };
        pixels.windows(2).flat_map(between).collect()
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

    /// Draws the triangle of motors, or the line between two, and the cables to the ball.
    fn motors(&self, points: &MotorPoints, ball: Option<Point3<f64>>) -> Result<(), DrawError> {
        let motors = &points.places;
        let corners: Vec<_> = motors.iter().map(|m| self.view.pixel(m)).collect();
        self.area.draw(&Polygon::new(corners, TRIANGLE.mix(0.10)))?;
        let round: Vec<_> = motors.iter().chain(&motors[..1]).copied().collect();
        self.line(&round, stroke(TRIANGLE, 4))?;
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

    /// Draws the start, and a ring at each target: one with the name "target", several with their
    /// numbers.
    fn targets(
        &self,
        targets: &[NumberedTarget],
        start: Option<Point3<f64>>,
        mut labels: Labels,
    ) -> Result<(), DrawError> {
        // A target that moves is not a place of its own at every frame.
        let shown: Vec<&NumberedTarget> =
            targets.iter().rev().step_by(apart(targets.len())).collect();
        let (radius, width, font) =
            if shown.len() > FEW_TARGETS { (11, 4, 32) } else { (18, 6, LABEL) };
        for target in &shown {
            self.drop_line(&target.place)?;
            let middle = self.view.pixel(&target.place);
            self.area.draw(&Circle::new(middle, radius, stroke(TARGET, width as u32)))?;
            labels.keep_free(middle, radius + width / 2);
        }
        let mut names = Vec::new();
        if let Some(start) = start {
            self.drop_line(&start)?;
            let middle = self.view.pixel(&start);
            self.area.draw(&Circle::new(middle, START_RADIUS, START.filled()))?;
            labels.keep_free(middle, START_RADIUS);
            let (text, radius, colour) = ("start".to_owned(), START_RADIUS, START);
            names.push(Name { text, middle, radius, colour });
        }
        for target in shown.iter().rev() {
            let text = if targets.len() == 1 { "target".to_owned() } else { target.name() };
            let (middle, radius) = (self.view.pixel(&target.place), radius + width / 2);
            names.push(Name { text, middle, radius, colour: TARGET });
        }
        self.names(&names, font, labels)
    }

    /// Writes names beside their rings, where there is room.
    fn names(&self, names: &[Name], font: i32, mut labels: Labels) -> Result<(), DrawError> {
        let mut place = |name: &Name| labels.place(&name.text, font, name.middle, name.radius);
        let placed: Vec<_> =
            names.iter().filter_map(|name| place(name).map(|place| (name, place))).collect();
        for (name, place) in &placed {
            if let Some(ends) = place.line {
                self.area.draw(&PathElement::new(ends, stroke(name.colour, 2)))?;
            }
        }
        let centre = Pos::new(HPos::Center, VPos::Center);
        for (name, place) in &placed {
            self.area.draw(&Rectangle::new(place.corners, WHITE.mix(0.75).filled()))?;
            let style = (FONT, font).into_font().color(&name.colour).pos(centre);
            self.area.draw_text(&name.text, &style, place.middle)?;
        }
        Ok(())
    }

    /// Draws what the lines are, below the figure.
    fn legend(&self, follows_path: bool, targets: usize) -> Result<(), DrawError> {
        let floor = Axis::linear(0.0..self.bounds.step, 1.0).text(self.bounds.least.z);
        let mut x = HEADING_X;
        let mut entry = |text: &str| {
            let from = x;
            x += 126 + 16 * text.chars().count() as i32;
            self.legend_text(text, from + 76).map(|()| [(from, LEGEND_Y), (from + 60, LEGEND_Y)])
        };
        let line = entry("ball")?;
        self.area.draw(&PathElement::new(line, stroke(MEASURED, 5)))?;
        let line = entry(&format!("its shadow at z = {floor} m"))?;
        self.area.draw(&PathElement::new(line, stroke(SHADOW, 4)))?;
        let line = entry(&format!("down to z = {floor} m"))?;
        self.area.draw(&DashedPathElement::new(line, 6, 8, stroke(TRIANGLE, 2)))?;
        if follows_path {
            let line = entry("path")?;
            self.area.draw(&PathElement::new(line, stroke(TARGET, 3)))?;
        }
        if targets > 1 {
            let order = match apart(targets) {
                1 => "targets in their order".to_owned(),
                apart => format!("targets, 1 of {apart}"),
            };
            let [(x, y), _] = entry(&order)?;
            self.area.draw(&Circle::new((x + 40, y), 11, stroke(TARGET, 4)))?;
        }
        Ok(())
    }

    fn legend_text(&self, text: &str, x: i32) -> Result<(), DrawError> {
        let left = Pos::new(HPos::Left, VPos::Center);
        let style = (FONT, TICK).into_font().color(&INK).pos(left);
        self.area.draw_text(text, &style, (x, LEGEND_Y))
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

    /// Returns a run of 28 targets, close together.
    fn crowd() -> Vec<Sample> {
        let place = |k: u32| {
            let [x, y, z] = [k % 5, k / 5, k % 3].map(f64::from);
            Point3::new(0.4 + 0.03 * x, 0.3 + 0.02 * y, 0.2 + 0.02 * z)
        };
        let sample = |k: u32| Sample {
            time_s: f64::from(k),
            position: Some(place(k)),
            target: Some(place(k)),
            error_m: None,
            deviation: None,
        };
        (0..28).map(sample).collect()
    }

    fn settings() -> FigureSettings {
        let places = [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.3, 0.665]].map(Point3::from);
        let motors = Some(MotorPoints { places: places.into(), is_approximate: false });
        FigureSettings { title: "taut".into(), threshold_m: 0.01, motors }
    }

    /// Returns an attribute of a line of SVG.
    fn number(line: &str, name: &str) -> f64 {
        let (_, rest) = line.split_once(&format!(" {name}=\"")).unwrap();
        rest.split('"').next().unwrap().parse().unwrap()
    }

    #[test]
    fn each_of_28_targets_has_its_number_and_no_number_hides_another() {
        let svg = in_space(&crowd(), &settings()).unwrap();
        let lines: Vec<&str> = svg.lines().collect();
        let places: Vec<(f64, f64, f64)> = (1..=28)
            .map(|k| {
                let is_label =
                    |pair: &&[&str]| pair[0].contains("#C83C28") && pair[1] == k.to_string();
                let label = lines.windows(2).find(is_label).unwrap_or_else(|| panic!("no {k}"))[0];
                (number(label, "x"), number(label, "y"), number(label, "font-size"))
            })
            .collect();
        for (k, a) in places.iter().enumerate() {
            for b in &places[k + 1..] {
                // Two digits are somewhat wider than high.
                let is_apart = (a.0 - b.0).abs() > 1.2 * a.2 || (a.1 - b.1).abs() > a.2;
                assert!(is_apart, "{a:?}, {b:?}");
            }
        }
    }

    #[test]
    fn lines_straight_down_end_on_the_floor_that_the_legend_names() {
        let svg = in_space(&crowd()[..1], &settings()).unwrap();
        for text in ["its shadow at z = 0.0 m", "down to z = 0.0 m", "Path of the ball in space"] {
            assert!(svg.lines().any(|line| line == text), "{text}");
        }
        // The ball is at (0.4, 0.3, 0.2); the floor has the scale of the box from 0 to 0.7 m.
        let points = crowd().iter().take(1).filter_map(|s| s.position).collect::<Vec<_>>();
        let motors = settings().motors.unwrap().places;
        let bounds = Bounds::around(points.iter().chain(&motors)).unwrap();
        let (low, high) = (bounds.least, bounds.greatest);
        let bounds = Bounds { least: Point3::new(low.x, low.y, 0.0), greatest: high, ..bounds };
        let corner = (f64::from(SIZE.0) - 140.0, f64::from(SIZE.1) - 220.0);
        let view = Projection::fit(&bounds, (180.0, f64::from(HEAD_HEIGHT) + 20.0), corner);
        let (x, y) = view.pixel(&Point3::new(points[0].x, points[0].y, 0.0));
        assert!(svg.contains(&format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"5\"")), "{x}, {y}");
    }
}
