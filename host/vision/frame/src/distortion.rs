//! Distortion of a lens: OpenCV's model with five coefficients ("plumb bob").

use nalgebra::{Matrix2, Point2, Vector2};
use thiserror::Error;

/// Largest tangent of the angle to the optical axis for which the model is used: 85 degrees.
const MAX_TANGENT: f64 = 11.43;
/// Steps of Newton's method after which the inversion ends.
const MAX_STEPS: usize = 40;
/// Halvings of a step that makes the residual larger.
const MAX_HALVINGS: usize = 8;
/// Largest residual of an inverted point, in focal lengths: a millionth of a pixel.
const MAX_RESIDUAL: f64 = 1e-9;
/// Residual at which the inversion ends, in focal lengths.
const LAST_RESIDUAL: f64 = 1e-14;
/// Places along each side of a picture at which the inverse is checked.
const CHECKED_PLACES: usize = 41;
/// Halvings of the interval that contains the fold.
const BISECTIONS: usize = 60;

/// Parts of the names of models of angles, in ROS, kalibr and OpenCV.
const OF_ANGLES: [&str; 5] = ["equidistant", "fisheye", "kannala", "omni", "fov"];

/// Returns whether the model of distortion of this name is one of the angle to the optical axis:
/// its camera is no pinhole camera, also where all coefficients are 0.
pub fn is_of_angles(model: &str) -> bool {
    OF_ANGLES.iter().any(|part| model.contains(part))
}

/// Coefficients of a [`Distortion`], in OpenCV's order.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DistortionCoefficients {
    /// Radial, of r².
    pub k1: f64,
    /// Radial, of r⁴.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial, of r⁶.
    pub k3: f64,
}

/// Numbers that are no [`DistortionCoefficients`].
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum CoefficientsError {
    /// There are too few of them.
    #[error("{0} coefficients are there, but 4 or 5 are needed: k1, k2, p1, p2, k3")]
    Count(usize),
    /// One of them is no number.
    #[error("a coefficient is {0}: it must be a finite number")]
    Number(f64),
    /// A coefficient after the fifth is not 0, as in OpenCV's models with 8, 12 or 14.
    #[error("coefficient {place} is {value}: only the first five may differ from 0")]
    Higher {
        /// Its place, from 1.
        place: usize,
        /// Its value.
        value: f64,
    },
}

impl DistortionCoefficients {
    /// Makes the coefficients of a list in OpenCV's order: k1, k2, p1, p2, and k3, which may be
    /// left out. Zeros may follow: a longer model is then this one.
    ///
    /// # Errors
    /// If there are fewer than four, or one of them is not finite, or not 0 after the fifth.
    pub fn from_slice(coefficients: &[f64]) -> Result<Self, CoefficientsError> {
        let [first, further] = match coefficients.split_at_checked(5) {
            Some((first, further)) => [first, further],
            None => [coefficients, &[]],
        };
        if let Some(index) = further.iter().position(|coefficient| *coefficient != 0.0) {
            let (place, value) = (first.len() + index + 1, further[index]);
            return Err(CoefficientsError::Higher { place, value });
        }
        if let Some(&value) = first.iter().find(|coefficient| !coefficient.is_finite()) {
            return Err(CoefficientsError::Number(value));
        }
        match *first {
            [k1, k2, p1, p2] => Ok(Self { k1, k2, p1, p2, k3: 0.0 }),
            [k1, k2, p1, p2, k3] => Ok(Self { k1, k2, p1, p2, k3 }),
            _ => Err(CoefficientsError::Count(coefficients.len())),
        }
    }

