//! Parameters of the stage "propose".

use super::refine::Tolerance;

/// Parameters of the blob detector, which works on the downsampled likeness map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlobParameters {
    /// Factor from one radius to the next.
    pub scale_step: f64,
    /// Smallest radius, downsampled pixels.
    pub min_radius: f64,
    /// Half size of the square within the disc, in the radius.
    pub inner_square: f64,
    /// Half size of the square around the disc, in the radius.
    pub disc_square: f64,
    /// Half size of the square that ends the surroundings, in the radius.
    pub outer_square: f64,
    /// Number of samples of the response in a radius: larger discs are searched in larger strides.
    pub strides_per_radius: f64,
    /// Least difference of mean likeness between the inside and the surroundings, 0 to 1; smaller
    /// ones are noise.
    pub min_difference: f32,
    /// Added to the sum of both likenesses that the difference is divided by, so that dim balls
    /// count as much as bright ones and noise does not.
    pub normalisation_offset: f32,
}

impl BlobParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        scale_step: 1.4,
        min_radius: 1.5,
        inner_square: 0.62,
        disc_square: 1.15,
        outer_square: 1.8,
        strides_per_radius: 3.0,
        min_difference: 0.02,
        normalisation_offset: 0.1,
    };
}

/// Parameters that turn blobs into seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeedParameters {
    /// Largest factor between a blob's radius and the ball's at the blob's depth: covers the steps
    /// between scales and partly covered balls.
    pub max_size_factor: f64,
    /// Largest number of seeds whose depth is known.
    pub max_with_depth: usize,
    /// Largest number of seeds without depth.
    pub max_without_depth: usize,
    /// Largest number of blobs that are screened.
    pub max_screened: usize,
    /// Distance at which the surroundings of a blob are read, in the ball's radius. A blob need
    /// not be centred on the ball.
    pub surroundings: f64,
    /// Number of places around a blob whose depth is read.
    pub surrounding_places: u32,
    /// Largest number of those places that may be as near as the blob.
    pub max_attached: usize,
    /// Spacing of the nine pixels that a blob's depth is read at, in its radius.
    pub depth_spacing: f64,
    /// Least number of those pixels with depth.
    pub min_depths: usize,
    /// Seeds whose centres are nearer than this are one, in the smaller radius.
    pub same_centre: f64,
    /// Seeds whose radii differ by less than this factor are one.
    pub same_radius_factor: f64,
}

impl SeedParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        max_size_factor: 2.0,
        max_with_depth: 3,
        max_without_depth: 2,
        max_screened: 10,
        surroundings: 1.7,
        surrounding_places: 16,
        max_attached: 8,
        depth_spacing: 0.4,
        min_depths: 4,
        same_centre: 0.4,
        same_radius_factor: 1.5,
    };
}

/// Parameters of the clusters of coloured pixels with depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusterParameters {
    /// Least likeness of a coloured pixel, 0 to 1.
    pub min_likeness: f32,
    /// Least likeness of a neighbour on the same object, in the pixel's likeness.
    pub same_object: f32,
    /// Distance at which a ball must have ended.
    pub beyond: Tolerance,
    /// Least number of the eight directions in which it must have ended.
    pub min_ends: usize,
    /// Distance at which the object must still be there, in the ball's radius.
    pub within: f64,
    /// Least number of the four directions in which it must still be there.
    pub min_within: usize,
    /// Radius from which on only every fourth pixel is read, pixels.
    pub large_radius: f64,
    /// Smallest radius of a ball, pixels.
    pub min_radius: f64,
    /// Largest radius of a ball, pixels.
    pub max_radius: f64,
    /// Largest number of clusters that a sphere is fitted to.
    pub max_clusters: usize,
}

impl ClusterParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        min_likeness: 0.14,
        same_object: 0.4,
        beyond: Tolerance { relative: 1.5, pixels: 2.0 },
        min_ends: 6,
        within: 0.45,
        min_within: 2,
        large_radius: 14.0,
        min_radius: 2.0,
        max_radius: 400.0,
        max_clusters: 14,
    };
}

/// Parameters of the fit of a sphere of the ball's radius to depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereFitParameters {
    /// Number of depth pixels that are read along the sphere's diameter.
    pub grid: f64,
    /// Radius within which depth is read, in the ball's radius in the image.
    pub reach: f64,
    /// Largest distance in depth from the centre of a pixel that is read, in the ball's radius.
    pub depth_reach: f64,
    /// Distance of the first centre behind the surface, in the ball's radius.
    pub first_depth: f64,
    /// Cut-off of Tukey's biweight in each step, in the ball's radius.
    pub cutoffs: [f64; 5],
    /// Step in which the pixels are read again around the new centre.
    pub reread_step: usize,
    /// Largest move of the centre in a step, in the ball's radius.
    pub max_move: f64,
    /// Least number of pixels on the sphere.
    pub min_pixels: usize,
    /// Number of directions in which the end of the sphere is checked.
    pub end_directions: u32,
    /// Depth in front of the centre from which on a neighbour is another object, in the ball's
    /// radius.
    pub in_front: f64,
    /// Least quality (part of the disc on the sphere times part of the directions in which it
    /// ends), 0 to 1.
    pub min_quality: f64,
}

impl SphereFitParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        grid: 10.0,
        reach: 1.15,
        depth_reach: 1.6,
        first_depth: 0.8,
        cutoffs: [1.0, 0.7, 0.5, 0.35, 0.3],
        reread_step: 2,
        max_move: 0.7,
        min_pixels: 6,
        end_directions: 16,
        in_front: 2.5,
        min_quality: 0.12,
    };
}
