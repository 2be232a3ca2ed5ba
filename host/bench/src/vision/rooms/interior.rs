//! Rendered rooms from a seed: painted walls, carpets, wood, curtains, furniture and what lies
//! about on it.

use nalgebra::{Point3, Vector3};
use plumb_sim::synthetic::{
    Background, Material, Object, Pattern, RenderOptions, Room, Scene, Shape, SyntheticCamera,
};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::vision::{BoxedError, VisionOptions};

/// Range of colours of a room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Palette {
    /// Pale walls, brown and grey furniture, a few red things.
    Usual,
    /// Walls, wood, carpet and cloth all reddish.
    Reddish,
    /// The pale walls alone.
    Plain,
}

/// An sRGB colour: red, green, blue.
type Rgb = [u8; 3];

impl Palette {
    /// Returns the colours of walls.
    const fn walls(self) -> &'static [Rgb] {
        match self {
            Self::Usual | Self::Plain => &[
                [226, 222, 210],
                [200, 205, 208],
                [186, 200, 184],
                [236, 220, 178],
                [150, 160, 176],
                [120, 118, 112],
            ],
            Self::Reddish => {
                &[[168, 74, 58], [130, 30, 34], [196, 110, 96], [150, 84, 60], [188, 60, 60]]
            }
        }
    }

    /// Returns the colours of wood: floors, tables, cupboards.
    const fn woods(self) -> &'static [Rgb] {
        match self {
            Self::Usual | Self::Plain => {
                &[[206, 176, 136], [150, 112, 80], [96, 72, 52], [225, 215, 200]]
            }
            Self::Reddish => &[[96, 38, 26], [128, 54, 34], [74, 28, 22], [150, 70, 46]],
        }
    }

    /// Returns the colours of cloth: carpets, curtains, sofas.
    const fn cloths(self) -> &'static [Rgb] {
        match self {
            Self::Usual | Self::Plain => {
                &[[70, 86, 110], [150, 150, 140], [90, 110, 84], [60, 58, 60]]
            }
            Self::Reddish => &[[140, 24, 32], [170, 40, 44], [110, 20, 28], [190, 70, 70]],
        }
    }
}

/// Colours of things that lie about.
const THINGS: [Rgb; 12] = [
    [190, 24, 30],
    [176, 30, 40],
    [205, 40, 44],
    [150, 28, 36],
    [235, 235, 230],
    [240, 200, 60],
    [60, 80, 160],
    [40, 120, 70],
    [34, 35, 38],
    [225, 110, 40],
    [170, 172, 176],
    [130, 90, 60],
];

/// A random interior in the view of the suite's camera, which looks along -x from (1.737, 0.286,
/// 0.225) m.
struct Interior {
    palette: Palette,
    random: ChaCha8Rng,
    objects: Vec<Object>,
}

/// Returns a picture of a random room, without a ball.
pub(super) fn picture(
    palette: Palette,
    camera: &Camera,
    options: &VisionOptions,
    mut random: ChaCha8Rng,
) -> Result<RgbdFrame, BoxedError> {
    let seed = random.random();
    let rendering =
        RenderOptions { width: options.width, height: options.height, ..RenderOptions::default() };
    let room = Interior { palette, random, objects: Vec::new() }.room();
    let background = Background::Room(room);
    let mut camera = SyntheticCamera::new(camera.clone(), background, rendering, seed)?;
    Ok(camera.render(0.0, &Scene::default())?)
}

impl Interior {
    /// Returns the room with all its furniture.
    fn room(mut self) -> Room {
        let walls = self.colour(self.palette.walls());
        if self.palette == Palette::Plain {
            return Room::bare(walls);
        }
        let (floor, pattern) = match self.random.random_range(0..3) {
            0 => (self.colour(self.palette.cloths()), Pattern::Carpet),
            1 => (self.colour(self.palette.woods()), Pattern::Boards),
            _ => (self.colour(self.palette.walls()), Pattern::Mottled),
        };
        self.back_wall();
        if self.random.random_bool(0.6) {
            self.curtain();
        }
        if self.random.random_bool(0.5) {
            self.cupboard();
        }
        if self.random.random_bool(0.5) {
            self.sofa();
        }
        if self.random.random_bool(0.8) {
            self.table();
        }
        let room = Room::bare(walls).with_floor(floor, pattern);
        self.objects.into_iter().fold(room, Room::with)
    }

    /// Returns one of `colours` as a matt material, a little lighter or darker.
    fn colour(&mut self, colours: &[Rgb]) -> Material {
        let [red, green, blue] = colours[self.random.random_range(0..colours.len())];
        let by: f64 = self.random.random_range(0.8..1.15);
        let material = Material::from_srgb(red, green, blue).matt();
        Material { colour: material.colour.map(|x| (x * by).min(0.9)), ..material }
    }

    /// Adds a block, metres.
    fn block(&mut self, centre: [f64; 3], half: [f64; 3], material: Material, pattern: Pattern) {
        let shape = Shape::Block { centre: centre.into(), half: half.into(), yaw: 0.0 };
        self.objects.push(Object::new(shape, material).with_pattern(pattern));
    }

