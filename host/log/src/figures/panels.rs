//! Figure 4: x, y, z and |e| over the time, and the deviation from a path.

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{
    DrawError, FAINT, FONT, FigureSettings, HEAD_HEIGHT, INK, MEASURED, SUBTITLE_Y, TARGET,
    draw_heading, shown_at_half_size, span, stretches, stroke,
};
use crate::plot_axis::Axis;
use crate::samples::{Deviation, FARTHEST_M, Sample};

const SIZE: (u32, u32) = (2000, 2012);
const LABEL: i32 = 38;
const TICK: i32 = 34;

/// Panel: measured value and its target over the time.
struct Panel {
    name: &'static str,
    measured: Vec<Vec<(f64, f64)>>,
    wanted: Vec<Vec<(f64, f64)>>,
    axis: Axis,
}

/// Texts above the panels.
struct Heading {
    /// What the figure shows.
    title: &'static str,
    /// What the dashed lines are.
    wanted: &'static str,
}

/// Range of the times, seconds.
type Times = std::ops::Range<f64>;

/// Returns the range of the times, seconds; not empty.
fn times(samples: &[Sample]) -> Times {
    let (first, last) = span(samples.iter().map(|s| s.time_s)).unwrap_or((0.0, 1.0));
    first..if last > first { last } else { first + 1.0 }
}

/// Returns the figure as SVG.
pub(crate) fn over_time(samples: &[Sample], scene: &FigureSettings) -> Result<String, DrawError> {
    let times = times(samples);
    let heading = Heading {
        title: "Position of the ball, and its distance |e| from the target",
        wanted: "target, threshold",
    };
    stacked(&panels(samples, scene, &times), &times, &heading, scene, SIZE)
}

/// Returns the figure with these panels, one below the other, as SVG.
fn stacked(
    panels: &[Panel],
    times: &Times,
    heading: &Heading,
    scene: &FigureSettings,
    size: (u32, u32),
) -> Result<String, DrawError> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, body) = root.split_vertically(HEAD_HEIGHT);
        draw_heading(&head, heading.title, &scene.title)?;
        draw_legend(&head, heading.wanted)?;
        let areas = body.margin(0, 46, 16, 40).split_evenly((panels.len(), 1));
        for (panel, area) in panels.iter().zip(&areas) {
            draw_panel(panel, area, times)?;
        }
        let below = Pos::new(HPos::Center, VPos::Bottom);
        let style = (FONT, LABEL).into_font().color(&INK).pos(below);
        root.draw_text("time (s)", &style, (size.0 as i32 / 2 + 60, size.1 as i32 - 8))?;
        root.present()?;
    }
    Ok(shown_at_half_size(&svg, size))
}

fn panels(samples: &[Sample], scene: &FigureSettings, times: &Times) -> [Panel; 4] {
    let coordinate = |name, i: usize| {
        let measured = thinned(samples, |s| s.position.map(|p| p[i]));
        let wanted = thinned(samples, |s| s.target.map(|p| p[i]));
        let values = measured.iter().chain(&wanted).flatten().map(|(_, v)| *v);
        let (least, greatest) = span(values).unwrap_or((0.0, 1.0));
        // At least 40 mm, so that noise on an axis that does not move stays small.
        let (middle, half) = ((least + greatest) / 2.0, ((greatest - least) * 0.58).max(0.02));
        let axis = Axis::linear(middle - half..middle + half, PARTS);
        Panel { name, measured, wanted, axis }
    };
    let error = thinned(samples, |s| s.error_m.map(|e| e * 1000.0));
    // A threshold that is not a number is drawn at zero.
    let threshold_m = Some(scene.threshold_m).filter(|t| !t.is_nan()).unwrap_or_default();
    let threshold = threshold_m.clamp(0.0, FARTHEST_M) * 1000.0;
    let (_, greatest) = span(error.iter().flatten().map(|(_, e)| *e)).unwrap_or((0.0, threshold));
    let error = Panel {
        name: "|e| (mm)",
        measured: error,
        wanted: vec![vec![(times.start, threshold), (times.end, threshold)]],
        axis: Axis::linear(0.0..1.08 * greatest.max(2.0 * threshold).max(1.0), PARTS),
    };
    [coordinate("x (m)", 0), coordinate("y (m)", 1), coordinate("z (m)", 2), error]
}

/// Parts of the vertical axis of a panel, about.
const PARTS: f64 = 5.0;

/// Returns the values over the time; of a long run the extremes.
pub(crate) fn thinned(
    samples: &[Sample],
    value: impl Fn(&Sample) -> Option<f64>,
) -> Vec<Vec<(f64, f64)>> {
    let extremes = |part: &[(f64, f64)]| {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let mut ends: Vec<(f64, f64)> = part
            .iter()
            .min_by(by_value)
            .into_iter()
            .chain(part.iter().max_by(by_value))
            .copied()
            .collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends
    };
    stretches(samples, |s| value(s).map(|v| (s.time_s, v)), extremes)
}

