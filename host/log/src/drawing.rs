//! The figures in the files of a run.

use std::path::{Path, PathBuf};

use super::RunLogError;
use super::figures::{DrawError, FigureSettings, errors_over_time, from_path, in_space, over_time};
use super::output_dir::write_new;
use super::samples::{LawCurve, Sample};

/// Writer of a file in a run's folder.
pub(super) type WriteFile = fn(&Path, &[u8]) -> Result<(), RunLogError>;

/// Draws the figures of a run into its `folder`. Returns their paths, and the errors of those that
/// cannot be drawn or written.
pub(super) fn draw(
    folder: &Path,
    samples: &[Sample],
    settings: &FigureSettings,
    write: WriteFile,
) -> Vec<Result<PathBuf, RunLogError>> {
    let figures = [
        ("figure4.svg", over_time(samples, settings).map(Some)),
        ("figure5.svg", in_space(samples, settings).map(Some)),
        // Of a run along no path there is none.
        ("deviation.svg", from_path(samples, settings)),
    ];
    let drawn =
        figures.into_iter().filter_map(|(name, svg)| Some((folder.join(name), svg.transpose()?)));
    drawn.map(|(path, svg)| write_figure(&path, svg, write).map(|()| path)).collect()
}

/// Writes the errors of several runs over time to the new file `path`.
pub(super) fn write_errors(
    path: &Path,
    title: &str,
    curves: &[LawCurve],
    threshold_m: Option<f64>,
) -> Result<(), RunLogError> {
    write_figure(path, errors_over_time(title, curves, threshold_m), write_new)
}

fn write_figure(
    path: &Path,
    svg: Result<String, DrawError>,
    write: WriteFile,
) -> Result<(), RunLogError> {
    let figure = |source| RunLogError::Figure { path: path.to_owned(), source };
    write(path, svg.map_err(figure)?.as_bytes())
}