    /// Adds a wall across the picture 1.5 to 3.5 m before the camera, with uneven paint or boards.
    fn back_wall(&mut self) {
        let x = self.random.random_range(-1.9..0.0);
        let material = self.colour(self.palette.walls());
        let material = match self.random.random_range(0..3) {
            0 => self.colour(self.palette.woods()),
            _ => material,
        };
        let pattern =
            [Pattern::Uneven, Pattern::Mottled, Pattern::Wood][self.random.random_range(0..3)];
        let aside = self.random.random_range(-2.0..2.6);
        self.block([x - 0.05, aside, 0.4], [0.05, 1.4, 1.2], material, pattern);
    }

    /// Adds a curtain: folds side by side, each a round column.
    fn curtain(&mut self) {
        let x = self.random.random_range(-1.9..0.2);
        let mut y: f64 = self.random.random_range(-1.2..1.2);
        let material = self.colour(self.palette.cloths());
        for _ in 0..self.random.random_range(6..14) {
            let radius = self.random.random_range(0.035..0.075);
            let base = Point3::new(x + self.random.random_range(-0.02..0.02), y, -0.7);
            let shape = Shape::Cylinder { base, radius, height: 2.3 };
            self.objects.push(Object::new(shape, material).with_pattern(Pattern::Cloth));
            y += 1.6 * radius;
        }
    }

    /// Adds a cupboard with doors, or a shelf of books.
    fn cupboard(&mut self) {
        let (x, y) = (self.random.random_range(-1.8..-0.4), self.random.random_range(-1.0..1.5));
        let red_doors = self.random.random_bool(0.3);
        let material =
            if red_doors { self.colour(&THINGS[..4]) } else { self.colour(self.palette.woods()) };
        let books = self.random.random_bool(0.3);
        let pattern = if books { Pattern::Books } else { Pattern::Doors };
        let z = self.random.random_range(-0.5..0.6);
        let half = if books { 0.125 } else { self.random.random_range(0.25..0.6) };
        self.block([x, y, z], [0.2, 0.6, half], material, pattern);
    }

    /// Adds a sofa with cushions.
    fn sofa(&mut self) {
        let (x, y) = (self.random.random_range(-1.4..-0.2), self.random.random_range(-0.7..1.1));
        let cloth = self.colour(self.palette.cloths());
        self.block([x, y, -0.45], [0.35, 0.7, 0.2], cloth, Pattern::Cloth);
        self.block([x - 0.3, y, -0.1], [0.1, 0.7, 0.35], cloth, Pattern::Cloth);
        for _ in 0..self.random.random_range(1..4) {
            let aside = self.random.random_range(-0.5..0.5);
            let size = self.random.random_range(0.14..0.22);
            let shape = Shape::Ellipsoid {
                centre: Point3::new(x - 0.1, y + aside, -0.25 + 0.75 * size),
                half: Vector3::new(0.4 * size, size, 0.75 * size),
                yaw: self.random.random_range(-0.4..0.4),
            };
            let material = self.colour(&THINGS);
            self.objects.push(Object::new(shape, material).with_pattern(Pattern::Cloth));
        }
    }

    /// Adds a table with things on it.
    fn table(&mut self) {
        let (x, y) = (self.random.random_range(-0.7..0.3), self.random.random_range(-0.2..0.8));
        let top = self.random.random_range(-0.4..-0.1);
        let wood = self.colour(self.palette.woods());
        self.block([x, y, top - 0.02], [0.45, 0.8, 0.02], wood, Pattern::Wood);
        for _ in 0..self.random.random_range(2..9) {
            let place = Point3::new(
                x + self.random.random_range(-0.4..0.35),
                y + self.random.random_range(-0.7..0.7),
                top,
            );
            self.thing(place);
        }
    }

    /// Adds a can, a box with print, a bear, or an apple that stands at `foot`.
    fn thing(&mut self, foot: Point3<f64>) {
        let material = self.colour(&THINGS);
        let ink = self.colour(&THINGS).colour;
        let size = self.random.random_range(0.03..0.1);
        let up = |by: f64| foot + Vector3::z() * by;
        let yaw = self.random.random_range(0.0..1.5);
        let round = |centre, half: [f64; 3]| Shape::Ellipsoid { centre, half: half.into(), yaw };
        match self.random.random_range(0..4) {
            0 => {
                let shape = Shape::Cylinder { base: foot, radius: 0.033, height: 0.115 };
                self.objects.push(Object::new(shape, material).with_pattern(Pattern::Label(ink)));
            }
            1 => {
                let half = Vector3::new(0.5 * size, size, 1.2 * size);
                let shape = Shape::Block { centre: up(1.2 * size), half, yaw };
                self.objects.push(Object::new(shape, material).with_pattern(Pattern::Print(ink)));
            }
            2 => {
                let fur = Material::from_srgb(120, 70, 40).matt();
                let parts = [(0.9, [0.8, 0.9, 1.0]), (2.2, [0.6, 0.65, 0.6])];
                for (height, half) in parts {
                    let shape = round(up(height * size), half.map(|x| x * size));
                    self.objects.push(Object::new(shape, fur).with_pattern(Pattern::Carpet));
                }
            }
            _ => {
                let shape = round(up(0.034), [0.04, 0.04, 0.034]);
                let blush = Pattern::Blush([0.05, 0.45, 0.6]);
                let red = self.colour(&THINGS[..4]);
                self.objects.push(Object::new(shape, red).with_pattern(blush));
            }
        }
    }
}
