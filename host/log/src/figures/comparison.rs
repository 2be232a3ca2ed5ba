//! Errors of several runs over time, one curve each.

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{
    CAPTION, DrawError, FAINT, FONT, HEADING_X, INK, TARGET, TITLE_Y, shown_at_half_size, stroke,
};
use crate::plot_axis::{Axis, dwarfs, round_step};
use crate::plot_colours::COLOURS;
use crate::samples::{FARTHEST_M, LATEST_S, LawCurve};

const WIDTH: u32 = 2000;
const CHART_HEIGHT: u32 = 1000;
const TITLE_HEIGHT: u32 = 84;
/// Height of a row of the legend, and of the room below the last.
const ROW_HEIGHT: u32 = 52;
const LABEL: i32 = 38;
const TICK: i32 = 34;
/// Most characters of a name in a legend of two columns.
const SHORT_NAME: usize = 50;

/// Least part of the shortest run, and of the smallest curve, on a logarithmic axis.
const LEAST_PART: f64 = 1.0 / 40.0;
const LEAST_ERROR_PART: f64 = 1.0 / 1000.0;

/// Axes of the figure: time in seconds, error in millimetres.
struct Axes {
    time: Axis,
    error: Axis,
}

impl Axes {
    /// Returns the axes that show all curves, and the threshold (metres) at some height. An axis is
    /// logarithmic where the longest run, or the largest error, dwarfs that of another run.
    fn around(curves: &[LawCurve], threshold_m: f64) -> Self {
        let points: Vec<Vec<(f64, f64)>> = curves.iter().map(shown).collect();
        let greatest = |of: fn(&(f64, f64)) -> f64| {
            let ends = points.iter().map(move |curve| curve.iter().map(of).fold(0.0, f64::max));
            ends.filter(|end| *end > 0.0).collect::<Vec<f64>>()
        };
        let (times, errors) = (greatest(|point| point.0), greatest(|point| 1e3 * point.1));
        let ends = |values: &[f64]| {
            let least = values.iter().copied().reduce(f64::min).unwrap_or(1.0);
            (least, values.iter().copied().fold(0.0, f64::max))
        };
        let ((shortest, longest), (smallest, largest)) = (ends(&times), ends(&errors));
        let time = if dwarfs(longest, shortest) {
            Axis::logarithmic(round_step(LEAST_PART * shortest, 1.0)..1.02 * longest)
        } else {
            Axis::linear(0.0..1.02 * if longest > 0.0 { longest } else { 1.0 }, 10.0)
        };
        let top = 1.08 * largest.max(2e3 * threshold_m).max(1.0);
        let error = if dwarfs(largest, smallest) {
            let values = points.iter().flatten().map(|(_, error)| 1e3 * error);
            let values = values.filter(|error| *error > LEAST_ERROR_PART * smallest);
            let least = values.fold(smallest, f64::min);
            let low = if threshold_m > 0.0 { least.min(500.0 * threshold_m) } else { least };
            Axis::logarithmic(low..top)
        } else {
            Axis::linear(0.0..top, 10.0)
        };
        Self { time, error }
    }
}

/// Returns the points of a curve that are drawn: seconds and metres.
fn shown(curve: &LawCurve) -> Vec<(f64, f64)> {
    let is_shown = |(t, e): &(f64, f64)| t.abs() <= LATEST_S && (0.0..=FARTHEST_M).contains(e);
    curve.points().into_iter().filter(is_shown).collect()
}

/// Returns |e| (mm) over time (s) as SVG, with the distance at which the target counts as reached
/// (metres) if there is one.
pub(crate) fn errors_over_time(
    title: &str,
    curves: &[LawCurve],
    threshold_m: Option<f64>,
) -> Result<String, DrawError> {
    // A threshold that is not a number is drawn at zero.
    let threshold_m = threshold_m.map(|t| if t.is_nan() { 0.0 } else { t.clamp(0.0, FARTHEST_M) });
    let axes = Axes::around(curves, threshold_m.unwrap_or_default());
    let are_short = curves.iter().all(|curve| curve.law().chars().count() <= SHORT_NAME);
    let columns = if are_short { 2 } else { 1 };
    let rows = curves.len().div_ceil(columns) as u32;
    let head_height = TITLE_HEIGHT + ROW_HEIGHT * rows;
    let size = (WIDTH, head_height + CHART_HEIGHT);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, body) = root.split_vertically(head_height);
        let left = Pos::new(HPos::Left, VPos::Center);
        let bold = (FONT, CAPTION).into_font().style(FontStyle::Bold).color(&INK).pos(left);
        head.draw_text(title, &bold, (HEADING_X, TITLE_Y))?;
        draw_legend(&head, curves, columns)?;
        draw_chart(&body, curves, threshold_m, axes)?;
        root.present()?;
    }
    Ok(shown_at_half_size(&svg, size))
}

/// Draws the names of the curves below the title, where they hide no curve.
fn draw_legend(
    area: &DrawingArea<SVGBackend, Shift>,
    curves: &[LawCurve],
    columns: usize,
) -> Result<(), DrawError> {
    let left = Pos::new(HPos::Left, VPos::Center);
    let plain = (FONT, LABEL).into_font().color(&INK).pos(left);
    for (number, (curve, colour)) in curves.iter().zip(COLOURS.into_iter().cycle()).enumerate() {
        let (row, column) = ((number / columns) as i32, (number % columns) as i32);
        let x = HEADING_X + column * (WIDTH as i32 - HEADING_X) / columns as i32;
        let y = TITLE_HEIGHT as i32 + row * ROW_HEIGHT as i32 + 20;
        area.draw(&PathElement::new([(x, y), (x + 56, y)], stroke(colour, 6)))?;
        area.draw_text(curve.law(), &plain, (x + 72, y))?;
    }
    Ok(())
}

