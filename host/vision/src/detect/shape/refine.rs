//! Stage 3, refine: the circle of a sphere or of a proposal, to a fraction of a pixel.
//!
//! [`radial_profile`] reads where the ball's colour ends along rays. [`ray_edges`] finds the edge
//! on each ray, and [`sub_pixel_edge`] fits a circle to those that [`boundary`] trusts. How wide an
//! edge may be follows from its [`blur`].

mod blur;
mod boundary;
mod radial_profile;
mod ray_edges;
mod sub_pixel_edge;

use std::array;

use nalgebra::Matrix3;

use super::radial_scan::RadialScan;
use super::ray_colours::RAYS;
use super::view::{Disc, FrameView};

pub(super) use boundary::Boundary;
pub use boundary::Surroundings;
pub(super) use radial_profile::Outline;
pub use radial_profile::RayEnd;
pub(super) use ray_edges::read_edges;
pub use sub_pixel_edge::RefinedCircle;
pub(super) use sub_pixel_edge::fit_edges;

/// Distances, in the radius, at which a ray must be in the image to end in it: the centre of the
/// disc may be outside.
const END_PLACES: [f64; 3] = [0.8, 1.0, 1.3];

/// A refined circle and its radial profile.
pub(super) struct Candidate {
    pub(super) circle: RefinedCircle,
    /// Depth of the ball's centre, metres; `None` if too little of the disc agrees on it.
    pub(super) depth: Option<f64>,
    pub(super) outline: Outline,
    /// Column and row at which each ray ends on the circle; `None` behind the camera.
    pub(super) ray_places: [Option<(f64, f64)>; RAYS],
    /// Whether the circle must not move far.
    pub(super) locked: bool,
}

/// Refines the disc at `start`. A `locked` start must not move far.
pub(super) fn refine(view: &FrameView, start: &Disc, locked: bool) -> Candidate {
    let parameters = &view.parameters.refine;
    let mut circle = fit_once(view, start, locked);
    // The boundary and the depth were read about the start: repeat if that was wrong.
    let has_moved = circle.disc.distance(start) > parameters.repeat_move * start.radius;
    let mut depth = view.centre_depth(&circle.disc);
    let other_size = depth
        .map(|z| view.radius_at(z))
        .filter(|radius| (radius / circle.disc.radius - 1.0).abs() > parameters.repeat_resize);
    if has_moved || other_size.is_some() {
        let radius = other_size.unwrap_or(circle.disc.radius);
        circle = fit_once(view, &Disc { radius, ..circle.disc }, locked);
        depth = view.centre_depth(&circle.disc);
    }
    let mut outline = Outline::new(view, circle.disc);
    let scan = RadialScan::new(&view.colour, &circle.disc);
    for (ray, end) in outline.ends.iter_mut().enumerate() {
        if circle.edges[ray] {
            *end = RayEnd::Edge;
        } else if *end == RayEnd::OutsideImage && ends_in_image(view, &scan, ray, &circle.disc) {
            *end = RayEnd::NoEdge;
        }
    }
    let ray_places = array::from_fn(|ray| scan.at(ray, circle.disc.radius));
    Candidate { circle, depth, outline, ray_places, locked }
}

/// Fits the disc at `start` to its edges, of the size that depth gives. Edges of objects that cover
/// the disc or are attached to it are left out as far as depth shows them. Returns `start` if there
/// are too few edges.
fn fit_once(view: &FrameView, start: &Disc, locked: bool) -> RefinedCircle {
    let parameters = &view.parameters.refine;
    let depth = view.centre_depth(start);
    let radius = depth.map(|z| view.radius_at(z));
    let boundary = depth.map(|z| Boundary::new(view, &Outline::new(view, *start), z));
    let trusted = boundary.map_or([true; RAYS], |boundary| boundary.trusted());
    let is_near = |circle: &RefinedCircle| {
        !locked || circle.disc.distance(start) < parameters.locked_move.at(start.radius)
    };
    let fitted = fit_edges(view, start, radius, &trusted, locked).filter(is_near);
    fitted.unwrap_or_else(|| {
        let error = parameters.unrefined_error * start.radius;
        RefinedCircle::unrefined(*start, Matrix3::identity() * error.powi(2))
    })
}

/// Checks whether a ray enters the image before it ends, and ends in it.
fn ends_in_image(view: &FrameView, scan: &RadialScan, ray: usize, disc: &Disc) -> bool {
    END_PLACES.iter().all(|&place| {
        let pixel = scan.at(ray, place * disc.radius);
        pixel.is_some_and(|(u, v)| view.colour.at(u, v).is_some())
    })
}
