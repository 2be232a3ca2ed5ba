//! Renders a room by ray casting: one ray a pixel, soft shadows, irradiance smoothed within each
//! surface, anti-aliased edges.

mod irradiance;
mod smoothing;

use nalgebra::{Point3, Vector3};
use plumb_frame::camera::Camera;

use super::pattern::hash_noise;
use super::shape::{BoundingSphere, Intersection, Ray, wall};
use super::view::View;
use super::{Object, Pattern, Room};
use crate::synthetic::light::{Material, encode, specular};
use smoothing::Light;

/// A pixel in progress.
#[derive(Clone, Copy)]
struct Pixel {
    hit: Hit,
    /// Irradiance, linear.
    arriving: [f32; 3],
}

/// First intersection of a ray with the room.
#[derive(Clone, Copy)]
struct Hit {
    at: Intersection,
    /// Index of the object and its side; walls follow the objects.
    surface: usize,
    material: Material,
    pattern: Pattern,
    glow: f64,
}

/// A room and the camera at `eye`.
struct RayCaster<'a> {
    room: &'a Room,
    /// Bounding sphere of each object.
    spheres: Vec<BoundingSphere>,
    /// Bounding sphere of each [`GROUP`] objects that follow each other.
    groups: Vec<BoundingSphere>,
    low: Point3<f64>,
    high: Point3<f64>,
    camera: &'a Camera,
    eye: Point3<f64>,
    width: usize,
    height: usize,
}

/// Objects in a group: they are near each other, as they are listed.
const GROUP: usize = 8;

/// Ambient light, linear, order blue, green, red.
const AMBIENT: [f64; 3] = [0.48, 0.48, 0.47];

impl Room {
    /// Renders a frame of `size` (columns, rows). A wall in front of the camera is moved behind it.
    pub(in crate::synthetic) fn render(&self, camera: &Camera, size: (usize, usize)) -> View {
        let eye = Point3::from(camera.pose.translation.vector);
        let margin = Vector3::repeat(0.3);
        let spheres: Vec<_> =
            self.objects.iter().map(|object| object.shape.bounding_sphere()).collect();
        let caster = RayCaster {
            room: self,
            groups: spheres.chunks(GROUP).map(BoundingSphere::around).collect(),
            spheres,
            low: self.low.coords.inf(&(eye - margin).coords).into(),
            high: self.high.coords.sup(&(eye + margin).coords).into(),
            camera,
            eye,
            width: size.0,
            height: size.1,
        };
        let mut pixels = caster.rows(|column, row| caster.trace(column, row));
        let value = |of: &dyn Fn(&Pixel) -> f32| pixels.iter().map(of).collect();
        let light = Light {
            surface: pixels.iter().map(|pixel| pixel.hit.surface as u32).collect(),
            normal: [0, 1, 2].map(|k| value(&|pixel| pixel.hit.at.normal[k] as f32)),
            arriving: [0, 1, 2].map(|k| value(&|pixel| pixel.arriving[k])),
        };
        let arriving = caster.lines(|row| light.smoothed(row, (caster.width, caster.height)));
        for (pixel, arriving) in pixels.iter_mut().zip(arriving) {
            pixel.arriving = arriving;
        }
        let colour = caster.rows(|column, row| caster.colour(&pixels, column, row));
        View {
            colour: colour.into_iter().flatten().collect(),
            range: pixels.iter().map(|pixel| pixel.hit.at.t as f32).collect(),
            reflects: pixels.iter().map(|pixel| pixel.hit.glow <= 0.0).collect(),
        }
    }
}

