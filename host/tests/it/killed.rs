//! A host that is killed (SIGKILL) in mid-run, again and again: the board stands within its
//! deadline, the run's folder reads, and the next start works. The board runs in this process, over
//! a pseudo-terminal; all times are those of its clock, which pauses on a busy machine.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;
use std::process::{Child, Stdio};
use std::thread;
use std::time::Duration;

use crate::common::{folder, plumb, program, rig_file, stderr, until_rows};
use plumb_protocol::message::{Fault, State};
use plumb_protocol::units::Micros;
use plumb_sim::emulator::{EMULATED, EmulatedBoard, MotorSample, Served, serve};

/// Number of kills; `make faults` sets PLUMB_KILLS to 100.
const KILLS: u32 = 3;
/// Deadline for a silent host, µs: one that a busy machine keeps.
const DEADLINE_US: u64 = 2_000_000;
/// Time from the deadline to standstill, µs: the law's running mean and the ramp, and what was on
/// its way when the host was killed.
const STOP_US: u64 = 1_000_000;
/// Longest time between the last row of a killed run and the kill, µs.
const LOST_US: u64 = 500_000;
/// Interval of the motor samples, µs.
const SAMPLE_US: u64 = 20_000;
/// Largest distance of the motors from a sample of the same instant, full steps.
const NEAR_STEPS: f64 = 0.5;

/// Places between which the ball goes to and fro, far from the start and from each other: a drive
/// takes a minute.
const TARGETS: [[&str; 3]; 2] = [["0.4", "0.4", "0.15"], ["0.6", "0.3", "0.3"]];

/// Returns a rig file's text with slow motors, and deadlines that a busy machine keeps.
fn slow(text: String) -> String {
    text.replace("host = 0.3", "host = 2.0")
        .replace("position = 0.5", "position = 5.0")
        .replace("max_age = 0.25", "max_age = 4.9")
        .replace("max_rate = 400.0", "max_rate = 10.0")
}

/// A board in this process, and the samples of its motors so far.
struct Board {
    served: Served,
    samples: Vec<MotorSample>,
}

impl Board {
    fn start() -> Self {
        let mut board = EmulatedBoard::new(EMULATED);
        board.sample_motors(Micros(SAMPLE_US));
        Self { served: serve(board).unwrap(), samples: Vec::new() }
    }

    fn port(&self) -> String {
        self.served.path().to_str().unwrap().to_owned()
    }

    fn now(&self) -> u64 {
        self.served.board().now().0
    }

    /// Waits until the board drives for `run`, or `run` has ended, which the test will see.
    fn wait_for_drive(&self, run: &mut Child) {
        while self.served.board().state() != State::Seeking && run.try_wait().unwrap().is_none() {
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until the board rests in the fault of a silent host. Returns when a motor turned last,
    /// µs.
    fn wait_for_standstill(&mut self, from: u64) -> u64 {
        loop {
            let (state, rates, now) = {
                let mut board = self.served.board();
                let (samples, dropped) = board.take_samples();
                assert_eq!(dropped, 0, "the samples are complete");
                self.samples.extend(samples);
                (board.state(), board.rates(), board.now().0)
            };
            if state == State::Fault(Fault::HostSilent) && rates == [0.0; 3] {
                break;
            }
            assert!(now - from < 10 * DEADLINE_US, "{state:?} at {rates:?} steps/s");
            thread::sleep(Duration::from_millis(20));
        }
        let mut turns = self.samples.windows(2).filter(|pair| pair[0].motors != pair[1].motors);
        turns.next_back().map_or(from, |pair| pair[1].time.0)
    }

    /// Returns the last time until `before` at which the motors stood at `motors`, µs.
    fn last_time_at(&self, motors: [f64; 3], before: u64) -> Option<u64> {
        let near = |sample: &&MotorSample| {
            let distance = |i: usize| (sample.motors[i] - motors[i]).abs();
            sample.time.0 <= before && (0..3).all(|i| distance(i) <= NEAR_STEPS)
        };
        self.samples.iter().rev().find(near).map(|sample| sample.time.0)
    }
}

/// Returns the motor positions of the last complete row of a run, full steps.
fn last_motors(folder: &Path) -> [f64; 3] {
    let text = std::fs::read_to_string(folder.join("run.csv")).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let (last, rows) = rows.split_last().unwrap();
    assert!(rows.iter().all(|row| row.len() == header.len()), "{text}");
    let is_whole = last.len() == header.len() && text.ends_with('\n');
    let last = if is_whole { last } else { rows.last().unwrap() };
    ["motors_steps_a", "motors_steps_b", "motors_steps_c"].map(|name| {
        let column = header.iter().position(|column| *column == name);
        let column = column.unwrap_or_else(|| panic!("{name} in {header:?}"));
        last[column].parse().unwrap()
    })
}

/// Starts a drive to `target` with its results in `out`.
fn start(folder: &Path, rig: &str, port: &str, target: [&str; 3], out: &str) -> Child {
    let goto =
        [["goto", "--rig", rig].as_slice(), &target, &["--port", port, "--out", out]].concat();
    program(&goto, folder).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn a_killed_host_leaves_a_board_that_stands_and_a_folder_that_reads() {
    let kills = std::env::var("PLUMB_KILLS").map_or(KILLS, |count| count.parse().unwrap());
    let folder = folder();
    let rig = rig_file(folder.path(), slow);
    let mut board = Board::start();
    let port = board.port();
    for kill in 0..kills {
        let out = kill.to_string();
        let target = TARGETS[kill as usize % 2];
        // Every start after the first is one after a kill.
        let mut run = start(folder.path(), &rig, &port, target, &out);
        until_rows(&mut run, &folder.path().join(&out), 5);
        board.wait_for_drive(&mut run);
        // An instant from 0 to 0.7 s later, other for each kill.
        thread::sleep(Duration::from_millis(u64::from(kill) * 263 % 700));
        assert_eq!(
            run.try_wait().unwrap(),
            None,
            "kill {kill}: the run goes on until it is killed"
        );
        run.kill().unwrap();
        run.wait().unwrap();
        let killed = board.now();

        let stood = board.wait_for_standstill(killed);
        let took = stood.saturating_sub(killed);
        assert!(took <= DEADLINE_US + STOP_US, "kill {kill}: the motors turned for {took} µs");
        let motors = last_motors(&folder.path().join(&out));
        let seen = board.last_time_at(motors, killed);
        let lost = killed - seen.unwrap_or_else(|| panic!("kill {kill}: never at {motors:?}"));
        assert!(lost <= LOST_US, "kill {kill}: the last row is of {lost} µs before");
        println!("kill {kill}: the motors turned for {took} µs, the last row is {lost} µs old");
        let plot = plumb(&["plot", &out], folder.path());
        assert_eq!(plot.status.code(), Some(0), "kill {kill}: {}", stderr(&plot));
    }
}
