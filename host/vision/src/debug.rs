//! Images that show what each stage of the detector found in a frame.
//!
//! | stage | shows |
//! |---|---|
//! | `1-proposals` | the network's odds (red), proposals with their log-odds (not judged: grey) |
//! | `2-outline` | each candidate: start (grey), refined circle (green), what each ray shows |
//! | `3-features` | each candidate: what surrounds it, ray by ray, and the features' values |
//! | `4-score` | all candidates with their scores; the ball is green |
//!
//! Candidates are numbered in the order in which they were refined.

mod canvas;

use plumb_frame::detect::{DetectError, StageImage};

use crate::detect::shape::{
    CandidateTrace, DetectionTrace, Disc, Features, RayEnd, SearchTrace, Surroundings, probability,
};
use crate::frame::RgbdFrame;
use crate::image::{Bgr, ColourImage, Image};
use crate::observation::BallObservation;
use canvas::Canvas;

/// Columns that the image is enlarged to, at least half of it.
const WIDTH: usize = 1280;
/// Candidates that have a tile.
const MAX_TILES: usize = 6;
/// Tiles in a row.
const TILES_IN_ROW: usize = 2;
/// Side of the picture in a tile, pixels.
const TILE: usize = 400;
/// Columns of the text beside it, pixels.
const PANEL: usize = 260;
/// Part of the frame in a tile, in the disc's radius on either side of its centre.
const TILE_REACH: f64 = 2.2;

const WHITE: Bgr = [255, 255, 255];
const GREY: Bgr = [160, 160, 160];
const GREEN: Bgr = [60, 230, 60];
const RED: Bgr = [60, 60, 255];
const YELLOW: Bgr = [0, 230, 255];
const CYAN: Bgr = [255, 230, 0];
const MAGENTA: Bgr = [255, 60, 255];
const ORANGE: Bgr = [0, 140, 255];

/// Draws what each stage found: one image for each stage of the last search in `trace`, and one of
/// the result.
///
/// # Errors
/// Returns an error if an image operation fails.
pub fn draw_stages(
    frame: &RgbdFrame,
    trace: &DetectionTrace,
    observation: Option<&BallObservation>,
) -> Result<Vec<StageImage>, DetectError> {
    draw(frame, trace, observation).map_err(DetectError::processing)
}

fn draw(
    frame: &RgbdFrame,
    trace: &DetectionTrace,
    observation: Option<&BallObservation>,
) -> opencv::Result<Vec<StageImage>> {
    let mut images = Vec::with_capacity(4);
    let mut add = |name, canvas: Canvas| -> opencv::Result<()> {
        images.push(StageImage { name, image: canvas.into_image()? });
        Ok(())
    };
    if let Some(search) = trace.searches.last() {
        add("1-proposals", proposals(frame, search)?)?;
        add("2-outline", tiles(frame, search, outline_tile)?)?;
        add("3-features", tiles(frame, search, features_tile)?)?;
    }
    add("4-score", score(frame, trace.searches.last(), observation)?)?;
    Ok(images)
}

/// Returns the whole frame, enlarged.
fn enlarged(colour: &ColourImage) -> opencv::Result<Canvas> {
    Canvas::new(colour, (WIDTH / colour.width()).clamp(1, 4))
}

