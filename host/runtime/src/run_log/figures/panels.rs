//! Figure 4: x, y, z and |e| over the frames.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{
    Deviation, DrawError, FAINT, FARTHEST_M, FONT, FigureSettings, INK, MEASURED, Sample, TARGET,
    round_step, shown_at_half_size, span, stretches, stroke,
};

const SIZE: (u32, u32) = (2000, 1960);
const TITLE_HEIGHT: u32 = 88;
const CAPTION: i32 = 46;
const LABEL: i32 = 38;
const TICK: i32 = 34;

/// Panel: measured value and its target over the frame number.
pub(super) struct Panel {
    pub(super) name: &'static str,
    pub(super) measured: Vec<Vec<(f64, f64)>>,
    pub(super) wanted: Vec<Vec<(f64, f64)>>,
    pub(super) range: (f64, f64),
    pub(super) digits: usize,
}

/// Range of the frame numbers.
pub(super) type Frames = std::ops::Range<f64>;

/// Returns the range of the frame numbers, at least one frame.
pub(super) fn frames(samples: &[Sample]) -> Frames {
    let (first, last) = span(samples.iter().map(|s| s.frame)).unwrap_or((0.0, 1.0));
    first..last.max(first + 1.0)
}

/// Returns the figure as SVG.
pub(crate) fn over_frames(samples: &[Sample], scene: &FigureSettings) -> Result<String, DrawError> {
    let frames = frames(samples);
    stacked(&panels(samples, scene, &frames), &frames, scene, SIZE)
}

/// Returns the figure with these panels, one below the other, as SVG.
pub(super) fn stacked(
    panels: &[Panel],
    frames: &Frames,
    scene: &FigureSettings,
    size: (u32, u32),
) -> Result<String, DrawError> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (title, body) = root.split_vertically(TITLE_HEIGHT);
        draw_title(&title, scene)?;
        let areas = body.margin(0, 46, 16, 40).split_evenly((panels.len(), 1));
        for (panel, area) in panels.iter().zip(&areas) {
            draw_panel(panel, area, frames)?;
        }
        let below = Pos::new(HPos::Center, VPos::Bottom);
        let style = (FONT, LABEL).into_font().color(&INK).pos(below);
        root.draw_text("frame", &style, (size.0 as i32 / 2 + 60, size.1 as i32 - 8))?;
        root.present()?;
    }
    Ok(shown_at_half_size(&svg, size))
}

fn panels(samples: &[Sample], scene: &FigureSettings, frames: &Frames) -> [Panel; 4] {
    let axis = |name, i: usize| {
        let measured = thinned(samples, |s| s.position.map(|p| p[i]));
        let wanted = thinned(samples, |s| s.target.map(|p| p[i]));
        let values = measured.iter().chain(&wanted).flatten().map(|(_, v)| *v);
        let (least, greatest) = span(values).unwrap_or((0.0, 1.0));
        // At least 40 mm, so that noise on an axis that does not move stays small.
        let (middle, half) = ((least + greatest) / 2.0, ((greatest - least) * 0.58).max(0.02));
        let range = (middle - half, middle + half);
        let digits = if half < 0.04 { 3 } else { 2 };
        Panel { name, measured, wanted, range, digits }
    };
    let error = thinned(samples, |s| s.error_m.map(|e| e * 1000.0));
    // A threshold that is not a number is drawn at zero.
    let threshold_m = Some(scene.threshold_m).filter(|t| !t.is_nan()).unwrap_or_default();
    let threshold = threshold_m.clamp(0.0, FARTHEST_M) * 1000.0;
    let (_, greatest) = span(error.iter().flatten().map(|(_, e)| *e)).unwrap_or((0.0, threshold));
    let error = Panel {
        name: "|e| (mm)",
        measured: error,
        wanted: vec![vec![(frames.start, threshold), (frames.end, threshold)]],
        range: (0.0, 1.08 * greatest.max(2.0 * threshold).max(1.0)),
        digits: 0,
    };
    [axis("x (m)", 0), axis("y (m)", 1), axis("z (m)", 2), error]
}

/// Returns the values over the frame number; of a long run the extremes.
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
    stretches(samples, |s| value(s).map(|v| (s.frame, v)), extremes)
}

fn draw_title(
    area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    scene: &FigureSettings,
) -> Result<(), DrawError> {
    let at = |h| Pos::new(h, VPos::Center);
    let middle = TITLE_HEIGHT as i32 / 2 + 8;
    let bold = (FONT, CAPTION).into_font().style(FontStyle::Bold).color(&INK);
    area.draw_text(&scene.title, &bold.pos(at(HPos::Left)), (184, middle))?;
    let plain = (FONT, LABEL).into_font().color(&INK).pos(at(HPos::Left));
    area.draw(&PathElement::new([(1290, middle), (1370, middle)], stroke(MEASURED, 6)))?;
    area.draw_text("measured", &plain, (1386, middle))?;
    area.draw(&DashedPathElement::new(
        [(1570, middle), (1650, middle)],
        16,
        10,
        stroke(TARGET, 4),
    ))?;
    area.draw_text("target, threshold", &plain, (1666, middle))
}