    /// Makes the coefficients of an array in OpenCV's order: k1, k2, p1, p2, k3.
    pub fn from_array([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self { k1, k2, p1, p2, k3 }
    }

    /// Returns the coefficients in OpenCV's order: k1, k2, p1, p2, k3.
    pub fn to_array(self) -> [f64; 5] {
        [self.k1, self.k2, self.p1, self.p2, self.k3]
    }
}

/// Distortion of a lens (Brown and Conrady; OpenCV's first five coefficients).
///
/// The point (x, y) = (X/Z, Y/Z) of a ray is seen at
///
/// ```text
/// x' = x L + 2 p1 x y + p2 (r² + 2 x²)
/// y' = y L + 2 p2 x y + p1 (r² + 2 y²),   L = 1 + k1 r² + k2 r⁴ + k3 r⁶,   r² = x² + y²
/// ```
///
/// in focal lengths from the principal point. The polynomial r L(r) folds back where its slope is
/// 0. The model ends there: rays farther from the axis have no image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    coefficients: DistortionCoefficients,
    /// Square of the largest r.
    max_r2: f64,
}

/// Distortion that has no inverse over the whole picture.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "the lens distortion has no inverse at column {u:.0}, row {v:.0} of a picture of \
     {width}x{height} pixels: no ray is seen there, or several are. Check the signs and the order \
     of k1, k2, p1, p2 and k3 and the size of the pictures that they were estimated from; estimate \
     them from pictures with the board in the corners, or leave k3 out"
)]
pub struct DistortionError {
    /// Column of the place nearest to the principal point that has no inverse, pixels.
    pub u: f64,
    /// Row of that place, pixels.
    pub v: f64,
    /// Columns of the picture.
    pub width: usize,
    /// Rows of the picture.
    pub height: usize,
}

impl Distortion {
    /// Makes the distortion with these coefficients; `None` if all are 0, for a lens without
    /// distortion.
    pub fn new(coefficients: DistortionCoefficients) -> Option<Self> {
        let is_identity = coefficients == DistortionCoefficients::default();
        (!is_identity).then(|| Self { coefficients, max_r2: max_r2(&coefficients) })
    }

    /// Returns the coefficients.
    pub fn coefficients(&self) -> DistortionCoefficients {
        self.coefficients
    }

    /// Returns where a ray is seen, in focal lengths from the principal point; `None` for a ray
    /// beyond the fold. `ray` is X/Z, Y/Z.
    #[inline]
    pub fn distort(&self, ray: &Point2<f64>) -> Option<Point2<f64>> {
        (ray.coords.norm_squared() < self.max_r2).then(|| self.image(ray))
    }

    /// Returns the ray (X/Z, Y/Z) that is seen at `image`, in focal lengths from the principal
    /// point; `None` if no ray is. The residual is at most 1e-9 focal lengths.
    pub fn undistort(&self, image: &Point2<f64>) -> Option<Point2<f64>> {
        let ray = self.nearest_ray(image);
        let is_before_fold = self.derivatives(&ray).determinant() > 0.0;
        let residual = (self.image(&ray) - image).norm();
        (is_before_fold && residual <= MAX_RESIDUAL).then_some(ray)
    }

    /// Returns the ray that is seen nearest to `image`, by damped Newton steps: that of
    /// [`Self::undistort`], or a ray at the fold.
    pub(crate) fn nearest_ray(&self, image: &Point2<f64>) -> Point2<f64> {
        let mut ray = self.before_fold(*image);
        let mut residual = image - self.image(&ray);
        for _ in 0..MAX_STEPS {
            if residual.norm_squared() <= LAST_RESIDUAL * LAST_RESIDUAL {
                break;
            }
            let Some(inverse) = self.derivatives(&ray).try_inverse() else { break };
            let mut step = inverse * residual;
            let better = (0..MAX_HALVINGS).find_map(|_| {
                let next = self.before_fold(ray + step);
                let left = image - self.image(&next);
                step /= 2.0;
                (left.norm_squared() < residual.norm_squared()).then_some((next, left))
            });
            let Some((next, left)) = better else { break };
            (ray, residual) = (next, left);
        }
        ray
    }

