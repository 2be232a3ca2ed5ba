//! A run folder that is read again, to draw its figures.

use std::path::{Path, PathBuf};

use csv::{ErrorKind, StringRecord};
use nalgebra::Point3;
use serde::Deserialize;

use super::figures::{self, Sample, Samples};
use super::output_dir::{replace, write_new};
use super::{FigureSettings, LawCurve, LogPath, LogRow, RunLogError};

/// Run as its folder has it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedRun {
    folder: PathBuf,
    settings: FigureSettings,
    samples: Samples<Sample>,
    /// |e| over the time, without a name.
    errors: LawCurve,
}

/// Columns of `run.csv` that the figures show. [`LogRow`] says what they are.
#[derive(Deserialize)]
struct Row {
    frame: u64,
    t_s: f64,
    x_m: Option<f64>,
    y_m: Option<f64>,
    z_m: Option<f64>,
    target_x_m: Option<f64>,
    target_y_m: Option<f64>,
    target_z_m: Option<f64>,
    error_m: Option<f64>,
    // Runs of older versions do not have the columns of paths.
    #[serde(default)]
    path_time_s: Option<f64>,
    #[serde(default)]
    path_pace: Option<f64>,
    #[serde(default)]
    along_track_m: Option<f64>,
    #[serde(default)]
    cross_track_m: Option<f64>,
}

impl From<Row> for LogRow {
    fn from(row: Row) -> Self {
        let point = |[x, y, z]: [Option<f64>; 3]| Some(Point3::new(x?, y?, z?));
        Self {
            frame: row.frame,
            t_s: row.t_s,
            position: point([row.x_m, row.y_m, row.z_m]),
            target: point([row.target_x_m, row.target_y_m, row.target_z_m]),
            error_m: row.error_m,
            path: row.path_time_s.map(|time| LogPath {
                time,
                pace: row.path_pace.unwrap_or_default(),
                along_m: row.along_track_m,
                cross_m: row.cross_track_m,
            }),
            ..Self::default()
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
        let take = |row: LogRow| {
            if let Some(error) = row.error_m {
                errors.add(row.t_s, error);
            }
            samples.push(Sample::from(&row));
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
        let draw = |name: &str, svg: Result<String, figures::DrawError>| {
            let path = self.folder.join(name);
            match svg {
                Ok(svg) => replace(&path, svg.as_bytes()).map(|()| path),
                Err(source) => Err(RunLogError::Figure { path, source }),
            }
        };
        let samples = self.samples.to_vec();
        let mut drawn = vec![
            draw("figure4.svg", figures::over_time(&samples, &self.settings))?,
            draw("figure5.svg", figures::in_space(&samples, &self.settings))?,
        ];
        if let Some(svg) = figures::from_path(&samples, &self.settings).transpose() {
            drawn.push(draw("deviation.svg", svg)?);
        }
        Ok(drawn)
    }

    /// Returns the errors over time, named after the folder and the law.
    fn curve(&self) -> LawCurve {
        let name = self.folder.file_name().unwrap_or(self.folder.as_os_str());
        let law = format!("{}: {}", name.to_string_lossy(), self.settings.title);
        self.errors.clone().named(law)
    }
}

/// Hands the rows of `run.csv` to `take`. A last row that a full disk cut off is left out.
fn read_rows(path: &Path, mut take: impl FnMut(LogRow)) -> Result<(), csv::Error> {
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
    match figures::errors_over_time(&title, &curves, threshold) {
        Ok(svg) => write_new(path, svg.as_bytes()),
        Err(source) => Err(RunLogError::Figure { path: path.into(), source }),
    }
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

    use super::super::{OutputDir, RunLog};
    use super::*;

    /// Writes a run of three frames to `folder`, without its end. The ball is lost in the second.
    fn write(folder: &Path, title: &str) {
        let title = title.to_owned();
        let settings = FigureSettings { title, threshold_m: 0.005, motors: None };
        let mut log = RunLog::create(&OutputDir::Path(folder.into()), settings).unwrap();
        for frame in 0..3 {
            let position = (frame != 1).then(|| Point3::new(0.1, 0.2, 0.3));
            log.record(&LogRow {
                frame,
                t_s: 0.5 * frame as f64,
                position,
                target: Some(Point3::new(0.1, 0.2, 0.4)),
                error_m: position.map(|_| 0.1),
                ..LogRow::default()
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
