//! Collects the places of the ball: typed or from options, each seen in several pictures.

use std::io::{BufRead, stdin};

use nalgebra::{Isometry3, Point3};
use plumb_calibrate::places::{BallPlace, MAX_PLACES, MIN_PLACES, mean_of};
use plumb_vision::camera::Camera;
use plumb_vision::detect::DetectorKind;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::Gaussian3;

use super::options::PlaceOptions;
use super::view::{Stage, View, last};
use crate::cli::choices;
use crate::cli::exit::{Failure, failed};
use crate::cli::numbers::typed_point;
use crate::cli::print::message;

/// Places of the ball, and a picture.
pub(super) struct Places {
    pub(super) places: Vec<BallPlace>,
    /// Picture of the ball at the last place.
    pub(super) frame: RgbdFrame,
}

/// A ball that is seen at a place.
struct Seen {
    ball: Gaussian3,
    frame: RgbdFrame,
}

/// Collects the places.
pub(super) fn collect(
    options: &PlaceOptions,
    detector: DetectorKind,
    is_quiet: bool,
    view: &mut View,
) -> Result<Places, Failure> {
    let sd = options.place_sd();
    let (mut places, mut frame) = (Vec::new(), None);
    let is_typed = options.places.is_empty();
    if is_typed {
        tell!(
            "Put the ball to a place that you can measure, and type its centre in the rig frame \
             (x y z, metres). {MIN_PLACES} places or more, not all at one height; six are better. \
             An empty line ends."
        );
    }
    let mut given = options.places.iter();
    while places.len() < MAX_PLACES {
        let number = places.len() + 1;
        let next = if is_typed { ask(number)? } else { given.next().copied() };
        let Some(place) = next else { break };
        if !is_typed && view.needs_person() && !is_quiet {
            wait(number, &place)?;
        }
        match look(&place, detector, view)? {
            Some(seen) => {
                places.push(BallPlace { known: place, known_sd: sd, seen: seen.ball });
                frame = Some(seen.frame);
            }
            None if is_typed => {
                tell!("the ball is not seen there: move it into the picture and type it again")
            }
            None => return Err(failed(format!("the ball is not seen at place {number}"))),
        }
    }
    let none = || failed(format!("no place was given: {MIN_PLACES} are needed"));
    Ok(Places { places, frame: frame.ok_or_else(none)? })
}

/// Waits until the ball is at a place.
fn wait(number: usize, place: &Point3<f64>) -> Result<(), Failure> {
    let Point3 { coords } = place;
    let (x, y, z) = (coords.x, coords.y, coords.z);
    message(format_args!("place {number}: put the ball to ({x}, {y}, {z}) m, then press Enter "));
    read_line().map(|_| ())
}

/// Asks for a place; `None` after an empty line or at the end of the input.
fn ask(number: usize) -> Result<Option<Point3<f64>>, Failure> {
    loop {
        message(format_args!("place {number} (x y z): "));
        let Some(line) = read_line()? else { return Ok(None) };
        let line = line.trim();
        if line.is_empty() {
            return Ok(None);
        }
        match typed_point(line) {
            Ok(place) => return Ok(Some(place)),
            Err(error) => tell!("a place is three numbers like 0.4 0.2 0.15: {error}"),
        }
    }
}

/// Reads a line from standard input; `None` at its end.
fn read_line() -> Result<Option<String>, Failure> {
    let mut line = String::new();
    Ok((stdin().lock().read_line(&mut line)? > 0).then_some(line))
}

/// Looks at the ball in several pictures; `None` if it is seen in less than half of them.
fn look(
    place: &Point3<f64>,
    detector: DetectorKind,
    view: &mut View,
) -> Result<Option<Seen>, Failure> {
    let frames = view.frames(&Stage::Ball(*place))?;
    // With this pose the detector's positions are in camera axes.
    let camera = Camera { pose: Isometry3::identity(), ..view.camera().clone() };
    let mut detector = choices::detector(detector, &camera);
    let mut seen = Vec::new();
    for frame in &frames {
        let found = detector.detect(frame)?;
        seen.extend(found.and_then(|observation| observation.position));
    }
    tell!("the ball is seen in {} of {} pictures", seen.len(), frames.len());
    if 2 * seen.len() < frames.len() {
        return Ok(None);
    }
    let Some(ball) = mean_of(&seen) else { return Ok(None) };
    Ok(Some(Seen { ball, frame: last(frames)? }))
}
