//! The measurements along a path.

use std::path::Path;

use nalgebra::{Point3, Vector3};
use plumb_path::trajectory::Moment;
use plumb_protocol::message::{Command, State};
use plumb_protocol::wiring::StepDir;
use plumb_runtime::reference::{INTERVAL_S, reference};
use plumb_tests::chip::{BALL_UM, CYCLES_PER_US, Chip, fast_config};
use serde_json::json;

use crate::measure::{
    BenchLaw, STEPPING, calls, cycles_to_new_period, lateness, longest, start_with,
    without_interrupts,
};
use crate::symbols::law_update;

/// Pictures of a run.
const PICTURES: u32 = 60;
/// Period of the pictures, µs.
const PERIOD_US: u64 = 33_333;
/// Period of the reference's states, µs.
const STATE_US: u64 = 16_384;
/// Moments of a state's period at which a position comes: 128 µs apart, less than a tick.
const MOMENTS: u64 = 128;

/// Execution times along a path, cycles.
pub(crate) struct Costs {
    /// Maximum of the stepping interrupt, with a position, a message of the path, a state of the
    /// reference, or none of them.
    pub(crate) tick: f64,
    /// Maximum of the law's update, without the ticks that interrupt it.
    pub(crate) update: f64,
    /// Maximum of the law's update, with everything that interrupts it.
    pub(crate) response: f64,
    /// Total lateness of the ticks.
    pub(crate) late: f64,
}

/// Returns the ball's motion on a circle of 10 cm at 10 cm/s, from [`BALL_UM`] on.
fn circle(time_s: f64) -> Moment {
    let (sin, cos) = time_s.sin_cos();
    let start = Vector3::from(BALL_UM.map(|p| f64::from(p) * 1e-6));
    Moment {
        position: Point3::from(start + 0.1 * Vector3::new(cos - 1.0, sin, 0.0)),
        velocity: 0.1 * Vector3::new(-sin, cos, 0.0),
        acceleration: 0.1 * Vector3::new(-cos, -sin, 0.0),
    }
}

/// Returns the next message of a path that goes on, which has begun at `begin` (cycles).
fn message(chip: &Chip, number: u16, begin: u64) -> Command {
    let time = (chip.cycle - begin) as f64 * 1e-6 / CYCLES_PER_US as f64;
    let first = (time / INTERVAL_S).floor() * INTERVAL_S;
    Command::Follow(reference(number, false, time, first, circle))
}

/// Has the board follow the circle. Returns when it began, cycles.
fn follow(chip: &mut Chip) -> u64 {
    chip.send_position(BALL_UM);
    let begin = chip.cycle;
    let first = message(chip, 1, begin);
    assert_eq!(chip.request(first), None);
    begin
}

/// Measures the law's function and the stepping handler over 60 pictures, each with a position and
/// a message of the path.
pub(crate) fn costs(image: &Path, law: BenchLaw) -> Costs {
    let config = law.select(fast_config(312.5, StepDir::TMC2209));
    let mut chip = Chip::start(image).configured(config);
    let begin = follow(&mut chip);
    let update = law_update(image, law != BenchLaw::Interval);
    chip.execute(json!({
        "trace": { "functions": { "update": update }, "handlers": { "tick": STEPPING } },
    }));
    for k in 1..=PICTURES {
        let place = circle(f64::from(k) * PERIOD_US as f64 * 1e-6).position;
        let ball = [0, 1, 2].map(|i| (place[i] * 1e6) as i32 + 900 * (k as i32 % 3 - 1));
        let frames = [chip.position_frame(ball), {
            let next = message(&chip, 1 + k as u16, begin);
            chip.frame(next)
        }];
        // Both frames of a picture come at once, at another phase of the tick each time.
        chip.send(&frames.concat(), PERIOD_US + u64::from(k) % 7 * 29);
    }
    assert_eq!(chip.status().state, State::Following);
    let reply = chip.execute(json!({ "calls": true }));
    let [updates, ticks] = ["update", "tick"].map(|name| calls(&reply["calls"][name]));
    assert!(updates.len() as u32 > PICTURES / 2, "{} positions", updates.len());
    Costs {
        tick: longest(ticks.iter().map(|tick| tick.1)),
        update: longest(updates.iter().map(|call| without_interrupts(call, &ticks))),
        response: longest(updates.iter().map(|call| call.1)),
        late: lateness(&ticks),
    }
}

/// Measures the time from the last byte of a position to the first pulse with another period along
/// a path, µs: the worst over all moments between two states of the reference.
pub(crate) fn latency(image: &Path) -> f64 {
    let moments: Vec<u64> = (0..MOMENTS).collect();
    // A new chip after some moments: motors that turn for long without the ball are a fault.
    let delays = moments.chunks(32).flat_map(|moments| delays(image, moments));
    delays.max().expect("moments") as f64 / CYCLES_PER_US as f64
}

/// Returns these times, cycles, for positions at some moments.
fn delays(image: &Path, moments: &[u64]) -> Vec<u64> {
    let mut chip = start_with(image, 62_500.0, BenchLaw::Interval);
    let begin = follow(&mut chip);
    // All three motors turn at the same rate.
    let [below, above] = [-900_000, 900_000].map(|z| [BALL_UM[0], BALL_UM[1], z]);
    chip.send_position(below);
    chip.run_us(40_000);
    let delay = |(k, moment): (u16, &u64)| {
        chip.send_position(below);
        let next = message(&chip, 2 + k, begin);
        chip.request(next);
        let since = (chip.cycle - begin) / CYCLES_PER_US % STATE_US;
        chip.run_us(STATE_US - since + 4000 + moment * STATE_US / MOMENTS);
        cycles_to_new_period(&mut chip, above)
    };
    (0..).zip(moments).map(delay).collect()
}
