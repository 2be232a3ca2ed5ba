//! The two cameras: computed circles, and rendered pictures with a detector for each.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use plumb_frame::source::BoxedError;
use plumb_sim::synthetic::{
    Background, Material, RenderOptions, Room, Scene, Strand, SyntheticCamera,
};
use plumb_vision::camera::{Camera, Intrinsics};
use plumb_vision::detect::{BallDetector, DetectorKind};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::Image;
use plumb_vision::observation::Circle;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::case::MIDDLE;

/// Half of the distance between the cameras, metres.
const HALF_BASE: f64 = 0.3;
/// Distance of the cameras from the middle of the workspace, metres.
const DISTANCE: f64 = 1.2;
/// Standard deviation of computed columns, rows and radii, pixels.
const SIGMA_PX: f64 = 0.2;
/// Diameter of the ball, metres.
const DIAMETER: f64 = 0.08;
/// Lens of the cameras; the renderer needs a unit of depth, which no detector is given.
const LENS: Intrinsics =
    Intrinsics { fx: 533.0, fy: 533.0, cx: 319.5, cy: 239.5, depth_scale: 0.0, distortion: None };
const DEPTH_SCALE: f64 = 5000.0;

/// Returns the two cameras, which look at the middle of the workspace.
pub(super) fn cameras() -> [Camera; 2] {
    [-HALF_BASE, HALF_BASE].map(|aside| {
        let back = (DISTANCE * DISTANCE - HALF_BASE * HALF_BASE).sqrt();
        let place = MIDDLE + Vector3::new(back, aside, 0.0);
        // Rows go down.
        let pose = Isometry3::face_towards(&place, &MIDDLE, &-Vector3::z());
        Camera::new(LENS, pose, DIAMETER)
    })
}

/// Returns the circle of a ball of `size` times the diameter at `place`, with noise; `None` outside
/// the picture.
pub(super) fn computed(
    camera: &Camera,
    place: &Point3<f64>,
    size: f64,
    random: &mut ChaCha8Rng,
) -> Option<Circle> {
    let at = camera.pose.inverse_transform_point(place);
    let (u, v) = LENS.project(&at)?;
    let (distance, ball_radius) = (at.coords.norm(), size * DIAMETER / 2.0);
    let tangent = (ball_radius / distance).asin().tan();
    let radius = LENS.focal() * tangent * distance / at.z;
    let mut noise = || SIGMA_PX * random.sample::<f64, _>(StandardNormal);
    let covariance = Matrix3::identity() * SIGMA_PX.powi(2);
    Some(Circle { u: u + noise(), v: v + noise(), radius: radius + noise(), covariance })
}

/// A camera whose pictures are rendered, and its detector.
pub(super) struct RenderedEye {
    camera: Camera,
    renderer: SyntheticCamera,
    detector: Box<dyn BallDetector>,
}

impl RenderedEye {
    /// Creates the eye in a grey room.
    pub(super) fn new(camera: &Camera, seed: u64) -> Result<Self, BoxedError> {
        let lens = Intrinsics { depth_scale: DEPTH_SCALE, ..LENS };
        let with_depth = Camera { intrinsics: lens, ..camera.clone() };
        let room = Background::Room(Room::bare(Material::from_srgb(104, 102, 97)));
        let renderer = SyntheticCamera::new(with_depth, room, RenderOptions::default(), seed)?;
        let detector = DetectorKind::Ball.build(camera);
        Ok(Self { camera: camera.clone(), renderer, detector })
    }

    /// Returns what the detector finds of a ball at `place`, `t` seconds after the start, with the
    /// middle of a post `beside` the ball's (diameters of the ball), if there is one.
    pub(super) fn circle(
        &mut self,
        t: f64,
        place: &Point3<f64>,
        beside: Option<f64>,
    ) -> Result<Option<Circle>, BoxedError> {
        let mut scene = Scene { ball: Some(*place), ..Scene::default() };
        scene.strands.extend(beside.map(|beside| self.post(place, beside)));
        let frame = self.renderer.render(t, &scene)?;
        let colour = frame.colour().clone();
        let depth = Image::filled(colour.width(), colour.height(), 0);
        let frame = RgbdFrame::new(t, colour, depth, LENS)?;
        Ok(self.detector.detect(&frame)?.map(|found| found.circle))
    }

    /// Returns an upright post before the ball, whose middle is `beside` the ball's, in diameters.
    fn post(&self, place: &Point3<f64>, beside: f64) -> Strand {
        let seen = self.camera.pose.inverse_transform_point(place);
        let nearer = (seen.z - 1.5 * DIAMETER) / seen.z;
        let aside = Vector3::new(beside * DIAMETER, 0.0, 0.0);
        let middle = self.camera.pose * (seen * nearer + aside);
        let along = self.camera.pose.rotation * Vector3::new(0.0, 0.5, 0.0);
        Strand {
            from: middle - along,
            to: middle + along,
            diameter: 0.6 * DIAMETER,
            material: Material::from_srgb(150, 152, 155).matt(),
        }
    }
}
