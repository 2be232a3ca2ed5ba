//! Deviation of the ball from a path, across and along it, over the frames.

use super::panels::{Panel, frames, stacked, thinned};
use super::{Deviation, DrawError, FigureSettings, Sample, span};

const SIZE: (u32, u32) = (2000, 1100);

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
    stacked(&panels, &frames, scene, SIZE).map(Some)
}
