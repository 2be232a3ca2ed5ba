//! Messages between the program and its page: JSON, a `type` in each. docs/use/page.md lists them.

use nalgebra::Point3;
use plumb_frame::camera::Camera;
use plumb_protocol::MotorList;
use plumb_runtime::observer::Tone;
use plumb_runtime::operator::OperatorCommand;
use plumb_runtime::record::Record;
use plumb_runtime::rig::Rig;
use plumb_runtime::rig::quantity::Corner;
use serde::{Deserialize, Serialize};

use crate::files::FileView;
use crate::sight::{Click, PlaneView, SeenBall, Sight, Source};

/// Version of the messages. A page of another version reloads itself.
pub const VERSION: u32 = 5;

/// Message of a page.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum FromPage {
    /// Acknowledges an update and its picture. The next one follows.
    Seen {
        /// [`Update::number`].
        update: u64,
    },
    // Braces: of a variant without them, serde takes unknown keys.
    /// Ramps the motors down, and holds the rig: nothing moves the ball before a Resume.
    Stop {},
    /// Ends a Stop, which it names. The ball stays where it is.
    Resume {
        /// [`StopView::number`].
        stop: u64,
    },
    /// Holds the ball where it is.
    Hold {},
    /// Drives the ball to a target, metres in the rig frame.
    Target { x: f64, y: f64, z: f64 },
    /// Moves the target that the ball follows, metres in the rig frame. The first message of a
    /// gesture says so.
    Move {
        x: f64,
        y: f64,
        z: f64,
        #[serde(default)]
        first: bool,
    },
    /// Asks which point of the workspace a pixel means. Moves nothing.
    Pick {
        /// Column and row; the middle of the first pixel is 0, 0.
        u: f64,
        v: f64,
        /// Point that the plane goes through, metres in the rig frame.
        x: f64,
        y: f64,
        z: f64,
        /// Whether the depth of the picture counts.
        depth: bool,
    },
    /// Asks where a point (metres in the rig frame) is seen. Moves nothing.
    Project { x: f64, y: f64, z: f64 },
    /// Turns one motor.
    Jog {
        motor: MotorName,
        /// Full steps, + pays out.
        steps: f64,
        /// Full steps/s.
        rate: f64,
    },
    /// Clears a fault.
    Clear {},
    /// Ends the run.
    End {},
    /// The page has all files of the run, or wants none.
    Taken {},
}

/// Name of a motor; its number is that of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub(crate) enum MotorName {
    A = 0,
    B = 1,
    C = 2,
}

/// What a message of a page asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Action {
    /// The next update; this one has arrived.
    Next(u64),
    /// A command to the run.
    Command(OperatorCommand),
    /// A place of the target that moves, metres; the first one of a gesture or a further one.
    Move(Point3<f64>, Gesture),
    /// The point of a click.
    Pick(Click),
    /// The pixel of a point, metres.
    Project(Point3<f64>),
    /// No further file of the run.
    Taken,
}

/// Place of a message in a gesture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Gesture {
    Begins,
    GoesOn,
}

impl From<FromPage> for Action {
    fn from(message: FromPage) -> Self {
        Self::Command(match message {
            FromPage::Seen { update } => return Self::Next(update),
            FromPage::Stop {} => OperatorCommand::Stop,
            FromPage::Resume { stop } => OperatorCommand::Resume { stop },
            FromPage::Hold {} => OperatorCommand::Hold,
            FromPage::Target { x, y, z } => OperatorCommand::Target(Point3::new(x, y, z)),
            FromPage::Move { x, y, z, first } => {
                let gesture = if first { Gesture::Begins } else { Gesture::GoesOn };
                return Self::Move(Point3::new(x, y, z), gesture);
            }
            FromPage::Pick { u, v, x, y, z, depth } => {
                return Self::Pick(Click { pixel: [u, v], through: [x, y, z], with_depth: depth });
            }
            FromPage::Taken {} => return Self::Taken,
            FromPage::Project { x, y, z } => return Self::Project(Point3::new(x, y, z)),
            FromPage::Jog { motor, steps, rate } => {
                OperatorCommand::Jog { motor: motor as u8, distance: steps, rate }
            }
            FromPage::Clear {} => OperatorCommand::ClearFault,
            FromPage::End {} => OperatorCommand::End,
        })
    }
}

