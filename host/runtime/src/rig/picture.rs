//! Rig frame of two motors in the picture of a camera whose place is unknown.
//!
//! Two jogs give the Jacobian J in pixels. The frame is the similarity M = c Q (Q a rotation or a
//! mirror) that brings M J nearest to the Jacobian that [`NOMINAL_JACOBIAN_M`] has: the signs are
//! then those of two motors wherever the camera stands, and the board's limits in metres fit.
//!
//! Such a frame is the pose of a camera that looks across the plane x = 0: every place in the
//! picture has one place in the plane, so that all that follows needs no other camera model.

use nalgebra::{Isometry3, Matrix2, Matrix3, Point2, Rotation3, Translation3, Vector2};
use plumb_config::quantity::{NumberError, PixelCoordinate};
use plumb_frame::camera::{Camera, Intrinsics};
use plumb_frame::image::ImageSize;
use plumb_protocol::MotorList;
use plumb_protocol::prior::{JacobianPrior, Prior};
use serde::Deserialize;
use thiserror::Error;

use super::quantity::{Corner, Distance};
use super::size::Box3;

/// Table `[plane]`: targets and motors are places in the picture.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneSettings {
    /// Targets in their order: column and row, pixels.
    #[serde(default)]
    pub targets: Vec<[PixelCoordinate; 2]>,
    /// Where the cables leave motors A and B: column and row, pixels.
    pub motors: Option<[[PixelCoordinate; 2]; 2]>,
}

impl PlaneSettings {
    /// Returns the motors' places, pixels.
    pub fn motors_px(&self) -> Option<[[f64; 2]; 2]> {
        self.motors.map(|motors| motors.map(|pixel| pixel.map(PixelCoordinate::get)))
    }

    /// Sets targets and motors: column and row, pixels.
    ///
    /// # Errors
    /// Where a number is below 0 or above 65535.
    pub fn set(
        &mut self,
        targets: Vec<[f64; 2]>,
        motors: Option<[[f64; 2]; 2]>,
    ) -> Result<(), NumberError> {
        let pixel = |[u, v]: [f64; 2]| Ok([u.try_into()?, v.try_into()?]);
        self.targets = targets.into_iter().map(pixel).collect::<Result<_, _>>()?;
        let motors = motors.map(|[a, b]| Ok([pixel(a)?, pixel(b)?]));
        self.motors = motors.transpose()?;
        Ok(())
    }
}

/// Jacobian at which the laws' gains are meant, metres a step: rows y, z; columns motors A, B.
pub const NOMINAL_JACOBIAN_M: Matrix2<f64> =
    Matrix2::new(-0.333e-3, 0.333e-3, -0.333e-3, -0.333e-3);

/// Largest width of a picture in its frame, metres: a workspace reaches from -4 m to 4 m.
const MAX_WIDTH_M: f64 = 7.5;

/// Distance at which a target counts as reached, pixels.
const REACHED_PX: f64 = 2.0;

/// Standard deviation of an entry of the measured Jacobian, as a share of the largest one.
const JACOBIAN_SD: f64 = 0.25;

/// Share of the picture at each border in which there are no targets.
const BORDER: f64 = 0.03;

/// Distance of the targets from the motors' verticals and from the line between the motors, as a
/// share of the motors' distance.
const FROM_MOTORS: f64 = 0.15;

/// Room about the place where the ball hangs, pixels: it may swing there.
const ROOM_PX: f64 = 12.0;

/// Similarity between the picture and the plane of two motors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureFrame {
    /// Q: from columns and rows to y and z.
    pub turn: Matrix2<f64>,
    /// c: metres of the frame for a pixel.
    pub scale: f64,
    /// J in the frame, metres a step.
    pub jacobian: Matrix2<f64>,
}

impl PictureFrame {
    /// Returns the frame of a Jacobian in pixels a step (rows column and row, columns motors A and
    /// B), in pictures of this width (pixels); `None` where the Jacobian is zero or not finite.
    pub fn of(jacobian_px: &Matrix2<f64>, width: f64) -> Option<Self> {
        let size = jacobian_px.norm();
        if !(size.is_finite() && size > 0.0) {
            return None;
        }
        let svd = (NOMINAL_JACOBIAN_M * jacobian_px.transpose()).svd(true, true);
        let turn = svd.u? * svd.v_t?;
        let scale = (NOMINAL_JACOBIAN_M.norm() / size).min(MAX_WIDTH_M / width);
        Some(Self { turn, scale, jacobian: turn * jacobian_px * scale })
    }

