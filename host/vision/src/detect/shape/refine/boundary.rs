//! What surrounds a disc, ray by ray.

use super::super::radial_scan::RadialScan;
use super::super::ray_colours::RAYS;
use super::super::view::FrameView;
use super::radial_profile::{Outline, RayEnd};

/// What surrounds a disc at the end of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Surroundings {
    /// The ball ends here: the likeness drops, and what is there is little behind it or has no
    /// depth.
    Free,
    /// The ball ends here: what is there is behind it, with an edge or without.
    Behind,
    /// No edge, and no depth or little difference of depth.
    Open,
    /// An object as near as the ball's surface: a print on a box has the box around it.
    Attached,
    /// An object of the ball's colour as near as its surface or nearer: a can's lower half.
    Continued,
    /// A nearer object that hides the edge.
    Covered,
    /// The same, of the ball's colour beside the disc.
    CoveredAlike,
}

/// What surrounds a disc, ray by ray.
pub(in super::super) struct Boundary {
    /// `None` outside the image.
    rays: [Option<Surroundings>; RAYS],
}

impl Boundary {
    /// Reads what surrounds a ball with `outline` whose centre has depth `z`, metres.
    pub(in super::super) fn new(view: &FrameView, outline: &Outline, z: f64) -> Self {
        let scan = RadialScan::new(&view.colour, &outline.disc);
        let visible = |ray: usize| outline.ends[ray] != RayEnd::OutsideImage;
        let rays = std::array::from_fn(|ray| {
            visible(ray).then(|| surroundings(view, outline, &scan, ray, z))
        });
        Self { rays }
    }

    /// Returns what each ray shows; `None` outside the image.
    pub(in super::super) fn rays(&self) -> &[Option<Surroundings>; RAYS] {
        &self.rays
    }

    /// Returns the number of rays within the image, but a quarter of all at least: the divisor of
    /// parts, so that a few rays of a sliver do not count as much as a ball.
    pub(in super::super) fn visible(&self) -> f64 {
        self.rays.iter().flatten().count().max(RAYS / 4) as f64
    }

    /// Returns the part of the visible rays that show `surroundings`.
    pub(in super::super) fn part(&self, surroundings: Surroundings) -> f64 {
        let count = self.rays.iter().filter(|&&ray| ray == Some(surroundings)).count();
        count as f64 / self.visible()
    }

    /// Returns the part of the visible rays on which a nearer object hides the edge.
    pub(in super::super) fn covered(&self) -> f64 {
        self.part(Surroundings::Covered) + self.part(Surroundings::CoveredAlike)
    }

    /// Returns the part of the visible rays on which depth shows an object of the ball's colour
    /// beside the disc or in front of its edge.
    pub(in super::super) fn continued(&self) -> f64 {
        self.part(Surroundings::Continued) + self.part(Surroundings::CoveredAlike)
    }

    /// Returns the part of the visible rays on which neither colour nor depth shows an end.
    pub(in super::super) fn endless(&self, outline: &Outline) -> f64 {
        let rays = self.rays.iter().zip(outline.ends);
        let endless = rays
            .filter(|&(&ray, end)| ray == Some(Surroundings::Open) && end == RayEnd::BallColoured);
        endless.count() as f64 / self.visible()
    }

    /// Returns the rays whose edges belong to the ball as far as depth shows.
    pub(in super::super) fn trusted(&self) -> [bool; RAYS] {
        use Surroundings::{Attached, Continued, Covered, CoveredAlike};
        self.rays.map(|ray| !matches!(ray, Some(Covered | CoveredAlike | Attached | Continued)))
    }
}

/// Reads what surrounds the disc at the end of a ray.
fn surroundings(
    view: &FrameView,
    outline: &Outline,
    scan: &RadialScan,
    ray: usize,
    z: f64,
) -> Surroundings {
    let (parameters, ball) = (&view.parameters.boundary, view.ball_radius);
    let depth_at = |pixel: Option<(f64, f64)>| pixel.and_then(|(u, v)| view.depth.at(u, v));
    let radius = outline.disc.radius;
    let pixel = scan.at(ray, parameters.outside.at(radius));
    let is_alike = pixel.is_some_and(|(u, v)| view.colour.likeness(u, v) > parameters.same_colour);
    let covered = if is_alike { Surroundings::CoveredAlike } else { Surroundings::Covered };
    let attached = if is_alike { Surroundings::Continued } else { Surroundings::Attached };
    let covers = z - parameters.covers * ball;
    // A post may end before the place beside the disc.
    if depth_at(scan.at(ray, radius)).is_some_and(|depth| depth <= covers) {
        return covered;
    }
    let end = outline.ends[ray];
    match depth_at(pixel) {
        Some(depth) if depth <= z - parameters.covers_any_colour * ball => covered,
        Some(depth) if depth <= z && end == RayEnd::BallColoured => Surroundings::Continued,
        Some(depth) if depth <= covers => covered,
        Some(depth) if depth <= z + parameters.attached_behind * ball => attached,
        Some(depth) if depth > z + parameters.behind * ball => Surroundings::Behind,
        _ if end == RayEnd::Edge => Surroundings::Free,
        _ => Surroundings::Open,
    }
}
