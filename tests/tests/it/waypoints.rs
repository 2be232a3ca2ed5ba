//! Waypoints with a dwell time, and with a wide tolerance, in virtual time.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_emulator::plant::Task;
use plumb_protocol::message::State;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunParts, Waypoint};
use plumb_sim::simulated::Timing;
use plumb_tests::links::{FixedDetector, TrackingCamera, link};

/// Frames of the present leg with the ball's distance from its target (metres) and the board's
/// state; those of the legs before.
#[derive(Default)]
struct Legs {
    present: Vec<(f64, State)>,
    ended: Vec<Vec<(f64, State)>>,
}

impl Observer for Legs {
    fn frame(&mut self, record: &FrameRecord) {
        let distance = record.position().zip(record.target).map(|(ball, at)| (ball - at).norm());
        self.present.extend(distance.zip(record.board_state()));
    }

    fn event(&mut self, record: &EventRecord) {
        if matches!(record.event, RunEvent::TargetEnded { .. }) {
            self.ended.push(std::mem::take(&mut self.present));
        }
    }
}

/// Drives the paper's rig through `waypoints`. Returns the frames of each leg.
fn drive(waypoints: &[Waypoint]) -> Vec<Vec<(f64, State)>> {
    let rig = Rig::paper().unwrap();
    let simulated = link("ideal").paper_board(7);
    let camera = camera_file::paper().unwrap();
    let mut source = TrackingCamera::new(simulated.rig(), camera.clone(), Timing::default());
    let mut legs = Legs::default();
    let mut run = Run::connect(&rig, simulated.transport()).unwrap();
    run.set_waypoints(waypoints, false).unwrap();
    let summary = run.drive(RunParts {
        source: &mut source,
        detector: &mut FixedDetector(camera),
        observers: &mut [&mut legs],
        operator: None,
        timeout: 20.0,
        interrupted: &AtomicBool::new(false),
    });
    assert!(summary.unwrap().reached);
    legs.ended
}

/// Returns a waypoint at `distance` metres from where the ball hangs at first.
fn at(distance: f64, dwell_s: f64, tolerance_m: f64) -> Waypoint {
    let Task { start, target, .. } = Task::paper();
    let place = start + (target - start).normalize() * distance;
    Waypoint { target: place.into(), dwell_s, tolerance_m: Some(tolerance_m) }
}

#[test]
fn the_board_holds_the_ball_for_the_dwell_time_also_with_a_wide_tolerance() {
    let legs = drive(&[at(0.036, 1.0, 0.03), at(0.15, 1.0, 0.03)]);
    for leg in &legs {
        let held = leg.iter().rev().take_while(|(_, state)| *state == State::Holding).count();
        assert!((29..34).contains(&held), "{held} of {} frames", leg.len());
    }
}

#[test]
fn a_ball_that_may_pass_a_waypoint_comes_within_its_tolerance() {
    let legs = drive(&[at(0.036, 0.0, 0.03), at(0.15, 0.0, 0.03)]);
    for leg in &legs {
        let (nearest, state) = *leg.last().unwrap();
        // The board tells of the picture before, and the ball comes nearer.
        assert!(nearest <= 0.031 && state == State::Seeking, "{nearest} m, {state:?}");
    }
}