    /// Returns the place in the plane (y and z, metres) of a pixel without the distortion of the
    /// lens, from the principal point.
    pub fn place(&self, flat: Vector2<f64>) -> Vector2<f64> {
        self.turn * flat * self.scale
    }

    /// Returns `camera` with the pose at which it shows the plane x = 0 as the picture does.
    pub fn camera(&self, camera: &Camera) -> Camera {
        let [right, down] = [0, 1].map(|k| self.turn.column(k).into_owned());
        let forward = right.perp(&down).signum();
        #[rustfmt::skip]
        let axes = Matrix3::new(
            0.0, 0.0, forward,
            right.x, down.x, 0.0,
            right.y, down.y, 0.0,
        );
        let rotation = Rotation3::from_matrix_unchecked(axes);
        let distance = self.scale * camera.intrinsics.focal();
        let place = Translation3::new(-forward * distance, 0.0, 0.0);
        let pose = Isometry3::from_parts(place, rotation.into());
        Camera { pose, is_planar: true, ..camera.clone() }
    }

    /// Returns what the law adaptive begins with.
    pub fn prior(&self) -> Prior {
        let micrometres = |metres: f64| (metres * 1e6).round();
        let largest = self.jacobian.amax();
        let row = |axis: usize| match axis {
            0 => [0; 2],
            _ => [0, 1].map(|motor| micrometres(self.jacobian[(axis - 1, motor)]) as i32),
        };
        let deviation = micrometres(JACOBIAN_SD * largest) as u32;
        Prior::Jacobian(JacobianPrior {
            entries: [0, 1, 2].map(|axis| MotorList::from(row(axis))),
            deviations: [0, deviation, deviation].map(|sd| MotorList::from([sd; 2])),
            common: 0,
        })
    }
}

/// Returns a pixel without the distortion of the lens, from the principal point, pixels.
pub fn flat(lens: &Intrinsics, [u, v]: [f64; 2]) -> Vector2<f64> {
    lens.deproject(u, v, lens.focal()).coords.xy()
}

/// Part of the picture in which targets may be: a convex polygon.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Corners in their order: column and row, pixels.
    corners: Vec<Point2<f64>>,
}

impl Region {
    /// Returns the region of pictures of this size: less a border, below the motors and between
    /// their verticals; the middle third where the places of the motors are unknown. `ball` is
    /// where the ball hangs, which tells which side of the motors is below. All in pixels.
    ///
    /// # Errors
    /// [`PictureError::NoRoom`] where the motors leave no room in the picture.
    pub fn of(
        size: ImageSize,
        motors: Option<[[f64; 2]; 2]>,
        ball: [f64; 2],
    ) -> Result<Self, PictureError> {
        let [width, height] = [size.width as f64, size.height as f64];
        let border = if motors.is_some() { BORDER } else { 1.0 / 3.0 };
        let [low, high] = [border, 1.0 - border];
        let corners = [[low, low], [high, low], [high, high], [low, high]];
        let corners = corners.map(|[u, v]| Point2::new(u * width - 0.5, v * height - 0.5));
        let mut region = Self { corners: corners.to_vec() };
        if let Some(motors) = motors {
            let [a, b] = motors.map(Point2::from);
            let (along, apart) = ((a - b).normalize(), (a - b).norm());
            let across = Vector2::new(-along.y, along.x);
            let below = across * across.dot(&(Point2::from(ball) - b)).signum();
            let margin = FROM_MOTORS * apart;
            region.clip(b, along, margin);
            region.clip(a, -along, margin);
            region.clip(b, below, margin);
        }
        match region.corners.len() {
            0..3 => Err(PictureError::NoRoom),
            _ => Ok(region),
        }
    }

    /// Keeps the part that is at least `margin` from `origin` along `direction`.
    fn clip(&mut self, origin: Point2<f64>, direction: Vector2<f64>, margin: f64) {
        let inside = |p: &Point2<f64>| direction.dot(&(p - origin)) - margin;
        let mut kept = Vec::new();
        for (k, p) in self.corners.iter().enumerate() {
            let q = &self.corners[(k + 1) % self.corners.len()];
            let (of_p, of_q) = (inside(p), inside(q));
            if of_p >= 0.0 {
                kept.push(*p);
            }
            if (of_p >= 0.0) != (of_q >= 0.0) {
                kept.push(p + (q - p) * (of_p / (of_p - of_q)));
            }
        }
        self.corners = kept;
    }

