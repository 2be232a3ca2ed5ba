//! Result of a comparison as a table.

use std::fmt::{Display, Formatter, Result};

use super::{DetectorReport, FrameGroup, GroupReport, SceneReport, VisionReport};

impl Display for VisionReport {
    /// Writes a table with a row for each scene. For each detector it has the hits, the false
    /// alarms, the error of the hits in pixels and in millimetres (median and 95th percentile),
    /// and the squared error over its covariance (mean and 95th percentile; a correct covariance
    /// gives 3 and 7.8). The times of the detectors follow.
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{:31}", "")?;
        for detector in &self.detectors {
            write!(f, "| {:47}", detector.name)?;
        }
        write!(f, "\n{:31}", "scene")?;
        for _ in &self.detectors {
            write!(
                f,
                "| {:>7} {:>7} {:>11} {:>8} {:>10}",
                "hits", "false", "px (p95)", "mm (p95)", "e²/C (p95)"
            )?;
        }
        writeln!(f)?;
        for (row, scene) in
            self.detectors.first().iter().flat_map(|first| first.scenes.iter()).enumerate()
        {
            write!(f, "{:31}", scene.scene)?;
            for scene in self.detectors.iter().filter_map(|detector| detector.scenes.get(row)) {
                cells(f, scene)?;
            }
            writeln!(f)?;
        }
        for detector in &self.detectors {
            for group in &detector.groups {
                group_line(f, detector.name, group)?;
            }
            summary(f, detector, self.reference_ms)?;
        }
        Ok(())
    }
}

/// Writes the cells of one detector in one scene.
fn cells(f: &mut Formatter<'_>, scene: &SceneReport) -> Result {
    let hits =
        if scene.balls > 0 { format!("{}/{}", scene.hits, scene.balls) } else { String::new() };
    let pair = |median: Option<f64>, p95: Option<f64>, digits: usize| match (median, p95) {
        (Some(median), Some(p95)) => format!("{median:.digits$} ({p95:.digits$})"),
        _ => String::new(),
    };
    let pixels = pair(scene.error_median_px, scene.error_p95_px, 2);
    let position = pair(scene.position_median_mm, scene.position_p95_mm, 1);
    let consistency = pair(scene.consistency, scene.consistency_p95, 0);
    write!(
        f,
        "| {hits:>7} {:>7} {pixels:>11} {position:>8} {consistency:>10}",
        format!("{}/{}", scene.false_alarms, scene.frames)
    )
}

/// Writes the sums of a group of kinds.
fn group_line(f: &mut Formatter<'_>, detector: &str, group: &GroupReport) -> Result {
    let GroupReport { frames, balls, hits, false_alarms, .. } = *group;
    write!(f, "{detector}, {}: ", group.group.as_str())?;
    if group.group != FrameGroup::Empty {
        let share = 100.0 * hits as f64 / balls.max(1) as f64;
        write!(f, "{hits} of {balls} balls ({share:.1} %), ")?;
    }
    write!(f, "{false_alarms} false alarms in {frames} frames")?;
    if let Some(consistency) = group.consistency {
        write!(f, ", mean e²/C {consistency:.1} of {} positions", group.located)?;
    }
    writeln!(f)
}

/// Writes the totals and times of a detector.
fn summary(f: &mut Formatter<'_>, detector: &DetectorReport, reference_ms: f64) -> Result {
    writeln!(
        f,
        "{}: {:.1} % of the balls, {} false alarms, {:.2} ms a frame: {:.3} of the full-size \
         red difference of Gaussians ({reference_ms:.2} ms){}{}, {:.3} tracking; \
         to the bytes on the wire 99 % within {:.2} ms ({:.3})",
        detector.name,
        100.0 * detector.hit_rate,
        detector.false_alarms,
        detector.median_ms,
        detector.ratio,
        detector
            .empty_ratio
            .map(|ratio| format!(", {ratio:.3} without a ball"))
            .unwrap_or_default(),
        detector
            .slowest
            .map(|(scene, ratio)| format!(", {ratio:.3} in \"{scene}\""))
            .unwrap_or_default(),
        detector.tracking_ratio,
        detector.path_p99_ms,
        detector.path_p99_ms / reference_ms.max(1e-9),
    )
}