/// Message of the program.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(crate) enum ToPage<'a> {
    /// First message: what does not change during a run.
    Hello(&'a Hello),
    /// State of the run. A binary message with a JPEG follows if [`Update::picture`] is there.
    Update(&'a Update),
    /// Answer to [`FromPage::Pick`].
    Picked(&'a PickedView),
    /// Answer to [`FromPage::Project`].
    Projected(&'a ProjectedView),
    /// A message of the page was not understood or cannot be carried out.
    Problem {
        /// Reason, for people.
        text: &'a str,
    },
}

/// Point that a click means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct PickedView {
    /// Metres in the rig frame; `None` where the click means no point of the workspace.
    pub(crate) point: Option<[f64; 3]>,
    /// What told the point.
    pub(crate) by: Option<Source>,
    /// The same for people, or the reason why there is no point.
    pub(crate) text: String,
}

/// Place of a point in the picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ProjectedView {
    /// Column and row; `None` where the point is not seen, or there is no picture yet.
    pub(crate) pixel: Option<[f64; 2]>,
    /// Plane through the point; `None` where there is no picture yet.
    pub(crate) plane: Option<PlaneView>,
}

/// What does not change during a run.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Hello {
    pub(crate) version: u32,
    /// What the page shows: `run`; another subject has other messages.
    pub(crate) subject: &'static str,
    /// Whether commands have an effect: false for a page that only shows.
    pub(crate) commands: bool,
    pub(crate) rig: RigView,
}

/// Rig as the page shows it. Metres, seconds, full steps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RigView {
    /// The law and its gain, for people.
    pub title: String,
    /// Name of the law.
    pub law: &'static str,
    /// Corners of the workspace, smallest and largest coordinates.
    pub workspace: [[f64; 3]; 2],
    /// |e| within which a target counts as reached.
    pub radius: f64,
    /// Number of the motors.
    pub motor_count: usize,
    /// Point of each motor; `None` where nobody knows them.
    pub motors: Option<MotorList<[f64; 3]>>,
    /// Names of the motors in the picture of the rig; they say where the points are approximate.
    pub motor_names: Option<[&'static str; 3]>,
    /// Highest rate of a motor, full steps/s.
    pub max_rate: f64,
    /// Highest rate of a jog, full steps/s.
    pub jog_rate: f64,
    /// Longest distance of one jog, full steps.
    pub jog_distance: f64,
    /// Lowest and highest position of a motor, full steps.
    pub travel: [f64; 2],
    /// The camera; `None` where its pose is unknown. JSON has the name of the coordinate that is
    /// the same on the plane of a click.
    pub sight: Option<Sight>,
}

impl RigView {
    /// Returns the view of a rig file.
    pub fn of(rig: &Rig) -> Self {
        let corner = |corner: [Corner; 3]| corner.map(Corner::get);
        let motors = rig.motor_points();
        Self {
            title: rig.law.title(),
            law: rig.law.name().as_str(),
            workspace: [corner(rig.workspace.min), corner(rig.workspace.max)],
            radius: rig.reached.radius.get(),
            motor_count: rig.motors.count(),
            motors: motors.map(|motors| motors.places.map(Into::into)),
            motor_names: motors.map(|motors| motors.names()),
            max_rate: rig.motors.max_rate.get(),
            jog_rate: rig.jog.max_rate.get().min(rig.motors.max_rate.get()),
            jog_distance: rig.jog.max_distance.get(),
            travel: rig.motors.travel.map(|steps| steps.get()),
            sight: None,
        }
    }

    /// Returns the same view of a rig that `camera` sees: a click into its picture means a point.
    #[must_use]
    pub fn seen_by(self, camera: &Camera) -> Self {
        Self { sight: Some(Sight::of(camera)), ..self }
    }
}

/// State of the run. `null` is unknown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Update {
    /// Number to acknowledge with [`FromPage::Seen`].
    pub(crate) number: u64,
    /// Frame of the picture that follows as a binary message; `None` if none follows.
    pub(crate) picture: Option<FrameView>,
    /// Samples since the client's last update, oldest first.
    pub(crate) samples: Vec<Sample>,
    /// The newest frame.
    pub(crate) observation: Option<FrameView>,
    /// Newest telemetry of the board.
    pub(crate) telemetry: Option<Record>,
    /// The present target and what became of it.
    pub(crate) goal: Option<Goal>,
    /// The Stop in force.
    pub(crate) stop: Option<StopView>,
    /// Events since the client's last update, oldest first.
    pub(crate) events: Vec<Event>,
    /// Number of records that found no room in the page's memory before this client took them.
    pub(crate) missed: u64,
    /// End of the run, once it has ended.
    pub(crate) ended: Option<Ended>,
    /// Files of the run, once it has ended and they are complete.
    pub(crate) files: Vec<FileView>,
}

/// Fields of the observation of one frame: `frame`, `time_s`, `position_m`, `error_m`, `target_m`.
/// The position and the error are `null` where the ball was not located, the target and the error
/// before there is one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Sample(
    pub(crate) u64,
    pub(crate) f64,
    pub(crate) [Option<f64>; 3],
    pub(crate) Option<f64>,
    pub(crate) [Option<f64>; 3],
);

