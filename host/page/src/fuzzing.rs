//! Entrances for the fuzz targets in `tests/fuzz` to what browsers send.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};

use mio::{Poll, Token as MioToken, Waker};
use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};
use plumb_frame::camera::{Camera, Distortion, DistortionCoefficients, Intrinsics};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::operator::{OperatorReceiver, operator};

use crate::RigView;
use crate::access::{Access, Token};
use crate::calibration::{CalibrationCommand, CalibrationFeed, CalibrationState};
use crate::feed::Feed;
use crate::http::{Parsed, Request};
use crate::signal::Signal;
use crate::subject::Subject;

/// Port of the page.
const PORT: u16 = 7586;
/// Size of the calibration's picture, pixels.
const PICTURE: (usize, usize) = (64, 48);

/// The page's parsers, with a run and a calibration behind them.
pub struct Parsers {
    run: Feed,
    _operator: OperatorReceiver,
    calibration: CalibrationFeed,
    commands: Receiver<CalibrationCommand>,
    open: Access,
    closed: Access,
    _polls: [Poll; 2],
}

/// Returns a camera that looks along x, with a lens.
fn camera() -> Camera {
    let coefficients = DistortionCoefficients { k1: -0.3, k2: 0.1, p1: 0.001, p2: 0.0, k3: 0.0 };
    let intrinsics = Intrinsics {
        fx: 60.0,
        fy: 60.0,
        cx: 31.5,
        cy: 23.5,
        depth_scale: 1000.0,
        distortion: Distortion::new(coefficients),
    };
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(0.5, -0.5, 0.5, -0.5));
    let pose = Isometry3::from_parts(Vector3::new(-1.0, 0.3, 0.3).into(), turn);
    Camera::new(intrinsics, pose, 0.08)
}

/// Returns a frame of that camera with a surface in the workspace; the upper rows have no depth.
fn record(camera: &Camera) -> Option<FrameRecord> {
    let (width, height) = PICTURE;
    let colour = Image::filled(width, height, [0; 3]);
    let mut depth = Image::filled(width, height, 1400);
    depth.pixels_mut()[..20 * width].fill(0);
    let frame = RgbdFrame::new(0.0, colour, depth, camera.intrinsics).ok()?;
    Some(FrameRecord {
        frame: Some(Arc::new(frame)),
        target: Some(Point3::new(0.4, 0.4, 0.15)),
        ..FrameRecord::default()
    })
}

impl Parsers {
    /// Returns the parsers of a page of `rig`; `None` where the operating system lacks something.
    pub fn new(rig: RigView) -> Option<Self> {
        let polls = [Poll::new().ok()?, Poll::new().ok()?];
        let signal = |poll: &Poll| {
            let waker = Waker::new(poll.registry(), MioToken(0)).ok();
            waker.map(Signal::new)
        };
        let (sender, operator) = operator();
        let (camera, seen) = (camera(), signal(&polls[0])?);
        seen.set_watchers(1);
        let run = Feed::new(seen, rig.seen_by(&camera), Some(sender)).ok()?;
        run.frame(&record(&camera)?);
        let (sender, commands) = sync_channel(1);
        let names = vec!["A".to_owned(), "B".to_owned(), "C".to_owned()];
        let file = "camera.toml".to_owned();
        let calibration = CalibrationFeed::new(signal(&polls[1])?, names, file, sender).ok()?;
        let picture = Image::filled(PICTURE.0, PICTURE.1, [0; 3]);
        calibration.show(0.0, picture, CalibrationState::default());
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, PORT));
        let open = Access::new(address, None);
        let closed = Access::new(address, Some(Token::random().ok()?));
        Some(Self { run, _operator: operator, calibration, commands, open, closed, _polls: polls })
    }

    /// Reads `bytes` as the head of a request. Returns whether a page at a loopback address answers
    /// it, and whether a page with a token does; `None` where there is no complete request.
    pub fn request(&self, bytes: &[u8]) -> Option<(bool, bool)> {
        let Parsed::Complete(request, _) = Request::parse(bytes) else { return None };
        let is_allowed = |access: &Access| {
            let _cookie = access.cookie(&request);
            access.check(&request).is_ok()
        };
        Some((is_allowed(&self.open), is_allowed(&self.closed)))
    }

    /// Handles a message of a page: of a run, then of a calibration. Returns whether each took it.
    pub fn message(&self, text: &str) -> (bool, bool) {
        let taken = (self.run.take(text, 1).is_ok(), self.calibration.take(text, 1).is_ok());
        while self.commands.try_recv().is_ok() {}
        taken
    }
}

#[cfg(test)]
mod tests {
    use plumb_runtime::rig::Rig;

    use super::*;

    #[test]
    fn questions_about_the_picture_reach_the_lens_and_the_depth() {
        let parsers = Parsers::new(RigView::of(&Rig::paper().unwrap())).unwrap();
        for (v, by) in [(28, "depth"), (16, "plane")] {
            let text =
                format!(r#"{{"type":"pick","u":31,"v":{v},"x":0.4,"y":0.3,"z":0.3,"depth":true}}"#);
            match parsers.run.take(&text, 1).unwrap() {
                crate::subject::Received::Answered(answer) => {
                    assert!(answer.contains(by), "{answer}");
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
