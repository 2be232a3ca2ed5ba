//! The program `plumb` with other people's stacks: OpenCV's videoio, OpenNI2, librealsense2, ROS 2,
//! Python's MCAP, MuJoCo. `make test-all` runs them.

#[path = "../it/common.rs"]
#[allow(dead_code, reason = "the program `it` uses the rest")]
mod common;
// With the options of the whole program.
#[path = "../it/control_characters.rs"]
mod control_characters;
mod import;
mod mujoco;
mod openni;
mod realsense;
mod ros2;
// With an MCAP file.
#[path = "../it/session.rs"]
mod session;
mod video_files;
mod viewers;
