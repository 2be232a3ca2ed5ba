//! Solids and their intersections with rays.

use nalgebra::{Point3, Vector3};

/// A solid in the rig frame, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A box that stands upright.
    Block {
        /// Its centre.
        centre: Point3<f64>,
        /// Half its size along its own x, y and z.
        half: Vector3<f64>,
        /// Rotation about z, radians.
        yaw: f64,
    },
    /// A ball.
    Sphere {
        /// Its centre.
        centre: Point3<f64>,
        /// Its radius.
        radius: f64,
    },
    /// A ball that is longer or shorter along its own axes: a cushion, an apple, a petal.
    Ellipsoid {
        /// Its centre.
        centre: Point3<f64>,
        /// Half its size along its own x, y and z.
        half: Vector3<f64>,
        /// Rotation about z, radians.
        yaw: f64,
    },
    /// A can that stands upright.
    Cylinder {
        /// Middle of its foot.
        base: Point3<f64>,
        /// Its radius.
        radius: f64,
        /// Its height.
        height: f64,
    },
    /// A flat disc without thickness, visible from both sides.
    Disc {
        /// Its centre.
        centre: Point3<f64>,
        /// Its radius.
        radius: f64,
        /// Across it; unit.
        normal: Vector3<f64>,
    },
}

/// A ray; a point on it is `from + along * t`, and `along` need not have unit length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub(super) from: Point3<f64>,
    pub(super) along: Vector3<f64>,
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Intersection {
    /// Along the ray.
    pub(super) t: f64,
    /// Unit, outwards.
    pub(super) normal: Vector3<f64>,
    /// From the solid's middle along its own axes, metres.
    pub(super) local: Vector3<f64>,
    /// Which side of the solid, 0 to 5.
    pub(super) side: u8,
}

/// A ball around solids.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoundingSphere {
    pub(super) centre: Point3<f64>,
    pub(super) radius: f64,
}

impl BoundingSphere {
    /// Returns a ball around `spheres`.
    pub(super) fn around(spheres: &[Self]) -> Self {
        let sum: Vector3<f64> = spheres.iter().map(|sphere| sphere.centre.coords).sum();
        let centre = Point3::from(sum / spheres.len() as f64);
        let reach = |sphere: &Self| (sphere.centre - centre).norm() + sphere.radius;
        let radius = spheres.iter().map(reach).fold(0.0, f64::max);
        // What is rounded never leaves a sphere out.
        Self { centre, radius: radius * (1.0 + 1e-9) }
    }

    /// Returns whether `ray`, whose direction has this `length`, intersects the ball before `t` =
    /// `end`.
    pub(super) fn is_near(&self, ray: &Ray, length: f64, end: f64) -> bool {
        let (square, to) = (length * length, self.centre - ray.from);
        let (along, reach) = (to.dot(&ray.along), self.radius * length);
        let near = along > -reach && along - reach < end * square;
        near && to.norm_squared() * square - along * along <= reach * reach
    }
}

/// A meeting nearer than this is the surface that a ray starts from.
const START: f64 = 1e-6;

impl Shape {
    /// Returns a ball around the solid.
    pub(super) fn bounding_sphere(&self) -> BoundingSphere {
        let (centre, radius) = match *self {
            Self::Block { centre, half, .. } => (centre, half.norm()),
            Self::Sphere { centre, radius } | Self::Disc { centre, radius, .. } => (centre, radius),
            Self::Ellipsoid { centre, half, .. } => (centre, half.max()),
            Self::Cylinder { base, radius, height } => {
                (base + Vector3::z() * (height / 2.0), radius.hypot(height / 2.0))
            }
        };
        BoundingSphere { centre, radius }
    }

