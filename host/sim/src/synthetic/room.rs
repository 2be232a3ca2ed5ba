//! A synthetic room: walls, objects, lights.

mod board;
mod furniture;
mod pattern;
mod ray_caster;
mod shape;
mod view;

use nalgebra::{Point3, Vector3};

use super::light::Material;

pub use pattern::Pattern;
pub use shape::Shape;

/// An object in a room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Object {
    /// Shape and position, rig frame.
    pub shape: Shape,
    /// Its material.
    pub material: Material,
    /// Variation of its colour.
    pub pattern: Pattern,
    /// Light that it gives itself, linear, times its colour; above 0 it has no depth (lamps,
    /// windows, screens).
    pub glow: f64,
}

impl Object {
    /// Creates an object of one colour that does not glow.
    pub fn new(shape: Shape, material: Material) -> Self {
        Self { shape, material, pattern: Pattern::Plain, glow: 0.0 }
    }

    /// Returns the object with a pattern.
    pub fn with_pattern(self, pattern: Pattern) -> Self {
        Self { pattern, ..self }
    }

    /// Returns the object with emitted light.
    pub fn glowing(self, glow: f64) -> Self {
        Self { glow, ..self }
    }
}

/// Intersection with a ray: distance in lengths of the ray, unit normal, material.
pub(crate) type Surface = (f64, Vector3<f64>, Material);

impl Object {
    /// Returns the bounding sphere: centre and radius, metres.
    pub(crate) fn bounding_sphere(&self) -> (Point3<f64>, f64) {
        let sphere = self.shape.bounding_sphere();
        (sphere.centre, sphere.radius)
    }

    /// Returns the first intersection with the ray from `from` along `along`.
    pub(crate) fn intersect(&self, from: Point3<f64>, along: Vector3<f64>) -> Option<Surface> {
        let meeting = self.shape.intersect(&shape::Ray { from, along })?;
        let colour = self.pattern.colour(self.material.colour, meeting.local);
        Some((meeting.t, meeting.normal, Material { colour, ..self.material }))
    }
}

/// A flat rectangular source of light.
#[derive(Debug, Clone, Copy, PartialEq)]
struct AreaLight {
    centre: Point3<f64>,
    /// From the middle to the middle of two edges, metres; light leaves along `a` x `b`.
    a: Vector3<f64>,
    b: Vector3<f64>,
    /// Linear, order blue, green, red.
    power: [f64; 3],
}

/// Index of the floor among a room's six sides.
const FLOOR: usize = 4;

/// A room and the objects in it, in the rig frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Room {
    low: Point3<f64>,
    high: Point3<f64>,
    /// Paint of the walls by axis and side: -x, +x, -y, +y, floor, ceiling.
    paint: Vec<Material>,
    floor: Pattern,
    objects: Vec<Object>,
    panels: Vec<AreaLight>,
}

impl Room {
    /// An empty room, painted all over with `paint`, 2.2 m behind the rig's origin, lit by a lamp
    /// on its ceiling.
    pub fn bare(paint: Material) -> Self {
        let panel = AreaLight {
            centre: Point3::new(1.3, -0.5, 1.6),
            a: Vector3::new(0.35, 0.0, 0.0),
            b: Vector3::new(0.0, -0.35, 0.0),
            power: [2.9, 3.1, 3.2],
        };
        Self {
            low: Point3::new(-2.2, -1.6, -0.75),
            high: Point3::new(3.0, 2.2, 1.65),
            paint: vec![paint.matt(); 6],
            floor: Pattern::Mottled,
            objects: Vec::new(),
            panels: vec![panel],
        }
    }

    /// Returns the room with another floor.
    pub fn with_floor(mut self, paint: Material, pattern: Pattern) -> Self {
        self.paint[FLOOR] = paint;
        self.floor = pattern;
        self
    }

    /// Returns the room with `object` added.
    pub fn with(mut self, object: Object) -> Self {
        self.objects.push(object);
        self
    }
}
