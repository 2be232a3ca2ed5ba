//! `--ros2`: a node of Cyclone DDS in another process sees the ball and steers the run; a camera's
//! node shows it. All traffic is on the loopback interface, in a domain that no other test has.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod camera;
mod moving;
mod peer;
mod run;

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use crate::common::{folder, plumb, program, stderr};

#[test]
fn bad_options_are_refused_before_anything_moves() {
    let folder = folder();
    for (arguments, reason) in [
        (vec!["--ros2", "--ros2-namespace=2nd"], "`2nd` is no namespace"),
        (vec!["--ros2", "--ros2-domain=233"], "must be 0 to 232"),
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

#[test]
fn a_stop_that_cannot_arrive_is_not_offered() {
    let folder = folder();
    let demo = |variable, value| {
        let options = ["--ros2", "--ros2-interface=127.0.0.1", "--ros2-domain=100", "--out", "run"];
        let mut demo = program(&[&["demo"][..], &options].concat(), folder.path());
        demo.env(variable, value).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    for (variable, value) in [
        ("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"),
        ("ROS_DISCOVERY_SERVER", "192.0.2.1:11811"),
        ("ROS_SECURITY_ENABLE", "true"),
        ("ROS_STATIC_PEERS", "192.0.2.1"),
    ] {
        let output = demo(variable, value).wait_with_output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(&format!("{variable} is `{value}`")), "{text}");
        assert!(!folder.path().join("run").exists(), "{variable}");
    }
    let mut named = demo("CYCLONEDDS_URI", "file:///profile.xml");
    let mut lines = BufReader::new(named.stderr.take().unwrap()).lines().map(Result::unwrap);
    let line = lines.find(|line| line.contains("ROS 2: "));
    named.kill().unwrap();
    named.wait().unwrap();
    let expected = "plumb: ROS 2: this node does not read CYCLONEDDS_URI: `ros2 service list` must \
                    show /plumb/stop, or no stop arrives";
    assert_eq!(line.as_deref(), Some(expected));
}
