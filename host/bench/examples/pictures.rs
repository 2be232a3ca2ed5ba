//! Writes the pictures of a suite and the discs that the detector `ball` looks at in them, from
//! which `scripts/detector` makes patches for the judging networks.
//!
//! Usage:
//! `cargo run --release -p plumb-bench --example pictures SUITE SEED FRAMES EMPTY FOLDER...`
//!
//! The arguments are those of the example `candidates`. Each frame is a line of JSON, then the
//! bytes of colour (blue, green, red) and of depth (two bytes, the lower one first), row by row.
//! The line has the `kind` of the frame, the size of the picture (`width`, `height`), the lens
//! (`focal` length and `middle`, pixels), the units of `depth_scale` in a metre (0 without depth),
//! the ball's radius (`ball_radius`, metres) and hue (`hue`, degrees), and the discs: the `ball` in
//! the picture or null, the `proposals`, and the `circles` (spheres in depth, and where the fits of
//! circles start and end). A disc is a column, a row and a radius, pixels.

mod common;

use std::io::{self, BufWriter, Write};

use common::Suite;
use plumb_bench::vision::{LabelledFrame, each_frame, suite_camera};
use plumb_frame::source::BoxedError;
use plumb_vision::camera::Camera;
use plumb_vision::detect::ball::ShapeDetector;
use plumb_vision::detect::shape::{Disc, SearchTrace};
use serde_json::json;

fn main() -> Result<(), BoxedError> {
    let Suite { camera, recorded, options, detector } = Suite::from_arguments()?;
    let seen = suite_camera(options.suite, &camera);
    let mut out = BufWriter::new(io::stdout().lock());
    let mut failed = None;
    each_frame(&camera, &recorded, &options, &mut |kind, labelled| {
        failed = failed.take().or(write(&mut out, kind, &seen, detector.clone(), labelled).err());
    })?;
    out.flush()?;
    failed.map_or(Ok(()), |error| Err(error.into()))
}

/// Writes a frame of this kind that the camera `seen` shows.
fn write(
    out: &mut impl Write,
    kind: &str,
    seen: &Camera,
    mut detector: ShapeDetector,
    LabelledFrame { frame, ball }: &LabelledFrame,
) -> io::Result<()> {
    let (_, trace) = detector.detect_traced(frame);
    let proposals = trace.searches.iter().flat_map(|search| &search.proposals);
    let proposals: Vec<[f64; 3]> = proposals.map(|proposal| numbers(proposal.disc)).collect();
    let circles: Vec<[f64; 3]> = trace.searches.iter().flat_map(circles).map(numbers).collect();
    let (colour, lens) = (frame.colour(), frame.intrinsics());
    let header = json!({
        "kind": kind,
        "width": colour.width(),
        "height": colour.height(),
        "focal": lens.fx,
        "middle": [lens.cx, lens.cy],
        "depth_scale": lens.depth_scale,
        "ball_radius": seen.ball_diameter / 2.0,
        "hue": seen.ball_hue,
        "ball": ball.as_ref().map(|ball| [ball.u, ball.v, ball.radius]),
        "proposals": proposals,
        "circles": circles,
    });
    writeln!(out, "{header}")?;
    out.write_all(colour.channels())?;
    let depth = frame.depth().pixels().iter().flat_map(|raw| raw.to_le_bytes());
    out.write_all(&depth.collect::<Vec<u8>>())
}

/// Returns the discs of a search that are not proposals.
fn circles(search: &SearchTrace) -> impl Iterator<Item = Disc> {
    let circles = search.candidates.iter().flat_map(|known| [known.start, known.circle.disc]);
    search.spheres.iter().copied().chain(circles)
}

/// Returns column, row and radius.
fn numbers(disc: Disc) -> [f64; 3] {
    [disc.u, disc.v, disc.radius]
}
