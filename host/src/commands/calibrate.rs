//! `plumb calibrate`: the camera's pose in the rig frame.

mod clicks;
mod import;
mod lens;
mod options;
mod output;
mod places;
mod plane;
mod report;
mod view;

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::Parser;
use nalgebra::Isometry3;
use plumb_calibrate::board::Placement;
use plumb_calibrate::board_pose::{BoardView, average, pose_from_board};
use plumb_calibrate::calibration::Grade;
use plumb_calibrate::corners::{SheetError, find_corners};
use plumb_calibrate::motors::{pose_from_motors, see_motors};
use plumb_calibrate::places::pose_from_places;
use plumb_calibrate::sheet::{self, Paper};
use plumb_config::whole_writes::write_new;
use plumb_runtime::rig::Rig;
use plumb_vision::detect::DetectorKind;

use crate::cli::exit::{Exit, Failure, Unwritten, Work, failed};
use crate::cli::interrupt::interrupt_flag;
use crate::cli::numbers;
use crate::cli::old_file::check_writable;
use crate::cli::rig_path::RigArg;
use crate::session::camera::read_camera;
use clicks::Clicks;
use import::ImportOptions;
use lens::LensOptions;
use options::{BoardOptions, MotorOptions, PlaceOptions};
use output::CameraFile;
use output::Found;
use report::{Report, Way};
use view::{Stage, View};

/// Find the camera's pose in the rig frame, or its lens, and write it into the camera file
///
/// The pose in three ways: --board (a printed board at a known place), --motors (their pixels, with
/// depth), --ball (at least four known places of the ball). The book's page "Calibrate
/// the camera's pose" says which one to take and what good numbers are. The picture with the result
/// drawn in is kept beside the camera file. Nothing moves: no microcontroller is needed.
/// On a rig with [plane], --motors writes the pixels of its two motors into the rig file.
///
/// --lens finds the intrinsics and the distortion of the lens from pictures of the printed board
/// at many places. Do that before the pose. --import takes a lens or a pose that another program
/// has found.
///
/// Examples:
///   plumb calibrate --print-board board.pdf
///   plumb calibrate --board
///   plumb calibrate --motors --page --height 0.665
///   plumb calibrate --motors --pixel 511,60 --pixel 150,62 --pixel 305,107 --height 0.665
///   plumb calibrate --ball
///   plumb calibrate --lens
///   plumb calibrate --lens --pictures photos
///   plumb calibrate --import camera_info.yaml
#[derive(Parser)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
#[command(group(clap::ArgGroup::new("way").required(true)
    .args(["board", "motors", "ball", "lens", "import", "print_board"])))]