    /// Where `ray` first enters the solid.
    pub(super) fn intersect(&self, ray: &Ray) -> Option<Intersection> {
        match *self {
            Self::Block { centre, half, yaw } => block(ray, &centre, &half, yaw),
            Self::Sphere { centre, radius } => sphere(ray, &centre, radius),
            Self::Ellipsoid { centre, half, yaw } => ellipsoid(ray, &centre, &half, yaw),
            Self::Cylinder { base, radius, height } => cylinder(ray, &base, radius, height),
            Self::Disc { centre, radius, normal } => disc(ray, &centre, radius, &normal),
        }
    }
}

fn turn(v: &Vector3<f64>, (sin, cos): (f64, f64)) -> Vector3<f64> {
    Vector3::new(v.x * cos - v.y * sin, v.x * sin + v.y * cos, v.z)
}

fn block(ray: &Ray, centre: &Point3<f64>, half: &Vector3<f64>, yaw: f64) -> Option<Intersection> {
    let (sin, cos) = yaw.sin_cos();
    let from = turn(&(ray.from - centre), (-sin, cos));
    let along = turn(&ray.along, (-sin, cos));
    let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for k in 0..3 {
        let inverse = 1.0 / along[k];
        let (a, b) = ((-half[k] - from[k]) * inverse, (half[k] - from[k]) * inverse);
        if a.min(b) > enter {
            (enter, axis) = (a.min(b), k);
        }
        leave = leave.min(a.max(b));
    }
    if enter > leave || enter < START {
        return None;
    }
    let mut normal = Vector3::zeros();
    normal[axis] = -along[axis].signum();
    let side = 2 * axis as u8 + u8::from(along[axis] < 0.0);
    Some(Intersection {
        t: enter,
        normal: turn(&normal, (sin, cos)),
        local: from + along * enter,
        side,
    })
}

fn sphere(ray: &Ray, centre: &Point3<f64>, radius: f64) -> Option<Intersection> {
    let from = ray.from - centre;
    let (a, b) = (ray.along.norm_squared(), from.dot(&ray.along));
    let root = b * b - a * (from.norm_squared() - radius * radius);
    if root < 0.0 {
        return None;
    }
    let t = (-b - root.sqrt()) / a;
    let local = from + ray.along * t;
    (t > START).then(|| Intersection { t, normal: local / radius, local, side: 0 })
}

fn ellipsoid(
    ray: &Ray,
    centre: &Point3<f64>,
    half: &Vector3<f64>,
    yaw: f64,
) -> Option<Intersection> {
    let (sin, cos) = yaw.sin_cos();
    // In units of its half sizes along its own axes it is a ball of radius 1.
    let own = |v: &Vector3<f64>| turn(v, (-sin, cos)).component_div(half);
    let ray = Ray { from: own(&(ray.from - centre)).into(), along: own(&ray.along) };
    let at = sphere(&ray, &Point3::origin(), 1.0)?;
    let normal = turn(&at.local.component_div(half).normalize(), (sin, cos));
    Some(Intersection { normal, local: at.local.component_mul(half), ..at })
}

fn cylinder(ray: &Ray, base: &Point3<f64>, radius: f64, height: f64) -> Option<Intersection> {
    let from = ray.from - base;
    let middle = Vector3::z() * (height / 2.0);
    let flat = |v: &Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
    let (f, d) = (flat(&from), flat(&ray.along));
    let (a, b) = (d.norm_squared(), f.dot(&d));
    let root = b * b - a * (f.norm_squared() - radius * radius);
    if root >= 0.0 && a > 0.0 {
        let t = (-b - root.sqrt()) / a;
        let p = from + ray.along * t;
        if t > START && (0.0..=height).contains(&p.z) {
            return Some(Intersection { t, normal: flat(&p) / radius, local: p - middle, side: 0 });
        }
    }
    let (lid, side) = if ray.along.z < 0.0 { (height, 1) } else { (0.0, 2) };
    let t = (lid - from.z) / ray.along.z;
    let p = from + ray.along * t;
    let normal = Vector3::z() * -ray.along.z.signum();
    (t > START && flat(&p).norm_squared() <= radius * radius).then(|| Intersection {
        t,
        normal,
        local: p - middle,
        side,
    })
}