    /// Returns the derivatives of the image by the ray: rows x', y', columns x, y.
    #[inline]
    pub(crate) fn derivatives(&self, ray: &Point2<f64>) -> Matrix2<f64> {
        let DistortionCoefficients { k1, k2, p1, p2, k3 } = self.coefficients;
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // Derivative of L by r², doubled: ∂L/∂x is this times x.
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let mixed = slope * x * y + 2.0 * (p1 * x + p2 * y);
        Matrix2::new(
            radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
            mixed,
            radial + slope * y * y + 2.0 * p2 * x + 6.0 * p1 * y,
        )
    }

    /// Returns the model's value, also beyond the fold.
    #[inline]
    fn image(&self, ray: &Point2<f64>) -> Point2<f64> {
        let DistortionCoefficients { k1, k2, p1, p2, k3 } = self.coefficients;
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let tangential = Vector2::new(
            2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y),
        );
        ray * radial + tangential
    }

    /// Returns `ray`, or the one in its direction just before the fold.
    #[inline]
    fn before_fold(&self, ray: Point2<f64>) -> Point2<f64> {
        let r2 = ray.coords.norm_squared();
        if r2 < self.max_r2 { ray } else { ray * (0.999_999 * (self.max_r2 / r2).sqrt()) }
    }
}

/// Returns the places of a picture of `width` x `height` pixels at which an inverse is checked, out
/// to the outer edges of the pixels.
pub(crate) fn checked_places(
    width: usize,
    height: usize,
) -> impl Iterator<Item = (f64, f64)> + Clone {
    let place = |k: usize, size: usize| size as f64 * k as f64 / (CHECKED_PLACES - 1) as f64 - 0.5;
    let rows = (0..CHECKED_PLACES).map(move |k| place(k, height));
    rows.flat_map(move |v| (0..CHECKED_PLACES).map(move |k| (place(k, width), v)))
}

