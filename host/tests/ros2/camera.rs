//! A camera's node in another process as the source of pictures.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::PoisonError;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::common::{self, Emulator, folder, patient, plumb, rig_file, stderr};
use crate::peer::{Domain, Peer};
use crate::run::{PAPER, Run, TURN, pause, target};

/// A camera's node in another process; killed when dropped.
struct Camera(Child);

impl Camera {
    /// Starts the node in `folder`, and waits until it publishes.
    fn start(domain: &Domain, folder: &Path, options: &[&str]) -> Self {
        let mut command = domain.script("camera.py", options);
        let mut child = command.current_dir(folder).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        assert_eq!(line, "ready\n");
        Self(child)
    }

    /// Ends the node without any notice to the other nodes.
    fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Camera {
    /// Ends the node, and with it the board that it has started.
    fn drop(&mut self) {
        let _ = kill(Pid::from_raw(i32::try_from(self.0.id()).unwrap()), Signal::SIGTERM);
        let _ = self.0.wait();
    }
}

/// Writes the paper's rig file for a board on `port` and a camera in ROS 2, with further `keys` of
/// the camera.
fn camera_rig(domain: &Domain, folder: &Path, port: &str, keys: &str) {
    rig_file(folder, |text| {
        let text = text[..text.find("\n[simulation]").unwrap()].replace("/dev/ttyACM0", port);
        let text =
            text.replace("file = \"camera.toml\"", "file = \"camera.toml\"\nsource = \"ros2\"");
        let table = format!(
            "\n[camera.ros2]\ndomain = {}\ninterface = \"127.0.0.1\"\nlatency = 0.01\n{keys}",
            domain.number()
        );
        patient(text + &table)
    });
}

/// The whole loop through DDS: the board's motors move the ball that the node shows.
#[test]
fn the_papers_task_is_done_with_the_camera_in_another_process() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let folder = folder();
    let options = ["--plumb", env!("CARGO_BIN_EXE_plumb")];
    let _camera = Camera::start(&domain, folder.path(), &options);
    camera_rig(&domain, folder.path(), "board", "");
    let output = plumb(&["run", "rig.toml", "--out", "run", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("640x480"), "{}", stderr(&output));
    let summary = common::json(&output);
    assert!(summary["error_mm"].as_f64().unwrap() < 10.0, "{summary}");
    // The ball begins 38 cm from the target and moves through many pictures.
    assert!(summary["located"].as_u64().unwrap() > 60, "{summary}");
}

#[test]
fn a_camera_that_vanishes_stops_the_board_and_a_stop_is_still_answered() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let (folder, emulator) = (folder(), Emulator::start());
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let mut run = Run::command(&domain, "/plumb", folder.path()).spawn().unwrap();
    // Before the first picture.
    peer.until_status("/plumb: run", "no picture");
    let answer = peer.call("stop");
    assert_eq!(answer["success"], true, "{answer}");
    let mut camera = Camera::start(&domain, folder.path(), &[]);
    peer.until_status("/plumb: run", "ready");
    assert_eq!(peer.call("resume")["success"], true);
    peer.send(&target(PAPER, "plumb/rig"));
    peer.until_held("/plumb", PAPER);
    camera.kill();
    let fault = peer.until_status("/plumb: run", "stopped by itself");
    assert_eq!(fault["level"], 2, "{fault}");
    assert!(fault["values"]["advice"].is_string(), "{fault}");
    let answer = peer.call("stop");
    assert_eq!(answer["success"], true, "{answer}");
    common::send(&run, Signal::SIGINT);
    assert_eq!(run.wait().unwrap().code(), Some(1));
    let lost = std::fs::read_to_string(folder.path().join("run/lost.csv")).unwrap();
    assert!(lost.contains("no picture for"), "{lost}");
}

#[test]
fn a_run_that_was_stopped_and_goes_on_sees_the_camera_and_answers_a_stop() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let (folder, emulator) = (folder(), Emulator::start());
    let _camera = Camera::start(&domain, folder.path(), &[]);
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let mut run = Run::command(&domain, "/plumb", folder.path()).spawn().unwrap();
    peer.until_held("/plumb", PAPER);
    pause(&run);
    peer.until("status", |status| status["values"]["joined"] == "2");
    peer.next("ball");
    let answer = peer.call("stop");
    assert_eq!(answer["success"], true, "{answer}");
    common::send(&run, Signal::SIGINT);
    assert_eq!(run.wait().unwrap().code(), Some(0));
}

#[test]
fn a_camera_of_another_type_is_refused_by_name() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let (folder, emulator) = (folder(), Emulator::start());
    let _camera = Camera::start(&domain, folder.path(), &["--type", "CompressedImage"]);
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let output = plumb(&["run", "rig.toml", "--out", "run"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    for part in ["/camera/camera/color/image_raw", "CompressedImage", "sensor_msgs/msg/Image"] {
        assert!(stderr(&output).contains(part), "{part}: {}", stderr(&output));
    }
    assert!(!folder.path().join("run").exists(), "nothing moves");
}

#[test]
fn compressed_pictures_and_a_camera_without_depth_are_read() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let compressed = "colour = \"/camera/camera/color/image_raw/compressed\"\n";
    for (options, keys) in [
        (&["--compressed"][..], compressed.to_owned()),
        (&["--no-depth"], "depth = \"none\"\n".to_owned()),
        (&["--compressed", "--no-depth"], format!("{compressed}depth = \"none\"\n")),
    ] {
        let (folder, emulator) = (folder(), Emulator::start());
        let _camera = Camera::start(&domain, folder.path(), options);
        camera_rig(&domain, folder.path(), &emulator.port, &keys);
        // The ball hangs still, and the board has no rig: 3 s of pictures.
        let run = ["run", "rig.toml", "--timeout", "3", "--out", "run", "--json"];
        let output = plumb(&run, folder.path());
        let summary = common::json(&output);
        assert!(summary["located"].as_u64().unwrap() >= 10, "{options:?}: {summary}");
        let error = summary["error_mm"].as_f64().unwrap();
        assert!(error < 40.0, "{options:?}: {summary}");
    }
}

#[test]
fn two_cameras_on_one_topic_are_refused() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let (folder, emulator) = (folder(), Emulator::start());
    let _cameras = [(); 2].map(|()| Camera::start(&domain, folder.path(), &[]));
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let output = plumb(&["run", "rig.toml", "--out", "run"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    for part in ["2 nodes publish on /camera/camera/", "[camera.ros2]"] {
        assert!(stderr(&output).contains(part), "{part}: {}", stderr(&output));
    }
    assert!(!folder.path().join("run").exists(), "nothing moves");
}
