//! Casts a room into a picture: a ray a pixel, light with soft shadows, smoothed within each
//! surface, edges anti-aliased.

use nalgebra::{Point3, Vector3};
use plumb_vision::camera::Camera;

use super::pattern::chance;
use super::shape::{Meeting, Ray, wall};
use super::view::View;
use super::{Panel, Pattern, Room, Thing};
use crate::synthetic::light::{Material, encode, glint};

/// A pixel while the picture is made.
#[derive(Clone, Copy)]
struct Pixel {
    hit: Hit,
    /// Light that arrives, linear.
    arriving: [f32; 3],
}

/// What the smoothing of light needs of a pixel, small for the sake of the cache.
#[derive(Clone, Copy)]
struct Light {
    surface: usize,
    normal: [f32; 3],
    arriving: [f32; 3],
}

impl Light {
    fn of(pixel: &Pixel) -> Self {
        let normal = pixel.hit.at.normal.map(|x| x as f32).into();
        Self { surface: pixel.hit.surface, normal, arriving: pixel.arriving }
    }

    /// Whether both are of one surface that does not turn much from one to the other.
    fn is_like(&self, other: &Self) -> bool {
        let [a, b] = [&self.normal, &other.normal];
        self.surface == other.surface && a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > 0.93
    }
}

/// What a ray of a room meets.
#[derive(Clone, Copy)]
struct Hit {
    at: Meeting,
    /// Index of the thing and side of it; walls come after the things.
    surface: usize,
    material: Material,
    pattern: Pattern,
    glow: f64,
}

/// A room as a camera at `eye` sees it.
struct Stage<'a> {
    room: &'a Room,
    /// Middle and radius around each thing.
    bounds: Vec<(Point3<f64>, f64)>,
    low: Point3<f64>,
    high: Point3<f64>,
    camera: &'a Camera,
    eye: Point3<f64>,
    width: usize,
    height: usize,
}

/// How far ambient light is taken away by what is near, metres.
const CORNER: f64 = 0.5;
/// Ambient light, linear, order blue, green, red.
const AMBIENT: [f64; 3] = [0.48, 0.48, 0.47];

impl Room {
    /// What `camera` sees in a picture of `size` (columns, rows). Walls that it stands behind move
    /// behind it.
    pub(in crate::synthetic) fn cast(&self, camera: &Camera, size: (usize, usize)) -> View {
        let eye = Point3::from(camera.pose.translation.vector);
        let margin = Vector3::repeat(0.3);
        let stage = Stage {
            room: self,
            bounds: self.things.iter().map(|thing| thing.shape.bounds()).collect(),
            low: self.low.coords.inf(&(eye - margin).coords).into(),
            high: self.high.coords.sup(&(eye + margin).coords).into(),
            camera,
            eye,
            width: size.0,
            height: size.1,
        };
        let mut pixels = stage.rows(|column, row| stage.first(column, row));
        let light: Vec<Light> = pixels.iter().map(Light::of).collect();
        let arriving = stage.rows(|column, row| stage.smoothed(&light, column, row));
        for (pixel, arriving) in pixels.iter_mut().zip(arriving) {
            pixel.arriving = arriving;
        }
        let colour = stage.rows(|column, row| stage.colour(&pixels, column, row));
        View {
            colour: colour.into_iter().flatten().collect(),
            range: pixels.iter().map(|pixel| pixel.hit.at.t as f32).collect(),
            reflects: pixels.iter().map(|pixel| pixel.hit.glow <= 0.0).collect(),
        }
    }
}