fn draw_chart(
    area: &DrawingArea<SVGBackend, Shift>,
    curves: &[LawCurve],
    threshold_m: Option<f64>,
    axes: Axes,
) -> Result<(), DrawError> {
    let mut chart = ChartBuilder::on(area)
        .margin_left(40)
        .margin_right(40)
        .margin_top(20)
        .margin_bottom(20)
        .set_label_area_size(LabelAreaPosition::Left, 150)
        .set_label_area_size(LabelAreaPosition::Bottom, 100)
        .build_cartesian_2d(axes.time.clone(), axes.error.clone())?;
    chart
        .configure_mesh()
        .axis_desc_style((FONT, LABEL).into_font().color(&INK))
        .label_style((FONT, TICK).into_font().color(&INK))
        .axis_style(stroke(INK, 2))
        .bold_line_style(stroke(FAINT, 2))
        .light_line_style(TRANSPARENT)
        .x_desc(axes.time.name("time (s)"))
        .y_desc(axes.error.name("|e| (mm)"))
        .draw()?;
    for (curve, colour) in curves.iter().zip(COLOURS.into_iter().cycle()) {
        let points = shown(curve).into_iter().filter(|(t, _)| *t >= axes.time.range().start);
        let points = points.map(|(t, e)| (t, 1e3 * e));
        chart.draw_series(LineSeries::new(points, stroke(colour, 5)))?;
    }
    if let Some(threshold) = threshold_m.map(|metres| 1e3 * metres) {
        let time = axes.time.range();
        let line = [(time.start, threshold), (time.end, threshold)];
        chart.draw_series([DashedPathElement::new(line, 16, 10, stroke(TARGET, 4))])?;
        let above = Pos::new(HPos::Left, VPos::Bottom);
        let style = (FONT, TICK).into_font().color(&TARGET).pos(above);
        let text = format!("reached below {threshold:.0} mm");
        chart.draw_series([
            EmptyElement::at((time.start, threshold)) + Text::new(text, (16, -10), style)
        ])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the figure of runs that begin at 384 mm and take these seconds to 1 mm.
    fn figure(seconds: &[f64]) -> String {
        let curve = |(number, end): (usize, &f64)| {
            let mut curve = LawCurve::new(format!("law {number}"));
            for k in 0..=30 {
                let share = f64::from(k) / 30.0;
                curve.add(share * end, 0.384 * (-6.0 * share).exp());
            }
            curve
        };
        let curves: Vec<LawCurve> = seconds.iter().enumerate().map(curve).collect();
        errors_over_time("Distance over time", &curves, Some(0.01)).unwrap()
    }

    fn has(svg: &str, text: &str) -> bool {
        svg.lines().any(|line| line == text)
    }

    #[test]
    fn time_is_logarithmic_where_one_run_dwarfs_another() {
        let like = figure(&[3.0, 4.0]);
        assert!(has(&like, "time (s)") && has(&like, "0"), "{like}");
        let unlike = figure(&[3.0, 28.0]);
        assert!(has(&unlike, "time (s), logarithmic") && has(&unlike, "|e| (mm)"), "{unlike}");
        for tick in ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20"] {
            assert!(has(&unlike, tick), "{tick}");
        }
    }

    #[test]
    fn the_threshold_has_its_name_on_its_line() {
        let svg = figure(&[3.0, 28.0]);
        let lines: Vec<&str> = svg.lines().collect();
        let name = lines.iter().position(|line| *line == "reached below 10 mm").unwrap();
        let number = |line: &str, attribute: &str| -> f64 {
            let (_, rest) = line.split_once(&format!(" {attribute}=\"")).unwrap();
            rest.split(['"', ',']).next().unwrap().parse().unwrap()
        };
        let (x, y) = (number(lines[name - 1], "x"), number(lines[name - 1], "y"));
        let is_dash = |line: &&&str| line.contains("#C83C28") && line.starts_with("<polyline");
        let dash = lines.iter().find(is_dash).unwrap();
        let (_, points) = dash.split_once("points=\"").unwrap();
        let start: Vec<f64> =
            points.split([',', ' ']).take(2).map(|k| k.parse().unwrap()).collect();
        assert!((x - start[0]).abs() < 30.0 && (y - start[1]).abs() < 30.0, "{x}, {y}: {start:?}");
    }

    #[test]
    fn the_error_is_logarithmic_where_that_of_one_run_dwarfs_another() {
        let mut curves = [LawCurve::new("small".into()), LawCurve::new("large".into())];
        for k in 0..10 {
            curves[0].add(f64::from(k), 0.004);
            curves[1].add(f64::from(k), 0.4);
        }
        let svg = errors_over_time("Distance over time", &curves, None).unwrap();
        assert!(has(&svg, "|e| (mm), logarithmic") && has(&svg, "time (s)"), "{svg}");
    }

    #[test]
    fn the_names_stand_above_the_curves_and_make_room_for_themselves() {
        let height = |svg: &str| svg.split('"').nth(3).unwrap().parse::<u32>().unwrap();
        assert!(height(&figure(&[1.0; 20])) > height(&figure(&[1.0; 2])));
    }

    #[test]
    fn curves_without_points_and_with_absurd_ones_are_drawn() {
        let mut curve = LawCurve::new("absurd".into());
        for (time, error) in [(f64::NAN, 0.1), (1.0, f64::NAN), (1e300, 1e300), (2.0, -1.0)] {
            curve.add(time, error);
        }
        let svg = errors_over_time("", &[LawCurve::new("none".into()), curve], Some(f64::NAN));
        assert!(svg.unwrap().ends_with("</svg>\n"));
    }
}
