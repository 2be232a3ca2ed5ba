//! A room of the camera's own: walls, things, a lamp and a window, cast into a picture once.

mod cast;
mod furniture;
mod pattern;
mod shape;
mod view;

pub use pattern::Pattern;
pub use shape::Shape;

use nalgebra::{Point3, Vector3};

use super::light::Material;

/// Something that stands in a room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thing {
    /// Where and of which shape, rig frame.
    pub shape: Shape,
    /// What it is made of.
    pub material: Material,
    /// How its colour changes over it.
    pub pattern: Pattern,
    /// Light that it gives itself, linear, times its colour; above 0 it has no depth (lamps,
    /// windows, screens).
    pub glow: f64,
}

impl Thing {
    /// A thing of one colour that does not glow.
    pub fn new(shape: Shape, material: Material) -> Self {
        Self { shape, material, pattern: Pattern::Plain, glow: 0.0 }
    }

    /// The same with a pattern.
    pub fn with_pattern(self, pattern: Pattern) -> Self {
        Self { pattern, ..self }
    }

    /// The same giving light.
    pub fn glowing(self, glow: f64) -> Self {
        Self { glow, ..self }
    }
}

/// What a ray meets: how far, in the ray's length; the unit normal; the material there.
pub(crate) type Surface = (f64, Vector3<f64>, Material);

impl Thing {
    /// A ball around it: middle and radius, metres.
    pub(crate) fn bounds(&self) -> (Point3<f64>, f64) {
        self.shape.bounds()
    }

    /// Where the ray from `from` along `along` first meets it.
    pub(crate) fn meet(&self, from: Point3<f64>, along: Vector3<f64>) -> Option<Surface> {
        let meeting = self.shape.meet(&shape::Ray { from, along })?;
        let colour = self.pattern.colour(self.material.colour, &meeting);
        Some((meeting.t, meeting.normal, Material { colour, ..self.material }))
    }
}

/// A flat rectangular source of light.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Panel {
    centre: Point3<f64>,
    /// From the middle to the middle of two edges, metres; light leaves along `a` x `b`.
    a: Vector3<f64>,
    b: Vector3<f64>,
    /// Linear, order blue, green, red.
    power: [f64; 3],
}

/// A room and the things in it, in the rig frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Room {
    low: Point3<f64>,
    high: Point3<f64>,
    /// Paint of the walls by axis and side: -x, +x, -y, +y, floor, ceiling.
    paint: Vec<Material>,
    floor: Pattern,
    things: Vec<Thing>,
    panels: Vec<Panel>,
}

impl Room {
    /// An empty room, painted all over with `paint`, 2.2 m behind the rig's origin, lit by a lamp
    /// on its ceiling.
    pub fn bare(paint: Material) -> Self {
        let panel = Panel {
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
            things: Vec::new(),
            panels: vec![panel],
        }
    }

    /// A furnished room for the paper's rig. In it stands what fools a detector that looks at the
    /// red channel: a white ball, a lamp, a window, a white piece of wall, balls the colour of skin
    /// and of oranges, red paper, a red can; all of it behind or beside the space that the ball
    /// moves in, as seen from the paper's camera.
    pub fn furnished() -> Self {
        furniture::furnished()
    }

    /// The same room with `thing` in it.
    pub fn with(mut self, thing: Thing) -> Self {
        self.things.push(thing);
        self
    }
}
