//! Drives the rig of a rig file to three targets, with an observer of its own.
//!
//! Usage: `cargo run --release -p plumb-runtime --example three_targets -- RIG.toml`

use std::error::Error;

use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunParts};
use plumb_vision::detect::DetectorKind;

/// Prints the distance to the target.
struct Distance;

impl Observer for Distance {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(error) = record.error() {
            println!("{:6.2} s: {:5.1} mm to go", record.time, error * 1e3);
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: three_targets RIG.toml")?;
    let mut rig = Rig::read(path.as_ref())?;
    rig.set_targets(&[[0.40, 0.40, 0.15], [0.52, 0.30, 0.30], [0.42, 0.36, 0.20]])?;
    let mut camera = rig.camera.open()?;
    let mut detector = DetectorKind::Ball.build(&camera.camera);
    let parts = RunParts::new(&mut *camera.source, &mut *detector);
    let summary = Run::open(&rig)?.drive(RunParts { observers: &mut [&mut Distance], ..parts })?;
    println!("{}: {} of 3 targets reached", summary.ending, summary.targets_reached);
    Ok(())
}
