//! A plot of the share of arrived runs over time, in multiples of the oracle's time.

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

use super::report::Report;
use plumb_log::plot_axis::{Axis, dwarfs};
use plumb_log::plot_colours::COLOURS;

/// Start of the time axis, multiples of the oracle's time.
const MIN_RATIO: f64 = 0.8;
/// Least end of the time axis, multiples of the oracle's time.
const MIN_END: f64 = 2.0;

/// Factor by which a logarithmic time axis is longer than the curves, so that the legend at its end
/// hides none of them.
const LEGEND_ROOM: f64 = 2.5;

/// Width and height of the plot, pixels.
const SIZE: (u32, u32) = (1200, 760);

/// Returns the time axis, to the slowest run that arrived: logarithmic where that one dwarfs the
/// median run of the fastest controller.
fn time_axis(reports: &[Report]) -> Axis {
    let finite = |ratio: &f64| ratio.is_finite();
    let slowest = reports.iter().flat_map(|report| &report.ratios).copied().filter(finite);
    let end = 1.02 * slowest.fold(MIN_END, f64::max);
    let medians = reports.iter().map(|report| report.median).filter(finite);
    if dwarfs(end, medians.fold(end, f64::min)) {
        Axis::logarithmic(MIN_RATIO..LEGEND_ROOM * end)
    } else {
        Axis::linear(MIN_RATIO..end, 10.0)
    }
}

/// Returns the curves of `reports` as SVG: share of runs over time to the threshold, in multiples
/// of the oracle's time. Runs that did not arrive keep their curve below 1.
///
/// # Errors
/// If the plotting library fails.
pub fn draw(reports: &[Report]) -> Result<String, DrawingAreaErrorKind<std::io::Error>> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let time = time_axis(reports);
        let mut chart = ChartBuilder::on(&area)
            .margin(24)
            .caption(
                "Share of the runs that have reached the target, over time",
                ("sans-serif", 28),
            )
            .set_label_area_size(LabelAreaPosition::Left, 72)
            .set_label_area_size(LabelAreaPosition::Bottom, 60)
            .build_cartesian_2d(time.clone(), Axis::linear(0.0..1.0, 10.0))?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 22))
            .x_desc(time.name("time to the threshold over the oracle's"))
            .y_desc("share of the runs")
            .draw()?;
        for (number, (report, colour)) in reports.iter().zip(COLOURS.iter().cycle()).enumerate() {
            // Thin lines distinguish a second use of a colour.
            let width = if number < COLOURS.len() { 3 } else { 1 };
            let n = report.ratios.len() as f64;
            let points = (0..).zip(&report.ratios).filter(|(_, r)| r.is_finite());
            let line = LineSeries::new(
                points.map(|(k, r)| (*r, f64::from(k + 1) / n)),
                colour.stroke_width(width),
            );
            let colour = *colour;
            chart.draw_series(line)?.label(label(report)).legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 28, y)], colour.stroke_width(width))
            });
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerRight)
            .label_font(("sans-serif", 22))
            .background_style(WHITE)
            .border_style(BLACK)
            .draw()?;
        area.present()?;
    }
    Ok(svg)
}

/// Returns the text beside a curve.
fn label(report: &Report) -> String {
    let (law, suite, target) = (&report.law, report.suite, report.target);
    if target == 1 { format!("{law}, {suite}") } else { format!("{law}, {suite}, target {target}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the figure of two laws: one at about the oracle's time, the other at `slow` times.
    fn figure(slow: f64) -> String {
        let report = |law: &str, ratio: f64| Report {
            law: law.into(),
            suite: "quasi-static",
            target: 1,
            rigs: 4,
            seed: 1,
            converged: 0.75,
            median: 1.1 * ratio,
            p90: f64::INFINITY,
            p99: f64::INFINITY,
            max: f64::INFINITY,
            lost_s: 0.1,
            lost_p99_s: f64::INFINITY,
            told_s: 0.5,
            told_p99_s: 0.5,
            slack: 0.0,
            hold_mean_mm: 0.0,
            hold_p99_mm: 0.0,
            false_reached: 0.0,
            ratios: vec![ratio, 1.1 * ratio, 1.2 * ratio, f64::INFINITY],
            median_s: 1.0,
            failed: Vec::new(),
            resumed: 0,
        };
        draw(&[report("fast", 1.0), report("slow", slow)]).unwrap()
    }

    #[test]
    fn time_is_logarithmic_where_one_law_dwarfs_another_and_no_curve_is_cut_off() {
        let has = |svg: &str, text: &str| svg.lines().any(|line| line == text);
        let name = "time to the threshold over the oracle&apos;s";
        let like = figure(2.0);
        assert!(has(&like, name) && has(&like, "1.6"), "{like}");
        let unlike = figure(18.0);
        assert!(has(&unlike, &format!("{name}, logarithmic")) && has(&unlike, "20"), "{unlike}");
        assert!(has(&unlike, "Share of the runs that have reached the target, over time"));
        assert_eq!(
            unlike.matches("stroke-width=\"3\"").count(),
            4,
            "two curves, two in the legend"
        );
    }
}
