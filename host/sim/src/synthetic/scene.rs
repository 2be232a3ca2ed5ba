//! The content of a frame.

use nalgebra::Point3;
use plumb_protocol::MotorList;

use super::light::Material;

/// Objects drawn in front of the background. Lengths in metres, positions in the rig frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Centre of the rig's ball; `None` if there is no ball.
    pub ball: Option<Point3<f64>>,
    /// Material of the ball.
    pub ball_material: Material,
    /// Where the cables leave the motors; `None` for a ball without cables and motors.
    pub motors: Option<MotorList<Point3<f64>>>,
    /// Diameter of the cables, metres.
    pub cable_diameter: f64,
    /// Material of the cables.
    pub cable_material: Material,
    /// Other balls.
    pub others: Vec<ExtraBall>,
    /// Other straight thin objects: cables that cross the frame, sticks.
    pub strands: Vec<Strand>,
    /// Exposure, above 0; 1 = the background's own.
    pub light: f64,
    /// Standard deviation of the blur of drawn objects, pixels: 0 = sharp, 0.6 = a low-cost camera,
    /// 2 = out of focus.
    pub blur: f64,
}

impl Default for Scene {
    /// An empty scene with the paper's ball and thin dark cables as defaults.
    fn default() -> Self {
        Self {
            ball: None,
            ball_material: Material::red_ball(),
            motors: None,
            cable_diameter: 0.001_5,
            cable_material: Material::from_srgb(52, 50, 48).matt(),
            others: Vec::new(),
            strands: Vec::new(),
            light: 1.0,
            blur: 0.6,
        }
    }
}

impl Scene {
    /// The rig with its ball at `ball` and its cables from `motors` (rig frame, metres).
    pub fn rig(ball: Point3<f64>, motors: impl Into<MotorList<Point3<f64>>>) -> Self {
        Self { ball: Some(ball), motors: Some(motors.into()), ..Self::default() }
    }

    /// Returns the scene with a ball of this hue, degrees.
    pub fn with_ball_hue(self, hue: f64) -> Self {
        Self { ball_material: Material::ball_of_hue(hue), ..self }
    }
}

/// A ball that is not the rig's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtraBall {
    /// Its centre, rig frame, metres.
    pub centre: Point3<f64>,
    /// Its diameter, metres.
    pub diameter: f64,
    /// Its material.
    pub material: Material,
}

/// A straight round thin object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strand {
    /// One end, rig frame, metres.
    pub from: Point3<f64>,
    /// The other end, rig frame, metres.
    pub to: Point3<f64>,
    /// Its diameter, metres.
    pub diameter: f64,
    /// Its material.
    pub material: Material,
}
