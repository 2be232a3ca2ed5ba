//! The motors, chosen in the live picture on the page: points, undo, the pose that they give.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nalgebra::{Isometry3, Point2};
use plumb_calibrate::calibration::{Calibration, CalibrationError, Grade};
use plumb_calibrate::motors::{LETTERS, MotorMeasures, SeenMotor, pose_from_motors, see_motor};
use plumb_calibrate::overlay;
use plumb_page::{
    CalibrationCommand, CalibrationPage, CalibrationPageSettings, CalibrationState, Limits,
    MarkView, ResultView,
};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::ColourImage;

use super::options::MotorOptions;
use super::output::{CameraFile, Found};
use super::report::{Report, Way};
use super::view::{Stage, View};
use crate::cli::exit::{Failure, failed};

/// Time between two pictures, in which commands are awaited.
pub(super) const INTERVAL: Duration = Duration::from_millis(33);

/// Failure with a recording that is over before its first picture.
pub(super) const NO_PICTURE: &str = "the recording is over: it has no picture for the calibration";

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

/// State of the choice.
pub(super) struct Choice {
    measures: MotorMeasures,
    /// Pose in the camera file.
    old: Isometry3<f64>,
    /// Number of pictures whose depths are averaged.
    capacity: usize,
    /// The newest pictures, oldest first.
    frames: VecDeque<RgbdFrame>,
    seen: Vec<SeenMotor>,
    calibration: Option<Calibration>,
    /// Reason why the last command was refused, or why the motors give no pose.
    problem: Option<String>,
}

impl Choice {
    /// Begins without a motor. The depth of a motor is the median of the last `capacity` pictures.
    pub(super) fn new(measures: MotorMeasures, old: Isometry3<f64>, capacity: usize) -> Self {
        let (frames, seen) = (VecDeque::new(), Vec::new());
        Self { measures, old, capacity, frames, seen, calibration: None, problem: None }
    }

    /// Adds a picture; the oldest one goes.
    pub(super) fn add_frame(&mut self, frame: RgbdFrame) {
        if self.is_ready() {
            self.frames.pop_front();
        }
        self.frames.push_back(frame);
    }

    /// Returns whether there are as many pictures as are wanted.
    pub(super) fn is_ready(&self) -> bool {
        self.frames.len() == self.capacity
    }

    /// Returns the newest picture.
    pub(super) fn newest(&self) -> Option<&RgbdFrame> {
        self.frames.back()
    }

    /// Carries out a command. Returns whether the pose is accepted.
    pub(super) fn handle(&mut self, command: CalibrationCommand) -> bool {
        self.problem = None;
        match command {
            CalibrationCommand::Click(pixel) => self.problem = self.choose(pixel).err(),
            CalibrationCommand::Undo => {
                self.seen.pop();
                self.calibration = None;
            }
            CalibrationCommand::Accept if self.is_acceptable() => return true,
            CalibrationCommand::Accept => {
                let text = "there is no good or usable pose to accept: choose A, B and C";
                self.problem = Some(text.to_owned());
            }
            _ => {}
        }
        false
    }

    /// Chooses a pixel for the next motor. The third one gives the pose.
    fn choose(&mut self, pixel: Point2<f64>) -> Result<(), String> {
        let Some(&letter) = LETTERS.get(self.seen.len()) else {
            return Err("all motors are chosen: accept the pose, or undo".to_owned());
        };
        let message = |error: CalibrationError| error.to_string();
        self.seen.push(see_motor(&self.frames, letter, pixel).map_err(message)?);
        if let (Ok(seen), Some(frame)) = (self.seen[..].try_into(), self.frames.back()) {
            let found = pose_from_motors(&seen, &self.measures, frame.intrinsics());
            self.calibration = Some(found.map_err(message)?);
        }
        Ok(())
    }

    fn is_acceptable(&self) -> bool {
        self.calibration.as_ref().is_some_and(|found| found.grade() != Grade::Poor)
    }

    /// Draws the pose into a picture, if there is one.
    pub(super) fn draw(&self, frame: &RgbdFrame) -> Result<ColourImage, Failure> {
        let Some(found) = &self.calibration else { return Ok(frame.colour().clone()) };
        let outline: Vec<_> = found.samples.iter().map(|sample| sample.known).collect();
        Ok(overlay::draw(frame.colour(), frame.intrinsics(), found, &outline)?)
    }

    /// Returns the state for the page.
    pub(super) fn state(&self) -> CalibrationState {
        let mark = |(seen, letter): (&SeenMotor, char)| MarkView {
            name: letter.to_string(),
            pixel: [seen.pixel.x, seen.pixel.y],
            depth: Some(seen.depth),
        };
        let result = self.calibration.as_ref().map(|found| ResultView {
            lines: Report::new(Way::Motors, found, &self.old).lines(),
            acceptable: self.is_acceptable(),
        });
        let marks = self.seen.iter().zip(LETTERS).map(mark).collect();
        CalibrationState { marks, result, problem: self.problem.clone() }
    }

    /// Returns the accepted pose with the newest picture.
    pub(super) fn into_found(mut self) -> Option<Found> {
        let (calibration, frame) = (self.calibration?, self.frames.pop_back()?);
        let outline = calibration.samples.iter().map(|sample| sample.known).collect();
        Some(Found { way: Way::Motors, calibration, frame, outline })
    }
}
