//! Waits of the host for a board that lies, or a camera that loses every picture. Each of them has
//! an end, in virtual time, and its error says what was waited for.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use plumb_cameras::camera_file;
use plumb_config::error_chain::ErrorChain;
use plumb_emulator::EmulatedBoard;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::Wiring;
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Answer, FromBoard, Jog, Refusal, State, Telemetry};
use plumb_protocol::provenance::BoardKind;
use plumb_protocol::units::{Acceleration, Micros, Milliseconds, Point, Rate, Steps16};
use plumb_runtime::link::{Link, LinkError, Transport};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts};
use plumb_setup::commission::Examination;
use plumb_setup::watch::WatchParts;
use plumb_sim::memory::Memory;
use plumb_sim::simulated::{SimClock, Timing, VirtualBoard};
use plumb_tests::links::{FixedDetector, TrackingCamera};
use plumb_vision::frame::RgbdFrame;

/// Change of a message on its way to the host; `false` loses it.
type Lie = Box<dyn FnMut(&mut FromBoard) -> bool>;

/// Time that a message to the board takes.
const SENDING: u64 = 1000;

/// Transport to an emulated board whose messages are changed on their way.
struct Lying {
    inner: Memory,
    board: Rc<RefCell<EmulatedBoard>>,
    accumulator: Accumulator,
    lie: Lie,
    /// Whether it pretends that the board waits for its host.
    leads: bool,
}

impl Lying {
    fn new(board: &VirtualBoard, lie: Lie) -> Self {
        let (inner, board) = (board.transport(), Rc::clone(board.board()));
        Self { inner, board, accumulator: Accumulator::new(), lie, leads: false }
    }
}

impl Transport for Lying {
    fn name(&self) -> String {
        "liar".to_owned()
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }

    fn leads(&self) -> bool {
        self.leads
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let arrival = self.board.borrow().now().0 + SENDING;
        self.board.borrow_mut().run_to(Micros(arrival)).unwrap();
        self.inner.send(bytes)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let mut honest = Vec::new();
        self.inner.receive(&mut honest, wait)?;
        for byte in honest {
            let message = self.accumulator.push::<FromBoard>(byte).and_then(Result::ok);
            if let Some(mut message) = message
                && (self.lie)(&mut message)
            {
                bytes.extend_from_slice(&encode(&message).unwrap());
            }
        }
        Ok(())
    }
}

/// The time of a real board is that of the world.
#[test]
fn only_an_emulated_board_leads_the_time_of_its_host() {
    let board = VirtualBoard::paper().unwrap();
    let connect = |kind: BoardKind| {
        let lie: Lie = Box::new(move |message| {
            if let FromBoard::Provenance(provenance) = message {
                provenance.board = kind;
            }
            true
        });
        Link::connect(Lying { leads: true, ..Lying::new(&board, lie) }).map(|_| ())
    };
    connect(BoardKind::Emulated).unwrap();
    for kind in [BoardKind::Pico, BoardKind::SkrPico, BoardKind::Pico2] {
        let refused = connect(kind);
        assert!(matches!(refused, Err(LinkError::Leads { .. })), "{kind:?}: {refused:?}");
    }
}

/// Returns a lie about telemetry.
fn telemetry(mut lie: impl FnMut(&mut Telemetry) + 'static) -> Lie {
    Box::new(move |message| {
        if let FromBoard::Telemetry(telemetry) = message {
            lie(telemetry);
        }
        true
    })
}

/// Returns a lie about answers.
fn answers(mut lie: impl FnMut(&mut Answer) -> bool + 'static) -> Lie {
    Box::new(move |message| match message {
        FromBoard::Answer(answer) => lie(answer),
        _ => true,
    })
}

/// Returns a lie of motors that turn at `rate` full steps/s and lose 1/256 full step/s with each
/// report.
fn creeping(rate: i32) -> Lie {
    let mut left = rate.saturating_mul(256);
    telemetry(move |telemetry| {
        left -= 1;
        (telemetry.rates, telemetry.state) = ([Rate(left); 3].into(), State::Stopping);
    })
}

/// Answers that the board is busy to everything but a Stop and a Status, which come first.
fn busy() -> Lie {
    let mut count = 0;
    answers(move |answer| {
        count += 1;
        if count > 2 {
            answer.refusal = Some(Refusal::Busy(State::Stopping));
        }
        true
    })
}

/// Runs `action` over a link to a board that begins to lie once it is connected, or configured.
/// Returns the error and the time until then, seconds.
fn outcome(
    is_configured: bool,
    mut lie: Lie,
    action: impl FnOnce(&mut Link<Lying>) -> Result<(), LinkError>,
) -> (String, f64) {
    let board = VirtualBoard::paper().unwrap();
    let lies = Rc::new(Cell::new(false));
    let begun = Rc::clone(&lies);
    let late: Lie = Box::new(move |message| !begun.get() || lie(message));
    let mut link = Link::connect(Lying::new(&board, late)).unwrap();
    if is_configured {
        link.configure(Wiring::example(), Rig::paper().unwrap().config().unwrap()).unwrap();
    }
    lies.set(true);
    let begin = board.board().borrow().now().0;
    let error = action(&mut link).unwrap_err();
    let end = board.board().borrow().now().0;
    (ErrorChain(&error).to_string(), (end - begin) as f64 * 1e-6)
}

