//! Homographies: maps of a plane onto an image.

use nalgebra::{
    Isometry3, Matrix3, Point2, Rotation3, SMatrix, SVector, Translation3, UnitQuaternion,
};

/// Returns the homography that maps the first of each pair to the second, in the least-squares
/// sense of the normalised direct linear transformation (Hartley and Zisserman, algorithm 4.2).
/// `None` for fewer than four pairs and for points on a line.
pub(crate) fn fit(pairs: &[(Point2<f64>, Point2<f64>)]) -> Option<Matrix3<f64>> {
    if pairs.len() < 4 {
        return None;
    }
    let from = normalisation(pairs.iter().map(|pair| pair.0))?;
    let to = normalisation(pairs.iter().map(|pair| pair.1))?;
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (source, image) in pairs {
        let (p, q) = (apply(&from, source)?, apply(&to, image)?);
        let rows = [
            [p.x, p.y, 1.0, 0.0, 0.0, 0.0, -q.x * p.x, -q.x * p.y, -q.x],
            [0.0, 0.0, 0.0, p.x, p.y, 1.0, -q.y * p.x, -q.y * p.y, -q.y],
        ];
        for row in rows {
            let row = SVector::<f64, 9>::from(row);
            normal += row * row.transpose();
        }
    }
    let eigen = normal.symmetric_eigen();
    let h = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let h = Matrix3::from_row_slice(h.clone_owned().as_slice());
    let h = to.try_inverse()? * h * from;
    (h.iter().all(|k| k.is_finite()) && h.determinant().abs() > 0.0).then_some(h)
}

/// Returns the image of a point; `None` for a point on the line at infinity.
pub(crate) fn apply(h: &Matrix3<f64>, p: &Point2<f64>) -> Option<Point2<f64>> {
    Point2::from_homogeneous(h * p.to_homogeneous())
}

/// Returns the pose of a plane (from its axes into camera axes) whose homography onto the plane at
/// depth 1 is `h`.
pub(crate) fn pose(h: &Matrix3<f64>) -> Isometry3<f64> {
    // The plane's origin is in front of the camera: the last entry is its distance.
    let scale = 2.0 * h[(2, 2)].signum() / (h.column(0).norm() + h.column(1).norm());
    let [x, y, origin] = [0, 1, 2].map(|k| h.column(k) * scale);
    let rotation = Rotation3::from_matrix(&Matrix3::from_columns(&[x, y, x.cross(&y)]));
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Isometry3::from_parts(Translation3::from(origin), rotation)
}

/// Returns the similarity that moves the points' centroid to 0 and their mean distance from it to
/// √2; `None` if the points coincide.
fn normalisation(points: impl Iterator<Item = Point2<f64>> + Clone) -> Option<Matrix3<f64>> {
    let n = points.clone().count() as f64;
    let centre = points.clone().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / n;
    let distance = points.map(|p| (p.coords - centre).norm()).sum::<f64>() / n;
    let scale = std::f64::consts::SQRT_2 / distance;
    let shift = -scale * centre;
    scale.is_finite().then(|| Matrix3::new(scale, 0.0, shift.x, 0.0, scale, shift.y, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homography_is_recovered_from_its_points() {
        let h = Matrix3::new(300.0, 20.0, 320.0, -15.0, 280.0, 240.0, 0.2, -0.1, 1.0);
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.3, 0.7], [0.6, 0.2]];
        let pairs = points.map(|[x, y]| {
            let p = Point2::new(x, y);
            (p, apply(&h, &p).unwrap())
        });
        let found = fit(&pairs).unwrap();
        let found = found / found[(2, 2)];
        assert!((found - h).norm() < 1e-6, "{found}");
    }

    #[test]
    fn points_on_a_line_or_too_few_give_none() {
        let p = |x: f64| (Point2::new(x, 0.0), Point2::new(2.0 * x, 1.0));
        assert_eq!(fit(&[p(0.0), p(1.0), p(2.0)]), None);
        assert_eq!(fit(&[p(1.0); 5]), None);
    }
}
