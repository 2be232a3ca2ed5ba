//! Rigid transformation between two sets of points in closed form (Kabsch's method).

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Handedness of a transformation between two sets of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Handedness {
    /// A rotation.
    Kept,
    /// A rotation and a reflection.
    Mirrored,
}

/// Orthogonal transformation: `q = matrix * p + shift`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Orthogonal {
    matrix: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Orthogonal {
    /// Returns the image of a point.
    pub(crate) fn apply(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.matrix * p.coords + self.shift)
    }

    /// Returns the transformation of a [`Handedness::Kept`].
    pub(crate) fn isometry(&self) -> Isometry3<f64> {
        let rotation = Rotation3::from_matrix_unchecked(self.matrix);
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        Isometry3::from_parts(Translation3::from(self.shift), rotation)
    }
}

/// Returns the transformation from the first points of `pairs` to the second ones that has the
/// least sum of squares. `None` for fewer than three pairs.
pub(crate) fn fit(
    pairs: &[(Point3<f64>, Point3<f64>)],
    handedness: Handedness,
) -> Option<Orthogonal> {
    if pairs.len() < 3 {
        return None;
    }
    let from = centroid(pairs.iter().map(|pair| pair.0));
    let to = centroid(pairs.iter().map(|pair| pair.1));
    let covariance: Matrix3<f64> =
        pairs.iter().map(|(p, q)| (q - to) * (p - from).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = match handedness {
        Handedness::Kept => 1.0,
        Handedness::Mirrored => -1.0,
    };
    let mut last = Vector3::repeat(1.0);
    last[svd.singular_values.imin()] = sign * (u * v_t).determinant().signum();
    let matrix = u * Matrix3::from_diagonal(&last) * v_t;
    Some(Orthogonal { matrix, shift: to.coords - matrix * from.coords })
}

/// Returns the mean of points.
pub(crate) fn centroid(points: impl Iterator<Item = Point3<f64>> + Clone) -> Point3<f64> {
    let n = points.clone().count() as f64;
    Point3::from(points.map(|p| p.coords).sum::<Vector3<f64>>() / n)
}

/// Returns the standard deviations of points along their principal axes, the largest first, metres.
pub(crate) fn spread(points: &[Point3<f64>]) -> [f64; 3] {
    let centre = centroid(points.iter().copied());
    let scatter: Matrix3<f64> =
        points.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
    let eigenvalues = (scatter / points.len() as f64).symmetric_eigenvalues();
    let mut spread = [0, 1, 2].map(|k| eigenvalues[k].max(0.0).sqrt());
    spread.sort_by(|a, b| b.total_cmp(a));
    spread
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> [Point3<f64>; 4] {
        [[0.0, 0.0, 0.0], [0.4, 0.1, 0.0], [0.1, 0.3, 0.0], [0.1, 0.1, 0.3]].map(Point3::from)
    }

    #[test]
    fn a_transformation_is_recovered() {
        let rotation = UnitQuaternion::from_euler_angles(0.4, -1.2, 2.5);
        let pose = Isometry3::from_parts(Translation3::new(1.0, -2.0, 0.5), rotation);
        let pairs = tetrahedron().map(|p| (p, pose * p));
        let found = fit(&pairs, Handedness::Kept).unwrap().isometry();
        assert!((found.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-9);
        // Three points determine a rotation too.
        let found = fit(&pairs[..3], Handedness::Kept).unwrap().isometry();
        assert!((found.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-9);
    }

    #[test]
    fn a_reflection_is_recovered_only_as_one() {
        let mirror = |p: Point3<f64>| Point3::new(p.y, p.x, p.z);
        let pairs = tetrahedron().map(|p| (p, mirror(p)));
        let worst = |handedness| {
            let map = fit(&pairs, handedness).unwrap();
            pairs.iter().map(|(p, q)| (map.apply(p) - q).norm()).fold(0.0, f64::max)
        };
        assert!(worst(Handedness::Mirrored) < 1e-12);
        assert!(worst(Handedness::Kept) > 0.05);
    }

    #[test]
    fn the_spread_of_points_in_a_plane_has_a_zero() {
        let [a, b, c, _] = tetrahedron();
        let [first, second, third] = spread(&[a, b, c]);
        assert!(first > second && second > 0.05 && third < 1e-9, "{first} {second} {third}");
    }
}