const JOG: Jog = Jog { motor: 0, distance: Steps16(16 * 20), rate: Rate(256 * 20) };

/// Jogs, and waits for the end.
fn jog(link: &mut Link<Lying>) -> Result<(), LinkError> {
    link.jog(JOG)?;
    loop {
        let telemetry = link.status()?;
        if !link.is_jogging(&telemetry)? {
            return Ok(());
        }
    }
}

fn configure(link: &mut Link<Lying>) -> Result<(), LinkError> {
    link.configure(Wiring::example(), Rig::paper().unwrap().config().unwrap())
}

fn target(link: &mut Link<Lying>) -> Result<(), LinkError> {
    link.set_target(Point::from_metres([0.4, 0.4, 0.15]).unwrap())
}

#[test]
fn a_ramp_that_creeps_ends_the_wait() {
    // The paper's motors need 0.2 s; 400 steps/s need 10 s at the least acceleration.
    for (rate, is_configured, longest) in
        [(400, true, 6.0), (400, false, 16.0), (i32::MAX, true, 6.0), (i32::MAX, false, 66.0)]
    {
        let (error, time) = outcome(is_configured, creeping(rate), Link::stop);
        assert!(error.contains("after the beginning of the stop"), "{error}");
        assert!(time < longest, "{rate} steps/s: {time} s");
    }
    let (error, time) = outcome(true, creeping(400), configure);
    assert!(error.contains("after the beginning of the stop") && time < 6.0, "{error}, {time} s");
    let (error, time) = outcome(true, creeping(400), Link::clear_fault);
    assert!(error.contains("after the beginning of the stop") && time < 6.0, "{error}, {time} s");
}

#[test]
fn motors_that_do_not_slow_down_or_stop_for_ever_end_the_wait() {
    let mut is_fast = false;
    let swinging = telemetry(move |telemetry| {
        is_fast = !is_fast;
        telemetry.rates = [Rate(if is_fast { 2000 } else { 1000 }); 3].into();
    });
    let stopping = telemetry(|telemetry| telemetry.state = State::Stopping);
    for lie in [swinging, stopping] {
        let (error, time) = outcome(true, lie, Link::stop);
        assert!(error.contains("the motors do not come to rest") && time < 2.0, "{error}, {time}");
    }
}

#[test]
fn a_jog_that_never_ends_ends_the_wait() {
    for state in [State::Jogging, State::Stopping] {
        let lie = telemetry(move |telemetry| telemetry.state = state);
        let (error, time) = outcome(true, lie, jog);
        // 20 steps at 20 steps/s.
        assert!(error.contains("after the beginning of the jog") && time < 7.0, "{error}, {time}");
    }
}

#[test]
fn requests_without_a_true_answer_end() {
    let no_answer = || answers(|_| false);
    let no_telemetry =
        || -> Lie { Box::new(|message| !matches!(message, FromBoard::Telemetry(_))) };
    let future = answers(|answer| {
        answer.time = Micros(u64::MAX);
        true
    });
    let nowhere = || -> Lie {
        Box::new(|message| match message {
            FromBoard::Telemetry(telemetry) => {
                telemetry.target = None;
                true
            }
            message => !matches!(message, FromBoard::Answer(_)),
        })
    };
    type Action = fn(&mut Link<Lying>) -> Result<(), LinkError>;
    let cases: [(Lie, Action, &str); 10] = [
        (no_answer(), Link::stop, "no answer to the request to stop"),
        (no_telemetry(), Link::stop, "no answer to the request for its state"),
        (future, |link| link.status().map(drop), "no answer to the request for its state"),
        (no_answer(), configure, "no answer to the request to stop"),
        (busy(), configure, "refused the configuration"),
        (busy(), Link::clear_fault, "refused the request to clear its fault"),
        (no_answer(), Link::home, "no answer to the request for a new zero of travel"),
        (no_answer(), Link::save, "no answer to the request to store its configuration"),
        (no_answer(), |link| link.jog(JOG), "no answer to the jog"),
        (nowhere(), target, "no answer to the target"),
    ];
    for (lie, action, waited_for) in cases {
        let (error, time) = outcome(true, lie, action);
        assert!(error.contains(waited_for), "{waited_for}: {error}");
        assert!(time < 4.0, "{waited_for}: {time} s");
    }
}

#[test]
fn a_board_that_never_leaves_for_its_bootloader_ends_the_wait() {
    for (lie, longest) in [(telemetry(|_| ()), 4.0), (creeping(400), 19.0)] {
        let board = VirtualBoard::paper().unwrap();
        let error = Link::bootloader(Lying::new(&board, lie)).unwrap_err();
        assert!(error.to_string().contains("has not restarted into its bootloader"), "{error}");
        let time = board.board().borrow().now().0 as f64 * 1e-6;
        assert!(time < longest, "{time} s");
    }
}

