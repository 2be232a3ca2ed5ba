//! The frames of each suite, kind by kind.

use plumb_sim::synthetic::SyntheticCamera;
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;

use super::backdrops;
use super::hard::{self, HardFrames};
use super::labelled::LabelledFrame;
use super::rooms::{self, Backgrounds, FrameGroup, RoomFrames, RoomKind};
use super::scene_kind::{Backdrop, KINDS, SceneKind};
use super::scenes::SceneFrames;
use super::{BoxedError, FrameSuite, VisionOptions};

/// A kind of frames of a suite.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameKind {
    pub(super) name: &'static str,
    /// Group that the report sums up; `None` in suites without groups.
    pub(super) group: Option<FrameGroup>,
    /// Largest number of its frames.
    pub(super) count: usize,
}

/// Returns the next frame of a kind; `None` after the last one.
pub(super) type NextFrame<'a> = dyn FnMut() -> Result<Option<LabelledFrame>, BoxedError> + 'a;

/// Takes a kind and its frames.
type Visit<'a> = dyn FnMut(FrameKind, &mut NextFrame) -> Result<(), BoxedError> + 'a;

/// Calls `visit` with each kind of the suite that `options` name, in their order.
///
/// # Errors
/// If the intrinsics do not fit the frames, or `visit` fails.
pub(super) fn each_kind(
    camera: &Camera,
    recorded: &[RgbdFrame],
    options: &VisionOptions,
    visit: &mut Visit,
) -> Result<(), BoxedError> {
    match options.suite {
        FrameSuite::Scenes => scenes(camera, recorded, options, visit),
        FrameSuite::Hard => hard(camera, recorded, options, visit),
        FrameSuite::Rooms => rooms(&rooms::KINDS, (camera, 0), recorded, options, visit),
        FrameSuite::Disc => {
            rooms(&rooms::DISC_KINDS, (camera, FIRST_DISC_KIND), recorded, options, visit)
        }
        FrameSuite::Pair => Ok(()),
        FrameSuite::Empty => {
            scenes(camera, recorded, options, visit)?;
            hard(camera, recorded, options, visit)
        }
    }
}

/// Visits the kinds of the suite `scenes`, or those without a ball.
fn scenes(
    camera: &Camera,
    recorded: &[RgbdFrame],
    options: &VisionOptions,
    visit: &mut Visit,
) -> Result<(), BoxedError> {
    let mut known: Vec<(Backdrop, Vec<SyntheticCamera>)> = Vec::new();
    for (number, kind) in (0..).zip(KINDS) {
        let unwanted = kind.ball && options.suite == FrameSuite::Empty;
        if unwanted || (kind.backdrop == Backdrop::Recorded && recorded.is_empty()) {
            continue;
        }
        if !known.iter().any(|(backdrop, _)| *backdrop == kind.backdrop) {
            let cameras = backdrops::cameras(kind.backdrop, camera, recorded, options)?;
            known.push((kind.backdrop, cameras));
        }
        let cameras = known.iter().find(|(backdrop, _)| *backdrop == kind.backdrop);
        let cameras = cameras.map(|(_, cameras)| cameras.clone()).unwrap_or_default();
        let mut frames = SceneFrames::new((number, kind), cameras, recorded, options);
        let count = count(&kind, options);
        visit(FrameKind { name: kind.name, group: None, count }, &mut || frames.next())?;
    }
    Ok(())
}

/// Number of balls composited into recorded frames of the suite `scenes`.
const RECORDED_BALLS: usize = 60;

/// Returns the number of frames of a kind of scene.
fn count(kind: &SceneKind, options: &VisionOptions) -> usize {
    match kind.ball {
        false => options.empty,
        true if kind.backdrop == Backdrop::Recorded => RECORDED_BALLS,
        true => options.frames,
    }
}

/// Visits the kinds of the suite `hard`, or those without a ball.
fn hard(
    camera: &Camera,
    recorded: &[RgbdFrame],
    options: &VisionOptions,
    visit: &mut Visit,
) -> Result<(), BoxedError> {
    for (number, kind) in (0..).zip(hard::CASES) {
        if kind.ball && options.suite == FrameSuite::Empty {
            continue;
        }
        let mut frames = HardFrames::new((number, kind), camera, recorded, options);
        let count = if kind.ball { options.frames } else { options.empty };
        visit(FrameKind { name: kind.name, group: None, count }, &mut || frames.next())?;
    }
    Ok(())
}

/// Number of the first kind of the suite `disc`: its random numbers are not those of `rooms`.
const FIRST_DISC_KIND: u32 = 1000;

/// Visits `kinds` of the suites `rooms` and `disc`; their numbers start at `first`.
fn rooms(
    kinds: &[RoomKind],
    (camera, first): (&Camera, u32),
    recorded: &[RgbdFrame],
    options: &VisionOptions,
    visit: &mut Visit,
) -> Result<(), BoxedError> {
    let backgrounds = Backgrounds::new(camera, recorded, options)?;
    for (number, &kind) in (first..).zip(kinds) {
        let mut frames = RoomFrames::new((number, kind), camera, &backgrounds, options);
        let count = if kind.ball { options.frames } else { options.empty };
        let group = Some(kind.group());
        visit(FrameKind { name: kind.name, group, count }, &mut || frames.next().map(Some))?;
    }
    Ok(())
}
