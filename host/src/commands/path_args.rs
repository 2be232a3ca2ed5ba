//! The path of `plumb run`: a file or a shape, its speed and its place.

mod file_places;

use std::fmt;
use std::path::Path;

use clap::Args;
use nalgebra::Point3;
use plumb_cameras::camera_file::is_rig_file;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::MAX_BYTES;
use plumb_path::file::{PathFile, parse};
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{
    DEFAULT_ACCELERATION, DEFAULT_JERK, MotionLimits, PathError, Run, Trajectory, Waypoints,
};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::PathPlan;
use plumb_runtime::run_log::is_run_log;

use super::number_list::point;
use super::print::note;
use super::{Failure, bad_input, numbers};
use file_places::FilePlaces;

/// Speed along a path where none is given, m/s.
const DEFAULT_SPEED: f64 = 0.05;

/// Largest distance of a path from a waypoint where none is given, metres.
const DEFAULT_TOLERANCE: f64 = 0.005;

/// Size of a shape where none is given, metres.
const DEFAULT_SIZE: f64 = 0.2;

/// What the log of a run is, and how its places become a path, for messages.
const RUN_LOG: &str = "this is the log of a run, and no path: write a file with only its columns \
                       x_m,y_m,z_m, or t_s,x_m,y_m,z_m";

/// Seed of the shape spline where none is given.
const DEFAULT_SEED: u64 = 1;

/// Mean time between two places of a file above which their times seem to be in another unit,
/// seconds.
const LONG_PAUSE_S: f64 = 5.0;

#[derive(Args)]
#[command(next_help_heading = "Path")]
pub(super) struct PathArgs {
    /// Path that the ball follows: a file with the columns x,y,z (waypoints, metres) or t,x,y,z
    /// (with times, seconds), G-code (G0 and G1), or one of circle, line, eight, square, spline
    #[arg(long, value_name = "FILE|SHAPE")]
    path: Option<String>,
    /// Speed along the path, above 0, to 2 m/s; lower in corners, and where G-code has a lower
    /// feed; not with a file with times, which has its own [default: 0.05, or `path.max_speed`]
    #[arg(
        long,
        allow_negative_numbers = true,
        requires = "path",
        value_parser = numbers::within(numbers::SPEED)
    )]
    speed: Option<f64>,
    /// Largest distance of the path from a waypoint, 0 to 1 m; with 0 the ball stops at corners
    /// [default: 0.005]
    #[arg(
        long,
        allow_negative_numbers = true,
        requires = "path",
        value_parser = numbers::within(numbers::TOLERANCE)
    )]
    tolerance: Option<f64>,
    /// Size of a shape, 0.001 to 8 m [default: 0.2]
    #[arg(
        long,
        allow_negative_numbers = true,
        requires = "path",
        value_parser = numbers::within(numbers::SIZE)
    )]
    size: Option<f64>,
    /// Centre of a shape in the rig frame, each -100 to 100 m [default: that of the workspace]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "path")]
    #[arg(value_parser = point)]
    centre: Option<Point3<f64>>,
    /// Draw a shape upright, in y and z, and not level
    #[arg(long, requires = "path")]
    upright: bool,
    /// Seed of the shape spline, 0 to 1e15 [default: 1]
    #[arg(long, requires = "path", value_parser = numbers::seed(), allow_negative_numbers = true)]
    path_seed: Option<u64>,
    /// Keep the path's time where the ball cannot follow, and do not wait for it
    #[arg(long, requires = "path")]
    no_wait: bool,
}