/// Examines the paper's rig with the pictures of `source`, and returns the error that ends it.
fn examination_error(transport: impl Transport, source: &mut dyn CameraSource) -> String {
    let rig = Rig::paper().unwrap();
    let mut link = Link::connect(transport).unwrap();
    link.configure(rig.wiring().unwrap(), rig.config().unwrap()).unwrap();
    let mut parts = WatchParts {
        source,
        detector: &mut FixedDetector(camera_file::paper().unwrap()),
        observers: &mut [],
        progress: &mut |_| (),
        interrupted: &AtomicBool::new(false),
    };
    ErrorChain(&Examination::run(&rig, &mut link, &mut parts).unwrap_err()).to_string()
}

#[test]
fn an_examination_whose_jog_never_ends_ends() {
    let board = VirtualBoard::paper().unwrap();
    let camera = camera_file::paper().unwrap();
    let mut source = TrackingCamera::new(board.rig(), camera, Timing::default());
    let lie = telemetry(|telemetry| {
        if telemetry.time > Micros(1_500_000) {
            telemetry.state = State::Jogging;
        }
    });
    let error = examination_error(Lying::new(&board, lie), &mut source);
    assert!(error.contains("the beginning of the jog"), "{error}");
    assert!(board.board().borrow().now() < Micros(10_000_000));
}

#[test]
fn a_run_whose_motors_never_come_to_rest_ends() {
    let board = VirtualBoard::paper().unwrap();
    let camera = camera_file::paper().unwrap();
    let mut source = TrackingCamera::new(board.rig(), camera.clone(), Timing::default());
    let mut creep = creeping(400);
    let lie: Lie = Box::new(move |message| match message {
        FromBoard::Telemetry(Telemetry { time, .. }) if *time > Micros(1_500_000) => creep(message),
        _ => true,
    });
    let run = Run::connect(&Rig::paper().unwrap(), Lying::new(&board, lie)).unwrap();
    let mut detector = FixedDetector(camera);
    let parts = RunParts { timeout: 2.0, ..RunParts::new(&mut source, &mut detector) };
    let Err(RunError::Broken { error, summary }) = run.drive(parts) else { panic!("no error") };
    let error = ErrorChain(&error).to_string();
    assert!(error.contains("after the beginning of the stop"), "{error}");
    assert!(!summary.at_rest && board.board().borrow().now() < Micros(11_000_000));
}

/// Camera that loses every picture.
struct Losing<C>(TrackingCamera<C>);

impl<C: SimClock> CameraSource for Losing<C> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        self.0.next_frame()?;
        Err(SourceError::new("a torn picture"))
    }

    fn now(&self) -> f64 {
        self.0.now()
    }

    fn is_live(&self) -> bool {
        true
    }

    fn wait(&mut self, limit: Duration) -> bool {
        self.0.wait(limit)
    }
}

#[test]
fn an_examination_whose_camera_loses_every_picture_ends() {
    let board = VirtualBoard::paper().unwrap();
    let camera = camera_file::paper().unwrap();
    let mut source = Losing(TrackingCamera::new(board.rig(), camera, Timing::default()));
    let error = examination_error(board.transport(), &mut source);
    assert!(error.contains("a torn picture"), "{error}");
    assert!(board.board().borrow().now() < Micros(3_000_000));
}

/// A ramp of 10 s, the longest of 400 steps/s, and a running mean.
#[test]
fn an_honest_ramp_ends_in_rest_however_long_it_is() {
    let rig = Rig::paper().unwrap();
    let mut config = rig.config().unwrap();
    for motor in &mut config.motors {
        motor.max_acceleration = Acceleration::from_si(40.0).unwrap();
    }
    config.mean = Milliseconds(400);
    config.jog.max_rate = Rate(400 * 256);
    config.jog.max_distance = Steps16(16 * 10_000);
    config.motors.iter_mut().for_each(|motor| motor.travel_max = Steps16(16 * 20_000));
    for is_known in [true, false] {
        let board = VirtualBoard::paper().unwrap();
        let mut link = Link::connect(board.transport()).unwrap();
        link.configure(Wiring::example(), config).unwrap();
        let distance = Steps16(16 * 10_000);
        link.jog(Jog { motor: 0, distance, rate: config.jog.max_rate }).unwrap();
        while link.status().unwrap().rates[0] < config.jog.max_rate {
            let soon = board.board().borrow().now().0 + 20_000;
            board.board().borrow_mut().run_to(Micros(soon)).unwrap();
        }
        if !is_known {
            link = Link::connect(board.transport()).unwrap();
        }
        let begin = board.board().borrow().now().0;
        link.stop().unwrap();
        let time = board.board().borrow().now().0 - begin;
        assert!(time > 9_500_000, "the ramp took {time} us");
    }
}
