//! The comparison for people.

use std::fmt::{Display, Formatter, Result};

use super::{DetectorReport, SceneReport, VisionReport};

impl Display for VisionReport {
    /// A table: a row a scene, for each detector the hits, the false alarms, and the error of the hits in pixels
    /// (median and 95th percentile); then the times.
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{:26}", "")?;
        for detector in &self.detectors {
            write!(f, "| {:38}", detector.name)?;
        }
        write!(f, "\n{:26}", "scene")?;
        for _ in &self.detectors {
            write!(f, "| {:>9} {:>12} {:>15}", "hits", "false alarms", "error px (p95)")?;
        }
        writeln!(f)?;
        for (row, scene) in self.detectors.first().iter().flat_map(|first| first.scenes.iter()).enumerate() {
            write!(f, "{:26}", scene.scene)?;
            for scene in self.detectors.iter().filter_map(|detector| detector.scenes.get(row)) {
                cells(f, scene)?;
            }
            writeln!(f)?;
        }
        for detector in &self.detectors {
            summary(f, detector, self.reference_ms)?;
        }
        Ok(())
    }
}

fn cells(f: &mut Formatter<'_>, scene: &SceneReport) -> Result {
    let hits = if scene.balls > 0 { format!("{}/{}", scene.hits, scene.balls) } else { String::new() };
    let error = match (scene.error_median_px, scene.error_p95_px) {
        (Some(median), Some(p95)) => format!("{median:.2} ({p95:.2})"),
        _ => String::new(),
    };
    write!(f, "| {hits:>9} {:>12} {error:>15}", format!("{}/{}", scene.false_alarms, scene.frames))
}

fn summary(f: &mut Formatter<'_>, detector: &DetectorReport, reference_ms: f64) -> Result {
    writeln!(
        f,
        "{}: {:.1} % of the balls, {} false alarms, {:.2} ms a picture: {:.3} of the full-size red difference of Gaussians ({reference_ms:.2} ms)",
        detector.name,
        100.0 * detector.hit_rate,
        detector.false_alarms,
        detector.median_ms,
        detector.ratio,
    )
}
