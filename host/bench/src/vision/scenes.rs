//! The scenes that detectors are compared on: what is in them and where the ball is, from a seed.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{VisionError, VisionOptions};
use plumb_sim::synthetic::{
    Background, Ball, Material, Options, Pattern, Room, Scene, Shape, Strand, SyntheticCamera,
    Thing,
};

/// A kind of scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kind {
    pub(super) name: &'static str,
    pub(super) backdrop: Backdrop,
    what: What,
    /// Whether the rig's ball is there.
    pub(super) ball: bool,
    light: f64,
    /// Blur of what is drawn, standard deviation, pixels.
    blur: f64,
    /// Least and largest radius of the ball, in that of the options.
    radii: (f64, f64),
    /// Whether about half of the ball is out of the picture.
    half_out: bool,
}

/// What is behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Backdrop {
    GreyWall,
    WhiteWall,
    LampAndWindow,
    RedPaper,
    RedThings,
    Furnished,
    Recorded,
}

/// What is in the picture besides the rig.
#[derive(Debug, Clone, Copy, PartialEq)]
enum What {
    Nothing,
    /// A ball beside the rig's, sRGB red, green, blue.
    Balls(&'static [[u8; 3]]),
    /// A cable across the ball, sRGB red, green, blue.
    Cable([u8; 3]),
    /// A post in front of a part of the ball.
    Post,
    /// Red balls of twice and half the size.
    RedBalls,
}

const WHITE: [u8; 3] = [242, 241, 238];
const SKIN: [u8; 3] = [228, 178, 148];
const ORANGE: [u8; 3] = [240, 132, 30];
const RED: [u8; 3] = [196, 32, 34];

const fn kind(name: &'static str, backdrop: Backdrop, what: What) -> Kind {
    let (light, blur, radii) = (1.0, 0.6, (0.85, 1.15));
    Kind { name, backdrop, what, ball: true, light, blur, radii, half_out: false }
}

const fn empty(name: &'static str, backdrop: Backdrop, what: What) -> Kind {
    Kind { ball: false, ..kind(name, backdrop, what) }
}

/// Every kind of scene, in the order of the table.
pub(super) const KINDS: [Kind; 29] = [
    kind("clean", Backdrop::GreyWall, What::Nothing),
    Kind { light: 0.25, ..kind("dark", Backdrop::GreyWall, What::Nothing) },
    Kind { light: 2.5, ..kind("overexposed", Backdrop::GreyWall, What::Nothing) },
    kind("white ball beside it", Backdrop::GreyWall, What::Balls(&[WHITE])),
    kind("lamp and window", Backdrop::LampAndWindow, What::Nothing),
    kind("white wall behind", Backdrop::WhiteWall, What::Nothing),
    kind("skin ball", Backdrop::GreyWall, What::Balls(&[SKIN])),
    kind("orange ball", Backdrop::GreyWall, What::Balls(&[ORANGE])),
    kind("red paper", Backdrop::RedPaper, What::Nothing),
    kind("dark cable across", Backdrop::GreyWall, What::Cable([34, 33, 32])),
    kind("white cable across", Backdrop::GreyWall, What::Cable(WHITE)),
    kind("furnished room", Backdrop::Furnished, What::Nothing),
    kind("red things behind", Backdrop::RedThings, What::Nothing),
    kind("other red balls", Backdrop::GreyWall, What::RedBalls),
    kind("partly behind a post", Backdrop::Furnished, What::Post),
    Kind { half_out: true, ..kind("half out of the picture", Backdrop::GreyWall, What::Nothing) },
    Kind { blur: 3.0, ..kind("out of focus", Backdrop::GreyWall, What::Nothing) },
    Kind { radii: (1.6, 2.3), ..kind("near", Backdrop::GreyWall, What::Nothing) },
    Kind { radii: (2.4, 3.0), ..kind("too near for depth", Backdrop::GreyWall, What::Nothing) },
    Kind { radii: (0.42, 0.65), ..kind("far", Backdrop::GreyWall, What::Nothing) },
    kind("real picture", Backdrop::Recorded, What::Nothing),
    empty("no ball", Backdrop::GreyWall, What::Nothing),
    empty("no ball: lamp and window", Backdrop::LampAndWindow, What::Nothing),
    empty("no ball: other balls", Backdrop::GreyWall, What::Balls(&[WHITE, SKIN, ORANGE])),
    empty("no ball: other red balls", Backdrop::GreyWall, What::RedBalls),
    empty("no ball: red paper", Backdrop::RedPaper, What::Nothing),
    empty("no ball: red things", Backdrop::RedThings, What::Nothing),
    empty("no ball: furnished room", Backdrop::Furnished, What::Nothing),
    empty("no ball: real picture", Backdrop::Recorded, What::Nothing),
];

/// Pictures of one kind of scene.
pub(super) struct Shots<'a> {
    kind: Kind,
    cameras: Vec<SyntheticCamera>,
    /// Of the recorded pictures that are backdrops, which the ball must not stand behind.
    recorded: &'a [RgbdFrame],
    random: ChaCha8Rng,
    radius: f64,
    shot: usize,
}