fn draw_panel(
    panel: &Panel,
    area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    frames: &Frames,
) -> Result<(), DrawError> {
    let mut chart = ChartBuilder::on(area)
        .margin_top(16)
        .x_label_area_size(54)
        .y_label_area_size(170)
        .build_cartesian_2d(frames.clone(), panel.range.0..panel.range.1)?;
    let steps = |(least, greatest): (f64, f64), parts| {
        let step = round_step(greatest - least, parts);
        ((greatest - least) / step).floor() as usize + 1
    };
    let tick = (FONT, TICK).into_font().color(&INK);
    chart
        .configure_mesh()
        .x_labels(steps((frames.start, frames.end), 10.0))
        .y_labels(steps(panel.range, 5.0))
        .x_label_formatter(&|frame| format!("{frame:.0}"))
        .y_label_formatter(&|value| format!("{value:.*}", panel.digits))
        .y_desc(panel.name)
        .axis_desc_style((FONT, LABEL).into_font().color(&INK))
        .label_style(tick)
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

/// Number of samples above which they are thinned out: 2.6 MB, ten for each point of a line.
const MOST: usize = 30_000;

/// Sample of a run.
pub(in crate::run_log) trait HasError: Copy {
    /// Returns |e|, metres, where it is known.
    fn error_m(&self) -> Option<f64>;
}

/// Samples of a run. A long run keeps the one with the largest error of each group of neighbours,
/// so that a run of days takes no more memory than one of a quarter of an hour.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::run_log) struct Samples<S> {
    kept: Vec<S>,
    /// Number of rows for each sample.
    group: u64,
    /// Number of rows in the present group, and the sample to keep of it.
    pending: (u64, Option<S>),
}

impl<S: HasError> Samples<S> {
    /// Creates an empty list.
    pub(in crate::run_log) fn new() -> Self {
        Self { kept: Vec::new(), group: 1, pending: (0, None) }
    }

    /// Adds the sample of the next row.
    pub(in crate::run_log) fn push(&mut self, sample: S) {
        let (rows, kept) = self.pending;
        let kept = kept.map_or(sample, |kept| farther(kept, sample));
        if rows + 1 < self.group {
            self.pending = (rows + 1, Some(kept));
            return;
        }
        self.pending = (0, None);
        self.kept.push(kept);
        if self.kept.len() == MOST {
            self.thin_out();
        }
    }

    /// Returns the samples, in the order of their rows.
    pub(in crate::run_log) fn to_vec(&self) -> Vec<S> {
        self.kept.iter().copied().chain(self.pending.1).collect()
    }

    /// Keeps one sample of two.
    fn thin_out(&mut self) {
        self.kept = self.kept.chunks_exact(2).map(|pair| farther(pair[0], pair[1])).collect();
        self.group *= 2;
    }
}

/// Returns the sample with the larger error.
fn farther<S: HasError>(a: S, b: S) -> S {
    if b.error_m() > a.error_m() { b } else { a }
}

const DEVIATION_SIZE: (u32, u32) = (2000, 1100);

/// Returns the figure as SVG; `None` for a run along no path.
pub(crate) fn from_path(
    samples: &[Sample],
    scene: &FigureSettings,
) -> Result<Option<String>, DrawError> {
    let first = samples.iter().position(|sample| sample.deviation.is_some());
    let last = samples.iter().rposition(|sample| sample.deviation.is_some());
    let (Some(first), Some(last)) = (first, last) else { return Ok(None) };
    let samples = &samples[first..=last];
    let frames = frames(samples);
    let panel = |name, value: fn(&Deviation) -> Option<f64>| {
        let millimetres = |s: &Sample| s.deviation.as_ref().and_then(value).map(|m| m * 1e3);
        let measured = thinned(samples, millimetres);
        let values = measured.iter().flatten().map(|(_, v)| *v);
        // At least 1 mm to both sides, so that noise stays small.
        let (least, greatest) = span(values.chain([-1.0, 1.0])).unwrap_or((-1.0, 1.0));
        let margin = 0.08 * (greatest - least);
        let wanted = vec![vec![(frames.start, 0.0), (frames.end, 0.0)]];
        Panel { name, measured, wanted, range: (least - margin, greatest + margin), digits: 1 }
    };
    let panels = [
        panel("across the path (mm)", |deviation| deviation.cross_m),
        panel("along the path (mm)", |deviation| deviation.along_m),
    ];
    stacked(&panels, &frames, scene, DEVIATION_SIZE).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run_log::figures::Sample;

    #[test]
    fn a_long_run_keeps_its_order_its_ends_and_its_largest_error() {
        let mut samples = Samples::new();
        let rows = 5 * MOST as u64 + 3;
        for frame in 0..rows {
            let error_m = if frame == 100_001 { 0.5 } else { 0.001 };
            let sample = Sample {
                frame: frame as f64,
                position: None,
                target: None,
                error_m: (frame % 7 != 0).then_some(error_m),
                deviation: None,
            };
            samples.push(sample);
            assert!(samples.kept.len() < MOST);
        }
        let kept = samples.to_vec();
        assert!(kept.len() > MOST / 2, "{}", kept.len());
        assert!(kept.windows(2).all(|pair| pair[0].frame < pair[1].frame));
        let last = kept[kept.len() - 1].frame;
        assert!(kept[0].frame < 8.0 && last > rows as f64 - 10.0, "{last}");
        assert!(kept.iter().any(|sample| sample.error_m == Some(0.5)));
    }

    #[test]
    fn a_short_run_keeps_every_row() {
        let mut samples = Samples::new();
        let row = |frame: u32| Sample {
            frame: f64::from(frame),
            position: None,
            target: None,
            error_m: None,
            deviation: None,
        };
        (0..1000).map(row).for_each(|sample| samples.push(sample));
        assert_eq!(samples.to_vec(), (0..1000).map(row).collect::<Vec<_>>());
    }
}
