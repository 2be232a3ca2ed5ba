//! The rig, the ball, its target and its path in space.

use std::collections::VecDeque;

use foxglove::messages::line_primitive::Type;
use foxglove::messages::{
    Color, LinePrimitive, Point3 as ScenePoint, Pose, Quaternion, SceneEntity, SceneUpdate,
    SpherePrimitive, TextPrimitive, Vector3,
};
use nalgebra::Point3;
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::rig::quantity::Corner;
use plumb_runtime::rig::{MotorPoints, Rig};

use crate::camera::RIG;
use crate::clock::timestamp;

/// Number of positions in the path: 20 s at 30 frames/s.
const PATH: usize = 600;

/// Width of the lines, metres.
const THIN: f64 = 0.002;
const THICK: f64 = 0.004;

/// Height of the letters, metres.
const LETTER: f64 = 0.04;

const RED: Color = Color { r: 0.85, g: 0.15, b: 0.1, a: 1.0 };
const GREEN: Color = Color { r: 0.1, g: 0.7, b: 0.3, a: 0.4 };
const BLUE: Color = Color { r: 0.12, g: 0.4, b: 0.8, a: 1.0 };
const GREY: Color = Color { r: 0.5, g: 0.5, b: 0.5, a: 1.0 };
const FAINT: Color = Color { r: 0.5, g: 0.5, b: 0.5, a: 0.4 };

/// Scene of a run. Every update is complete, so that a viewer may come at any time.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// Corners of the workspace, smallest and largest coordinates, metres.
    workspace: [Point3<f64>; 2],
    /// Motor points; `None` where they are unknown.
    motors: Option<MotorPoints>,
    /// Radius within which a target counts as reached, metres.
    reached: f64,
    /// Diameter of the ball, metres.
    ball_diameter: f64,
    /// The newest measured positions, oldest first, metres.
    path: VecDeque<Point3<f64>>,
}

impl Scene {
    /// Makes the scene of a rig and a ball of `ball_diameter` metres.
    pub(crate) fn new(rig: &Rig, ball_diameter: f64) -> Self {
        let corner = |corner: [Corner; 3]| Point3::from(corner.map(Corner::get));
        Self {
            workspace: [corner(rig.workspace.min), corner(rig.workspace.max)],
            motors: rig.motor_points(),
            reached: rig.reached.radius.get(),
            ball_diameter,
            path: VecDeque::new(),
        }
    }

    /// Adds the frame's position to the path. Returns the scene at the frame.
    pub(crate) fn update(&mut self, record: &FrameRecord, stamp: u64) -> SceneUpdate {
        let ball = record.position();
        if let Some(ball) = ball {
            if self.path.len() == PATH {
                self.path.pop_front();
            }
            self.path.push_back(ball);
        }
        let entity = |id: &str| SceneEntity {
            timestamp: timestamp(stamp),
            frame_id: RIG.to_owned(),
            id: id.to_owned(),
            ..SceneEntity::default()
        };
        let target = record.target.map(|at| sphere(&at, 2.0 * self.reached, GREEN));
        // An entity replaces the one of its name: without a shape, the ball and the cables vanish.
        let mut entities = vec![
            SceneEntity {
                spheres: ball.map(|at| sphere(&at, self.ball_diameter, RED)).into_iter().collect(),
                ..entity("ball")
            },
            SceneEntity { spheres: target.into_iter().collect(), ..entity("target") },
            SceneEntity {
                lines: vec![line(Type::LineStrip, self.path.iter(), THICK, BLUE)],
                ..entity("path")
            },
            SceneEntity { lines: vec![self.workspace()], ..entity("workspace") },
        ];
        if let Some(points) = &self.motors {
            let motors = &points.places;
            entities.push(SceneEntity {
                lines: vec![line(Type::LineLoop, motors.iter(), THICK, GREY)],
                texts: motors.iter().zip(points.names()).map(|(at, name)| text(at, name)).collect(),
                ..entity("motors")
            });
            entities.push(SceneEntity {
                lines: ball.map(|ball| cables(motors, &ball)).into_iter().collect(),
                ..entity("cables")
            });
        }
        SceneUpdate { deletions: Vec::new(), entities }
    }