impl PathArgs {
    /// Returns the path, checked against the rig; `None` where none is asked for.
    pub(super) fn plan(&self, rig: &Rig, is_loop: bool) -> Result<Option<PathPlan>, Failure> {
        let Some(path) = &self.path else { return Ok(None) };
        let run = if is_loop { Run::Loop } else { Run::Once };
        let limits = self.limits(rig)?;
        let (trajectory, file) = match path.parse() {
            Ok(kind) => {
                self.check_effect(&Source::Shape(kind))?;
                (self.shape(kind, rig).trajectory(&limits, run)?, FilePlaces::default())
            }
            Err(_) if is_absent(path) && Path::new(path).extension().is_some() => {
                return Err(bad_input(format!("--path: {path}: there is no such file")));
            }
            Err(unknown) if is_absent(path) => {
                return Err(bad_input(format!("--path: {unknown}; no file has this name either")));
            }
            Err(_) => self.read(Path::new(path), &limits, run)?,
        };
        let plan = PathPlan::new(trajectory.clone(), !self.no_wait, rig).map_err(|error| {
            bad_input(match file.first_wrong(&rig.motion_rules()) {
                Some((line, mistake)) => format!("{path}:{line}: {mistake}"),
                None => format!("{path}: {}", file.explain(&error, &trajectory, rig)),
            })
        })?;
        note_size(&trajectory, &file.times);
        Ok(Some(plan))
    }

    /// Returns the limits of the path: those of the options, within those of the rig file.
    fn limits(&self, rig: &Rig) -> Result<MotionLimits, Failure> {
        let highest = rig.path.max_speed.get();
        let speed = self.speed.unwrap_or(DEFAULT_SPEED.min(highest));
        if speed > highest {
            let message = format!(
                "--speed {speed} is above {highest} m/s, which is `path.max_speed` of the rig"
            );
            return Err(bad_input(message));
        }
        Ok(MotionLimits {
            speed,
            acceleration: DEFAULT_ACCELERATION.min(rig.path.max_acceleration.get()),
            jerk: DEFAULT_JERK.min(rig.path.max_jerk.get()),
        })
    }

    fn shape(&self, kind: ShapeKind, rig: &Rig) -> Shape {
        let [min, max] = [rig.workspace.min, rig.workspace.max]
            .map(|corner| Point3::from(corner.map(|coordinate| coordinate.get())));
        Shape {
            kind,
            centre: self.centre.unwrap_or_else(|| nalgebra::center(&min, &max)),
            size: self.size.unwrap_or(DEFAULT_SIZE),
            plane: if self.upright { Plane::Upright } else { Plane::Level },
            tolerance: self.tolerance(),
            seed: self.path_seed.unwrap_or(DEFAULT_SEED),
        }
    }

    fn tolerance(&self) -> f64 {
        self.tolerance.unwrap_or(DEFAULT_TOLERANCE)
    }

    /// Checks that no option is given where the run has no path, but the places of `option`.
    pub(super) fn check_unused(&self, option: &'static str) -> Result<(), Failure> {
        self.check_effect(&Source::Other(option))
    }

    /// Checks that no option is given that has no effect on places from `source`.
    fn check_effect(&self, source: &Source) -> Result<(), Failure> {
        use ShapeKind::{Spline, Square};
        let is_shape = matches!(source, Source::Shape(_));
        let is_path = !matches!(source, Source::Other(_));
        let has_speed = matches!(source, Source::Shape(_) | Source::Waypoints);
        let has_corners = matches!(source, Source::Waypoints | Source::Shape(Square));
        let is_spline = matches!(source, Source::Shape(Spline));
        let options = [
            ("--speed", self.speed.is_some(), has_speed),
            ("--tolerance", self.tolerance.is_some(), has_corners),
            ("--size", self.size.is_some(), is_shape),
            ("--centre", self.centre.is_some(), is_shape),
            ("--upright", self.upright, is_shape),
            ("--path-seed", self.path_seed.is_some(), is_spline),
            ("--no-wait", self.no_wait, is_path),
        ];
        let other = if is_path { "choose another path" } else { "drive along a path, --path" };
        match options.iter().find(|(_, is_given, has_effect)| *is_given && !has_effect) {
            Some((option, ..)) => Err(bad_input(format!(
                "{option} has no effect on {source}: leave it out, or {other}"
            ))),
            None => Ok(()),
        }
    }