pub(crate) struct Args {
    #[command(flatten)]
    rig: RigArg,
    /// Write the board for the printer to this file, a .pdf
    #[arg(long, value_name = "FILE")]
    print_board: Option<PathBuf>,
    /// Size of the printer's paper
    #[arg(long, value_enum, default_value = "a4", requires = "print_board")]
    paper: Paper,
    /// Use a printed board at a known place
    #[arg(long)]
    board: bool,
    /// Use the three motors
    #[arg(long)]
    motors: bool,
    /// Use known places of the ball
    #[arg(long)]
    ball: bool,
    /// Find the intrinsics and the distortion of the lens
    #[arg(long)]
    lens: bool,
    /// Number of pictures of each view, 1 to 1000 pictures
    #[arg(long, default_value_t = 15)]
    #[arg(value_parser = numbers::whole::<u16>(1.0, 1000.0, "pictures"))]
    frames: u16,
    /// Detector of the ball
    #[arg(long, value_enum, default_value = "ball")]
    detector: DetectorKind,
    /// Write the camera file without asking
    #[arg(long)]
    yes: bool,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    board_options: BoardOptions,
    #[command(flatten)]
    motor_options: MotorOptions,
    #[command(flatten)]
    place_options: PlaceOptions,
    #[command(flatten)]
    lens_options: LensOptions,
    #[command(flatten)]
    import_options: ImportOptions,
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    if let Some(file) = &args.print_board {
        return print_board(file, args.paper);
    }
    let (file, rig) = args.rig.read()?;
    let (text, camera) = read_camera(&file, &rig)?;
    if args.motors && rig.plane.is_some() {
        let (motors, answers) = (args.motor_options, (args.yes, args.json));
        let (path, opened, count) = (file.clone(), rig.clone(), usize::from(args.frames));
        let open = move || View::open(&path, &opened, camera, count);
        return plane::prepare(motors, file, rig, open, answers);
    }
    let camera_file = CameraFile { path: rig.camera.file.clone(), text };
    check_writable(&camera_file.path)?;
    let answers = (args.yes, args.json);
    if let Some(path) = &args.import_options.import {
        let input = (path.as_path(), &args.import_options);
        return import::prepare(input, (&file, &rig, &camera), camera_file, answers);
    }
    if args.lens {
        return lens::prepare(&args.lens_options, (&file, &rig, camera), camera_file, answers);
    }
    args.place_options.check()?;
    args.motor_options.check()?;
    // A picture alone needs no depth.
    if args.motors && !camera.intrinsics.has_depth() && !args.motor_options.is_for_picture()? {
        return Err(failed(
            "--motors needs depth, and the camera file says that there is none: take --board or \
             --ball. `plumb calibrate --motors` alone keeps a picture",
        ));
    }
    let clicks = Clicks::start(&args.motor_options, &camera_file)?;
    let old = camera.pose;
    let mut view = View::open(&file, &rig, camera, usize::from(args.frames))?;
    Ok(Box::new(move || match clicks {
        Some(clicks) => from_clicks(clicks, &mut view, &old, &camera_file, args.json),
        None => match find(&args, &rig, &mut view)? {
            Some(found) => conclude(&found, &old, &camera_file, args.yes, args.json),
            None => Ok(Exit::Failed),
        },
    }))
}

/// Finds the pose from the motors that a person chooses on the page, and writes it.
fn from_clicks(
    clicks: Clicks,
    view: &mut View,
    old: &Isometry3<f64>,
    camera_file: &CameraFile,
    is_json: bool,
) -> Result<Exit, Failure> {
    let Some(found) = clicks.collect(view, old, &*interrupt_flag(false)?)? else {
        clicks.end("Nothing is written.");
        return Err(failed("the calibration was ended without a pose: nothing is written"));
    };
    // Who accepts a pose on the page has agreed.
    let concluded = conclude(&found, old, camera_file, true, is_json);
    clicks.end(&match &concluded {
        Ok(_) => format!("The pose is written into {}.", camera_file.path.display()),
        Err(failure) => format!("Nothing is written: {}", failure.message()),
    });
    concluded
}

/// Keeps the picture, reports the result and writes the pose, if the user agrees or has agreed.
fn conclude(
    found: &Found,
    old: &Isometry3<f64>,
    camera_file: &CameraFile,
    is_agreed: bool,
    is_json: bool,
) -> Result<Exit, Failure> {
    let mut report = Report::new(found.way, &found.calibration, old);
    report.picture = Some(camera_file.keep_picture(&found.draw()?)?);
    report.tell();
    let written = match found.calibration.grade() {
        Grade::Poor => Ok(false),
        _ => camera_file.offer(found, is_agreed),
    };
    output::conclude(written, is_json, |written| {
        report.written = written;
        report
    })
}

/// Takes the pictures and finds the pose. Returns `None` where the user must first read pixels.
fn find(args: &Args, rig: &Rig, view: &mut View) -> Result<Option<Found>, Failure> {
    if args.board {
        from_board(&args.board_options, view).map(Some)
    } else if args.motors {
        from_motors(&args.motor_options, rig, view)
    } else {
        let places = places::collect(&args.place_options, args.detector, args.yes, view)?;
        let calibration = pose_from_places(&places.places)?;
        Ok(Some(Found { way: Way::Ball, calibration, frame: places.frame, outline: Vec::new() }))
    }
}