    /// Returns the edges of the workspace.
    fn workspace(&self) -> LinePrimitive {
        let corner = |k: usize| {
            Point3::from(std::array::from_fn::<f64, 3, _>(|i| self.workspace[k >> i & 1][i]))
        };
        let along =
            |axis: usize| (0..8).filter(move |k| k >> axis & 1 == 0).map(move |k| (k, axis));
        let edges = (0..3).flat_map(along);
        let ends: Vec<Point3<f64>> =
            edges.flat_map(|(k, axis)| [corner(k), corner(k | 1 << axis)]).collect();
        line(Type::LineList, ends.iter(), THIN, FAINT)
    }
}

/// Returns the straight lines from the motors to the ball.
fn cables(motors: &[Point3<f64>], ball: &Point3<f64>) -> LinePrimitive {
    line(Type::LineList, motors.iter().flat_map(|motor| [motor, ball]), THIN, GREY)
}

fn line<'a>(
    kind: Type,
    points: impl Iterator<Item = &'a Point3<f64>>,
    thickness: f64,
    colour: Color,
) -> LinePrimitive {
    LinePrimitive {
        r#type: kind as i32,
        pose: Some(pose(&Point3::origin())),
        thickness,
        points: points.map(|p| ScenePoint { x: p.x, y: p.y, z: p.z }).collect(),
        color: Some(colour),
        ..LinePrimitive::default()
    }
}

fn sphere(at: &Point3<f64>, diameter: f64, colour: Color) -> SpherePrimitive {
    let size = Vector3 { x: diameter, y: diameter, z: diameter };
    SpherePrimitive { pose: Some(pose(at)), size: Some(size), color: Some(colour) }
}

fn text(at: &Point3<f64>, text: &str) -> TextPrimitive {
    TextPrimitive {
        pose: Some(pose(at)),
        billboard: true,
        font_size: LETTER,
        scale_invariant: false,
        color: Some(GREY),
        text: text.to_owned(),
    }
}

/// Returns the pose of a shape at a point, along the axes.
fn pose(at: &Point3<f64>) -> Pose {
    Pose {
        position: Some(Vector3 { x: at.x, y: at.y, z: at.z }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(number: u64) -> FrameRecord {
        FrameRecord {
            number,
            time: number as f64,
            target: Some(Point3::new(0.4, 0.4, 0.15)),
            ..FrameRecord::default()
        }
    }

    #[test]
    fn a_frame_without_the_ball_shows_no_ball_and_no_cables() {
        let mut scene = Scene::new(&Rig::paper().unwrap(), 0.04);
        let update = scene.update(&record(0), 0);
        let named = |id: &str| update.entities.iter().find(|entity| entity.id == id).unwrap();
        assert!(named("ball").spheres.is_empty() && named("cables").lines.is_empty());
        let target = named("target").spheres[0].pose.unwrap().position.unwrap();
        assert_eq!((target.x, target.y, target.z), (0.4, 0.4, 0.15));
    }

    #[test]
    fn the_workspace_has_twelve_edges_along_the_axes() {
        let scene = Scene::new(&Rig::paper().unwrap(), 0.04);
        let points = scene.workspace().points;
        assert_eq!(points.len(), 24);
        for edge in points.chunks(2) {
            let difference = [edge[1].x - edge[0].x, edge[1].y - edge[0].y, edge[1].z - edge[0].z];
            assert_eq!(difference.iter().filter(|d| **d > 0.0).count(), 1, "{edge:?}");
            assert_eq!(difference.iter().filter(|d| **d == 0.0).count(), 2, "{edge:?}");
        }
    }

    #[test]
    fn the_path_is_bounded() {
        let mut scene = Scene::new(&Rig::paper().unwrap(), 0.04);
        scene.path.extend((0..PATH).map(|k| Point3::new(k as f64, 0.0, 0.0)));
        let circle = plumb_frame::observation::Circle::rough(1.0, 1.0, 1.0);
        let mean = Point3::new(9.0, 9.0, 9.0);
        let position = plumb_frame::observation::Gaussian3 { mean, covariance: nalgebra::zero() };
        let ball = plumb_frame::observation::BallObservation {
            stamp: 0.0,
            circle,
            score: 1.0,
            position: Some(position),
            depths: None,
        };
        let _ = scene.update(&FrameRecord { observation: Some(ball), ..record(0) }, 0);
        assert_eq!(scene.path.len(), PATH);
        assert_eq!((scene.path[0].x, scene.path.back().copied()), (1.0, Some(mean)));
    }
}
