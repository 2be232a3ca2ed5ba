use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use plumb_config::error_chain::ErrorChain;
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::Image;

use super::*;

/// Longest wait for another thread: a test that reaches it fails.
const LONG: Duration = Duration::from_secs(60);

/// What a [`Script`] does next.
enum Step {
    Frame(f64),
    Lost(&'static str),
    Fail(&'static str),
    End,
    Panic,
}

/// Source that follows the steps of a channel, and waits where there is none.
struct Script {
    steps: Receiver<Step>,
    clock: LiveClock,
    dropped: Arc<AtomicBool>,
}

impl CameraSource for Script {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        match self.steps.recv() {
            Ok(Step::Frame(time)) => Ok(Some(frame(time))),
            Ok(Step::Lost(message)) => Err(SourceError::new(message)),
            Ok(Step::Fail(message)) => Err(SourceError::over(message)),
            Ok(Step::Panic) => panic!("a defect of the driver"),
            Ok(Step::End) | Err(_) => Ok(None),
        }
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        self.dropped.store(true, Ordering::SeqCst);
    }
}

fn frame(time: f64) -> RgbdFrame {
    let intrinsics =
        Intrinsics { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, depth_scale: 1000.0, distortion: None };
    let (colour, depth) = (Image::filled(2, 2, [1; 3]), Image::filled(2, 2, 1));
    RgbdFrame::new(time, colour, depth, intrinsics).unwrap()
}

/// Starts a capture. Returns it, the sender of its steps, and whether its source is dropped.
fn capture(silence: Duration) -> (Capture, Sender<Step>, Arc<AtomicBool>) {
    let (sender, steps) = channel();
    let dropped = Arc::new(AtomicBool::new(false));
    let clock = LiveClock::since(Instant::now());
    let source = Script { steps, clock, dropped: Arc::clone(&dropped) };
    let limits = CaptureLimits { silence, close: LONG };
    (Capture::start(source, limits).unwrap(), sender, dropped)
}

fn wait_until(done: impl Fn() -> bool) {
    let begin = Instant::now();
    while !done() {
        assert!(begin.elapsed() < LONG, "nothing happens");
        thread::yield_now();
    }
}

#[test]
fn a_slow_reader_of_200_frames_a_second_gets_the_newest() {
    let (mut capture, steps, _) = capture(LONG);
    for detection in 0..50 {
        // 35 ms of a detector are 7 frames.
        let times = (0..7).map(|k| f64::from(detection * 7 + k) / 200.0);
        times.for_each(|time| steps.send(Step::Frame(time)).unwrap());
        let skipped = 6 * (detection as u64 + 1);
        wait_until(|| capture.skipped() == skipped);
        let newest = f64::from(detection * 7 + 6) / 200.0;
        assert_eq!(capture.next_frame().unwrap().unwrap().time(), newest);
    }
}

#[test]
fn errors_come_in_order_and_are_never_skipped() {
    let (mut capture, steps, _) = capture(LONG);
    let frames = [Step::Frame(0.1), Step::Lost("one"), Step::Frame(0.2), Step::Frame(0.3)];
    frames.into_iter().for_each(|step| steps.send(step).unwrap());
    steps.send(Step::Lost("two")).unwrap();
    steps.send(Step::Fail("gone")).unwrap();
    wait_until(|| capture.skipped() == 2);
    let error = |capture: &mut Capture| capture.next_frame().unwrap_err();
    assert_eq!(ErrorChain(&error(&mut capture)).to_string(), "no frame: one");
    assert_eq!(capture.next_frame().unwrap().unwrap().time(), 0.3);
    assert_eq!(ErrorChain(&error(&mut capture)).to_string(), "no frame: two");
    let gone = error(&mut capture);
    assert!(gone.is_over());
    assert_eq!(ErrorChain(&gone).to_string(), "no further frame: gone");
    assert!(capture.next_frame().unwrap().is_none());
}

#[test]
fn a_source_that_fails_again_and_again_waits_for_its_reader() {
    let (mut capture, steps, _) = capture(LONG);
    (0..1000).for_each(|_| steps.send(Step::Lost("a frame")).unwrap());
    steps.send(Step::Frame(0.5)).unwrap();
    for _ in 0..1000 {
        assert!(!capture.next_frame().unwrap_err().is_over());
    }
    assert_eq!(capture.next_frame().unwrap().unwrap().time(), 0.5);
}

#[test]
fn the_last_frame_comes_before_the_end() {
    let (mut capture, steps, _) = capture(LONG);
    steps.send(Step::Frame(0.1)).unwrap();
    steps.send(Step::End).unwrap();
    assert_eq!(capture.next_frame().unwrap().unwrap().time(), 0.1);
    assert!(capture.next_frame().unwrap().is_none());
    assert!(capture.next_frame().unwrap().is_none());
}

#[test]
fn a_source_that_blocks_is_an_error_and_is_abandoned() {
    let (mut capture, steps, dropped) = capture(Duration::from_millis(50));
    let error = capture.next_frame().unwrap_err();
    let message = ErrorChain(&error).to_string();
    assert!(error.is_over() && message.contains("delivered nothing"), "{message}");
    drop(capture);
    assert!(!dropped.load(Ordering::SeqCst));
    // Once it returns, its thread closes it and ends.
    drop(steps);
    wait_until(|| dropped.load(Ordering::SeqCst));
}

#[test]
fn a_panic_of_the_source_is_an_error() {
    let (mut capture, steps, dropped) = capture(LONG);
    steps.send(Step::Panic).unwrap();
    let error = capture.next_frame().unwrap_err();
    let message = ErrorChain(&error).to_string();
    assert!(error.is_over() && message.contains("a defect of the driver"), "{message}");
    drop(capture);
    assert!(dropped.load(Ordering::SeqCst));
}

#[test]
fn dropping_closes_the_source() {
    let (capture, steps, dropped) = capture(LONG);
    let sender = thread::spawn(move || {
        // A camera delivers frames until it is closed.
        while steps.send(Step::Frame(0.1)).is_ok() {
            thread::yield_now();
        }
    });
    drop(capture);
    assert!(dropped.load(Ordering::SeqCst));
    sender.join().unwrap();
}

#[test]
fn a_waker_ends_the_wait() {
    let (mut capture, steps, _) = capture(LONG);
    let waker = capture.waker().unwrap();
    waker.wake_by_ref();
    assert!(!capture.wait(LONG));
    let other = thread::spawn(move || waker.wake());
    assert!(!capture.wait(LONG));
    other.join().unwrap();
    assert!(!capture.wait(Duration::ZERO));
    steps.send(Step::Frame(0.1)).unwrap();
    assert!(capture.wait(LONG));
}

#[test]
fn a_recording_that_is_read_at_any_speed_has_no_clock() {
    struct Still;
    impl CameraSource for Still {
        fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
            Ok(None)
        }

        fn now(&self) -> f64 {
            0.0
        }
    }
    let error = Capture::start(Still, CaptureLimits::default()).unwrap_err();
    assert!(matches!(error, StartCaptureError::NoClock));
}
