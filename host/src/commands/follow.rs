//! `plumb follow`: what the ball follows, and how.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, Parser};
use nalgebra::Point3;
use plumb_cameras::stream::{AddressError, StreamAddress};
use plumb_path::file::{Kind, Place, Places};
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{
    DEFAULT_ACCELERATION, DEFAULT_JERK, MotionLimits, PathError, Run, Trajectory,
};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{FollowFile, PathPlan, misplaced};
use plumb_runtime::targets::TargetOrigin;

use crate::cli::exit::{Failure, Work, failed};
use crate::cli::numbers;
use crate::cli::numbers::point;
use crate::cli::rig_path::RigArg;
use crate::commands::run::{Common, drive, drive_in_picture};
use crate::session::goal::Goal;

/// Speed along a path where none is given, m/s.
const DEFAULT_SPEED: f64 = 0.05;

/// Largest distance of a path from a corner where none is given, metres.
const DEFAULT_TOLERANCE: f64 = 0.005;

/// Size of a shape where none is given, metres.
const DEFAULT_SIZE: f64 = 0.2;

/// Seed of the shape spline where none is given.
const DEFAULT_SEED: u64 = 1;

/// Mean time between two places of a file above which their times seem to be in another unit,
/// seconds.
const LONG_PAUSE_S: f64 = 5.0;

/// Follow a shape, the places of a file, or a target that another program moves
///
/// The ball goes along a shape without a stop. What a file holds decides: along x,y,z and G-code it
/// goes without a stop, with t,x,y,z it is at each place at its time, with a column dwell or
/// tolerance it stops at each place, and lines of JSON are a target that moves. With [plane] in the
/// rig file, a file has pixels: u,v in place of x,y,z.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb follow eight --speed 0.05 --loop",
    "plumb follow path.csv --tolerance 0.01",
    "plumb follow drawing.nc",
    "tracker.py | plumb follow -",
    "plumb follow tcp:127.0.0.1:5601",
])]
pub(crate) struct FollowArgs {
    /// circle, line, eight, square or spline; a file; or a program that sends lines of JSON: `-`
    /// (standard input), unix:PATH or tcp:127.0.0.1:PORT, where Plumb listens
    #[arg(value_name = "WHAT")]
    what: What,
    #[command(flatten)]
    rig: RigArg,
    #[command(flatten)]
    path: PathOptions,
    /// Again and again, until Ctrl-C
    #[arg(long = "loop")]
    is_repeated: bool,
    #[command(flatten)]
    options: Common,
}

pub(crate) fn follow(args: FollowArgs) -> Result<Work, Failure> {
    let (file, rig) = args.rig.read()?;
    args.options.port.note(&file, &rig);
    if rig.plane.is_none() {
        let goal = args.path.goal(&args.what, &rig, args.is_repeated)?;
        return drive(&file, rig, goal, args.options);
    }
    let What::File(path) = &args.what else {
        return Err(failed("a rig file with [plane] has no metres: give a file of pixels, u,v"));
    };
    FollowFile::check_pixels(path)?;
    let goal = move |rig: &Rig| args.path.goal(&args.what, rig, args.is_repeated);
    drive_in_picture(&file, rig, goal, args.options)
}

/// What the ball follows.
#[derive(Debug, Clone)]
pub(super) enum What {
    Shape(ShapeKind),
    /// Targets of another program.
    Program(StreamAddress),
    File(PathBuf),
}

impl FromStr for What {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = match text.parse() {
            Ok(kind) => return Ok(Self::Shape(kind)),
            Err(unknown) => unknown,
        };
        match text.parse() {
            Ok(address) => Ok(Self::Program(address)),
            Err(AddressError::Form(_)) => match Path::new(text).try_exists() {
                Ok(false) => Err(format!("{unknown}; no file has this name either")),
                // The reader says why a file cannot be looked at.
                Ok(true) | Err(_) => Ok(Self::File(text.into())),
            },
            Err(error) => Err(error.to_string()),
        }
    }
}

#[derive(Args)]
#[command(next_help_heading = "Path")]
pub(super) struct PathOptions {
    /// Speed along the path, above 0, to 2 m/s; lower in corners, and where G-code has a lower
    /// feed; not with a file with times, which has its own [default: 0.05, or `path.max_speed`]
    #[arg(long, allow_negative_numbers = true, requires = "what")]
    #[arg(value_parser = numbers::within(numbers::SPEED))]
    speed: Option<f64>,
    /// Largest distance of the path from a corner, 0 to 1 m; with 0 the ball stops there
    /// [default: 0.005]
    #[arg(long, allow_negative_numbers = true, requires = "what")]
    #[arg(value_parser = numbers::within(numbers::TOLERANCE))]
    tolerance: Option<f64>,
    /// Size of a shape, 0.001 to 8 m [default: 0.2]
    #[arg(long, allow_negative_numbers = true, requires = "what")]
    #[arg(value_parser = numbers::within(numbers::SIZE))]
    size: Option<f64>,
    /// Centre of a shape in the rig frame, each -100 to 100 m [default: that of the workspace]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "what")]
    #[arg(value_parser = point)]
    centre: Option<Point3<f64>>,
    /// Draw a shape upright, in y and z, and not level
    #[arg(long, requires = "what")]
    upright: bool,
    /// Seed of the shape spline, 0 to 1e15 [default: 1]
    #[arg(long, requires = "what", value_parser = numbers::seed(), allow_negative_numbers = true)]
    path_seed: Option<u64>,
    /// Keep the path's time where the ball cannot follow, and do not wait for it
    #[arg(long, requires = "what")]
    no_wait: bool,
}

/// Kind of what the ball follows. The text is for people.
#[derive(Clone, Copy)]
enum Course {
    Shape(ShapeKind),
    Places(Kind),
    Moving,
}

