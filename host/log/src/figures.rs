//! The figures of a run, drawn like the paper's figures 4 and 5.

mod comparison;
mod labels;
mod panels;
mod path;
mod projection;

use std::path::Path;

use nalgebra::Point3;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::prelude::SVGBackend;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, IntoFont, RGBColor, ShapeStyle};
use plumb_config::bounded_read::read_text;
use plumb_config::quantity::Coordinate;
use plumb_protocol::MotorList;
use plumb_runtime::rig::quantity::Distance;
use plumb_runtime::rig::{MotorPoints, Rig};
use serde::{Deserialize, Deserializer, Serialize};

use super::RunLogError;
use super::output_dir::write_new;
use super::samples::Sample;

pub(super) use comparison::errors_over_time;
pub(super) use panels::{from_path, over_time};
pub(super) use path::in_space;

/// Failure to draw a figure.
pub(super) type DrawError = DrawingAreaErrorKind<std::io::Error>;

/// Greatest number of points in a line. More cannot be seen and make the file large.
const MOST_POINTS: usize = 3000;

const FONT: &str = "sans-serif";
/// Height of title and subtitle together.
const HEAD_HEIGHT: u32 = 140;
const HEADING_X: i32 = 60;
const TITLE_Y: i32 = 46;
const SUBTITLE_Y: i32 = 106;
const CAPTION: i32 = 46;
const SUBTITLE: i32 = 38;
const MEASURED: RGBColor = RGBColor(31, 97, 171);
const TARGET: RGBColor = RGBColor(200, 60, 40);
const START: RGBColor = RGBColor(40, 140, 70);
const INK: RGBColor = RGBColor(50, 50, 55);
const FAINT: RGBColor = RGBColor(218, 220, 224);

/// Content of the figures besides the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureSettings {
    /// Title of the figures: the law, its gain and the like.
    pub title: String,
    /// |e| below which the target counts as reached, metres.
    pub threshold_m: f64,
    /// Motor points, if they are known.
    pub motors: Option<MotorPoints>,
}

impl FigureSettings {
    /// Returns the settings for a run of `rig`.
    pub fn of(rig: &Rig) -> Self {
        Self {
            title: rig.law.title(),
            threshold_m: rig.reached.radius.get(),
            motors: rig.motor_points(),
        }
    }
}

/// Draws what a figure shows (bold), and below it the settings of the run.
fn draw_heading(
    area: &DrawingArea<SVGBackend, Shift>,
    title: &str,
    subtitle: &str,
) -> Result<(), DrawError> {
    let left = Pos::new(HPos::Left, VPos::Center);
    let bold = (FONT, CAPTION).into_font().style(FontStyle::Bold).color(&INK).pos(left);
    area.draw_text(title, &bold, (HEADING_X, TITLE_Y))?;
    let plain = (FONT, SUBTITLE).into_font().color(&INK).pos(left);
    area.draw_text(subtitle, &plain, (HEADING_X, SUBTITLE_Y))
}

/// Sets the displayed size to half of the drawn size: the drawing library rounds to whole pixels.
fn shown_at_half_size(svg: &str, (width, height): (u32, u32)) -> String {
    let size = |w, h| format!("width=\"{w}\" height=\"{h}\"");
    svg.replacen(&size(width, height), &size(width / 2, height / 2), 1)
}

/// Returns a line style of this colour and width in pixels.
fn stroke(colour: RGBColor, width: u32) -> ShapeStyle {
    colour.stroke_width(width)
}

/// Returns the least and the greatest of some numbers; `None` if there are none.
fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .fold(None, |span, v| Some(span.map_or((v, v), |(a, b): (f64, f64)| (a.min(v), b.max(v)))))
}

