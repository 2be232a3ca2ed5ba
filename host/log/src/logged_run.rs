//! A run folder that is read again, to draw its figures.

use std::path::{Path, PathBuf};

use csv::{ErrorKind, StringRecord};
use nalgebra::Point3;
use serde::Deserialize;

use super::drawing::{draw, write_errors};
use super::figures;
use super::output_dir::replace;
use super::samples::{Deviation, Sample, Samples};
use super::{FigureSettings, LawCurve, RunLogError};

/// Run as its folder has it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedRun {
    folder: PathBuf,
    settings: FigureSettings,
    samples: Samples<Sample>,
    /// |e| over the time, without a name.
    errors: LawCurve,
}

/// Columns of `run.csv` that the figures show.
#[derive(Deserialize)]
struct Row {
    time_s: f64,
    position_m_x: Option<f64>,
    position_m_y: Option<f64>,
    position_m_z: Option<f64>,
    target_m_x: Option<f64>,
    target_m_y: Option<f64>,
    target_m_z: Option<f64>,
    error_m: Option<f64>,
    path_time_s: Option<f64>,
    along_track_m: Option<f64>,
    cross_track_m: Option<f64>,
}

impl From<Row> for Sample {
    fn from(row: Row) -> Self {
        let point = |[x, y, z]: [Option<f64>; 3]| Some(Point3::new(x?, y?, z?));
        let deviation = Deviation { along_m: row.along_track_m, cross_m: row.cross_track_m };
        Self {
            time_s: row.time_s,
            position: point([row.position_m_x, row.position_m_y, row.position_m_z]),
            target: point([row.target_m_x, row.target_m_y, row.target_m_z]),
            error_m: row.error_m,
            deviation: row.path_time_s.map(|_| deviation),
        }
    }
}

impl LoggedRun {
    /// Reads the run in `folder`, also one that ended early.
    ///
    /// # Errors
    /// [`RunLogError::NotARun`] where `run.csv` or `figures.json` is missing or has another
    /// content.
    pub fn read(folder: &Path) -> Result<Self, RunLogError> {
        let settings = figures::read(folder)?;
        let failed = |source: csv::Error| {
            let path = folder.join("run.csv");
            RunLogError::NotARun { folder: folder.into(), source: RowError { path, source }.into() }
        };
        let (mut samples, mut errors) = (Samples::new(), LawCurve::new(String::new()));
        let take = |sample: Sample| {
            if let Some(error) = sample.error_m {
                errors.add(sample.time_s, error);
            }
            samples.push(sample.shown());
        };
        read_rows(&folder.join("run.csv"), take).map_err(failed)?;
        Ok(Self { folder: folder.into(), settings, samples, errors })
    }

    /// Draws `figure4.svg`, `figure5.svg` and, of a run along a path, `deviation.svg` in the
    /// folder, in place of those that are there. Returns their paths.
    ///
    /// # Errors
    /// Where one cannot be drawn or written. What was there then stays.
    pub fn redraw(&self) -> Result<Vec<PathBuf>, RunLogError> {
        let samples = self.samples.to_vec();
        draw(&self.folder, &samples, &self.settings, replace).into_iter().collect()
    }

    /// Returns the errors over time, named after the folder and the law.
    fn curve(&self) -> LawCurve {
        let name = self.folder.file_name().unwrap_or(self.folder.as_os_str());
        let law = format!("{}: {}", name.to_string_lossy(), self.settings.title);
        self.errors.clone().named(law)
    }
}

/// Hands the rows of `run.csv` to `take`. A last row that a full disk cut off is left out.
fn read_rows(path: &Path, mut take: impl FnMut(Sample)) -> Result<(), csv::Error> {
    let mut reader = csv::Reader::from_path(path)?;
    let header = reader.headers()?.clone();
    let mut record = StringRecord::new();
    loop {
        match reader.read_record(&mut record) {
            Ok(true) => take(record.deserialize::<Row>(Some(&header))?.into()),
            Ok(false) => return Ok(()),
            Err(error) => {
                let is_cut = matches!(error.kind(), ErrorKind::UnequalLengths { .. });
                let is_last = !reader.read_record(&mut record).unwrap_or(true);
                return if is_cut && is_last { Ok(()) } else { Err(error) };
            }
        }
    }
}

