//! The real firmware on a serial port in real time, with a simulated camera that follows the
//! telemetry.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use std::error::Error;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_runtime::link::Serial;
use plumb_runtime::rig::{LawName, Rig};
use plumb_runtime::run::{Run, RunParts, Summary};
use plumb_sim::simulated::{HilPlant, SimulatedCamera, Timing};
use plumb_sim::synthetic::{Background, Material, RenderOptions, Room, SyntheticCamera};
use plumb_tests::chip::firmware_image;
use plumb_tests::in_time::in_time;
use plumb_vision::detect::DetectorKind;

/// A process that is killed on drop.
struct KillOnDrop(Child);

impl Drop for KillOnDrop {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_run_drives_the_real_firmware_over_a_serial_port() {
    let Some(image) = firmware_image() else { return };
    let summary = in_time(|| paper_task(&image)).expect("an unbroken run");
    assert!(summary.reached, "{summary:?}");
    assert!(summary.filtered_error_mm.is_some_and(|e| e < 10.0), "{summary:?}");
}

/// Does the task with a chip that has just started.
fn paper_task(image: &Path) -> Result<Summary, Box<dyn Error>> {
    let mut terminal = KillOnDrop(
        Command::new(env!("CARGO_BIN_EXE_chip-terminal"))
            .arg(image)
            .stdout(Stdio::piped())
            .spawn()?,
    );
    let mut port = String::new();
    let output = terminal.0.stdout.take().expect("its standard output");
    BufReader::new(output).read_line(&mut port)?;

    let task = Task::paper();
    let paper = Rig::paper()?;
    let mut rig = Rig { law: LawName::Interval.into(), ..paper };
    rig.law.set_gamma(150.0)?;
    // Deadlines that a busy machine keeps.
    rig.deadlines.host = 5.0.try_into()?;
    rig.deadlines.position = 5.0.try_into()?;
    rig.deadlines.max_age = 4.9.try_into()?;
    let camera = camera_file::paper()?;
    let background = Background::Room(Room::bare(Material::from_srgb(150, 150, 145)));
    let synthetic = SyntheticCamera::new(camera.clone(), background, RenderOptions::default(), 1)?;
    let plant = QuasiStatic::new(task.geometry, task.start)?;
    let plant = HilPlant::new(Box::new(plant), None);
    let mut follower = plant.observer();
    // On a busy machine the chip is slower than its clock, and pictures that come faster than it
    // reads positions would wait on the link.
    let timing = Timing { rate: 10.0, ..Timing::default() };
    let mut source = SimulatedCamera::new(plant, synthetic, *task.geometry.motors(), timing);
    // On a busy machine the chip needs longer to start than a host waits for its greeting.
    let connect = || {
        let transport = Serial::open(port.trim(), 115_200).expect("the port");
        Run::connect(&rig, transport)
    };
    let mut run = connect();
    for _ in 0..20 {
        run = run.or_else(|_| connect());
    }
    Ok(run?.drive(RunParts {
        source: &mut source,
        detector: &mut *DetectorKind::Ball.build(&camera),
        observers: &mut [&mut follower],
        operator: None,
        timeout: 1200.0,
        interrupted: &AtomicBool::new(false),
    })?)
}
