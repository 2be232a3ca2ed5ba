//! A run in ROS 2: its options.

#[cfg_attr(feature = "ros2", path = "ros2/present.rs")]
#[cfg_attr(not(feature = "ros2"), path = "ros2/absent.rs")]
mod output;

use std::net::IpAddr;

use clap::Args;

use crate::cli::numbers;

pub(crate) use output::{Ros2, open_camera, open_recording};

#[derive(Args)]
pub(crate) struct Ros2Options {
    /// Join ROS 2: publish the ball, tf and diagnostics, take targets and a stop; the run goes on
    /// until Ctrl-C. Every computer in the domain that reaches this one can move the rig
    #[arg(long, value_parser = output::flag)]
    pub(crate) ros2: bool,
    /// Namespace of the node, its topics and services
    #[arg(long, value_name = "NAMESPACE", requires = "ros2", default_value = "/plumb")]
    pub(crate) ros2_namespace: String,
    /// Domain of ROS 2, 0 to 232 [default: ROS_DOMAIN_ID, or 0]
    #[arg(long, value_name = "DOMAIN", requires = "ros2", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u16>(0.0, 232.0, ""))]
    pub(crate) ros2_domain: Option<u16>,
    /// Address of the only network interface for ROS 2; 127.0.0.1 for this computer only [default:
    /// all; 127.0.0.1 with ROS_LOCALHOST_ONLY=1 or ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST]
    #[arg(long, value_name = "ADDRESS", requires = "ros2")]
    pub(crate) ros2_interface: Option<IpAddr>,
}