/// What to do where a rendered picture does not show the board.
const RENDERED: &str = ". This picture is rendered: the board is where --origin, --turn and \
                        --upright say, and the camera where the camera file says";

fn from_board(options: &BoardOptions, view: &mut View) -> Result<Found, Failure> {
    let board = options.board();
    let placement: Placement = options.placement();
    let frames = view.frames(&Stage::Board { board, placement })?;
    let mut views = Vec::new();
    let mut last = None;
    for frame in &frames {
        match find_corners(frame.colour(), &board) {
            Ok(corners) => views.push(BoardView::new(&corners, frame)),
            // A single picture may be blurred.
            Err(error @ (SheetError::NotSeen { .. } | SheetError::Other { .. })) => {
                last = Some(error);
            }
            Err(error) => return Err(error.into()),
        }
    }
    tell!("the board is seen in {} of {} pictures", views.len(), frames.len());
    if 2 * views.len() < frames.len()
        && let Some(error) = last
    {
        return Err(match view.is_simulated() {
            true => failed(format!("{error}{RENDERED}")),
            false => error.into(),
        });
    }
    let frame = view::last(frames)?;
    let seen = average(&views, &board)?;
    let calibration = pose_from_board(&seen, frame.intrinsics(), &placement)?;
    let outline = board.outline().map(|p| placement.pose() * p).to_vec();
    Ok(Found { way: Way::Board, calibration, frame, outline })
}

fn from_motors(
    options: &MotorOptions,
    rig: &Rig,
    view: &mut View,
) -> Result<Option<Found>, Failure> {
    let frames = view.frames(&Stage::Motors)?;
    let Some(pixels) = options.pixels()? else {
        let path = output::beside(&rig.camera.file, "motors");
        plumb_cameras::png::save(&path, view::last(frames)?.colour())?;
        tell!("The picture is in {}. {}", path.display(), after_picture(view, options));
        return Ok(None);
    };
    let measures = options.measures()?;
    let seen = see_motors(&frames, pixels)?;
    let frame = view::last(frames)?;
    let calibration = pose_from_motors(&seen, &measures, frame.intrinsics())?;
    let outline = calibration.samples.iter().map(|sample| sample.known).collect();
    Ok(Some(Found { way: Way::Motors, calibration, frame, outline }))
}

/// Returns what to do with the picture of the motors, for a person.
fn after_picture(view: &View, options: &MotorOptions) -> String {
    if !view.camera().intrinsics.has_depth() {
        return "The pose from the motors needs depth, which this camera does not have: take \
                --board or --ball for the pose"
            .to_owned();
    }
    format!(
        "Read there the column and row where the cable leaves each motor, and give them in the \
         order A, B, C: --pixel U,V --pixel U,V --pixel U,V{}. Or choose them in a browser: --page",
        options.also_needed()
    )
}

/// Writes the sheet with the board. No work is left then.
fn print_board(file: &Path, paper: Paper) -> Result<Work, Failure> {
    let extension = file.extension().and_then(|it| it.to_str()).unwrap_or_default();
    if !extension.eq_ignore_ascii_case("pdf") {
        return Err(failed(format!("{}: must end in .pdf", file.display())));
    }
    write_new(file, &sheet::pdf(paper)).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => failed(format!(
            "{}: exists already, and is not overwritten: give another name, or remove it",
            file.display()
        )),
        _ => Unwritten::at(file)(error).into(),
    })?;
    tell!(
        "The board is in {}. Print it at 100 % (actual size), check that its ruler measures \
         100 mm, and glue it onto something flat.",
        file.display()
    );
    Ok(Box::new(|| Ok(Exit::Done)))
}