    /// Returns whether a pixel is in the region.
    pub fn contains(&self, pixel: [f64; 2]) -> bool {
        let pixel = Point2::from(pixel);
        let side = |k: usize| {
            let (p, q) = (self.corners[k], self.corners[(k + 1) % self.corners.len()]);
            (q - p).perp(&(pixel - p))
        };
        let is_left = |k: usize| side(k) >= -1e-6;
        let is_right = |k: usize| side(k) <= 1e-6;
        let mut all = 0..self.corners.len();
        all.clone().all(is_left) || all.all(is_right)
    }

    /// Returns the corners: column and row, pixels.
    pub fn corners(&self) -> impl Iterator<Item = [f64; 2]> {
        self.corners.iter().map(|corner| [corner.x, corner.y])
    }
}

/// Reason that a rig has no frame in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum PictureError {
    /// The motors leave no room.
    #[error("`plane.motors` leaves no room for the ball in the picture")]
    NoRoom,
}

/// Frame and region of a rig in the picture of its camera.
#[derive(Debug, Clone, PartialEq)]
pub struct RigPicture {
    /// Frame.
    pub frame: PictureFrame,
    /// Where targets may be.
    pub region: Region,
    /// The camera, with the pose of the frame.
    pub camera: Camera,
    /// Where the ball hung after the jogs, pixels.
    pub ball: [f64; 2],
}

impl RigPicture {
    /// Returns the picture of `frame` for targets and motors of `plane`: `camera` takes pictures of
    /// this `size`, and `ball` is the pixel where the ball hangs.
    ///
    /// # Errors
    /// [`PictureError::NoRoom`] where the motors leave no room in the picture.
    pub(super) fn new(
        frame: PictureFrame,
        plane: &PlaneSettings,
        (camera, size): (&Camera, ImageSize),
        ball: [f64; 2],
    ) -> Result<Self, PictureError> {
        let region = Region::of(size, plane.motors_px(), ball)?;
        Ok(Self { frame, region, camera: frame.camera(camera), ball })
    }

    /// Returns the places of the targets of `plane` (without any, that of the ball), metres.
    pub(super) fn targets(&self, plane: &PlaneSettings) -> Vec<[f64; 3]> {
        let targets = plane.targets.iter().map(|pixel| pixel.map(PixelCoordinate::get));
        let mut targets: Vec<_> = targets.map(|pixel| self.place(pixel)).collect();
        if targets.is_empty() {
            targets.push(self.place(self.ball));
        }
        targets
    }

    /// Returns the distance at which a target counts as reached.
    pub(super) fn reached(&self) -> Distance {
        Distance::constant((REACHED_PX * self.frame.scale).min(1.0))
    }

    /// Returns the pixel of a place in the plane (y and z, metres).
    pub fn pixel(&self, place: [f64; 3]) -> [f64; 2] {
        let in_camera = self.camera.pose.inverse_transform_point(&place.into());
        let pixel = self.camera.intrinsics.project(&in_camera);
        pixel.map_or([f64::NAN; 2], <[f64; 2]>::from)
    }

    /// Returns whether the ball may be driven to a pixel: in the region, or where it hung.
    pub(super) fn allows(&self, pixel: [f64; 2]) -> bool {
        let [u, v] = [0, 1].map(|k| pixel[k] - self.ball[k]);
        self.region.contains(pixel) || u.hypot(v) < ROOM_PX
    }

    /// Returns the place of a pixel, metres in the rig frame.
    pub fn place(&self, pixel: [f64; 2]) -> [f64; 3] {
        let place = self.frame.place(flat(&self.camera.intrinsics, pixel));
        [0.0, place.x, place.y]
    }

