//! Entrances for the fuzz targets in `tests/fuzz` to what browsers send.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::mpsc::{Receiver, sync_channel};

use mio::{Poll, Token as MioToken, Waker};
use plumb_frame::image::Image;
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

impl Parsers {
    /// Returns the parsers of a page of `rig`; `None` where the operating system lacks something.
    pub fn new(rig: RigView) -> Option<Self> {
        let polls = [Poll::new().ok()?, Poll::new().ok()?];
        let signal = |poll: &Poll| {
            let waker = Waker::new(poll.registry(), MioToken(0)).ok();
            waker.map(Signal::new)
        };
        let (sender, operator) = operator();
        let run = Feed::new(signal(&polls[0])?, rig, Some(sender)).ok()?;
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
