//! The places of two motors in the picture, for a rig with `[plane]`: nothing has metres there.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Point2;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::{MAX_BYTES, TomlFileError};
use plumb_config::toml_text::TomlText;
use plumb_page::{
    CalibrationCommand, CalibrationPage, CalibrationPageSettings, CalibrationState, Limits,
    MarkView, ResultView,
};
use plumb_runtime::rig::Rig;
use plumb_vision::frame::RgbdFrame;
use serde::Serialize;

use super::clicks::{INTERVAL, NO_PICTURE};
use super::options::MotorOptions;
use super::output;
use super::view::{self, Stage, View};
use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::interrupt::interrupt_flag;
use crate::cli::old_file::{OldFile, check_writable};

/// Names of the motors, in the order of their pixels.
const NAMES: [&str; 2] = ["A", "B"];

/// Least distance of the motors, pixels.
const LEAST_PX: f64 = 20.0;

/// The rig file, which gets the pixels.
struct RigFile {
    path: PathBuf,
    text: String,
}

/// Line of JSON.
#[derive(Serialize)]
struct Report {
    /// Column and row of each motor, pixels.
    motors: Vec<[f64; 2]>,
    written: bool,
}

/// Prepares the choice of the motors of the rig file `path`: by `options`, on the page, or neither,
/// which keeps a picture.
pub(super) fn prepare(
    options: MotorOptions,
    path: PathBuf,
    rig: Rig,
    open: impl FnOnce() -> Result<View, Failure>,
    (is_agreed, is_json): (bool, bool),
) -> Result<Work, Failure> {
    options.check_planar()?;
    check_writable(&path)?;
    let text = read_text(&path, MAX_BYTES).map_err(TomlFileError::from)?;
    let file = RigFile { path, text };
    if !options.pixels.is_empty() {
        let motors: Vec<_> = options.pixels.iter().map(|pixel| [pixel.x, pixel.y]).collect();
        check(&motors).map_err(failed)?;
        return Ok(Box::new(move || file.write(motors, is_agreed, is_json)));
    }
    let page = match options.page {
        true => Some(CalibrationPage::start(CalibrationPageSettings {
            address: options.address.page_address,
            names: NAMES.map(String::from).to_vec(),
            file: file.path.display().to_string(),
            limits: Limits::DEFAULT,
        })?),
        false => None,
    };
    let mut view = open()?;
    let Some(page) = page else {
        return Ok(Box::new(move || keep_picture(&mut view, &rig)));
    };
    tell!("page: {} (choose the motors there; nothing moves)", page.address());
    Ok(Box::new(move || {
        let Some(motors) = choose(&page, &mut view, &*interrupt_flag(false)?)? else {
            page.end("Nothing is written.");
            return Err(failed("ended without the motors: nothing is written"));
        };
        let written = file.write(motors, true, is_json);
        page.end(&match &written {
            Ok(_) => format!("The motors are written into {}.", file.path.display()),
            Err(failure) => format!("Nothing is written: {}", failure.message()),
        });
        written
    }))
}

/// Keeps the picture in which the pixels are read.
fn keep_picture(view: &mut View, rig: &Rig) -> Result<Exit, Failure> {
    let path = output::beside(&rig.camera.file, "motors");
    plumb_cameras::png::save(&path, view::last(view.frames(&Stage::Motors)?)?.colour())?;
    tell!(
        "The picture is in {}. Read there the column and row where the cable leaves each motor, \
         and give them in the order A, B: --pixel U,V --pixel U,V. Or choose them in a browser: \
         --page",
        path.display()
    );
    Ok(Exit::Failed)
}

/// Shows pictures until a person has accepted both motors. Returns `None` if the person ends
/// without them, or `interrupted` is set.
fn choose(
    page: &CalibrationPage,
    view: &mut View,
    interrupted: &AtomicBool,
) -> Result<Option<Vec<[f64; 2]>>, Failure> {
    let (mut newest, mut state) = (None::<RgbdFrame>, CalibrationState::default());
    let mut is_over = false;
    while !interrupted.load(Ordering::Relaxed) {
        if !is_over {
            match view.next_picture(&Stage::Motors)? {
                Some(frame) => newest = Some(frame),
                None => is_over = true,
            }
        }
        let Some(frame) = &newest else { return Err(failed(NO_PICTURE)) };
        page.show(frame.time(), frame.colour().clone(), state.clone());
        let Some(command) = page.command(INTERVAL) else { continue };
        match command {
            CalibrationCommand::Quit => return Ok(None),
            CalibrationCommand::Accept if state.result.is_some() => {
                return Ok(Some(state.marks.iter().map(|mark| mark.pixel).collect()));
            }
            command => handle(&mut state, command),
        }
    }
    Ok(None)
}

/// Carries out a command of the page.
fn handle(state: &mut CalibrationState, command: CalibrationCommand) {
    state.problem = None;
    match command {
        CalibrationCommand::Click(pixel) => match NAMES.get(state.marks.len()) {
            Some(name) => state.marks.push(mark(name, pixel)),
            None => state.problem = Some("both motors are chosen: accept, or undo".to_owned()),
        },
        CalibrationCommand::Undo => drop(state.marks.pop()),
        _ => state.problem = Some("choose motors A and B first".to_owned()),
    }
    state.result = None;
    if state.marks.len() == NAMES.len() {
        let motors: Vec<_> = state.marks.iter().map(|mark| mark.pixel).collect();
        match check(&motors) {
            Ok(()) => {
                let line = "targets may be below both motors and between their verticals";
                state.result = Some(ResultView { lines: vec![line.into()], acceptable: true });
            }
            Err(problem) => state.problem = Some(problem),
        }
    }
}

fn mark(name: &str, pixel: Point2<f64>) -> MarkView {
    MarkView { name: name.to_owned(), pixel: [pixel.x, pixel.y], depth: None }
}

/// Checks that these are two motors at different places.
fn check(motors: &[[f64; 2]]) -> Result<(), String> {
    let [[u, v], [other_u, other_v]] = *motors else {
        return Err(format!("--pixel: 2 are needed; given: {}", motors.len()));
    };
    match (u - other_u).hypot(v - other_v) < LEAST_PX {
        true => Err(format!("the motors are less than {LEAST_PX} pixels apart")),
        false => Ok(()),
    }
}

impl RigFile {
    /// Writes the motors into the rig file, if the user agrees or has agreed.
    fn write(
        &self,
        motors: Vec<[f64; 2]>,
        is_agreed: bool,
        is_json: bool,
    ) -> Result<Exit, Failure> {
        let mut text = TomlText::parse(&self.text)?;
        let comment = "plumb calibrate --motors";
        let pixels = motors.iter().map(|[u, v]| format!("[{u:.1}, {v:.1}]"));
        let value = format!("[{}]", pixels.collect::<Vec<_>>().join(", "));
        // A rig without the table is no rig in a picture.
        if let Some(mut plane) = text.table("plane", Some(comment)) {
            plane.set("motors", &value);
        }
        let text = text.text();
        Rig::parse(&self.path, &text)?;
        let old = OldFile { path: &self.path, text: &self.text };
        let written = old.offer(&text, "the motors' pixels", is_agreed);
        output::conclude(written, is_json, |written| Report { motors, written })
    }
}
