//! Frames of rendered scenes: content and position of the ball from a seed.

use nalgebra::{Point3, Vector3};
use plumb_sim::synthetic::{ExtraBall, Material, Scene, Strand, SyntheticCamera};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::labelled::{GroundTruth, LabelledFrame};
use super::scene_kind::{Addition, Backdrop, RED, SceneKind};
use super::{BoxedError, VisionOptions};

/// Generator of the frames of one kind of scene.
pub(super) struct SceneFrames<'a> {
    kind: SceneKind,
    cameras: Vec<SyntheticCamera>,
    /// Recorded frames behind the ball, one for each camera, if the background is recorded.
    recorded: &'a [RgbdFrame],
    random: ChaCha8Rng,
    /// Radius of the ball from the options, pixels.
    radius: f64,
    /// Number of frames so far.
    count: usize,
}

impl<'a> SceneFrames<'a> {
    /// Creates the generator for the kind of number `number`. A recorded background needs one of
    /// the `cameras` for each of the `recorded` frames.
    pub(super) fn new(
        (number, kind): (u64, SceneKind),
        cameras: Vec<SyntheticCamera>,
        recorded: &'a [RgbdFrame],
        options: &VisionOptions,
    ) -> Self {
        let random =
            ChaCha8Rng::seed_from_u64(options.seed.wrapping_mul(1000).wrapping_add(number));
        Self { kind, cameras, recorded, random, radius: options.radius, count: 0 }
    }

    /// Returns the next frame; `None` if there is no background for this kind.
    pub(super) fn next(&mut self) -> Result<Option<LabelledFrame>, BoxedError> {
        if self.cameras.is_empty() {
            return Ok(None);
        }
        let which = self.count % self.cameras.len();
        let camera = self.cameras[which].camera().clone();
        let size = self.cameras[which].size();
        let centre = match self.kind.backdrop {
            Backdrop::Furnished => self.in_workspace(),
            Backdrop::Recorded => self.in_front(&camera, size, &self.recorded[which]),
            _ => self.in_frame(&camera, size),
        };
        let scene = self.scene(centre, &camera);
        let frame = self.cameras[which].render(self.count as f64 / 30.0, &scene)?;
        self.count += 1;
        let seen = camera.pose.inverse() * centre;
        let radius = camera.intrinsics.fx * camera.ball_diameter / 2.0 / seen.z;
        let ball = camera
            .intrinsics
            .project(&seen)
            .filter(|_| self.kind.ball)
            .map(|(u, v)| GroundTruth { u, v, radius, centre });
        Ok(Some(LabelledFrame { frame, ball }))
    }

    /// Returns a random position of a ball of about the option's radius, well inside the frame.
    fn in_frame(&mut self, camera: &Camera, size: (usize, usize)) -> Point3<f64> {
        let radius =
            self.radius * self.random.random_range(self.kind.radii.min..self.kind.radii.max);
        let margin = 2.5 * self.radius * self.kind.radii.max.max(1.0);
        // The red paper covers the left part of the frame.
        let left =
            if self.kind.backdrop == Backdrop::RedPaper { 0.42 * size.0 as f64 } else { margin };
        let u = self.random.random_range(left..(size.0 as f64 - margin).max(left + 1.0));
        let v = self.random.random_range(margin..(size.1 as f64 - margin).max(margin + 1.0));
        let z = camera.intrinsics.fx * camera.ball_diameter / 2.0 / radius;
        let out = radius * self.random.random_range(-0.3..0.5);
        let (u, v) = match self.count % 4 {
            _ if !self.kind.half_out => (u, v),
            0 => (out, v),
            1 => (size.0 as f64 - 1.0 - out, v),
            2 => (u, out),
            _ => (u, size.1 as f64 - 1.0 - out),
        };
        camera.pose * camera.intrinsics.deproject(u, v, z)
    }