/// Returns the present values as stretches without a gap, of about `MOST_POINTS` in all: `keep`
/// picks from each group of neighbours.
fn stretches<T: Copy>(
    samples: &[Sample],
    value: impl Fn(&Sample) -> Option<T>,
    keep: impl Fn(&[T]) -> Vec<T>,
) -> Vec<Vec<T>> {
    let group = samples.len().div_ceil(MOST_POINTS).max(1);
    samples
        .chunk_by(|a, b| value(a).is_some() == value(b).is_some())
        .map(|stretch| stretch.iter().filter_map(&value).collect::<Vec<T>>())
        .filter(|stretch| !stretch.is_empty())
        .map(
            |stretch| {
                if group > 1 {
                    stretch.chunks(2 * group).flat_map(&keep).collect()
                } else {
                    stretch
                }
            },
        )
        .collect()
}

/// Name of the file in the folder of the run.
const FILE: &str = "figures.json";

/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 10;

/// Content of the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    title: String,
    #[serde(deserialize_with = "threshold")]
    threshold_m: f64,
    /// Motor points A, B, C, metres in the rig frame; `None` where they are unknown.
    #[serde(default, deserialize_with = "motors")]
    motors_m: Option<MotorList<[f64; 3]>>,
    /// Whether a person has measured them.
    #[serde(default)]
    motors_are_approximate: bool,
}

/// Reads a threshold, metres.
fn threshold<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Distance::deserialize(deserializer).map(Distance::get)
}

/// Reads the motor points, metres.
fn motors<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<MotorList<[f64; 3]>>, D::Error> {
    let motors = Option::<MotorList<[Coordinate; 3]>>::deserialize(deserializer)?;
    Ok(motors.map(|motors| motors.map(|motor| motor.map(Coordinate::get))))
}

/// Writes the file into `folder`.
///
/// # Errors
/// Where it exists or cannot be written (a full disk).
pub(super) fn write(folder: &Path, settings: &FigureSettings) -> Result<(), RunLogError> {
    let path = folder.join(FILE);
    let content = Content {
        title: settings.title.clone(),
        threshold_m: settings.threshold_m,
        motors_m: settings.motors.map(|motors| motors.places.map(Into::into)),
        motors_are_approximate: settings.motors.is_some_and(|motors| motors.is_approximate),
    };
    match serde_json::to_vec_pretty(&content) {
        Ok(mut json) => {
            json.push(b'\n');
            write_new(&path, &json)
        }
        Err(source) => Err(RunLogError::Json { path, source }),
    }
}

/// Reads the file of `folder`.
///
/// # Errors
/// Where it cannot be read, has another content, or a number is out of its range.
pub(super) fn read(folder: &Path) -> Result<FigureSettings, RunLogError> {
    let path = folder.join(FILE);
    let text = read_text(&path, MAX_BYTES)
        .map_err(|source| RunLogError::NotARun { folder: folder.into(), source: source.into() })?;
    let content: Content = serde_json::from_str(&text)
        .map_err(|source| RunLogError::NotARun { folder: folder.into(), source: source.into() })?;
    let Content { title, threshold_m, motors_m, motors_are_approximate: is_approximate } = content;
    let motors = motors_m.map(|motors| {
        let places = motors.map(Point3::from);
        MotorPoints { places, is_approximate }
    });
    Ok(FigureSettings { title, threshold_m, motors })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_cut_a_line_and_long_runs_are_thinned_but_keep_their_peaks() {
        let sample = |second: u32, error_m| Sample {
            time_s: f64::from(second),
            position: None,
            target: None,
            error_m,
            deviation: None,
        };
        let gap =
            [sample(0, Some(1.0)), sample(1, None), sample(2, Some(2.0)), sample(3, Some(3.0))];
        let lines = stretches(&gap, |s| s.error_m, |part| part.to_vec());
        assert_eq!(lines, [vec![1.0], vec![2.0, 3.0]]);

        let long: Vec<Sample> =
            (0..50_000).map(|k| sample(k, Some(f64::from(u8::from(k == 12_345))))).collect();
        let thinned = panels::thinned(&long, |s| s.error_m);
        assert_eq!(thinned.len(), 1);
        assert!(thinned[0].len() <= MOST_POINTS + 2, "{}", thinned[0].len());
        assert!(thinned[0].contains(&(12_345.0, 1.0)), "the peak is kept");
        assert!(thinned[0].is_sorted_by(|a, b| a.0 <= b.0));
    }
}
