//! What is in front of the camera at one moment.

use nalgebra::Point3;

use super::light::Material;

/// What is drawn into the background. Lengths in metres, positions in the rig frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Centre of the rig's ball; `None` where there is none in the picture.
    pub ball: Option<Point3<f64>>,
    /// What the ball is made of.
    pub ball_material: Material,
    /// Where the three cables leave motors A, B, C; `None` for a ball without cables and motors.
    pub motors: Option<[Point3<f64>; 3]>,
    /// Diameter of the cables, metres.
    pub cable_diameter: f64,
    /// What the cables are made of.
    pub cable_material: Material,
    /// Other balls.
    pub others: Vec<Ball>,
    /// Other straight thin things: cables that cross the picture, sticks.
    pub strands: Vec<Strand>,
    /// Exposure: 1 = as the background is, less is darker, more saturates. Greater than 0.
    pub light: f64,
    /// Standard deviation of the blur of what is drawn, pixels; 0 = sharp, 0.6 = as cheap cameras
    /// are, 2 = out of focus.
    pub blur: f64,
}

impl Default for Scene {
    /// Nothing in the picture, the paper's ball and thin dark cables for what is put there.
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
    /// The rig with its ball at `ball` and its cables from `motors` A, B, C (rig frame, metres).
    pub fn rig(ball: Point3<f64>, motors: [Point3<f64>; 3]) -> Self {
        Self { ball: Some(ball), motors: Some(motors), ..Self::default() }
    }
}

/// A ball that is not the rig's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its centre, rig frame, metres.
    pub centre: Point3<f64>,
    /// Its diameter, metres.
    pub diameter: f64,
    /// What it is made of.
    pub material: Material,
}

/// A straight round thin thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strand {
    /// One end, rig frame, metres.
    pub from: Point3<f64>,
    /// The other end, rig frame, metres.
    pub to: Point3<f64>,
    /// Its diameter, metres.
    pub diameter: f64,
    /// What it is made of.
    pub material: Material,
}