/// Frame with the ball in it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct FrameView {
    #[serde(skip)]
    pub(crate) number: u64,
    /// The ball, if it was found and its position is known.
    #[serde(skip)]
    pub(crate) ball: Option<SeenBall>,
    /// The observation.
    #[serde(flatten)]
    pub(crate) record: Record,
    /// Column and row of the target, pixels; `None` where it is not seen.
    pub(crate) target_px: Option<[f64; 2]>,
}

/// Stop in force.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct StopView {
    /// Number that a Resume must name.
    pub(crate) number: u64,
    /// Who sent it, for people.
    pub(crate) by: String,
    /// When it was sent, milliseconds since 1970.
    pub(crate) since_ms: u64,
    /// Number of commands and targets that were refused since then.
    pub(crate) refused: u64,
}

/// A target, and how the drive to it ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Goal {
    /// Metres in the rig frame.
    pub(crate) target_m: [f64; 3],
    /// Whether the run has confirmed that the ball is there.
    pub(crate) reached: bool,
    /// How the drive ended; `None` while it lasts.
    pub(crate) ending: Option<String>,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Event {
    /// Number of the event on the page, from 0.
    pub(crate) id: u64,
    /// When it happened, milliseconds since 1970.
    pub(crate) at_ms: u64,
    pub(crate) tone: Tone,
    pub(crate) text: String,
}

/// End of the run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Ended {
    /// Reason, for people.
    pub(crate) ending: String,
    /// Whether the board reported that its motors stand still.
    pub(crate) at_rest: bool,
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::mem::discriminant;

    use super::*;

    #[test]
    fn jogs_keep_the_limits_of_the_rig_file() {
        let mut rig = Rig::paper().unwrap();
        rig.jog.max_rate = 40.0.try_into().unwrap();
        rig.jog.max_distance = 60.0.try_into().unwrap();
        let view = RigView::of(&rig);
        assert_eq!((view.jog_rate, view.jog_distance), (40.0, 60.0));
        rig.motors.max_rate = 30.0.try_into().unwrap();
        assert_eq!(RigView::of(&rig).jog_rate, 30.0);
    }

    #[test]
    fn the_book_has_an_example_of_each_message_of_a_page() {
        let book = include_str!("../../../docs/use/page.md");
        let messages = book.split("### Examples").nth(1).unwrap().split("```").nth(1).unwrap();
        let read: Vec<FromPage> =
            messages.lines().skip(1).map(|line| serde_json::from_str(line).unwrap()).collect();
        let kinds: HashSet<_> = read.iter().map(discriminant).collect();
        // An unknown type is refused with the names of all of them.
        let unknown = serde_json::from_str::<FromPage>(r#"{"type":"fly"}"#).unwrap_err();
        let names =
            unknown.to_string().split("expected one of").nth(1).unwrap().matches(", ").count();
        assert_eq!(kinds.len(), names + 1, "{unknown}");
    }

    #[test]
    fn messages_of_a_page_are_read_strictly() {
        let read = |text: &str| serde_json::from_str::<FromPage>(text).ok();
        assert_eq!(read(r#"{"type":"stop"}"#), Some(FromPage::Stop {}));
        let resume = FromPage::Resume { stop: 7 };
        assert_eq!(read(r#"{"type":"resume","stop":7}"#), Some(resume));
        let target = FromPage::Target { x: 0.4, y: -1.0, z: 0.25 };
        assert_eq!(read(r#"{"type":"target","x":0.4,"y":-1,"z":0.25}"#), Some(target));
        let jog = FromPage::Jog { motor: MotorName::B, steps: -20.0, rate: 50.0 };
        assert_eq!(read(r#"{"type":"jog","motor":"B","steps":-20,"rate":50}"#), Some(jog));
        let moved = FromPage::Move { x: 0.4, y: 0.3, z: 0.25, first: false };
        assert_eq!(read(r#"{"type":"move","x":0.4,"y":0.3,"z":0.25}"#), Some(moved));
        for text in [
            "",
            "stop",
            "{}",
            r#"{"type":"fly"}"#,
            r#"{"type":"stop","now":1}"#,
            r#"{"type":"resume"}"#,
            r#"{"type":"resume","stop":-7}"#,
            r#"{"type":"target","x":0.4,"y":1}"#,
            r#"{"type":"target","x":0.4,"y":1,"z":2,"w":3}"#,
            r#"{"type":"target","x":"0.4","y":1,"z":2}"#,
            r#"{"type":"target","x":1e999,"y":1,"z":2}"#,
            r#"{"type":"move","x":0.4,"y":0.3,"z":0.25,"first":1}"#,
            r#"{"type":"pick","u":1,"v":2,"x":0,"y":0,"z":0}"#,
            r#"{"type":"pick","u":null,"v":2,"x":0,"y":0,"z":0,"depth":true}"#,
            r#"{"type":"project","x":1e999,"y":0,"z":0}"#,
            r#"{"type":"jog","motor":"D","steps":1,"rate":1}"#,
            r#"[{"type":"stop"}]"#,
        ] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