/// Draws the network's odds and the proposals.
fn proposals(frame: &RgbdFrame, search: &SearchTrace) -> opencv::Result<Canvas> {
    let mut tinted = frame.colour().clone();
    let width = tinted.width();
    let odds = |u, v| search.odds.iter().filter_map(|map| map.at(u, v)).reduce(f32::max);
    for (i, pixel) in tinted.pixels_mut().iter_mut().enumerate() {
        let (u, v) = ((i % width) as f64, (i / width) as f64);
        let probability = odds(u, v).map_or(0.0, |odds| probability(f64::from(odds)) as f32);
        let grey = pixel.iter().map(|&c| f32::from(c)).sum::<f32>() / 6.0;
        let red = (grey + 255.0 * probability).min(255.0);
        *pixel = [grey, grey, red].map(|c| c as u8);
    }
    let mut canvas = enlarged(&tinted)?;
    let window = search.window;
    canvas.rectangle([window.left, window.top, window.width, window.height], GREY)?;
    for sphere in &search.spheres {
        canvas.disc(sphere, CYAN, 2)?;
    }
    let (all, spheres) = (search.proposals.len(), search.spheres.len());
    for proposal in &search.proposals {
        let colour = if proposal.is_judged { WHITE } else { GREY };
        canvas.disc(&proposal.disc, colour, if proposal.is_judged { 2 } else { 1 })?;
        canvas.label(&proposal.disc, &format!("{:.1}", proposal.log_odds), colour)?;
    }
    canvas.title(&format!(
        "{spheres} spheres in depth (cyan), {all} proposals, {} not judged",
        search.left_out()
    ))?;
    Ok(canvas)
}

/// Draws a tile for each candidate.
fn tiles(
    frame: &RgbdFrame,
    search: &SearchTrace,
    tile: impl Fn(&mut Canvas, &CandidateTrace) -> opencv::Result<()>,
) -> opencv::Result<Canvas> {
    let count = search.candidates.len().min(MAX_TILES);
    let rows = count.div_ceil(TILES_IN_ROW).max(1);
    let columns = count.clamp(1, TILES_IN_ROW);
    let width = columns * (PANEL + TILE);
    let mut all = Image::filled(width, rows * TILE, [0; 3]);
    for (i, candidate) in search.candidates.iter().enumerate().take(count) {
        let reach = TILE_REACH * candidate.circle.disc.radius;
        let mut canvas =
            Canvas::around(frame.colour(), &candidate.circle.disc, reach, TILE, PANEL)?;
        tile(&mut canvas, candidate)?;
        let best = if search.best == Some(i) { ", the best" } else { "" };
        canvas.title(&format!("{}: score {:.3}{best}", i + 1, candidate.score()))?;
        let drawn = canvas.into_image()?;
        let (left, top) = (i % TILES_IN_ROW * drawn.width(), i / TILES_IN_ROW * TILE);
        for (row, pixels) in drawn.rows().enumerate() {
            let start = (top + row) * width + left;
            all.pixels_mut()[start..start + pixels.len()].copy_from_slice(pixels);
        }
    }
    let mut canvas = Canvas::new(&all, 1)?;
    if count == 0 {
        canvas.title("no candidates")?;
    }
    Ok(canvas)
}

/// Draws a dot for each ray of a candidate at the end of its circle.
fn draw_rays(
    canvas: &mut Canvas,
    candidate: &CandidateTrace,
    colour: impl Fn(usize) -> Option<Bgr>,
) -> opencv::Result<()> {
    for (ray, place) in candidate.ray_places.iter().enumerate() {
        if let (Some((u, v)), Some(colour)) = (*place, colour(ray)) {
            canvas.dot(u, v, colour)?;
        }
    }
    Ok(())
}

/// Draws the refinement of a candidate.
fn outline_tile(canvas: &mut Canvas, candidate: &CandidateTrace) -> opencv::Result<()> {
    let circle = &candidate.circle;
    canvas.disc(&candidate.start, GREY, 1)?;
    canvas.disc(&circle.disc, GREEN, 1)?;
    draw_rays(canvas, candidate, |ray| match candidate.ray_ends[ray] {
        RayEnd::Edge => Some(GREEN),
        RayEnd::BallColoured => Some(RED),
        RayEnd::NoEdge => Some(YELLOW),
        RayEnd::OutsideImage => None,
    })?;
    let Disc { u, v, radius } = circle.disc;
    canvas.text(&[
        ("edge".into(), GREEN),
        ("ball's colour continues".into(), RED),
        ("no edge".into(), YELLOW),
        (format!("({u:.2}, {v:.2}), radius {radius:.2} px"), WHITE),
        (format!("{} edges, blur {:.2} px", circle.edge_count(), circle.blur), WHITE),
        (format!("rms residual {:.2} px", circle.rms_residual), WHITE),
    ])
}

