//! `--ros2`: a node of Cyclone DDS in another process sees the ball and steers the run; a camera's
//! node shows it. All traffic is on the loopback interface, in a domain that no other test has.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod camera;
mod moving;
mod peer;
mod run;

use crate::common::{folder, plumb, stderr};

#[test]
fn bad_options_are_refused_before_anything_moves() {
    let folder = folder();
    for (arguments, reason) in [
        (vec!["--ros2=2nd"], "`2nd` is no namespace"),
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
