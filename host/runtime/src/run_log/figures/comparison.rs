//! Errors of several runs over time, one curve each.

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::LawCurve;
use super::{
    DrawError, FAINT, FARTHEST_M, FONT, INK, TARGET, round_step, shown_at_half_size, stroke,
};
use crate::plot_colours::COLOURS;

const SIZE: (u32, u32) = (2000, 1100);
const TITLE_HEIGHT: u32 = 100;
const CAPTION: i32 = 46;
const LABEL: i32 = 38;
const TICK: i32 = 34;

/// Ranges of the axes.
struct Axes {
    /// End of the time axis, seconds.
    time_s: f64,
    /// Upper end of the error axis, millimetres.
    error_mm: f64,
}

impl Axes {
    /// Returns the axes that show all curves, and the threshold (metres) at some height.
    fn around(curves: &[LawCurve], threshold_m: f64) -> Self {
        let points = || curves.iter().flat_map(LawCurve::points);
        let last = points().map(|(t, _)| t).filter(|t| t.is_finite()).fold(1.0, f64::max);
        let error = points().map(|(_, e)| e).filter(|e| *e <= FARTHEST_M);
        let error = error.fold(2.0 * threshold_m, f64::max);
        Self { time_s: 1.02 * last, error_mm: 1.08e3 * error.max(1e-3) }
    }
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
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, body) = root.split_vertically(TITLE_HEIGHT);
        let bold = (FONT, CAPTION).into_font().style(FontStyle::Bold).color(&INK);
        head.draw_text(title, &bold, (190, 40))?;
        draw_chart(&body, curves, threshold_m, &axes)?;
        root.present()?;
    }
    Ok(shown_at_half_size(&svg, SIZE))
}

fn draw_chart(
    area: &DrawingArea<SVGBackend, Shift>,
    curves: &[LawCurve],
    threshold_m: Option<f64>,
    axes: &Axes,
) -> Result<(), DrawError> {
    let mut chart = ChartBuilder::on(area)
        .margin_left(40)
        .margin_right(40)
        .margin_bottom(20)
        .set_label_area_size(LabelAreaPosition::Left, 150)
        .set_label_area_size(LabelAreaPosition::Bottom, 100)
        .build_cartesian_2d(0.0..axes.time_s, 0.0..axes.error_mm)?;
    let ticks = |end: f64| (end / round_step(end, 10.0)).floor() as usize + 1;
    let digits = usize::from(axes.time_s < 5.0);
    chart
        .configure_mesh()
        .x_labels(ticks(axes.time_s))
        .y_labels(ticks(axes.error_mm))
        .x_label_formatter(&|time| format!("{time:.digits$}"))
        .y_label_formatter(&|error| format!("{error:.0}"))
        .axis_desc_style((FONT, LABEL).into_font().color(&INK))
        .label_style((FONT, TICK).into_font().color(&INK))
        .axis_style(stroke(INK, 2))
        .bold_line_style(stroke(FAINT, 2))
        .light_line_style(TRANSPARENT)
        .x_desc("time (s)")
        .y_desc("|e| (mm)")
        .draw()?;
    for (curve, colour) in curves.iter().zip(COLOURS.into_iter().cycle()) {
        let points = curve.points().into_iter().map(|(t, e)| (t, 1e3 * e));
        chart
            .draw_series(LineSeries::new(points, stroke(colour, 5)))?
            .label(curve.law())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 48, y)], stroke(colour, 5)));
    }
    if let Some(threshold) = threshold_m.map(|metres| 1e3 * metres) {
        let line = [(0.0, threshold), (axes.time_s, threshold)];
        chart.draw_series([DashedPathElement::new(line, 16, 10, stroke(TARGET, 4))])?;
        let above = Pos::new(HPos::Right, VPos::Bottom);
        let style = (FONT, TICK).into_font().color(&TARGET).pos(above);
        let text = format!("reached below {threshold:.0} mm");
        let at = (axes.time_s, threshold + 0.012 * axes.error_mm);
        chart.draw_series([Text::new(text, at, style)])?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .margin(20)
        .legend_area_size(60)
        .label_font((FONT, LABEL).into_font().color(&INK))
        .background_style(WHITE)
        .border_style(FAINT)
        .draw()?;
    Ok(())
}