fn disc(
    ray: &Ray,
    centre: &Point3<f64>,
    radius: f64,
    normal: &Vector3<f64>,
) -> Option<Intersection> {
    let towards = ray.along.dot(normal);
    let t = (centre - ray.from).dot(normal) / towards;
    let local = ray.from + ray.along * t - centre;
    // A ray in the plane of the disc has no finite place.
    let is_hit = t.is_finite() && t > START && local.norm_squared() <= radius * radius;
    is_hit.then(|| Intersection { t, normal: normal * -towards.signum(), local, side: 0 })
}

/// Where `ray`, from inside, meets the wall of the room from `low` to `high`.
pub(super) fn wall(ray: &Ray, low: &Point3<f64>, high: &Point3<f64>) -> Intersection {
    let (mut t, mut axis) = (f64::INFINITY, 0);
    for k in 0..3 {
        let to = if ray.along[k] > 0.0 { high[k] } else { low[k] };
        let reach = (to - ray.from[k]) / ray.along[k];
        if reach < t {
            (t, axis) = (reach, k);
        }
    }
    let mut normal = Vector3::zeros();
    normal[axis] = -ray.along[axis].signum();
    let side = 2 * axis as u8 + u8::from(ray.along[axis] > 0.0);
    Intersection { t, normal, local: (ray.from + ray.along * t).coords, side }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_solids_where_they_are() {
        let ray = Ray { from: Point3::new(3.0, 0.1, 0.2), along: -Vector3::x() * 2.0 };
        let meets = [
            Shape::Block { centre: Point3::origin(), half: Vector3::new(1.0, 1.0, 1.0), yaw: 0.0 },
            Shape::Sphere { centre: Point3::new(0.0, 0.1, 0.2), radius: 1.0 },
            Shape::Cylinder { base: Point3::new(0.0, 0.1, 0.0), radius: 1.0, height: 0.5 },
            Shape::Ellipsoid {
                centre: Point3::new(0.0, 0.1, 0.2),
                half: Vector3::new(2.0, 1.0, 3.0),
                yaw: std::f64::consts::FRAC_PI_2,
            },
            Shape::Disc { centre: Point3::new(1.0, 0.5, 0.5), radius: 0.6, normal: -Vector3::x() },
        ]
        .map(|shape| shape.intersect(&ray));
        for meeting in meets {
            let meeting = meeting.expect("it is in the way");
            assert!((meeting.t - 1.0).abs() < 1e-9, "{meeting:?}");
            assert!((meeting.normal - Vector3::x()).norm() < 1e-9, "{meeting:?}");
        }
        let turned = Shape::Block {
            centre: Point3::origin(),
            half: Vector3::new(1.0, 1.0, 1.0),
            yaw: std::f64::consts::FRAC_PI_4,
        };
        let meeting = turned.intersect(&ray).expect("it is in the way");
        assert!((meeting.t - (3.0 - (2.0_f64.sqrt() - 0.1)) / 2.0).abs() < 1e-9, "{meeting:?}");
    }

    #[test]
    fn rays_miss_shapes_beside_or_behind_them() {
        let away = Ray { from: Point3::new(3.0, 0.0, 0.0), along: Vector3::x() };
        let beside = Ray { from: Point3::new(3.0, 2.0, 0.0), along: -Vector3::x() };
        for shape in [
            Shape::Block { centre: Point3::origin(), half: Vector3::new(1.0, 1.0, 1.0), yaw: 0.0 },
            Shape::Sphere { centre: Point3::origin(), radius: 1.0 },
            Shape::Cylinder { base: Point3::new(0.0, 0.0, -0.5), radius: 1.0, height: 1.0 },
            Shape::Disc { centre: Point3::origin(), radius: 1.0, normal: Vector3::x() },
            Shape::Disc { centre: Point3::origin(), radius: 1.0, normal: Vector3::z() },
        ] {
            assert!(
                shape.intersect(&away).is_none() && shape.intersect(&beside).is_none(),
                "{shape:?}"
            );
        }
    }
}