/// Returns the square of the radius at which r L(r) folds back, at most [`MAX_TANGENT`] squared:
/// the smallest positive root of its slope 1 + 3 k1 s + 5 k2 s² + 7 k3 s³ with s = r².
fn max_r2(&DistortionCoefficients { k1, k2, k3, .. }: &DistortionCoefficients) -> f64 {
    let slope = |s: f64| 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * 7.0 * k3));
    let farthest = MAX_TANGENT * MAX_TANGENT;
    // Between its extrema the slope is monotonic.
    let [a, b, c] = [21.0 * k3, 5.0 * k2, 3.0 * k1];
    let root = (b * b - a * c).max(0.0).sqrt();
    let mut ends = [(-b - root) / a, (-b + root) / a, -c / (2.0 * b), farthest];
    ends.sort_by(f64::total_cmp);
    let mut low = 0.0;
    for high in ends.into_iter().filter(|&end| end > 0.0 && end <= farthest) {
        if slope(high) <= 0.0 {
            let (mut low, mut high) = (low, high);
            for _ in 0..BISECTIONS {
                let middle = (low + high) / 2.0;
                if slope(middle) > 0.0 { low = middle } else { high = middle }
            }
            return low;
        }
        low = high;
    }
    farthest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distortion(k1: f64, k2: f64, p1: f64, p2: f64, k3: f64) -> Distortion {
        Distortion::new(DistortionCoefficients { k1, k2, p1, p2, k3 }).unwrap()
    }

    #[test]
    fn a_point_is_where_opencv_puts_it() {
        // cv2.projectPoints of OpenCV 5.0.0, with a focal length of 1.
        let lens = distortion(-0.28, 0.11, 0.001_2, -0.000_7, -0.02);
        let pairs = [
            ([0.3, -0.2], [0.289_263_518, -0.192_747_012]),
            ([-0.5, 0.4], [-0.452_273_29, 0.362_081_032]),
        ];
        for (ray, expected) in pairs {
            let seen = lens.distort(&Point2::from(ray)).unwrap();
            assert!((seen - Point2::from(expected)).norm() < 1e-9, "{seen}");
        }
    }

    #[test]
    fn undistorting_is_the_inverse_of_distorting() {
        let lenses = [
            distortion(-0.3, 0.0, 0.0, 0.0, 0.0),
            distortion(-0.35, 0.15, 0.002, -0.001, -0.03),
            distortion(0.25, -0.02, -0.003, 0.002, 0.01),
            distortion(0.0, 0.0, 0.01, -0.02, 0.0),
        ];
        for lens in lenses {
            for (i, j) in (-10..=10).flat_map(|i| (-10..=10).map(move |j| (i, j))) {
                let ray = Point2::new(0.07 * f64::from(i), 0.05 * f64::from(j));
                let image = lens.distort(&ray).unwrap();
                let back = lens.undistort(&image).unwrap();
                assert!((back - ray).norm() < 1e-8, "{lens:?}: {ray} became {back}");
            }
        }
    }

    #[test]
    fn the_derivatives_are_those_of_the_model() {
        let lens = distortion(-0.35, 0.15, 0.002, -0.001, -0.03);
        let (ray, h) = (Point2::new(0.31, -0.17), 1e-6);
        let found = lens.derivatives(&ray);
        for (k, step) in [Vector2::x() * h, Vector2::y() * h].into_iter().enumerate() {
            let slope = (lens.image(&(ray + step)) - lens.image(&(ray - step))) / (2.0 * h);
            assert!((found.column(k) - slope).norm() < 1e-8, "{found}");
        }
    }

    #[test]
    fn rays_beyond_the_fold_have_no_image() {
        // 1 - 0.9 r² is 0 at r = 1.0541.
        let lens = distortion(-0.3, 0.0, 0.0, 0.0, 0.0);
        assert!(lens.distort(&Point2::new(1.05, 0.0)).is_some());
        assert_eq!(lens.distort(&Point2::new(1.06, 0.0)), None);
        // Without the fold it would be seen inside the picture.
        assert!(lens.image(&Point2::new(1.7, 0.0)).x < 0.3);
        // The farthest image is at 2/3 of that radius.
        assert!(lens.undistort(&Point2::new(0.70, 0.0)).is_some());
        assert_eq!(lens.undistort(&Point2::new(0.71, 0.0)), None);
        // The nearest ray is still in that direction.
        let ray = lens.nearest_ray(&Point2::new(0.0, -0.9));
        assert!(ray.x.abs() < 1e-9 && (-1.06..-1.0).contains(&ray.y), "{ray}");
    }

    #[test]
    fn the_fold_is_the_smallest_root_of_the_slope() {
        let slope = |c: &DistortionCoefficients, s: f64| {
            1.0 + s * (3.0 * c.k1 + s * (5.0 * c.k2 + s * 7.0 * c.k3))
        };
        let sets = [
            [-0.3, 0.0, 0.0],
            [-0.3, 0.1, 0.0],
            [0.1, -0.2, 0.0],
            [-0.4, 0.2, -0.05],
            [0.2, -0.3, 0.1],
            [0.0, 0.0, -0.1],
            [-1e-12, 1e-13, -1e-12],
        ];
        for [k1, k2, k3] in sets {
            let c = DistortionCoefficients { k1, k2, k3, ..Default::default() };
            let fold = max_r2(&c);
            let before = (0..1000).map(|k| fold * f64::from(k) / 1000.0);
            assert!(before.into_iter().all(|s| slope(&c, s) > 0.0), "{c:?}: {fold}");
            let is_last = fold == MAX_TANGENT * MAX_TANGENT;
            assert!(is_last || slope(&c, fold).abs() < 1e-9, "{c:?}: {fold}");
        }
    }

    #[test]
    fn no_coefficients_are_no_distortion() {
        assert_eq!(Distortion::new(DistortionCoefficients::default()), None);
        let array = [0.1, 0.2, 0.3, 0.4, 0.5];
        assert_eq!(DistortionCoefficients::from_array(array).to_array(), array);
    }
}
