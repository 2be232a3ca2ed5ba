//! Points of the rig in the camera's picture, for the pages that ask.

use std::sync::Arc;

use nalgebra::Point3;
use plumb_frame::frame::RgbdFrame;

use super::views::round;
use crate::message::{FrameView, PickedView, ProjectedView, RigView};
use crate::sight::{Click, Corners, Sight, Source};

/// Answer where the camera's pose is unknown.
const NO_POSE: &str = "the page does not know where the camera is";

/// Answer before the first picture.
const NO_PICTURE: &str = "there is no picture yet";

/// What a picture means in the rig.
pub(super) struct Aim {
    /// `None` where the camera's pose is unknown.
    sight: Option<Sight>,
    workspace: Corners,
}

/// Frame with its pictures; `None` before the first one.
type Newest = Option<(FrameView, Arc<RgbdFrame>)>;

impl Aim {
    pub(super) fn of(rig: &RigView) -> Self {
        Self { sight: rig.sight, workspace: rig.workspace }
    }

    pub(super) fn sight(&self) -> Option<&Sight> {
        self.sight.as_ref()
    }

    /// Returns the point that a click into the newest picture means.
    pub(super) fn point(&self, newest: &Newest, click: &Click) -> PickedView {
        let found = match (&self.sight, newest) {
            (Some(sight), Some((seen, frame))) => {
                sight.point(frame, seen.ball.as_ref(), &self.workspace, click)
            }
            (None, _) => Err(NO_POSE.to_owned()),
            (_, None) => Err(NO_PICTURE.to_owned()),
        };
        match found {
            Ok((point, by)) => {
                let text = match by {
                    Source::Ball => "target chosen: where the ball is now",
                    Source::Depth => "target chosen by the depth: the ball touches this surface",
                    Source::Plane => "target chosen on the plane",
                };
                let point = <[f64; 3]>::from(point).map(round);
                PickedView { point: Some(point), by: Some(by), text: text.to_owned() }
            }
            Err(text) => PickedView { point: None, by: None, text },
        }
    }

    /// Returns where a point is seen in the newest picture, with the plane through it.
    pub(super) fn pixel(&self, newest: &Newest, point: &Point3<f64>) -> ProjectedView {
        let Some((sight, (_, frame))) = self.sight.as_ref().zip(newest.as_ref()) else {
            return ProjectedView { pixel: None, plane: None };
        };
        let lens = frame.intrinsics();
        let plane = sight.plane(lens, &self.workspace, point);
        ProjectedView { pixel: sight.pixel(lens, point), plane: Some(plane) }
    }
}
