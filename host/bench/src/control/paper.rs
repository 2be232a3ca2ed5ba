//! `plumb-lab paper`: frames of the paper's law to 10 mm of the paper's target.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_frame::source::BoxedError;
use plumb_protocol::units::{Micros, Point};
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::{LawName, Rig};
use plumb_sim::memory::Memory;
use serde::Serialize;

/// Gains of the suite `paper`, 1/s.
pub const PAPER_GAMMAS: [f64; 4] = [10.0, 20.0, 40.0, 80.0];

/// Frame rate of the paper, Hz.
const FRAME_RATE_HZ: u64 = 30;

/// Frame limit of a run. γ = 10 /s takes about 1700 frames.
const MAX_FRAMES: u32 = 10_000;

/// Distance from the target at which the paper stops, metres.
const THRESHOLD_M: f64 = 0.010;

/// Result of the suite `paper`: frames until the ball is within 10 mm of the target, without noise,
/// at 30 Hz.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PaperSuite {
    /// Always `"paper"`.
    pub suite: &'static str,
    /// The control law.
    pub law: &'static str,
    /// γ, 1/s at 0.471 mm of cable a step.
    pub gamma: Vec<f64>,
    /// Frames for each γ.
    pub frames: Vec<u32>,
}

/// Runs the paper's task with the paper's law, without noise or latency, for each of `gammas`
/// (1/s).
///
/// # Errors
/// If the ball does not arrive.
pub fn paper(gammas: &[f64]) -> Result<PaperSuite, BoxedError> {
    let frames = gammas.iter().map(|&gamma| paper_frames(gamma)).collect::<Result<_, _>>()?;
    Ok(PaperSuite { suite: "paper", law: "interval", gamma: gammas.to_vec(), frames })
}

/// Rate limit, steps/s. It is never active, as the paper's law has no limits.
const MAX_RATE: f64 = 4_000.0;
/// Acceleration limit, steps/s². It is never active either.
const MAX_ACCELERATION: f64 = 400_000.0;

/// Returns the number of frames to 10 mm with gain `gamma` (1/s).
fn paper_frames(gamma: f64) -> Result<u32, BoxedError> {
    let mut rig = Rig { law: LawName::Interval.into(), ..Rig::paper()? };
    rig.law.set_gamma(gamma)?;
    rig.motors.max_rate = MAX_RATE.try_into()?;
    rig.motors.max_acceleration = MAX_ACCELERATION.try_into()?;
    let task = Task::paper();
    let plant = Box::new(QuasiStatic::new(task.geometry, task.start)?);
    let board = Rc::new(RefCell::new(EmulatedBoard::with_plant(EMULATED, plant)));
    let mut link = Link::connect(Memory::new(Rc::clone(&board)))?;
    link.configure(rig.wiring()?, rig.config()?)?;
    for target in rig.targets()? {
        link.set_target(target)?;
    }
    let start = board.borrow().now();
    for frame in 0..MAX_FRAMES {
        board
            .borrow_mut()
            .run_to(Micros(start.0 + u64::from(frame) * 1_000_000 / FRAME_RATE_HZ))?;
        let Some(ball) = board.borrow().ball() else { break };
        if (ball - task.target).norm() < THRESHOLD_M {
            return Ok(frame);
        }
        link.position(Point::from_metres(ball.into()), None, Duration::ZERO)?;
        link.poll()?;
        if let Some(fault) = link.fault() {
            return Err(LinkError::Fault(fault).into());
        }
    }
    Err(format!("γ = {gamma} /s: not within 10 mm after {MAX_FRAMES} frames").into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// docs/understand/method.md: 17 100/γ within 5 %.
    #[test]
    fn the_papers_law_takes_17_100_frames_over_gamma() {
        let suite = paper(&PAPER_GAMMAS).unwrap();
        for (gamma, frames) in suite.gamma.iter().zip(&suite.frames) {
            let product = gamma * f64::from(*frames);
            assert!((product / 17_100.0 - 1.0).abs() < 0.05, "γ = {gamma}: {frames} frames");
        }
    }
}