/// One picture and where the ball is in it.
pub(super) struct Shot {
    pub(super) frame: RgbdFrame,
    /// Column, row and radius of the ball, pixels.
    pub(super) ball: Option<[f64; 3]>,
    /// Where it is, rig frame, metres.
    pub(super) centre: Point3<f64>,
}

/// `camera` where the scenes are built for: level, at (1.737, 0.286, 0.225) m of the rig frame,
/// looking along -x.
pub(super) fn placed(camera: &Camera) -> Camera {
    let axes = Matrix3::new(0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let pose = Isometry3::from_parts(Translation3::new(1.737, 0.286, 0.225), rotation);
    Camera { pose, ..camera.clone() }
}

/// Cameras before one backdrop: one, or one for each recorded picture.
pub(super) fn cameras(
    backdrop: Backdrop,
    camera: &Camera,
    recorded: &[RgbdFrame],
    options: &VisionOptions,
) -> Result<Vec<SyntheticCamera>, VisionError> {
    let camera = placed(camera);
    let rendering = Options { width: options.width, height: options.height, ..Options::default() };
    let grey = Room::bare(Material::from_srgb(104, 102, 97));
    let room = match backdrop {
        Backdrop::GreyWall => grey,
        Backdrop::WhiteWall => Room::bare(Material::from_srgb(250, 249, 246)),
        Backdrop::LampAndWindow => lamp_and_window(grey),
        Backdrop::RedPaper => red_paper(grey),
        Backdrop::RedThings => red_things(grey),
        Backdrop::Furnished => Room::furnished(),
        Backdrop::Recorded => {
            let camera_of = |frame: &RgbdFrame| {
                let background = Background::Frame(frame.clone());
                SyntheticCamera::new(camera.clone(), background, rendering, options.seed)
            };
            return Ok(recorded.iter().map(camera_of).collect::<Result<_, _>>()?);
        }
    };
    Ok(vec![SyntheticCamera::new(camera, Background::Room(room), rendering, options.seed)?])
}

fn lamp_and_window(room: Room) -> Room {
    let block = |centre: [f64; 3], half: [f64; 3]| Shape::Block {
        centre: centre.into(),
        half: half.into(),
        yaw: 0.0,
    };
    let frame = Material::from_srgb(236, 236, 232);
    let pane = Thing::new(
        block([-2.19, -0.6, 0.5], [0.01, 0.55, 0.6]),
        Material::from_srgb(228, 238, 255),
    );
    let lamp = Shape::Sphere { centre: Point3::new(0.2, 0.8, 0.35), radius: 0.06 };
    let pole = Shape::Cylinder { base: Point3::new(0.2, 0.8, -0.75), radius: 0.008, height: 1.05 };
    room.with(pane.with_pattern(Pattern::Sky).glowing(1.3))
        .with(Thing::new(block([-2.17, -0.6, 0.5], [0.03, 0.02, 0.6]), frame))
        .with(Thing::new(block([-2.17, -0.6, 0.7], [0.03, 0.55, 0.02]), frame))
        .with(Thing::new(lamp, Material::from_srgb(255, 244, 222)).glowing(1.6))
        .with(Thing::new(pole, Material::from_srgb(90, 90, 94)))
}

/// A sheet of A4 in the left part of the picture, 1.3 m away.
fn red_paper(room: Room) -> Room {
    let half = Vector3::new(0.001, 0.105, 0.148);
    let sheet = Shape::Block { centre: Point3::new(0.437, -0.18, 0.225), half, yaw: 0.15 };
    room.with(Thing::new(sheet, Material::from_srgb(205, 40, 44).matt()))
}

/// Cans, boxes and a cushion, all red, 1.3 to 1.8 m away: behind any ball.
fn red_things(room: Room) -> Room {
    let red = |r, g, b| Material::from_srgb(r, g, b);
    let can = |base: [f64; 3]| {
        let shape = Shape::Cylinder { base: base.into(), radius: 0.033, height: 0.115 };
        Thing::new(shape, red(190, 24, 30)).with_pattern(Pattern::Label([0.75, 0.75, 0.75]))
    };
    let block = |centre: [f64; 3], half: [f64; 3], yaw: f64| {
        let shape = Shape::Block { centre: centre.into(), half: half.into(), yaw };
        Thing::new(shape, red(176, 30, 40).matt())
    };
    let cushion = Shape::Sphere { centre: Point3::new(-0.1, -0.28, 0.36), radius: 0.16 };
    room.with(can([0.4, 0.45, 0.1]))
        .with(can([0.25, 0.1, 0.3]))
        .with(can([0.05, 0.62, 0.35]))
        .with(
            block([0.3, 0.3, 0.02], [0.04, 0.06, 0.09], 0.5)
                .with_pattern(Pattern::Print([0.6, 0.6, 0.6])),
        )
        .with(block([0.1, -0.05, 0.02], [0.05, 0.04, 0.05], 0.9))
        .with(Thing::new(cushion, red(150, 28, 36).matt()))
}

impl<'a> Shots<'a> {
    /// Pictures of `kind`, number `number`, before `cameras` (one for each of the `recorded`
    /// pictures if it needs such).
    pub(super) fn new(
        (number, kind): (u64, Kind),
        cameras: Vec<SyntheticCamera>,
        recorded: &'a [RgbdFrame],
        options: &VisionOptions,
    ) -> Self {
        let random =
            ChaCha8Rng::seed_from_u64(options.seed.wrapping_mul(1000).wrapping_add(number));
        Self { kind, cameras, recorded, random, radius: options.radius, shot: 0 }
    }

    /// The next picture; `None` where there is no backdrop for this kind.
    pub(super) fn next(&mut self) -> Result<Option<Shot>, VisionError> {
        if self.cameras.is_empty() {
            return Ok(None);
        }
        let which = self.shot % self.cameras.len();
        let camera = self.cameras[which].camera().clone();
        let size = self.cameras[which].size();
        let centre = match self.kind.backdrop {
            Backdrop::Furnished => self.in_workspace(),
            Backdrop::Recorded => self.in_front(&camera, size, &self.recorded[which]),
            _ => self.in_picture(&camera, size),
        };
        let scene = self.scene(centre, &camera);
        let frame = self.cameras[which].render(self.shot as f64 / 30.0, &scene)?;
        self.shot += 1;
        let seen = camera.pose.inverse() * centre;
        let radius = camera.intrinsics.fx * camera.ball_diameter / 2.0 / seen.z;
        let ball = camera
            .intrinsics
            .project(&seen)
            .filter(|_| self.kind.ball)
            .map(|(u, v)| [u, v, radius]);
        Ok(Some(Shot { frame, ball, centre }))
    }

    /// A ball of about the wished radius anywhere in the picture, well inside.
    fn in_picture(&mut self, camera: &Camera, size: (usize, usize)) -> Point3<f64> {
        let radius = self.radius * self.random.random_range(self.kind.radii.0..self.kind.radii.1);
        let margin = 2.5 * self.radius * self.kind.radii.1.max(1.0);
        // The red paper is in the left part: the ball is beside it.
        let left =
            if self.kind.backdrop == Backdrop::RedPaper { 0.42 * size.0 as f64 } else { margin };
        let u = self.random.random_range(left..(size.0 as f64 - margin).max(left + 1.0));
        let v = self.random.random_range(margin..(size.1 as f64 - margin).max(margin + 1.0));
        let z = camera.intrinsics.fx * camera.ball_diameter / 2.0 / radius;
        let out = radius * self.random.random_range(-0.3..0.5);
        let (u, v) = match self.shot % 4 {
            _ if !self.kind.half_out => (u, v),
            0 => (out, v),
            1 => (size.0 as f64 - 1.0 - out, v),
            2 => (u, out),
            _ => (u, size.1 as f64 - 1.0 - out),
        };
        camera.pose * camera.intrinsics.deproject(u, v, z)
    }

    /// A ball where everything that `behind` has depth of is farther away; where no such place is
    /// found in some tries, one at the last place but so near (and large) that it is.
    fn in_front(
        &mut self,
        camera: &Camera,
        size: (usize, usize),
        behind: &RgbdFrame,
    ) -> Point3<f64> {
        let mut brought = Point3::origin();
        for _ in 0..40 {
            let centre = self.in_picture(camera, size);
            let seen = camera.pose.inverse() * centre;
            let nearest = nearest(camera, &seen, behind);
            if nearest > seen.z + 0.02 {
                return centre;
            }
            brought = camera.pose * (seen * ((nearest - 0.1) / seen.z).max(0.4));
        }
        brought
    }

    /// A ball where the paper's rig can bring it.
    fn in_workspace(&mut self) -> Point3<f64> {
        let weights: [f64; 3] = std::array::from_fn(|_| self.random.random_range(0.15..1.0));
        let sum: f64 = weights.iter().sum();
        let [a, b, _] = weights.map(|weight| weight / sum);
        let z = self.random.random_range(0.12..0.48);
        Point3::new(0.85 * (a + b), 0.61 * a + 0.24 * (1.0 - a - b), z)
    }

    /// What is there around `centre`, where the rig's ball is or would be.
    fn scene(&mut self, centre: Point3<f64>, camera: &Camera) -> Scene {
        let to = |x, y, z| centre + Vector3::new(x, y, z);
        let mut scene = Scene { light: self.kind.light, blur: self.kind.blur, ..Scene::default() };
        if self.kind.ball {
            scene.ball = Some(centre);
            scene.motors = Some([to(0.3, 0.35, 0.5), to(0.3, -0.25, 0.5), to(-0.5, 0.0, 0.5)]);
        }
        match self.kind.what {
            What::Nothing => {}
            What::Balls(colours) => {
                for colour in colours {
                    scene.others.push(self.beside(&centre, camera, 1.0, *colour));
                }
            }
            What::RedBalls => {
                for size in [0.5, 2.0] {
                    scene.others.push(self.beside(&centre, camera, size, RED));
                }
            }
            What::Cable(colour) => scene.strands.push(self.across(&centre, camera, colour)),
            What::Post => scene.strands.push(self.post(&centre, camera)),
        }
        scene
    }

    /// A ball of another colour or `size` (in the rig's ball's), 1.5 to 2.5 of its larger diameter
    /// beside `centre`.
    fn beside(
        &mut self,
        centre: &Point3<f64>,
        camera: &Camera,
        size: f64,
        [red, green, blue]: [u8; 3],
    ) -> Ball {
        let diameter = camera.ball_diameter * size;
        let (sin, cos) = self.random.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let away = camera.ball_diameter.max(diameter) * self.random.random_range(1.5..2.5);
        let offset = camera.pose.rotation * Vector3::new(away * cos, away * sin, 0.0);
        Ball { centre: centre + offset, diameter, material: Material::from_srgb(red, green, blue) }
    }

    /// A cable 0.15 diameters thick before the ball, near its middle, rather upright.
    fn across(
        &mut self,
        centre: &Point3<f64>,
        camera: &Camera,
        [red, green, blue]: [u8; 3],
    ) -> Strand {
        let diameter = camera.ball_diameter;
        let (sin, cos) = self.random.random_range(-0.7_f64..0.7).sin_cos();
        let aside = 0.2 * diameter * self.random.random_range(-1.0..1.0);
        let middle = centre + camera.pose.rotation * Vector3::new(aside, 0.0, -0.7 * diameter);
        let along = camera.pose.rotation * Vector3::new(sin, cos, 0.0) * 0.6;
        Strand {
            from: middle - along,
            to: middle + along,
            diameter: 0.15 * diameter,
            material: Material::from_srgb(red, green, blue).matt(),
        }
    }
    /// An upright post 1.5 diameters before the ball that hides a sixth to a half of it.
    fn post(&mut self, centre: &Point3<f64>, camera: &Camera) -> Strand {
        let diameter = camera.ball_diameter;
        let edge = diameter * self.random.random_range(0.0..0.33);
        let side = if self.random.random_bool(0.5) { 1.0 } else { -1.0 };
        let seen = camera.pose.inverse() * centre;
        let nearer = (seen.z - 1.5 * diameter) / seen.z;
        let aside = Vector3::new(side * (edge + 0.3 * diameter), 0.0, 0.0);
        let middle = camera.pose * (seen * nearer + aside);
        let along = camera.pose.rotation * Vector3::new(0.0, 0.5, 0.0);
        Strand {
            from: middle - along,
            to: middle + along,
            diameter: 0.6 * diameter,
            material: Material::from_srgb(150, 152, 155).matt(),
        }
    }
}

/// The nearest depth that `frame` has where a ball at `seen` (camera axes) covers it, metres.
fn nearest(camera: &Camera, seen: &Point3<f64>, frame: &RgbdFrame) -> f64 {
    let Some((u, v)) = camera.intrinsics.project(seen) else { return 0.0 };
    let reach = (1.2 * camera.intrinsics.fx * camera.ball_diameter / 2.0 / seen.z).ceil() as i32;
    let around = |x: f64| (x as i32 - reach..=x as i32 + reach).step_by(2);
    around(v)
        .flat_map(|row| around(u).map(move |column| (column, row)))
        .filter_map(|(column, row)| frame.depth_at(column, row))
        .fold(f64::INFINITY, f64::min)
}