impl Stage<'_> {
    /// `of(column, row)` of every pixel, row by row; the machine's processors share the work.
    fn rows<T: Send>(&self, of: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
        let workers = std::thread::available_parallelism().map_or(1, usize::from).min(self.height);
        let share = self.height.div_ceil(workers);
        let part = |worker: usize| -> Vec<T> {
            let rows = worker * share..((worker + 1) * share).min(self.height);
            rows.flat_map(|row| (0..self.width).map(move |column| (column, row)))
                .map(|(column, row)| of(column, row))
                .collect()
        };
        std::thread::scope(|scope| {
            let part = &part;
            let others: Vec<_> =
                (1..workers).map(|worker| scope.spawn(move || part(worker))).collect();
            let mut all = part(0);
            for (worker, other) in (1..workers).zip(others) {
                // A part that was lost with its thread is made again here.
                all.extend(other.join().unwrap_or_else(|_| part(worker)));
            }
            all
        })
    }

    fn ray(&self, u: f64, v: f64) -> Ray {
        let along = self.camera.pose.rotation * self.camera.intrinsics.deproject(u, v, 1.0).coords;
        Ray { from: self.eye, along }
    }

    /// The things that `ray`, whose direction has the length `length`, may meet before `t` = `end`.
    fn on_the_way(
        &self,
        ray: &Ray,
        length: f64,
        end: f64,
    ) -> impl Iterator<Item = (usize, &Thing)> {
        let (ray, square) = (*ray, length * length);
        self.room.things.iter().enumerate().zip(&self.bounds).filter_map(
            move |((k, thing), (centre, radius))| {
                let to = centre - ray.from;
                let (along, reach) = (to.dot(&ray.along), radius * length);
                let near = along > -reach && along - reach < end * square;
                (near && to.norm_squared() * square - along * along <= reach * reach)
                    .then_some((k, thing))
            },
        )
    }

    fn meet(&self, ray: &Ray) -> Hit {
        let mut nearest: Option<(Meeting, usize)> = None;
        for (k, thing) in self.on_the_way(ray, ray.along.norm(), f64::INFINITY) {
            if let Some(at) =
                thing.shape.meet(ray).filter(|at| nearest.is_none_or(|(n, _)| at.t < n.t))
            {
                nearest = Some((at, k));
            }
        }
        if let Some((at, k)) = nearest {
            let Thing { material, pattern, glow, .. } = self.room.things[k];
            return Hit { at, surface: 8 * k + usize::from(at.side), material, pattern, glow };
        }
        let at = wall(ray, &self.low, &self.high);
        let side = usize::from(at.side);
        let pattern = if side == 4 { self.room.floor } else { Pattern::Mottled };
        let surface = 8 * self.room.things.len() + side;
        Hit { at, surface, material: self.room.paint[side], pattern, glow: 0.0 }
    }

    /// Whether something stands on `ray` before `t` = `end`.
    fn hidden(&self, ray: &Ray, end: f64) -> bool {
        self.on_the_way(ray, ray.along.norm(), end).any(|(_, thing)| {
            thing.glow <= 0.0 && thing.shape.meet(ray).is_some_and(|at| at.t < end)
        })
    }

    fn first(&self, column: usize, row: usize) -> Pixel {
        let ray = self.ray(column as f64, row as f64);
        let hit = self.meet(&ray);
        if hit.glow > 0.0 {
            return Pixel { hit, arriving: [0.0; 3] };
        }
        let from = self.eye + ray.along * hit.at.t + hit.at.normal * 1e-4;
        let random = |k: i64| chance(column as i64, row as i64, 17 + k);
        let mut arriving = AMBIENT.map(|x| x * self.openness(&from, &hit.at.normal, &random));
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

    /// How much of the room's own light gets to `from`: 1 in the open, less in corners and under
    /// things.
    fn openness(
        &self,
        from: &Point3<f64>,
        normal: &Vector3<f64>,
        random: &impl Fn(i64) -> f64,
    ) -> f64 {
        let mut open = 0.0;
        for sample in 0..3 {
            let z = 2.0 * random(2 * sample) - 1.0;
            let (sin, cos) = (std::f64::consts::TAU * random(2 * sample + 1)).sin_cos();
            let flat = (1.0 - z * z).max(0.0).sqrt();
            // A point on a ball that touches the surface: directions weigh as their cosine.
            let along = normal + Vector3::new(flat * cos, flat * sin, z);
            let ray = Ray { from: *from, along: along.try_normalize(1e-9).unwrap_or(*normal) };
            let free = (wall(&ray, &self.low, &self.high).t / CORNER).min(1.0);
            open += if self.hidden(&ray, CORNER) { 0.15 } else { 0.35 + 0.65 * free };
        }
        // Light comes rather from above than from below.
        open / 3.0 * (0.85 + 0.15 * normal.z)
    }

    /// Share of `panel`'s light that gets to `from` from the point of it at `place` (0 to 1 each
    /// way).
    fn panel(
        &self,
        panel: &Panel,
        from: &Point3<f64>,
        normal: &Vector3<f64>,
        place: [f64; 2],
    ) -> f64 {
        let source =
            panel.centre + panel.a * (2.0 * place[0] - 1.0) + panel.b * (2.0 * place[1] - 1.0);
        let to = source - from;
        let distance = to.norm();
        let out = panel.a.cross(&panel.b).try_normalize(1e-12).unwrap_or_else(Vector3::z);
        let facing = normal.dot(&to) / distance;
        let leaving = -out.dot(&to) / distance;
        if facing <= 0.0 || leaving <= 0.0 || self.hidden(&Ray { from: *from, along: to }, 0.995) {
            return 0.0;
        }
        // Falls off more slowly than 1/d², as the walls give back what falls on them.
        facing * (0.3 + 0.7 * leaving) / (1.0 + distance * distance)
    }

    /// The light of a pixel from its neighbours on the same surface.
    fn smoothed(&self, light: &[Light], column: usize, row: usize) -> [f32; 3] {
        const REACH: usize = 4;
        let own = &light[row * self.width + column];
        let columns = column.saturating_sub(REACH)..(column + REACH + 1).min(self.width);
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for y in row.saturating_sub(REACH)..(row + REACH + 1).min(self.height) {
            let line = &light[y * self.width..(y + 1) * self.width];
            for other in line[columns.clone()].iter().filter(|other| own.is_like(other)) {
                count += 1.0;
                sum = std::array::from_fn(|k| sum[k] + other.arriving[k]);
            }
        }
        sum.map(|x| x / f32::max(count, 1.0))
    }

    /// What is seen, linear: of `hit` along `ray` with the light `arriving`.
    fn seen(&self, hit: &Hit, ray: &Ray, arriving: &[f32; 3]) -> [f64; 3] {
        let base = hit.pattern.colour(hit.material.colour, &hit.at);
        if hit.glow > 0.0 {
            return base.map(|x| x * hit.glow);
        }
        let to_eye = -ray.along.normalize();
        let at = self.eye + ray.along * hit.at.t;
        let bright = self.room.panels.first().map_or(0.0, |panel| {
            let to_lamp = (panel.centre - at).normalize();
            1.2 * glint(&hit.material, &hit.at.normal, &to_eye, &to_lamp)
        });
        std::array::from_fn(|k| (base[k] + bright) * f64::from(arriving[k]))
    }

    fn colour(&self, pixels: &[Pixel], column: usize, row: usize) -> [u8; 3] {
        let own = &pixels[row * self.width + column];
        let edge = self.neighbours(column, row, 1).any(|i| {
            let other = &pixels[i];
            other.hit.surface != own.hit.surface
                || other.hit.at.normal.dot(&own.hit.at.normal) < 0.9
        });
        let round = |linear: [f64; 3]| linear.map(|x| encode(x).round() as u8);
        if !edge && !own.hit.pattern.has_edges() {
            return round(self.seen(&own.hit, &self.ray(column as f64, row as f64), &own.arriving));
        }
        let mut sum = [0.0; 3];
        for (du, dv) in [(-0.125, -0.375), (0.375, -0.125), (0.125, 0.375), (-0.375, 0.125)] {
            let ray = self.ray(column as f64 + du, row as f64 + dv);
            let hit = self.meet(&ray);
            let lit = if hit.surface == own.hit.surface {
                own.arriving
            } else {
                let alike =
                    self.neighbours(column, row, 2).find(|&i| pixels[i].hit.surface == hit.surface);
                pixels[alike.unwrap_or(row * self.width + column)].arriving
            };
            let seen = self.seen(&hit, &ray, &lit);
            sum = std::array::from_fn(|k| sum[k] + seen[k].min(1.0) / 4.0);
        }
        round(sum)
    }

    /// Indices of the pixels around one, up to `reach` away, without itself.
    fn neighbours(&self, column: usize, row: usize, reach: usize) -> impl Iterator<Item = usize> {
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(self.height);
        let (width, left, right) =
            (self.width, column.saturating_sub(reach), (column + reach + 1).min(self.width));
        let own = row * width + column;
        rows.flat_map(move |y| (left..right).map(move |x| y * width + x)).filter(move |&i| i != own)
    }
}
