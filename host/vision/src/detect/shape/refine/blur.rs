//! The blur about each ray: medians of that of the edges near it.

use std::array;

use multiversion::multiversion;

use super::super::ray_colours::RAYS;
use super::ray_edges::Edges;

/// Rays to either side of a ray, and of its opposite, whose edges give its blur.
const NEIGHBOURS: usize = 2;
/// Number of those rays on one side of the disc.
const SIDE: usize = 2 * NEIGHBOURS + 1;

/// The blur about each ray, pixels; `None` where too few edges are near.
pub(super) type Blurs = [Option<f64>; RAYS];

/// Returns the median blur of the edges about each ray.
pub(super) fn side_blurs(edges: &Edges) -> Blurs {
    median_blurs::<SIDE>(edges, NEIGHBOURS + 1)
}

/// Returns the median blur of the edges about each ray and about its opposite.
pub(super) fn blurs_about(edges: &Edges) -> Blurs {
    median_blurs::<{ 2 * SIDE }>(edges, NEIGHBOURS)
}

/// Returns the median blur of the edges about each ray, of which at least `least` are known. The
/// first half of more than [`SIDE`] edges is about the ray, and the second one about its opposite.
fn median_blurs<const N: usize>(edges: &Edges, least: usize) -> Blurs {
    let known = edges.map(|edge| edge.map_or(f64::INFINITY, |edge| edge.blur));
    // In each row the neighbours of all rays in one place.
    let mut rows: [[f64; RAYS]; N] = array::from_fn(|k| {
        let mut row = known;
        row.rotate_left((RAYS - NEIGHBOURS + k % SIDE + k / SIDE * (RAYS / 2)) % RAYS);
        row
    });
    sort_columns(&mut rows);
    array::from_fn(|ray| {
        let count = rows.iter().filter(|row| row[ray] < f64::INFINITY).count();
        (count >= least).then(|| rows[count / 2][ray])
    })
}

/// Sorts the numbers of each column, the smallest first, by exchanges of neighbours (odd-even
/// sort): the same ones in all columns, so that the compiler computes many columns at once.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn sort_columns(rows: &mut [[f64; RAYS]]) {
    for pass in 0..rows.len() {
        for [above, below] in rows[pass % 2..].as_chunks_mut::<2>().0 {
            for (a, b) in above.iter_mut().zip(below) {
                (*a, *b) = if *b < *a { (*b, *a) } else { (*a, *b) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ray_edges::Edge;
    use super::*;

    /// Returns the median of the blurs of the edges on `rays`, of which `least` must be known.
    fn median(edges: &Edges, rays: impl Iterator<Item = usize>, least: usize) -> Option<f64> {
        let mut blurs: Vec<f64> =
            rays.filter_map(|ray| edges[ray % RAYS]).map(|e| e.blur).collect();
        blurs.sort_by(f64::total_cmp);
        (blurs.len() >= least).then(|| blurs[blurs.len() / 2])
    }

    #[test]
    fn the_blur_about_a_ray_is_the_median_of_its_neighbours() {
        // Few edges, most of them, and all.
        for known in [3, 8, 10] {
            let edges: Edges = array::from_fn(|ray| {
                let blur = (ray * 17 % 23) as f64 / 10.0;
                (ray * 7 % 10 < known).then_some(Edge { residual: 0.0, weight: 1.0, blur })
            });
            let (sides, abouts) = (side_blurs(&edges), blurs_about(&edges));
            for ray in 0..RAYS {
                let side = || ray + RAYS - NEIGHBOURS..=ray + RAYS + NEIGHBOURS;
                assert_eq!(sides[ray], median(&edges, side(), NEIGHBOURS + 1), "{known}, {ray}");
                let both = side().chain(side().map(|ray| ray + RAYS / 2));
                assert_eq!(abouts[ray], median(&edges, both, NEIGHBOURS), "{known}, {ray}");
            }
        }
    }
}
