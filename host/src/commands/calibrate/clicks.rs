//! The motors, chosen in the live picture on the page.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nalgebra::Isometry3;
use plumb_calibrate::motors::{LETTERS, MotorMeasures};
use plumb_page::{CalibrationCommand, CalibrationPage, CalibrationPageSettings, Limits};

use super::choice::Choice;
use super::found::Found;
use super::options::MotorOptions;
use super::output::CameraFile;
use super::view::{Stage, View};
use crate::cli::exit::{Failure, failed};

/// Time between two pictures, in which commands are awaited.
const INTERVAL: Duration = Duration::from_millis(33);

/// Failure with a recording that is over before its first picture.
const NO_PICTURE: &str = "the recording is over: it has no picture for the calibration";

/// Page of a calibration, and what the user measured on the rig.
pub(super) struct Clicks {
    page: CalibrationPage,
    measures: MotorMeasures,
}

impl Clicks {
    /// Starts the page, if there is to be one, and prints its address.
    pub(super) fn start(
        options: &MotorOptions,
        file: &CameraFile,
    ) -> Result<Option<Self>, Failure> {
        if !options.page {
            return Ok(None);
        }
        let address = options.address.page_address;
        let measures = options.measures()?;
        let page = CalibrationPage::start(CalibrationPageSettings {
            address,
            names: LETTERS.map(String::from).to_vec(),
            file: file.path.display().to_string(),
            limits: Limits::DEFAULT,
        })?;
        tell!("page: {} (choose the motors there; nothing moves)", page.address());
        Ok(Some(Self { page, measures }))
    }

    /// Shows pictures until a person accepts a pose. Returns `None` if the person ends without one,
    /// or `interrupted` is set. `old` is the pose in the camera file.
    pub(super) fn collect(
        &self,
        view: &mut View,
        old: &Isometry3<f64>,
        interrupted: &AtomicBool,
    ) -> Result<Option<Found>, Failure> {
        let mut choice = Choice::new(self.measures, *old, view.count());
        let mut is_over = false;
        while !interrupted.load(Ordering::Relaxed) {
            if !is_over {
                match view.next_picture(&Stage::Motors)? {
                    Some(frame) => choice.add_frame(frame),
                    None if choice.newest().is_none() => return Err(failed(NO_PICTURE)),
                    None => is_over = true,
                }
            }
            self.show(&choice)?;
            // Commands wait for the first pictures.
            if !(is_over || choice.is_ready()) {
                continue;
            }
            match self.page.command(INTERVAL) {
                Some(CalibrationCommand::Quit) => return Ok(None),
                Some(command) if choice.handle(command) => return Ok(choice.into_found()),
                _ => {}
            }
        }
        Ok(None)
    }

    /// Tells the page how the calibration ended.
    pub(super) fn end(self, text: &str) {
        self.page.end(text);
    }

    fn show(&self, choice: &Choice) -> Result<(), Failure> {
        if let Some(frame) = choice.newest() {
            self.page.show(frame.time(), choice.draw(frame)?, choice.state());
        }
        Ok(())
    }
}