impl fmt::Display for Course {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Shape(kind) => kind.name(),
            Self::Places(Kind::Path) => "places of a file",
            Self::Places(Kind::Timed) => "a file with times",
            Self::Places(Kind::Stops) => "places to stop at",
            Self::Moving => "a target that moves",
        })
    }
}

impl PathOptions {
    /// Returns what the ball follows as the goal of a run, checked against the rig.
    pub(super) fn goal(&self, what: &What, rig: &Rig, is_loop: bool) -> Result<Goal, Failure> {
        let run = if is_loop { Run::Loop } else { Run::Once };
        let limits = self.limits(rig)?;
        match what {
            What::Shape(kind) => {
                self.check_effect(Course::Shape(*kind), is_loop)?;
                let trajectory = self.shape(*kind, rig).trajectory(&limits, run);
                self.path(kind.name(), trajectory, None, rig)
            }
            What::Program(address) => {
                self.check_effect(Course::Moving, is_loop)?;
                Ok(Goal::Moving(TargetOrigin::Program(address.clone())))
            }
            What::File(path) => match FollowFile::read(path, &rig.motion_rules())? {
                FollowFile::Path(places) => {
                    self.check_effect(Course::Places(places.kind), is_loop)?;
                    tell_slower(&places.speeds, limits.speed);
                    let trajectory = places.trajectory(&limits, self.tolerance(), run);
                    self.path(path.display(), trajectory, Some((path, &places)), rig)
                }
                FollowFile::Stops(waypoints) => {
                    self.check_effect(Course::Places(Kind::Stops), is_loop)?;
                    Ok(Goal::Waypoints(waypoints, is_loop))
                }
                FollowFile::Targets(targets) => {
                    self.check_effect(Course::Moving, is_loop)?;
                    let span_s = targets.last().map_or(0.0, |last| last.time_s);
                    let (count, doubt) = (targets.len(), time_doubt(targets.len(), span_s));
                    note!("targets: {}, {count} in {span_s:.1} s{doubt}", path.display());
                    Ok(Goal::Moving(TargetOrigin::File(targets)))
                }
            },
        }
    }

    /// Returns the path of that `name` as a goal, checked against the rig. Where its file has
    /// places that the rig does not allow, the error lists them with their lines.
    fn path(
        &self,
        name: impl fmt::Display,
        trajectory: Result<Trajectory, PathError>,
        file: Option<(&Path, &Places)>,
        rig: &Rig,
    ) -> Result<Goal, Failure> {
        let trajectory = trajectory.map_err(|error| failed(format!("{name}: {error}")))?;
        let plan = PathPlan::new(trajectory, !self.no_wait, rig).map_err(|error| {
            let rules = rig.motion_rules();
            match file.map(|(path, places)| misplaced(path, places, &rules)) {
                Some(wrong) if !wrong.mistakes.is_empty() => failed(wrong),
                _ => failed(format!("{name}: {error}: {}", error.rule)),
            }
        })?;
        note_size(plan.trajectory(), file.map_or(&[], |(_, places)| &places.places));
        Ok(Goal::Path(Box::new(plan)))
    }

    /// Returns the limits of the path: those of the options, within those of the rig file.
    fn limits(&self, rig: &Rig) -> Result<MotionLimits, Failure> {
        let highest = rig.path.max_speed.get();
        let speed = self.speed.unwrap_or(DEFAULT_SPEED.min(highest));
        if speed > highest {
            let message = format!(
                "--speed {speed} is above {highest} m/s, which is `path.max_speed` of the rig"
            );
            return Err(failed(message));
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

    /// Checks that no option is given that has no effect on `course`.
    fn check_effect(&self, course: Course, is_loop: bool) -> Result<(), Failure> {
        use ShapeKind::{Spline, Square};
        let is_shape = matches!(course, Course::Shape(_));
        let is_path = is_shape || matches!(course, Course::Places(Kind::Path | Kind::Timed));
        let has_speed = is_shape || matches!(course, Course::Places(Kind::Path));
        let has_corners = matches!(course, Course::Shape(Square) | Course::Places(Kind::Path));
        let options = [
            ("--speed", self.speed.is_some(), has_speed),
            ("--tolerance", self.tolerance.is_some(), has_corners),
            ("--size", self.size.is_some(), is_shape),
            ("--centre", self.centre.is_some(), is_shape),
            ("--upright", self.upright, is_shape),
            ("--path-seed", self.path_seed.is_some(), matches!(course, Course::Shape(Spline))),
            ("--no-wait", self.no_wait, is_path),
            ("--loop", is_loop, !matches!(course, Course::Moving)),
        ];
        match options.iter().find(|(_, is_given, has_effect)| *is_given && !has_effect) {
            Some((option, ..)) => Err(failed(format!("{option} has no effect on {course}"))),
            None => Ok(()),
        }
    }
}

/// Says how long a path is, and how long the ball takes for it; with a doubt about the times of its
/// `places` where they are far apart.
fn note_size(trajectory: &Trajectory, places: &[Place]) {
    let span_s =
        places.last().zip(places.first()).map_or(0.0, |(last, first)| last.time_s - first.time_s);
    let (length, doubt) = (trajectory.length(), time_doubt(places.len(), span_s));
    match trajectory.period() {
        Some(lap) => note!("path: a lap of {length:.3} m takes {lap:.1} s{doubt}"),
        None => note!("path: {length:.3} m, {:.1} s{doubt}", trajectory.duration()),
    }
}

/// Returns the doubt about the unit of `t` in a file of so many places that take `span_s` seconds,
/// as the end of a message; empty where there is none.
fn time_doubt(places: usize, span_s: f64) -> &'static str {
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
