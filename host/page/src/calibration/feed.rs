//! Memory between a calibration and its page: the newest picture and the state.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};

use nalgebra::Point2;
use plumb_frame::image::ColourImage;
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::record::observation;

use super::message::{CalibrationCommand, CalibrationState, FromPage, ToPage};
use crate::assets::{Asset, CALIBRATION_ASSETS};
use crate::message::{FrameView, VERSION};
use crate::shared::Shared;
use crate::signal::Signal;
use crate::subject::{ClientId, Cursor, Picture, Received, Subject, not_understood};

/// What a calibration hands to the page's thread.
pub(crate) struct CalibrationFeed {
    shared: Shared<News>,
    /// First message to every page.
    hello: String,
    commands: SyncSender<CalibrationCommand>,
}

#[derive(Default)]
struct News {
    picture: Option<(FrameView, Arc<ColourImage>)>,
    state: CalibrationState,
    ended: Option<String>,
}

impl CalibrationFeed {
    pub(crate) fn new(
        signal: Signal,
        names: Vec<String>,
        file: String,
        commands: SyncSender<CalibrationCommand>,
    ) -> serde_json::Result<Self> {
        let hello =
            ToPage::Hello { version: VERSION, subject: "calibration", names: &names, file: &file };
        let hello = serde_json::to_string(&hello)?;
        Ok(Self { shared: Shared::new(signal), hello, commands })
    }

    /// Takes a picture and the state.
    pub(crate) fn show(&self, time: f64, picture: ColourImage, state: CalibrationState) {
        let mut news = self.shared.lock();
        let number = self.shared.version();
        let record = observation(&FrameRecord { number, time, ..FrameRecord::default() });
        let frame = FrameView { number, ball: None, record, target_px: None };
        let old = news.picture.replace((frame, Arc::new(picture)));
        news.state = state;
        self.shared.publish(news);
        drop(old);
    }

    /// Takes the end of the calibration.
    pub(super) fn end(&self, text: &str) {
        let mut news = self.shared.lock();
        news.ended = Some(text.to_owned());
        self.shared.publish(news);
    }

    /// Returns the command for a pixel, if it is inside the picture.
    fn click(&self, u: f64, v: f64) -> Result<CalibrationCommand, String> {
        let news = self.shared.lock();
        let Some((_, image)) = &news.picture else { return Err("no picture yet".to_owned()) };
        let (width, height) = (image.width(), image.height());
        let is_inside = |pixel: f64, size: usize| pixel >= -0.5 && pixel < size as f64 - 0.5;
        if is_inside(u, width) && is_inside(v, height) {
            Ok(CalibrationCommand::Click(Point2::new(u, v)))
        } else {
            Err(format!("this pixel is outside the picture of {width}x{height} pixels"))
        }
    }
}

impl Subject for CalibrationFeed {
    fn assets(&self) -> &'static [Asset] {
        CALIBRATION_ASSETS
    }

    fn hello(&self) -> &str {
        &self.hello
    }

    fn signal(&self) -> &Signal {
        self.shared.signal()
    }

    fn version(&self) -> u64 {
        self.shared.version()
    }

    fn update(
        &self,
        number: u64,
        picture: Option<FrameView>,
        _cursor: &mut Cursor,
    ) -> serde_json::Result<String> {
        let news = self.shared.lock();
        let (state, ended) = (&news.state, news.ended.as_deref());
        serde_json::to_string(&ToPage::Update { number, picture, state, ended })
    }

    fn picture(&self) -> Option<(FrameView, Picture)> {
        let news = self.shared.lock();
        let (frame, image) = news.picture.as_ref()?;
        Some((frame.clone(), Picture::Drawn(Arc::clone(image))))
    }

    fn take(&self, text: &str, _client: ClientId) -> Result<Received, String> {
        let command = match serde_json::from_str(text).map_err(|e| not_understood(&e))? {
            FromPage::Seen { update } => return Ok(Received::Seen(update)),
            FromPage::Click { u, v } => self.click(u, v)?,
            FromPage::Undo {} => CalibrationCommand::Undo,
            FromPage::Accept {} => CalibrationCommand::Accept,
            FromPage::Quit {} => CalibrationCommand::Quit,
        };
        match self.commands.try_send(command) {
            Ok(()) => Ok(Received::Command),
            Err(TrySendError::Full(_)) => Err("the program is busy: try again".to_owned()),
            Err(TrySendError::Disconnected(_)) => Err("the calibration has ended".to_owned()),
        }
    }

    /// Nothing of a calibration ends with a page: nothing moves.
    fn release_absent(&self, _is_present: &dyn Fn(ClientId) -> bool) {}
}
