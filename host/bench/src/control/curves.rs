//! A plot of the share of arrived runs over time, in multiples of the oracle's time.

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

use super::report::Report;
use plumb_runtime::plot_colours::COLOURS;

/// Start of the time axis, multiples of the oracle's time.
const MIN_RATIO: f64 = 0.8;
/// End of the time axis, multiples of the oracle's time. Beyond it the curves hardly differ.
const MAX_RATIO: f64 = 6.0;

/// Width and height of the plot, pixels.
const SIZE: (u32, u32) = (1200, 720);

/// Returns the curves of `reports` as SVG: share of runs over time to the threshold, in multiples
/// of the oracle's time.
///
/// # Errors
/// If the plotting library fails.
pub fn draw(reports: &[Report]) -> Result<String, DrawingAreaErrorKind<std::io::Error>> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(24)
            .set_label_area_size(LabelAreaPosition::Left, 72)
            .set_label_area_size(LabelAreaPosition::Bottom, 60)
            .build_cartesian_2d(MIN_RATIO..MAX_RATIO, 0.0..1.0)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 22))
            .x_desc("time to the threshold over the oracle's")
            .y_desc("share of the runs")
            .draw()?;
        for (number, (report, colour)) in reports.iter().zip(COLOURS.iter().cycle()).enumerate() {
            // Thin lines distinguish a second use of a colour.
            let width = if number < COLOURS.len() { 3 } else { 1 };
            let n = report.ratios.len() as f64;
            let points = (0..).zip(&report.ratios).filter(|(_, r)| **r <= MAX_RATIO);
            let line = LineSeries::new(
                points.map(|(k, r)| (*r, f64::from(k + 1) / n)),
                colour.stroke_width(width),
            );
            let colour = *colour;
            chart.draw_series(line)?.label(format!("{}, {}", report.law, report.suite)).legend(
                move |(x, y)| PathElement::new([(x, y), (x + 28, y)], colour.stroke_width(width)),
            );
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
