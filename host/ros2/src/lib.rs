//! Plumb as a node of ROS 2, without an installation of ROS 2.
//!
//! [`Ros2Output::start`] joins a domain and returns an observer for the run. It publishes the ball,
//! the transforms and the diagnostics, and sends targets and services of other nodes to the run as
//! its operator:
//!
//! ```text
//! run -> Ros2Output (observer) -> newest sample, status, outcomes -> thread of the node -> topics
//!     <- commands              <-                                    targets, services <-
//! ```
//!
//! [`Ros2Driver`] opens a camera that another node publishes, such as that of realsense-ros.
//! [`McapRecording`] reads one that was recorded.
//!
//! docs/use/ros2.md lists the topics and services.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod action;
mod camera;
mod endpoints;
mod error;
mod feed;
#[doc(hidden)]
pub mod fuzzing;
mod gate;
mod interruption;
mod ledger;
mod message;
mod moving_status;
mod namespace;
mod network;
mod node_loop;
mod output;
mod peers;
mod publishers;
mod qos;
mod recording;
mod senders;
mod service;
mod status;
mod targets;
mod topic;

pub use camera::{FIRST_PICTURE, Ros2Camera, Ros2CameraError, Ros2Driver};
pub use error::{MAX_DOMAIN, Ros2Error};
pub use namespace::Namespace;
pub use network::Network;
pub use output::{Ros2Output, Ros2Settings};
pub use peers::UnusablePublisher;
pub use recording::{McapError, McapRecording};