impl RayCaster<'_> {
    /// Returns `of(column, row)` for every pixel, row by row, computed on all cores.
    fn rows<T: Send>(&self, of: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
        self.lines(|row| (0..self.width).map(|column| of(column, row)).collect())
    }

    /// Returns the pixels `of(row)` of every row, computed on all cores.
    fn lines<T: Send>(&self, of: impl Fn(usize) -> Vec<T> + Sync) -> Vec<T> {
        let workers = std::thread::available_parallelism().map_or(1, usize::from).min(self.height);
        let share = self.height.div_ceil(workers);
        let part = |worker: usize| -> Vec<T> {
            let rows = worker * share..((worker + 1) * share).min(self.height);
            rows.flat_map(&of).collect()
        };
        std::thread::scope(|scope| {
            let part = &part;
            let others: Vec<_> =
                (1..workers).map(|worker| scope.spawn(move || part(worker))).collect();
            let mut all = part(0);
            for (worker, other) in (1..workers).zip(others) {
                // If a thread failed, its part is computed here.
                all.extend(other.join().unwrap_or_else(|_| part(worker)));
            }
            all
        })
    }

    /// Returns the ray through a point of the frame.
    fn ray(&self, u: f64, v: f64) -> Ray {
        let along = self.camera.pose.rotation * self.camera.intrinsics.deproject(u, v, 1.0).coords;
        Ray { from: self.eye, along }
    }

    /// Calls `of` with the objects whose bounding sphere `ray` intersects before `t` = `end`, in
    /// their order, until it returns something. `length` is the length of the ray's direction.
    fn find<T>(
        &self,
        (ray, length, end): (&Ray, f64, f64),
        mut of: impl FnMut(usize, &Object) -> Option<T>,
    ) -> Option<T> {
        for (number, group) in self.groups.iter().enumerate() {
            if !group.is_near(ray, length, end) {
                continue;
            }
            let first = number * GROUP;
            let spheres = &self.spheres[first..(first + GROUP).min(self.spheres.len())];
            for (k, sphere) in (first..).zip(spheres) {
                if sphere.is_near(ray, length, end)
                    && let Some(found) = of(k, &self.room.objects[k])
                {
                    return Some(found);
                }
            }
        }
        None
    }

    /// Returns the first intersection of `ray` with an object or a wall.
    fn intersect(&self, ray: &Ray) -> Hit {
        let mut nearest: Option<(Intersection, usize)> = None;
        self.find::<()>((ray, ray.along.norm(), f64::INFINITY), |k, object| {
            if let Some(at) =
                object.shape.intersect(ray).filter(|at| nearest.is_none_or(|(n, _)| at.t < n.t))
            {
                nearest = Some((at, k));
            }
            None
        });
        if let Some((at, k)) = nearest {
            let Object { material, pattern, glow, .. } = self.room.objects[k];
            return Hit { at, surface: 8 * k + usize::from(at.side), material, pattern, glow };
        }
        let at = wall(ray, &self.low, &self.high);
        let side = usize::from(at.side);
        let pattern = if side == 4 { self.room.floor } else { Pattern::Mottled };
        let surface = 8 * self.room.objects.len() + side;
        Hit { at, surface, material: self.room.paint[side], pattern, glow: 0.0 }
    }

    /// Returns the first hit of a pixel with its irradiance before smoothing.
    fn trace(&self, column: usize, row: usize) -> Pixel {
        let ray = self.ray(column as f64, row as f64);
        let hit = self.intersect(&ray);
        if hit.glow > 0.0 {
            return Pixel { hit, arriving: [0.0; 3] };
        }
        let from = self.eye + ray.along * hit.at.t + hit.at.normal * 1e-4;
        let random = |k: i64| hash_noise(column as i64, row as i64, 17 + k);
        let mut arriving =
            AMBIENT.map(|x| x * self.ambient_visibility(&from, &hit.at.normal, &random));
        for (k, panel) in (0_i64..).zip(&self.room.panels) {
            for sample in 0..2 {
                let at = 10 + 8 * k + 2 * sample;
                let share =
                    self.panel(panel, &from, &hit.at.normal, [random(at), random(at + 1)]) / 2.0;
                for (sum, power) in arriving.iter_mut().zip(panel.power) {
                    *sum += power * share;
                }
            }
        }
        Pixel { hit, arriving: arriving.map(|x| x as f32) }
    }

    /// Returns the visible colour of `hit` along `ray` with the irradiance `arriving`, linear.
    fn radiance(&self, hit: &Hit, ray: &Ray, arriving: &[f32; 3]) -> [f64; 3] {
        let base = hit.pattern.colour(hit.material.colour, hit.at.local);
        if hit.glow > 0.0 {
            return base.map(|x| x * hit.glow);
        }
        let to_eye = -ray.along.normalize();
        let at = self.eye + ray.along * hit.at.t;
        let bright = self.room.panels.first().map_or(0.0, |panel| {
            let to_lamp = (panel.centre - at).normalize();
            1.2 * specular(&hit.material, &hit.at.normal, &to_eye, &to_lamp)
        });
        std::array::from_fn(|k| (base[k] + bright) * f64::from(arriving[k]))
    }

    /// Returns the sRGB colour of a pixel; edges are anti-aliased with four rays.
    fn colour(&self, pixels: &[Pixel], column: usize, row: usize) -> [u8; 3] {
        let own = &pixels[row * self.width + column];
        let edge = self.neighbours(column, row, 1).any(|i| {
            let other = &pixels[i];
            other.hit.surface != own.hit.surface
                || other.hit.at.normal.dot(&own.hit.at.normal) < 0.9
        });
        let round = |linear: [f64; 3]| linear.map(|x| encode(x).round() as u8);
        if !edge && !own.hit.pattern.has_edges() {
            return round(self.radiance(
                &own.hit,
                &self.ray(column as f64, row as f64),
                &own.arriving,
            ));
        }
        let mut sum = [0.0; 3];
        for (du, dv) in [(-0.125, -0.375), (0.375, -0.125), (0.125, 0.375), (-0.375, 0.125)] {
            let ray = self.ray(column as f64 + du, row as f64 + dv);
            let hit = self.intersect(&ray);
            let lit = if hit.surface == own.hit.surface {
                own.arriving
            } else {
                let alike =
                    self.neighbours(column, row, 2).find(|&i| pixels[i].hit.surface == hit.surface);
                pixels[alike.unwrap_or(row * self.width + column)].arriving
            };
            let seen = self.radiance(&hit, &ray, &lit);
            sum = std::array::from_fn(|k| sum[k] + seen[k].min(1.0) / 4.0);
        }
        round(sum)
    }

    /// Returns the indices of the pixels up to `reach` away from one, without itself.
    fn neighbours(&self, column: usize, row: usize, reach: usize) -> impl Iterator<Item = usize> {
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(self.height);
        let (width, left, right) =
            (self.width, column.saturating_sub(reach), (column + reach + 1).min(self.width));
        let own = row * width + column;
        rows.flat_map(move |y| (left..right).map(move |x| y * width + x)).filter(move |&i| i != own)
    }
}