/// Draws the decision about a candidate.
fn features_tile(canvas: &mut Canvas, candidate: &CandidateTrace) -> opencv::Result<()> {
    let Some(decision) = &candidate.decision else {
        return canvas.text(&[("the ball cannot have this size".into(), RED)]);
    };
    draw_rays(canvas, candidate, |ray| {
        decision.surroundings[ray].map(|surroundings| match surroundings {
            Surroundings::Free => GREEN,
            Surroundings::Behind => CYAN,
            Surroundings::Open => YELLOW,
            Surroundings::Attached => ORANGE,
            Surroundings::Continued => RED,
            Surroundings::Covered | Surroundings::CoveredAlike => MAGENTA,
        })
    })?;
    let mut lines = vec![
        ("free".to_owned(), GREEN),
        ("behind".to_owned(), CYAN),
        ("open".to_owned(), YELLOW),
        ("attached".to_owned(), ORANGE),
        ("continued".to_owned(), RED),
        ("covered".to_owned(), MAGENTA),
    ];
    let values = decision.features.iter().flat_map(feature_lines);
    lines.extend(values.map(|line| (line, WHITE)));
    lines.extend(
        decision
            .free_fit
            .iter()
            .map(|free| (format!("free fit: size {:.2}, rms {:.2}", free.size, free.rms), WHITE)),
    );
    canvas.text(&lines)
}

/// Returns the features' values as lines of text.
fn feature_lines(features: &Features) -> Vec<String> {
    match features {
        Features::Depth(depth) => {
            let curvature = depth.curvature.map_or("unknown".to_owned(), |curvature| {
                format!("{:.2} to {:.2}", curvature.least, curvature.most)
            });
            vec![
                format!("likeness {:.2}", depth.likeness),
                format!("curvature {curvature}"),
                format!("off the sphere {:.3}", depth.off_sphere),
                format!("attached {:.2}, continued {:.2}", depth.attached, depth.continued),
            ]
        }
        Features::Colour(colour) => {
            vec![format!("no depth; edges {:.2}, through {:.2}", colour.edges, colour.through)]
        }
    }
}

/// Draws all candidates with their scores, and the ball.
fn score(
    frame: &RgbdFrame,
    search: Option<&SearchTrace>,
    observation: Option<&BallObservation>,
) -> opencv::Result<Canvas> {
    let mut canvas = enlarged(frame.colour())?;
    let candidates = search.map_or(&[][..], |search| &search.candidates);
    for (i, candidate) in candidates.iter().enumerate() {
        let is_ball = observation.is_some() && search.and_then(|s| s.best) == Some(i);
        if !is_ball {
            canvas.disc(&candidate.circle.disc, YELLOW, 1)?;
            let text = format!("{}: {:.2}", i + 1, candidate.score());
            canvas.label(&candidate.circle.disc, &text, YELLOW)?;
        }
    }
    let Some(BallObservation { circle, score, position, .. }) = observation else {
        canvas.title(&format!("{} candidates, no ball", candidates.len()))?;
        return Ok(canvas);
    };
    let disc = Disc { u: circle.u, v: circle.v, radius: circle.radius };
    canvas.disc(&disc, GREEN, 2)?;
    canvas.label(&disc, &format!("{score:.2}"), GREEN)?;
    let position = position.map_or("position unknown".to_owned(), |position| {
        let [x, y, z] = position.mean.into();
        format!("position ({x:.4}, {y:.4}, {z:.4}) m")
    });
    canvas.title(&format!("ball, score {score:.3}, {position}"))?;
    Ok(canvas)
}
