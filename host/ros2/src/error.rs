//! Failure to join ROS 2.

use std::io;
use std::net::IpAddr;

use plumb_frame::source::BoxedError;
use thiserror::Error;

/// Largest domain whose ports exist: 7400 + 250 * 232 + 11 + 2 * 119 < 65536.
pub const MAX_DOMAIN: u16 = 232;

/// Failure to join ROS 2.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Ros2Error {
    /// The namespace breaks the rules of ROS 2.
    #[error(
        "`{0}` is no namespace of ROS 2: its parts, between slashes, begin with a letter and have \
         letters, digits and single underscores, as in /hall/left"
    )]
    Namespace(String),
    /// The domain is out of range.
    #[error("the ROS 2 domain {0} is out of range: 0 to {MAX_DOMAIN}")]
    Domain(u16),
    /// The variable `ROS_DOMAIN_ID` is no domain.
    #[error("the variable ROS_DOMAIN_ID is `{0}`, which is no domain: 0 to {MAX_DOMAIN}")]
    DomainVariable(String),
    /// A variable has a value with which other programs and this node do not find each other.
    #[error("the variable {name} is `{value}`, {why}")]
    Variable {
        /// Name of the variable.
        name: &'static str,
        /// Its value.
        value: String,
        /// Why no other program is found, and what is possible.
        why: &'static str,
    },
    /// No interface of this computer has the address.
    #[error(
        "no network interface of this computer has the address {address}; `ip address` lists them"
    )]
    Interface {
        /// The address.
        address: IpAddr,
        /// Cause.
        source: io::Error,
    },
    /// The domain cannot be joined.
    #[error(
        "cannot join the ROS 2 domain {domain}: is there a network interface, and are fewer than \
         120 programs in this domain on this computer?"
    )]
    Join {
        /// The domain.
        domain: u16,
        /// Cause.
        source: BoxedError,
    },
    /// A topic or service cannot be created.
    #[error("cannot create the ROS 2 topic or service {name}")]
    Endpoint {
        /// Its name.
        name: String,
        /// Cause.
        source: BoxedError,
    },
    /// The thread of the node cannot be started.
    #[error("cannot start the thread of the ROS 2 node")]
    Thread(#[source] io::Error),
}

impl Ros2Error {
    /// Returns what makes the error of a topic or service out of its cause.
    pub(crate) fn of_endpoint<E: Into<BoxedError>>(name: &str) -> impl Fn(E) -> Self + '_ {
        |source| Self::Endpoint { name: name.to_owned(), source: source.into() }
    }
}