    /// Returns a random position of a ball in front of all depth of `behind`. If 40 tries find
    /// none, moves the last one towards the camera until it is in front.
    fn in_front(
        &mut self,
        camera: &Camera,
        size: (usize, usize),
        behind: &RgbdFrame,
    ) -> Point3<f64> {
        let mut moved = Point3::origin();
        for _ in 0..40 {
            let centre = self.in_frame(camera, size);
            let seen = camera.pose.inverse() * centre;
            let nearest = nearest(camera, &seen, behind);
            if nearest > seen.z + 0.02 {
                return centre;
            }
            moved = camera.pose * (seen * ((nearest - 0.1) / seen.z).max(0.4));
        }
        moved
    }

    /// Returns a random position of a ball in the reach of the paper's rig.
    fn in_workspace(&mut self) -> Point3<f64> {
        let weights: [f64; 3] = std::array::from_fn(|_| self.random.random_range(0.15..1.0));
        let sum: f64 = weights.iter().sum();
        let [a, b, _] = weights.map(|weight| weight / sum);
        let z = self.random.random_range(0.12..0.48);
        Point3::new(0.85 * (a + b), 0.61 * a + 0.24 * (1.0 - a - b), z)
    }

    /// Returns the scene around `centre`, the position of the rig's ball.
    fn scene(&mut self, centre: Point3<f64>, camera: &Camera) -> Scene {
        let to = |x, y, z| centre + Vector3::new(x, y, z);
        let mut scene = Scene { light: self.kind.light, blur: self.kind.blur, ..Scene::default() };
        if self.kind.ball {
            scene.ball = Some(centre);
            let motors = [to(0.3, 0.35, 0.5), to(0.3, -0.25, 0.5), to(-0.5, 0.0, 0.5)];
            scene.motors = Some(motors.into());
        }
        match self.kind.addition {
            Addition::Nothing => {}
            Addition::Balls(colours) => {
                for colour in colours {
                    scene.others.push(self.beside(&centre, camera, 1.0, *colour));
                }
            }
            Addition::RedBalls => {
                for size in [0.5, 2.0] {
                    scene.others.push(self.beside(&centre, camera, size, RED));
                }
            }
            Addition::Cable(colour) => scene.strands.push(self.across(&centre, camera, colour)),
            Addition::Post => scene.strands.push(self.post(&centre, camera)),
        }
        scene
    }

    /// Returns a ball of another colour or `size` (in diameters of the rig's ball), 1.5 to 2.5 of
    /// the larger diameter beside `centre`.
    fn beside(
        &mut self,
        centre: &Point3<f64>,
        camera: &Camera,
        size: f64,
        [red, green, blue]: [u8; 3],
    ) -> ExtraBall {
        let diameter = camera.ball_diameter * size;
        let (sin, cos) = self.random.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let away = camera.ball_diameter.max(diameter) * self.random.random_range(1.5..2.5);
        let offset = camera.pose.rotation * Vector3::new(away * cos, away * sin, 0.0);
        ExtraBall {
            centre: centre + offset,
            diameter,
            material: Material::from_srgb(red, green, blue),
        }
    }

    /// Returns a cable of 0.15 ball diameters in front of the ball, near its middle and nearly
    /// upright.
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

    /// Returns an upright post 1.5 diameters in front of the ball that occludes a sixth to a half
    /// of it.
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

/// Returns the least depth (metres) of the part of `frame` covered by a ball at `seen` (camera
/// axes).
fn nearest(camera: &Camera, seen: &Point3<f64>, frame: &RgbdFrame) -> f64 {
    let Some((u, v)) = camera.intrinsics.project(seen) else { return 0.0 };
    let reach = (1.2 * camera.intrinsics.fx * camera.ball_diameter / 2.0 / seen.z).ceil() as i32;
    let around = |x: f64| (x as i32 - reach..=x as i32 + reach).step_by(2);
    around(v)
        .flat_map(|row| around(u).map(move |column| (column, row)))
        .filter_map(|(column, row)| frame.depth_at(column, row))
        .fold(f64::INFINITY, f64::min)
}