/// Draws the errors of several runs over time to the new file `path`. The threshold is drawn if the
/// runs have the same.
///
/// # Errors
/// Where it exists, or cannot be drawn or written.
pub fn compare(runs: &[LoggedRun], path: &Path) -> Result<(), RunLogError> {
    let curves: Vec<LawCurve> = runs.iter().map(LoggedRun::curve).collect();
    let mut thresholds: Vec<f64> = runs.iter().map(|run| run.settings.threshold_m).collect();
    thresholds.dedup();
    let threshold = Some(thresholds).filter(|all| all.len() == 1).map(|all| all[0]);
    let title = format!("Distance from the target over time, {} runs", runs.len());
    write_errors(path, &title, &curves, threshold)
}

/// A row, or the whole file, cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read {}", .path.display())]
struct RowError {
    path: PathBuf,
    source: csv::Error,
}

#[cfg(test)]
mod tests {
    use std::fs;

    use plumb_runtime::observer::FrameRecord;

    use super::super::log::tests::ball;
    use super::super::{OutputDir, RunLog};
    use super::*;

    /// Writes a run of three frames to `folder`, without its end. The ball is lost in the second.
    fn write(folder: &Path, title: &str) {
        let title = title.to_owned();
        let settings = FigureSettings { title, threshold_m: 0.005, motors: None };
        let mut log = RunLog::create(&OutputDir::Path(folder.into()), settings).unwrap();
        for frame in 0..3 {
            let position = (frame != 1).then(|| Point3::new(0.1, 0.2, 0.3));
            log.record(&FrameRecord {
                number: frame,
                time: 0.5 * frame as f64,
                observation: position.map(ball),
                target: Some(Point3::new(0.1, 0.2, 0.4)),
                ..FrameRecord::default()
            })
            .unwrap();
        }
    }

    #[test]
    fn a_run_that_ended_early_is_drawn_from_its_rows() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        write(&path, "taut");
        let run = LoggedRun::read(&path).unwrap();
        assert_eq!((run.settings.title.as_str(), run.settings.threshold_m), ("taut", 0.005));
        assert_eq!(
            (run.samples.to_vec().len(), run.errors.points()),
            (3, vec![(0.0, 0.1), (1.0, 0.1)])
        );
        for figure in [run.redraw().unwrap(), run.redraw().unwrap()].concat() {
            let svg = fs::read_to_string(figure).unwrap();
            assert!(svg.starts_with("<svg") && svg.contains("taut"), "{svg}");
        }
    }

    #[test]
    fn a_last_row_that_is_cut_off_is_left_out() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        write(&path, "taut");
        let rows = fs::read_to_string(path.join("run.csv")).unwrap();
        fs::write(path.join("run.csv"), format!("{rows}3,1.5,12")).unwrap();
        assert_eq!(LoggedRun::read(&path).unwrap().samples.to_vec().len(), 3);
        fs::write(path.join("run.csv"), format!("{rows}3,1.5,12\n{rows}")).unwrap();
        assert!(matches!(LoggedRun::read(&path), Err(RunLogError::NotARun { .. })));
    }

    #[test]
    fn several_runs_are_drawn_with_their_names_into_a_new_file() {
        let folder = tempfile::tempdir().unwrap();
        let runs = ["one", "two"].map(|name| {
            write(&folder.path().join(name), "taut");
            LoggedRun::read(&folder.path().join(name)).unwrap()
        });
        let file = folder.path().join("runs.svg");
        compare(&runs, &file).unwrap();
        let svg = fs::read_to_string(&file).unwrap();
        for text in ["one: taut", "two: taut", "reached below 5 mm"] {
            assert!(svg.contains(text), "{svg}");
        }
        assert!(matches!(compare(&runs, &file), Err(RunLogError::FileExists(_))));
    }
}