/// Draws the legend beside the subtitle.
fn draw_legend(area: &DrawingArea<SVGBackend, Shift>, wanted: &str) -> Result<(), DrawError> {
    let y = SUBTITLE_Y;
    let left = Pos::new(HPos::Left, VPos::Center);
    let plain = (FONT, LABEL).into_font().color(&INK).pos(left);
    area.draw(&PathElement::new([(1290, y), (1370, y)], stroke(MEASURED, 6)))?;
    area.draw_text("measured", &plain, (1386, y))?;
    area.draw(&DashedPathElement::new([(1570, y), (1650, y)], 16, 10, stroke(TARGET, 4)))?;
    area.draw_text(wanted, &plain, (1666, y))
}

fn draw_panel(
    panel: &Panel,
    area: &DrawingArea<SVGBackend, Shift>,
    times: &Times,
) -> Result<(), DrawError> {
    let mut chart = ChartBuilder::on(area)
        .margin_top(16)
        .x_label_area_size(54)
        .y_label_area_size(170)
        .build_cartesian_2d(Axis::linear(times.clone(), 10.0), panel.axis.clone())?;
    chart
        .configure_mesh()
        .y_desc(panel.name)
        .axis_desc_style((FONT, LABEL).into_font().color(&INK))
        .label_style((FONT, TICK).into_font().color(&INK))
        .axis_style(stroke(INK, 2))
        .bold_line_style(stroke(FAINT, 2))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for line in &panel.wanted {
        chart.draw_series(DashedLineSeries::new(line.clone(), 16, 10, stroke(TARGET, 4)))?;
    }
    for line in &panel.measured {
        chart.draw_series(LineSeries::new(line.clone(), stroke(MEASURED, 4)))?;
    }
    Ok(())
}

const DEVIATION_SIZE: (u32, u32) = (2000, 1152);

/// Returns the figure of the deviation from a path as SVG; `None` for a run along no path.
pub(crate) fn from_path(
    samples: &[Sample],
    scene: &FigureSettings,
) -> Result<Option<String>, DrawError> {
    let first = samples.iter().position(|sample| sample.deviation.is_some());
    let last = samples.iter().rposition(|sample| sample.deviation.is_some());
    let (Some(first), Some(last)) = (first, last) else { return Ok(None) };
    let samples = &samples[first..=last];
    let times = times(samples);
    // The range has at least these ends, so that noise stays small.
    let panel = |name, ends: [f64; 2], value: fn(&Deviation) -> Option<f64>| {
        let millimetres = |s: &Sample| s.deviation.as_ref().and_then(value).map(|m| m * 1e3);
        let measured = thinned(samples, millimetres);
        let values = measured.iter().flatten().map(|(_, v)| *v);
        let (least, greatest) = span(values.chain(ends)).unwrap_or((ends[0], ends[1]));
        let margin = 0.08 * (greatest - least);
        // A distance has no negative half.
        let least = if least < 0.0 { least - margin } else { 0.0 };
        let wanted = vec![vec![(times.start, 0.0), (times.end, 0.0)]];
        Panel { name, measured, wanted, axis: Axis::linear(least..greatest + margin, PARTS) }
    };
    let panels = [
        panel("across the path (mm)", [0.0, 1.0], |deviation| deviation.cross_m),
        panel("along the path (mm)", [-1.0, 1.0], |deviation| deviation.along_m),
    ];
    let heading = Heading { title: "Distance of the ball from its path", wanted: "path" };
    stacked(&panels, &times, &heading, scene, DEVIATION_SIZE).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns samples at 30 a second, along a path if `cross_m` is given.
    fn run(cross_m: Option<f64>) -> Vec<Sample> {
        let sample = |k: u32| Sample {
            time_s: f64::from(k) / 30.0,
            position: None,
            target: None,
            error_m: Some(0.03 / f64::from(1 + k)),
            deviation: cross_m.map(|_| Deviation { along_m: Some(-0.002), cross_m }),
        };
        (0..=300).map(sample).collect()
    }

    fn settings() -> FigureSettings {
        FigureSettings { title: "taut".into(), threshold_m: 0.01, motors: None }
    }

    #[test]
    fn the_axis_is_time_in_seconds_and_the_heading_says_what_is_drawn() {
        let svg = over_time(&run(None), &settings()).unwrap();
        let texts: Vec<&str> = svg.lines().collect();
        let title = "Position of the ball, and its distance |e| from the target";
        for text in ["time (s)", title, "taut", "10"] {
            assert!(texts.contains(&text), "{text}");
        }
        assert!(!texts.contains(&"frame") && !texts.contains(&"300"), "no numbers of frames");
    }

    #[test]
    fn a_distance_has_no_negative_half_and_a_lead_has_one() {
        let svg = from_path(&run(Some(0.002)), &settings()).unwrap().unwrap();
        let across = svg.find("across the path (mm)").unwrap();
        let along = svg.find("along the path (mm)").unwrap();
        assert!(!svg[across..along].contains("\n-") && svg[along..].contains("\n-1"), "{svg}");
        assert!(svg.contains("Distance of the ball from its path"), "{svg}");
    }
}
