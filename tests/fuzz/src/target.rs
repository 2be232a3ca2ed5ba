//! The targets.

pub mod board;
#[cfg(feature = "host")]
pub mod calibration;
#[cfg(feature = "host")]
pub mod camera_file;
pub mod configuration;
pub mod frames;
#[cfg(feature = "host")]
pub mod http_reply;
pub mod laws;
#[cfg(feature = "host")]
pub mod mcap;
#[cfg(feature = "host")]
pub mod oni_file;
#[cfg(feature = "host")]
pub mod page_message;
#[cfg(feature = "host")]
pub mod page_request;
#[cfg(feature = "host")]
pub mod path_file;
#[cfg(feature = "host")]
pub mod picture;
#[cfg(feature = "host")]
pub mod rig_file;
#[cfg(feature = "host")]
pub mod ros2_camera;
#[cfg(feature = "host")]
pub mod ros2_packet;
pub mod stored;
#[cfg(feature = "host")]
pub mod stream;
#[cfg(feature = "host")]
pub mod target_lines;
#[cfg(feature = "host")]
pub mod tum_folder;

pub use crate::fuzz_target::Target;

/// Every target.
pub const TARGETS: &[Target] = &[
    frames::TARGET,
    board::TARGET,
    laws::TARGET,
    configuration::TARGET,
    stored::TARGET,
    #[cfg(feature = "host")]
    rig_file::TARGET,
    #[cfg(feature = "host")]
    camera_file::TARGET,
    #[cfg(feature = "host")]
    calibration::TARGET,
    #[cfg(feature = "host")]
    tum_folder::TARGET,
    #[cfg(feature = "host")]
    oni_file::TARGET,
    #[cfg(feature = "host")]
    mcap::TARGET,
    #[cfg(feature = "host")]
    picture::TARGET,
    #[cfg(feature = "host")]
    stream::TARGET,
    #[cfg(feature = "host")]
    http_reply::TARGET,
    #[cfg(feature = "host")]
    page_message::TARGET,
    #[cfg(feature = "host")]
    page_request::TARGET,
    #[cfg(feature = "host")]
    ros2_camera::TARGET,
    #[cfg(feature = "host")]
    ros2_packet::TARGET,
    #[cfg(feature = "host")]
    path_file::TARGET,
    #[cfg(feature = "host")]
    target_lines::TARGET,
];

/// Returns the target of this name.
pub fn named(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
