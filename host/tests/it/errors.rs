//! Messages of errors: no message contains that of its source, so that a chain of errors can be
//! joined.

use std::error::Error;
use std::io;

use plumb_cameras::capture::StartCaptureError;
use plumb_cameras::open::OpenError;
use plumb_cameras::png::PngError;
use plumb_cameras::record::RecordError;
use plumb_cameras::recording::OpenRecordingError;
use plumb_cameras::settings::{SettingsError, SourceName};
use plumb_cameras::stream::{Part, StreamError};
use plumb_cameras::tum::TumError;
use plumb_config::bounded_read::{LineError, ReadError};
use plumb_config::error_chain::ErrorChain;
use plumb_config::toml_file::TomlFileError;
use plumb_frame::source::{InvalidFrame, SourceError};
use plumb_log::RunLogError;
use plumb_log::replay::{DebugError, Problem, ReplayError};
use plumb_pictures::decode::DecodeError;
use plumb_protocol::frame::TooLong;
use plumb_runtime::bounded_observer::QueuedError;
use plumb_runtime::link::LinkError;
use plumb_runtime::rig::OutOfRange;
use plumb_runtime::run::{ControlLoopError, RunError};
use plumb_sim::emulator::plant::RigError;
use plumb_sim::emulator::serve::ServeError;
use plumb_sim::simulated::SimulationError;
use plumb_sim::synthetic::SyntheticError;
use plumb_vision::detect::DetectError;
use plumb_vision::frame::FrameError;
use plumb_vision::image::{ImageError, ImageSize};

/// Returns the last cause of most chains.
fn io_error() -> io::Error {
    io::Error::other("the disk is full")
}

fn read_error() -> ReadError {
    ReadError::Io { path: "rgb.txt".into(), error: io_error() }
}

fn tum_error() -> TumError {
    read_error().into()
}

fn invalid_frame() -> InvalidFrame {
    InvalidFrame { origin: "000001.png".to_owned(), error: FrameError::Empty }
}

fn png_error() -> PngError {
    PngError::Write { path: "outline.png".into(), source: io_error() }
}

fn detect_error() -> DetectError {
    DetectError::processing(io_error())
}

fn rig_error() -> RigError {
    RigError::NoCable { motor: 'A', length_m: -0.1 }
}

fn image_error() -> ImageError {
    ImageError { size: ImageSize { width: 2, height: 2 }, pixels: 3 }
}

fn lost() -> LinkError {
    LinkError::Lost { port: "/dev/ttyACM0".to_owned(), source: io_error() }
}

fn camera_errors() -> Vec<Box<dyn Error>> {
    let driver = SourceName::Recording;
    vec![
        Box::new(SourceError::new(tum_error())),
        Box::new(SourceError::new(invalid_frame()).with_stamp(1.5)),
        Box::new(SourceError::over(io_error())),
        Box::new(OpenError::Settings(SettingsError::NoRecording)),
        Box::new(OpenError::NoDriver(driver)),
        Box::new(OpenError::Driver { driver, cause: OpenRecordingError::Tum(tum_error()).into() }),
        Box::new(StartCaptureError::Thread(io_error())),
        Box::new(RecordError::Io { action: "write", path: "rgb.txt".into(), error: io_error() }),
        Box::new(RecordError::Encode { path: "1.png".into(), error: io_error().into() }),
        Box::new(png_error()),
        Box::new(PngError::Encode { path: "1.png".into(), source: io_error().into() }),
        Box::new(TumError::Frame(invalid_frame())),
        Box::new(TumError::Decode {
            path: "1.png".into(),
            error: DecodeError::Image(image_error()),
        }),
        Box::new(StreamError::Listen { address: "unix:camera.sock".to_owned(), error: io_error() }),
        Box::new(StreamError::Decode {
            part: Part::Depth,
            error: DecodeError::Image(image_error()),
        }),
        Box::new(LineError::Io(io_error())),
        Box::new(TomlFileError::Read(read_error())),
    ]
}

fn runtime_errors() -> Vec<Box<dyn Error>> {
    let why = "is out of the board's range".to_owned();
    let rig_file = OutOfRange { key: "law.gamma", value: Some(1e9), why };
    let figure = RunLogError::Io { action: "make", path: "run".into(), source: io_error() };
    vec![
        Box::new(lost()),
        Box::new(LinkError::Other(SimulationError::Rig(rig_error()).into())),
        Box::new(LinkError::TooLong(TooLong)),
        Box::new(RunError::Config(rig_file)),
        Box::new(RunError::Connect(lost())),
        Box::new(ControlLoopError::Link(lost())),
        Box::new(ControlLoopError::Source(SourceError::over(io_error()))),
        Box::new(ControlLoopError::Detect(detect_error())),
        Box::new(ControlLoopError::Observer(Box::new(QueuedError::Observer {
            name: "run log",
            source: figure.into(),
        }))),
        Box::new(RunLogError::Csv { path: "run.csv".into(), source: io_error() }),
        Box::new(ReplayError::Write(io_error())),
        Box::new(ReplayError::Debug(DebugError::Png(png_error()))),
        Box::new(DebugError::Folder { path: "stages".into(), source: io_error() }),
        Box::new(Problem::Source(SourceError::new(invalid_frame()).with_stamp(1.5))),
        Box::new(Problem::Detect { time: 1.5, error: detect_error() }),
    ]
}

fn simulation_errors() -> Vec<Box<dyn Error>> {
    vec![
        Box::new(SimulationError::Synthetic(SyntheticError::Frame(FrameError::Empty))),
        Box::new(SyntheticError::Image(image_error())),
        Box::new(ServeError::Terminal(io_error())),
        Box::new(ServeError::Rig(rig_error())),
    ]
}

#[test]
fn no_message_contains_that_of_its_source() {
    let errors = [camera_errors(), runtime_errors(), simulation_errors()];
    for error in errors.iter().flatten() {
        let mut upper: &dyn Error = &**error;
        while let Some(source) = upper.source() {
            let (message, cause) = (upper.to_string(), source.to_string());
            assert!(!message.contains(&cause), "{error:?}: {message:?} contains {cause:?}");
            upper = source;
        }
    }
}

#[test]
fn the_last_cause_stands_once_in_the_chain() {
    for error in [camera_errors(), runtime_errors(), simulation_errors()].iter().flatten() {
        let text = ErrorChain(&**error).to_string();
        assert!(text.matches("the disk is full").count() <= 1, "{text}");
    }
    let error = Problem::Source(SourceError::new(invalid_frame()).with_stamp(1.5));
    assert_eq!(
        ErrorChain(&error).to_string(),
        "the frame at 1.500000 s: 000001.png: no frame can be made of the images: the colour \
         picture is empty"
    );
    let error = RunError::Connect(lost());
    assert_eq!(
        ErrorChain(&error).to_string(),
        "connection to the board: /dev/ttyACM0: the board was unplugged, or its link broke: the \
         disk is full"
    );
}