    /// Returns the box about the region and the place of the ball, metres.
    pub(super) fn workspace(&self) -> Box3 {
        let ball = self.ball;
        let room = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let about_ball = room.map(|[u, v]| [ball[0] + ROOM_PX * u, ball[1] + ROOM_PX * v]);
        let places = self.region.corners().chain(about_ball).map(|pixel| self.place(pixel));
        let (mut min, mut max) = ([0.0_f64, f64::MAX, f64::MAX], [0.0_f64, f64::MIN, f64::MIN]);
        for place in places {
            for axis in 1..3 {
                min[axis] = min[axis].min(place[axis]);
                max[axis] = max[axis].max(place[axis]);
            }
        }
        // In whole millimetres, as the page's fields count.
        let corner = |at: f64| Corner::constant((at / 1e3).clamp(-4.0, 4.0));
        let (min, max) = (min.map(|at| (at * 1e3).floor()), max.map(|at| (at * 1e3).ceil()));
        Box3 { min: min.map(corner), max: max.map(corner) }
    }
}

#[cfg(test)]
mod tests {
    use plumb_cameras::camera_file;

    use super::*;

    const SIZE: ImageSize = ImageSize { width: 640, height: 480 };

    /// Returns the Jacobian (pixels a step) of a camera that is turned, mirrored or near.
    fn jacobian(angle: f64, mirror: f64, pixels_per_metre: f64) -> Matrix2<f64> {
        let (sin, cos) = angle.sin_cos();
        let turn = Matrix2::new(cos, -sin, sin, cos) * Matrix2::new(mirror, 0.0, 0.0, -1.0);
        turn * NOMINAL_JACOBIAN_M * pixels_per_metre * 1.3
    }

    #[test]
    fn the_frame_undoes_any_turn_and_mirror_of_the_camera() {
        for angle in [0.0, 0.3, 1.0, 3.0, -2.0] {
            for (mirror, pixels) in [(1.0, 600.0), (-1.0, 200.0)] {
                let frame = PictureFrame::of(&jacobian(angle, mirror, pixels), 640.0).unwrap();
                let error = (frame.jacobian - NOMINAL_JACOBIAN_M).norm();
                assert!(error < 1e-12, "{angle} {mirror}: {}", frame.jacobian);
                assert!((frame.scale * pixels * 1.3 - 1.0).abs() < 1e-12);
            }
        }
        assert!(PictureFrame::of(&Matrix2::zeros(), 640.0).is_none());
        // A picture as wide as a house keeps a frame that the board takes.
        let wide = PictureFrame::of(&jacobian(0.0, 1.0, 10.0), 640.0).unwrap();
        assert!((wide.scale * 640.0 - MAX_WIDTH_M).abs() < 1e-9);
    }

    #[test]
    fn the_pose_of_the_frame_shows_each_pixel_where_it_is() {
        let camera = camera_file::paper().unwrap();
        for (angle, mirror) in [(0.4, 1.0), (-1.2, -1.0)] {
            let frame = PictureFrame::of(&jacobian(angle, mirror, 500.0), 640.0).unwrap();
            let region = Region::of(SIZE, None, [320.0, 240.0]).unwrap();
            let ball = [320.0, 240.0];
            let picture = RigPicture { frame, region, camera: frame.camera(&camera), ball };
            for pixel in [[0.0, 0.0], [412.0, 233.0], [639.0, 479.0]] {
                let place = picture.place(pixel);
                let back = picture.pixel(place);
                assert!((back[0] - pixel[0]).hypot(back[1] - pixel[1]) < 1e-6, "{back:?}");
                assert_eq!(place[0], 0.0);
            }
        }
    }

    #[test]
    fn targets_keep_away_from_the_motors_and_the_border() {
        let ball = [300.0, 250.0];
        let region = Region::of(SIZE, Some([[520.0, 60.0], [120.0, 60.0]]), ball).unwrap();
        for (pixel, is_inside) in [
            (ball, true),
            ([185.0, 300.0], true),
            ([175.0, 300.0], false),
            ([465.0, 300.0], false),
            ([300.0, 115.0], false),
            ([300.0, 125.0], true),
            ([300.0, 470.0], false),
        ] {
            assert_eq!(region.contains(pixel), is_inside, "{pixel:?}");
        }
        // Upside down, the ball hangs above the motors.
        let over = Region::of(SIZE, Some([[120.0, 420.0], [520.0, 420.0]]), ball).unwrap();
        assert!(over.contains([300.0, 300.0]) && !over.contains([300.0, 380.0]));
        let third = Region::of(SIZE, None, ball).unwrap();
        assert!(third.contains([320.0, 240.0]) && !third.contains([200.0, 240.0]));
        let near = Region::of(SIZE, Some([[2.0, 2.0], [1.0, 2.0]]), [1.5, 3.0]);
        assert_eq!(near, Err(PictureError::NoRoom));
    }
}
