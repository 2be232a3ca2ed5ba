//! A camera's node in another process as the source of pictures.

use std::io::{BufRead, BufReader};
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::PoisonError;
use std::time::Duration;
use std::{fs, thread};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_cameras::camera_file;
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_ros2::{FIRST_PICTURE, Network, Ros2Camera, Ros2CameraError};

use super::peer::{Domain, Peer};
use super::run::{PAPER, Run, TURN, pause, target};
use crate::common::{self, Emulator, folder, patient, plumb, rig_file, stderr};

/// Latency of the camera in the rig file, seconds.
const LATENCY_S: f64 = 0.01;

/// Frames and losses in which a camera must be noticed.
const LOSSES: usize = 1000;

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

    /// Lets a node that was started with `--wait` begin.
    fn begin(&self) {
        common::send(&self.0, Signal::SIGUSR1);
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
            "\n[camera.ros2]\ndomain = {}\ninterface = \"127.0.0.1\"\n\
             latency = {LATENCY_S}\n{keys}",
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
    let output = plumb(&["run", "--out", "run", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("640x480"), "{}", stderr(&output));
    let summary = common::json(&output);
    assert!(summary["filtered_error_mm"].as_f64().unwrap() < 10.0, "{summary}");
    // The ball begins 38 cm from the target and moves for some seconds. A busy computer takes fewer
    // pictures than the camera sends.
    assert!(summary["located"].as_u64().unwrap() > 20, "{summary}");
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
    let lost = fs::read_to_string(folder.path().join("run/lost.csv")).unwrap();
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
    // The stamps are those of the node.
    peer.assert_ages(0.0);
    pause(&run);
    peer.until_joined_again();
    peer.assert_ages(0.0);
    let answer = peer.call("stop");
    assert_eq!(answer["success"], true, "{answer}");
    common::send(&run, Signal::SIGINT);
    assert_eq!(run.wait().unwrap().code(), Some(0));
}

/// The second node is ready when the first one ends, as one that starts at once.
#[test]
fn a_camera_that_restarts_at_once_is_heard_again() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let (folder, emulator) = (folder(), Emulator::start());
    let mut first = Camera::start(&domain, folder.path(), &[]);
    let second = Camera::start(&domain, folder.path(), &["--wait"]);
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let mut run = Run::command(&domain, "/plumb", folder.path()).spawn().unwrap();
    peer.until_held("/plumb", PAPER);
    first.kill();
    second.begin();
    // More pictures than those of the first node that were not read yet.
    for _ in 0..100 {
        peer.next("ball");
    }
    common::send(&run, Signal::SIGINT);
    assert_eq!(run.wait().unwrap().code(), Some(0));
    let lost = fs::read_to_string(folder.path().join("run/lost.csv")).unwrap_or_default();
    assert!(!lost.contains("nodes publish"), "{lost}");
}

#[test]
fn a_second_camera_that_begins_during_a_run_is_refused() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let (folder, emulator) = (folder(), Emulator::start());
    let _first = Camera::start(&domain, folder.path(), &[]);
    let second = Camera::start(&domain, folder.path(), &["--wait"]);
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let run = Run::command(&domain, "/plumb", folder.path()).spawn().unwrap();
    peer.until_held("/plumb", PAPER);
    second.begin();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("2 nodes publish on /camera/camera/"), "{}", stderr(&output));
}

/// Other nodes join the ball to the colour picture by equal stamps.
#[test]
fn the_ball_has_the_stamp_of_its_picture_to_the_nanosecond() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let (folder, emulator) = (folder(), Emulator::start());
    // Stamps far from this computer's clock, as those of a simulator, are sent on as they come.
    let options = ["--stamps", "stamps.txt", "--clock-zero", "12"];
    let _camera = Camera::start(&domain, folder.path(), &options);
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let mut run = Run::command(&domain, "/plumb", folder.path()).spawn().unwrap();
    peer.until_held("/plumb", PAPER);
    let mut seen = Vec::new();
    for _ in 0..20 {
        seen.extend(["ball", "pose", "tf"].map(|kind| peer.next(kind)["stamp"].to_string()));
    }
    common::send(&run, Signal::SIGINT);
    assert_eq!(run.wait().unwrap().code(), Some(0));
    let sent = fs::read_to_string(folder.path().join("stamps.txt")).unwrap();
    let sent: Vec<_> = sent.lines().map(|line| format!("[{}]", line.replace(' ', ","))).collect();
    assert!(sent.len() >= 20 && seen.iter().all(|stamp| sent.contains(stamp)), "{seen:?} {sent:?}");
}

#[test]
fn a_description_that_is_sent_once_is_received_and_kept() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let folder = folder();
    let _camera = Camera::start(&domain, folder.path(), &["--info-once", "--focal", "601"]);
    // The description was sent before.
    thread::sleep(Duration::from_secs(1));
    let mut camera = open(domain.number());
    assert_eq!(camera.intrinsics().fx, 601.0);
    assert!(camera.next_frame().unwrap().is_some());
}

