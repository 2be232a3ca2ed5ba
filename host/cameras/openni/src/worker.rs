//! Thread that makes all calls into the library for one camera.

use std::sync::Arc;
use std::time::Instant;

use crate::device::Device;
use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::mailbox::{Event, Mailbox};
use crate::reader::{Reader, ReaderOptions};
use crate::recorder::Recorder;
use crate::settings::{DepthUnit, Opened, Settings, Target};
use crate::sys;

/// Inputs and outputs of the thread.
pub(crate) struct Worker {
    pub(crate) openni: OpenNi,
    pub(crate) target: Target,
    pub(crate) settings: Settings,
    /// Start of the clock that stamps live pictures.
    pub(crate) start: Instant,
    /// Receives the description of the open camera, or why it cannot be opened.
    pub(crate) opened: Arc<Mailbox<Result<Opened, OpenniError>>>,
    /// Receives the pictures.
    pub(crate) mailbox: Arc<Mailbox<Event>>,
}

impl Worker {
    /// Opens the camera, sends its description, and sends its pictures until it is over or the
    /// mailbox is closed.
    pub(crate) fn run(self) {
        match self.open() {
            Ok((device, recorder, opened)) => {
                self.opened.send(Ok(opened));
                let options = ReaderOptions {
                    is_recording: self.target.is_recording(),
                    start: self.start,
                    latency: self.settings.latency,
                    timeout: self.settings.timeouts.picture,
                };
                let mut reader = Reader::new(options, recorder, device);
                let over = reader.run(&self.mailbox);
                self.mailbox.send(Event::Over(over));
            }
            Err(error) => {
                self.opened.send(Err(error));
            }
        }
    }

    /// Opens the camera and starts it, with its own recording where that is asked for.
    fn open(&self) -> Result<(Device, Option<Recorder>, Opened), OpenniError> {
        let mut device = Device::open(&self.openni, &self.target, &self.settings)?;
        let recorder = match &self.settings.record {
            Some(path) => Some(Recorder::start(&device, path)?),
            None => None,
        };
        device.start()?;
        let mut notes = Vec::new();
        if !self.target.is_recording()
            && let Err(error) = device.synchronise()
        {
            notes.push(format!("{error}; they are paired by their time stamps"));
        }
        let unit = match device.depth.mode.format {
            sys::FORMAT_DEPTH_100_UM => DepthUnit::Tenth,
            _ => DepthUnit::Millimetre,
        };
        let opened = Opened {
            uri: device.uri.clone(),
            name: device.name.clone(),
            mode: device.colour.mode,
            unit,
            field_of_view: device.field_of_view(),
            notes,
        };
        Ok((device, recorder, opened))
    }
}
