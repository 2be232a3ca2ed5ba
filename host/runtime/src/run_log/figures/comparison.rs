//! Errors of several runs over time, one curve each.

use plotters::prelude::*;

use super::super::LawCurve;
use super::{DrawError, FAINT, FONT, INK, TARGET, shown_at_half_size, stroke};
use crate::plot_colours::COLOURS;

const SIZE: (u32, u32) = (2000, 1100);
const LABEL: i32 = 38;
/// Begin of the time axis, seconds. The axis is logarithmic, since laws differ by factors.
const FIRST_S: f64 = 0.1;

/// Returns |e| (mm) over time (s) as SVG, with the distance at which the target counts as reached.
pub(crate) fn errors_over_time(curves: &[LawCurve], threshold_m: f64) -> Result<String, DrawError> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let last = points().map(|(t, _)| *t).fold(10.0 * FIRST_S, f64::max);
    let greatest = points().map(|(_, e)| 1e3 * e).fold(2e3 * threshold_m, f64::max);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .margin(40)
            .set_label_area_size(LabelAreaPosition::Left, 150)
            .set_label_area_size(LabelAreaPosition::Bottom, 110)
            .build_cartesian_2d((FIRST_S..last).log_scale(), 0.0..1.05 * greatest)?;
        chart
            .configure_mesh()
            .bold_line_style(stroke(FAINT, 2))
            .light_line_style(TRANSPARENT)
            .label_style((FONT, LABEL).into_font().color(&INK))
            .x_desc("time (s)")
            .y_desc("|e| (mm)")
            .draw()?;
        let threshold = 1e3 * threshold_m;
        chart.draw_series(LineSeries::new(
            [(FIRST_S, threshold), (last, threshold)],
            stroke(TARGET, 3),
        ))?;
        for (curve, colour) in curves.iter().zip(COLOURS.into_iter().cycle()) {
            let points = curve.points.iter().map(|(t, e)| (t.max(FIRST_S), 1e3 * e));
            chart
                .draw_series(LineSeries::new(points, stroke(colour, 5)))?
                .label(&curve.law)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 48, y)], stroke(colour, 5)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .legend_area_size(60)
            .label_font((FONT, LABEL).into_font().color(&INK))
            .background_style(WHITE)
            .border_style(FAINT)
            .draw()?;
        root.present()?;
    }
    Ok(shown_at_half_size(&svg, SIZE))
}