#[test]
fn a_description_that_does_not_come_is_named() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let folder = folder();
    let _camera = Camera::start(&domain, folder.path(), &["--no-info"]);
    let limit = Duration::from_secs(5);
    let error = try_open(domain.number(), limit).err().unwrap().to_string();
    for part in ["nothing on /camera/camera/color/camera_info", "transient local"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn the_description_of_another_camera_is_refused_with_both_frames() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let folder = folder();
    let frame = "--info-frame=camera_infra1_optical_frame";
    let _camera = Camera::start(&domain, folder.path(), &[frame]);
    let error = try_open(domain.number(), FIRST_PICTURE).err().unwrap();
    let error = ErrorChain(&error).to_string();
    let colour = "`camera_color_optical_frame`";
    for part in ["/camera/camera/color/camera_info", "`camera_infra1_optical_frame`", colour] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_clock_that_runs_slower_is_refused_with_its_rate() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let folder = folder();
    for (rate, words) in [
        ("0.8", "times the rate of this computer's clock"),
        ("0", "stand still"),
        ("-1", "run backwards"),
    ] {
        let _camera = Camera::start(&domain, folder.path(), &[&format!("--clock-rate={rate}")]);
        let error = try_open(domain.number(), FIRST_PICTURE).err().unwrap();
        let Ros2CameraError::ClockRate { rate: found, .. } = error else { panic!("{error}") };
        assert!((found - rate.parse::<f64>().unwrap()).abs() < 0.1, "{found} for {rate}");
        let error = error.to_string();
        for part in ["/camera/camera/color/image_raw", words, "use_sim_time", "--rate"] {
            assert!(error.contains(part), "{rate}: {error}");
        }
    }
}

/// The delay of depth is no part of the offset between the clocks, though it is always there.
#[test]
fn a_frame_whose_depth_comes_late_is_old() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let folder = folder();
    let _camera = Camera::start(&domain, folder.path(), &["--depth-delay", "0.1"]);
    let mut camera = open(domain.number());
    let mut age = || {
        let frame = camera.next_frame().ok()??;
        Some(camera.now() - frame.time())
    };
    // The latency of 45 ms and the delay, less that of the fastest of ten colour pictures.
    let ages: Vec<f64> = (0..40).map(|_| age()).skip(10).flatten().collect();
    assert!(ages.len() >= 20 && ages.iter().all(|age| *age > 0.135), "{ages:?}");
}

/// Opens the camera with the topics of realsense-ros.
fn open(domain: u16) -> Ros2Camera {
    try_open(domain, FIRST_PICTURE).unwrap()
}

/// Does the same, and waits for the first picture for `limit` at most.
fn try_open(domain: u16, limit: Duration) -> Result<Ros2Camera, Ros2CameraError> {
    let network = Network { domain, interface: Some(IpAddr::V4(Ipv4Addr::LOCALHOST)) };
    let intrinsics = camera_file::paper().unwrap().intrinsics;
    Ros2Camera::open(&Ros2CameraSettings::default(), &network, intrinsics, limit)
}

#[test]
fn the_intrinsics_are_those_of_the_node_whose_pictures_come() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let folder = folder();
    // A node that has no depth yet, then one with depth and another lens.
    let mut first = Camera::start(&domain, folder.path(), &["--no-depth", "--focal", "500"]);
    let number = domain.number();
    let opened = thread::spawn(move || open(number));
    thread::sleep(Duration::from_secs(2));
    first.kill();
    let mut second = Camera::start(&domain, folder.path(), &["--focal", "600"]);
    let mut camera = opened.join().unwrap();
    assert_eq!(camera.intrinsics().fx, 600.0);
    // During the run, the camera is replaced by a third one.
    assert!(camera.next_frame().unwrap().is_some());
    second.kill();
    let _third = Camera::start(&domain, folder.path(), &["--focal", "601"]);
    let error = (0..LOSSES).find_map(|_| camera.next_frame().err().filter(SourceError::is_over));
    let error = ErrorChain(&error.unwrap()).to_string();
    assert!(error.contains("/camera/camera/color/camera_info: the description"), "{error}");
}

#[test]
fn a_camera_of_another_type_is_refused_by_name() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let (folder, emulator) = (folder(), Emulator::start());
    let _camera = Camera::start(&domain, folder.path(), &["--type", "CompressedImage"]);
    camera_rig(&domain, folder.path(), &emulator.port, "");
    let output = plumb(&["run", "--out", "run"], folder.path());
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
    let depth = "camera/camera/aligned_depth_to_color/image_raw/compressedDepth";
    for (options, keys) in [
        (&["--compressed"][..], compressed.to_owned()),
        // Without the slash at its beginning.
        (&["--compressed-depth"], format!("depth = \"{depth}\"\n")),
        (&["--no-depth"], "depth = \"none\"\n".to_owned()),
        (&["--compressed", "--no-depth"], format!("{compressed}depth = \"none\"\n")),
    ] {
        let (folder, emulator) = (folder(), Emulator::start());
        let _camera = Camera::start(&domain, folder.path(), options);
        camera_rig(&domain, folder.path(), &emulator.port, &keys);
        // The ball hangs still, and the board has no rig: 3 s of pictures.
        let run = ["run", "--timeout", "3", "--out", "run", "--json"];
        let output = plumb(&run, folder.path());
        let summary = common::json(&output);
        assert!(summary["located"].as_u64().unwrap() >= 5, "{options:?}: {summary}");
        let error = summary["filtered_error_mm"].as_f64().unwrap();
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
    let output = plumb(&["run", "--out", "run"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    for part in ["2 nodes publish on /camera/camera/", "[camera.ros2]"] {
        assert!(stderr(&output).contains(part), "{part}: {}", stderr(&output));
    }
    assert!(!folder.path().join("run").exists(), "nothing moves");
}
