//! `--ros2`: a node of Cyclone DDS in another process sees the ball and steers the run. All traffic
//! is on the loopback interface, in a domain that no other test has.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;
#[cfg(feature = "ros2")]
#[path = "ros2/peer.rs"]
mod peer;

use common::{folder, plumb, stderr};

#[cfg(not(feature = "ros2"))]
#[test]
fn a_program_without_ros_says_how_to_build_it() {
    let folder = folder();
    let output = plumb(&["demo", "--ros2", "--out", "run"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("--features ros2"), "{}", stderr(&output));
    assert!(!folder.path().join("run").exists(), "nothing moves");
}

#[cfg(feature = "ros2")]
mod with_ros2 {
    use std::io::{BufRead, BufReader};
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::sync::{Mutex, PoisonError};

    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;
    use serde_json::{Value, json};

    use super::common::{self, Emulator, patient, rig_file};
    use super::peer::{Domain, Peer};
    use super::{folder, plumb, stderr};

    /// Boards have deadlines: one test at a time.
    static TURN: Mutex<()> = Mutex::new(());

    /// Target of the paper, metres.
    const PAPER: [f64; 3] = [0.4, 0.4, 0.15];

    /// A run of a simulated rig in ROS 2; killed when dropped.
    struct Run {
        child: Option<Child>,
        _emulator: Emulator,
        _folder: tempfile::TempDir,
    }

    impl Run {
        fn start(domain: &Domain, namespace: &str) -> Self {
            let folder = folder();
            let emulator = Emulator::start();
            rig_file(folder.path(), |text| patient(text.replace("/dev/ttyACM0", &emulator.port)));
            let child = Self::command(domain, namespace, folder.path()).spawn().unwrap();
            Self { child: Some(child), _emulator: emulator, _folder: folder }
        }

        fn command(domain: &Domain, namespace: &str, folder: &Path) -> Command {
            let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
            command
                .args(["run", "rig.toml", "--out", "run", "--json"])
                .arg(format!("--ros2={namespace}"))
                .arg(format!("--ros2-domain={}", domain.number()))
                .arg("--ros2-interface=127.0.0.1")
                .current_dir(folder)
                .stdout(Stdio::piped())
                .stderr(Stdio::piped());
            command
        }

        /// Interrupts the run. Returns its summary.
        fn end(mut self) -> Value {
            let child = self.child.take().unwrap();
            kill(Pid::from_raw(i32::try_from(child.id()).unwrap()), Signal::SIGINT).unwrap();
            common::json(&child.wait_with_output().unwrap())
        }
    }

    impl Drop for Run {
        fn drop(&mut self) {
            if let Some(child) = &mut self.child {
                let _ = child.kill();
                let _ = child.wait();
            }
        }
    }

    fn target(at: [f64; 3], frame: &str) -> Value {
        json!({"target": at, "frame": frame})
    }

    /// Returns how each leg of a summary ended.
    fn endings(summary: &Value) -> Vec<&str> {
        let legs = summary["legs"].as_array().unwrap();
        legs.iter().map(|leg| leg["ending"].as_str().unwrap()).collect()
    }

    #[test]
    fn a_node_sees_the_ball_and_drives_it() {
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(domain) = Domain::reserve() else { return };
        let mut peer = Peer::start(&domain, "/plumb", &[]);
        let run = Run::start(&domain, "/plumb");
        peer.until_held("/plumb", PAPER);
        let ball = peer.next("ball");
        assert_eq!(ball["frame"], "plumb/rig", "{ball}");
        peer.assert_ball_at(PAPER);
        let pose = peer.next("pose");
        let variance = |k: usize| pose["covariance"][7 * k].as_f64().unwrap();
        assert!((0..3).all(|k| (1e-10..1e-4).contains(&variance(k))), "{pose}");
        let camera = peer.until("tf", |tf| tf["child"] == "plumb/camera");
        assert_eq!(camera["parent"], "plumb/rig", "{camera}");
        // The camera file's translation.
        let x = camera["at"][0].as_f64().unwrap();
        assert!((x - 1.737).abs() < 1e-9, "{camera}");
        peer.until("tf", |tf| tf["child"] == "plumb/ball");

        peer.send(&target([0.45, 0.3, 0.2], "plumb/rig"));
        peer.until_held("/plumb", [0.45, 0.3, 0.2]);
        peer.assert_ball_at([0.45, 0.3, 0.2]);
        for (sent, reason) in [
            (target([0.4, 0.3, 7.0], "plumb/rig"), "outside the workspace"),
            (target([0.4, 0.3, 0.2], "map"), "in the frame `map`"),
        ] {
            peer.send(&sent);
            let status = peer.until_status("/plumb: commands", reason);
            assert_eq!(status["level"], 1, "{status}");
        }
        // A vector has the bytes of a point.
        peer.send(&json!({"vector": [0.4, 0.3, 0.2]}));
        let status = peer.until_status("/plumb: graph", "geometry_msgs/msg/Vector3Stamped");
        assert_eq!(status["level"], 1, "{status}");
        assert_eq!(peer.call("hold")["success"], true);
        peer.assert_ball_at([0.45, 0.3, 0.2]);
        let summary = run.end();
        assert_eq!(endings(&summary), ["reached", "reached"], "{summary}");
    }

    #[test]
    fn a_stop_works_for_both_kinds_of_clients_and_under_a_flood_of_targets() {
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(domain) = Domain::reserve() else { return };
        let mut flooding = Peer::start(&domain, "/hall/left", &[]);
        // A client as rmw_fastrtps_cpp is, the other as rmw_cyclonedds_cpp.
        let mut plain = Peer::start(&domain, "/hall/left", &["--plain"]);
        let mut right = Peer::start(&domain, "/right", &[]);
        let (left_run, right_run) =
            (Run::start(&domain, "/hall/left"), Run::start(&domain, "/right"));
        flooding.until_held("/hall/left", PAPER);
        plain.until_held("/hall/left", PAPER);
        right.until_held("/right", PAPER);
        let place = [0.45, 0.3, 0.2];
        flooding.send(&json!({"flood": 4.0, "target": place, "frame": "hall/left/rig"}));
        plain.until_status("/hall/left: run", "seeking");
        let answer = plain.call("stop");
        assert_eq!(answer["success"], true, "{answer}");
        let flooded = flooding.until("flooded", |_| true);
        assert!(flooded.as_u64().unwrap() > 1000, "{flooded}");
        let refused = plain.until_status("/hall/left: commands", "/hall/left/resume");
        assert_eq!(refused["values"]["targets"], "refused since a stop", "{refused}");
        // The other way to call a service.
        assert_eq!(flooding.call("resume")["success"], true);
        flooding.send(&target(place, "hall/left/rig"));
        flooding.until_held("/hall/left", place);
        assert_eq!(flooding.call("stop")["success"], true);
        right.assert_ball_at(PAPER);
        let (left, right) = (left_run.end(), right_run.end());
        assert_eq!(endings(&right), ["reached"], "{right}");
        // Twenty targets in a second at most, until the stop.
        let endings = endings(&left);
        let stop = endings.iter().position(|ending| ending.starts_with("stopped"));
        let stop = stop.unwrap_or_else(|| panic!("{endings:?}"));
        assert_eq!(endings[stop + 1..], ["reached"], "{endings:?}");
        assert!(stop <= 82, "{endings:?}");
    }

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

    /// Writes the paper's rig file for a board on `port` and a camera in ROS 2.
    fn camera_rig(domain: &Domain, folder: &Path, port: &str) {
        rig_file(folder, |text| {
            let text = text[..text.find("\n[simulation]").unwrap()].replace("/dev/ttyACM0", port);
            let text =
                text.replace("file = \"camera.toml\"", "file = \"camera.toml\"\nsource = \"ros2\"");
            let table = format!(
                "\n[camera.ros2]\ndomain = {}\ninterface = \"127.0.0.1\"\nlatency = 0.01\n",
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
        camera_rig(&domain, folder.path(), "board");
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
        camera_rig(&domain, folder.path(), &emulator.port);
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
        kill(Pid::from_raw(i32::try_from(run.id()).unwrap()), Signal::SIGINT).unwrap();
        assert_eq!(run.wait().unwrap().code(), Some(1));
        let lost = std::fs::read_to_string(folder.path().join("run/lost.csv")).unwrap();
        assert!(lost.contains("no picture for"), "{lost}");
    }

    #[test]
    fn a_camera_of_another_type_is_refused_by_name() {
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(domain) = Domain::reserve() else { return };
        let (folder, emulator) = (folder(), Emulator::start());
        let _camera = Camera::start(&domain, folder.path(), &["--type", "CompressedImage"]);
        camera_rig(&domain, folder.path(), &emulator.port);
        let output = plumb(&["run", "rig.toml", "--out", "run"], folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        for part in ["/camera/camera/color/image_raw", "CompressedImage", "sensor_msgs/msg/Image"] {
            assert!(stderr(&output).contains(part), "{part}: {}", stderr(&output));
        }
        assert!(!folder.path().join("run").exists(), "nothing moves");
    }

    #[test]
    fn bad_options_are_refused_before_anything_moves() {
        let folder = folder();
        for (arguments, reason) in [
            (vec!["--ros2=2nd"], "`2nd` is no namespace"),
            (vec!["--ros2", "--ros2-domain=233"], "the ROS 2 domain 233 is out of range"),
            (vec!["--ros2", "--ros2-interface=192.0.2.1"], "192.0.2.1"),
            (vec!["--ros2-domain=3"], "--ros2"),
            (vec!["--ros2", "--virtual-time"], "--virtual-time"),
        ] {
            let all = [&["demo", "--out", "run"], &*arguments].concat();
            let output = plumb(&all, folder.path());
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
            assert!(stderr(&output).contains(reason), "{arguments:?}: {}", stderr(&output));
            assert!(!folder.path().join("run").exists(), "{arguments:?}");
        }
    }
}