    /// Returns the trajectory through the places of a file, and these.
    fn read(
        &self,
        file: &Path,
        limits: &MotionLimits,
        run: Run,
    ) -> Result<(Trajectory, FilePlaces), Failure> {
        let text = read_text(file, MAX_BYTES)?;
        let contents = parse(&text).map_err(|error| {
            let is_json = text.trim_start().starts_with('{');
            let other_kind = if is_rig_file(&text) {
                Some("this is a rig file, and no path")
            } else if is_run_log(&text) {
                Some(RUN_LOG)
            } else {
                is_json.then_some("these are moving targets in JSON, and no path")
            };
            bad_input(match other_kind {
                Some(is) => format!("{}: {is}", file.display()),
                None => error.in_file(file.display()),
            })
        })?;
        let (places, mut times) = (contents.places(), Vec::new());
        let trajectory = match contents {
            PathFile::Waypoints { places, speeds, .. } => {
                self.check_effect(&Source::Waypoints)?;
                tell_slower(&speeds, limits.speed);
                let waypoints = Waypoints { places, speeds, tolerance: self.tolerance() };
                Trajectory::through(&waypoints, limits, run)
            }
            PathFile::Samples { samples, .. } => {
                self.check_effect(&Source::Samples)?;
                times = samples.iter().map(|sample| sample.time).collect();
                Trajectory::through_samples(&samples, run)
            }
        };
        let trajectory = trajectory
            .map_err(|error: PathError| bad_input(format!("{}: {error}", file.display())))?;
        let is_in_inches = text.to_ascii_uppercase().contains("G20");
        Ok((trajectory, FilePlaces { places, times, is_in_inches }))
    }
}

/// Source of a path. The text is for people.
enum Source {
    /// A shape.
    Shape(ShapeKind),
    /// A file of waypoints, or G-code.
    Waypoints,
    /// A file with times.
    Samples,
    /// No path, but the places of this option.
    Other(&'static str),
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shape(kind) => {
                write!(f, "the shape {}", format!("{kind:?}").to_ascii_lowercase())
            }
            Self::Waypoints => write!(f, "a file"),
            Self::Samples => write!(f, "a file with times"),
            Self::Other(option) => write!(f, "the places of {option}"),
        }
    }
}

/// Returns whether no file has this name. In a folder that may not be looked into nobody knows.
fn is_absent(path: &str) -> bool {
    matches!(Path::new(path).try_exists(), Ok(false))
}

/// Says how long a path is, and how long the ball takes for it; with a doubt about the `times` of
/// its file, seconds, where they are far apart.
fn note_size(trajectory: &Trajectory, times: &[f64]) {
    let span_s = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    let (length, doubt) = (trajectory.length(), time_doubt(times.len(), span_s));
    match trajectory.period() {
        Some(lap) => note!("path: a lap of {length:.3} m takes {lap:.1} s{doubt}"),
        None => note!("path: {length:.3} m, {:.1} s{doubt}", trajectory.duration()),
    }
}

/// Returns the doubt about the unit of `t` in a file of so many places that take `span_s` seconds,
/// as the end of a message; empty where there is none.
pub(super) fn time_doubt(places: usize, span_s: f64) -> &'static str {
    match span_s > LONG_PAUSE_S * places as f64 {
        true => " (is its `t` in milliseconds? It must be in seconds)",
        false => "",
    }
}

/// Says that the feeds of a file are above the speed of the path, m/s.
fn tell_slower(feeds: &[f64], speed: f64) {
    let feeds = feeds.iter().copied().filter(|feed| feed.is_finite());
    let highest = feeds.fold(0.0, f64::max);
    if highest > speed {
        note!("the file's feeds reach {highest:.3} m/s; the ball follows at --speed {speed} m/s");
    }
}
