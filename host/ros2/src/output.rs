//! Observer that publishes a run in ROS 2.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use nalgebra::Isometry3;
use plumb_frame::clock::LiveClock;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer};
use plumb_runtime::operator::OperatorSender;
use plumb_runtime::run::Summary;

use crate::error::Ros2Error;
use crate::feed::Feed;
use crate::namespace::Namespace;
use crate::network::Network;
use crate::node_loop::NodeLoop;

/// Longest time that leaving ROS 2 takes. The DDS library may wait for ever for its threads.
const LEAVE: Duration = Duration::from_secs(3);

/// Settings of a node.
#[derive(Debug, Clone, PartialEq)]
pub struct Ros2Settings {
    /// Namespace of the rig.
    pub namespace: Namespace,
    /// Domain and network interface.
    pub network: Network,
    /// Pose of the camera in the rig frame, metres.
    pub camera: Isometry3<f64>,
}

/// Observer that publishes a run in ROS 2, and sends the commands of other nodes to it.
///
/// Its methods only write into a bounded memory, which a thread reads: it needs no queue. The node
/// leaves ROS 2 when the observer is dropped; after 3 s its thread is left to itself.
pub struct Ros2Output {
    feed: Arc<Feed>,
    /// Disconnected once the node has left ROS 2.
    left: Receiver<()>,
}

impl Ros2Output {
    /// Joins ROS 2 with a node that sends its commands to `operator`.
    ///
    /// # Errors
    /// Where the domain or the interface does not exist, or a topic cannot be created.
    pub fn start(settings: &Ros2Settings, operator: OperatorSender) -> Result<Self, Ros2Error> {
        let node = NodeLoop::new(settings, operator)?;
        let feed = node.feed();
        let (leaving, left) = channel();
        let run = move || {
            // Dropped last, also by a panic.
            let _leaving = leaving;
            node.run();
        };
        thread::Builder::new().name("ros2".to_owned()).spawn(run).map_err(Ros2Error::Thread)?;
        Ok(Self { feed, left })
    }

    /// Sets the clock that stamps the run's frames, before the first of them: the stamps of the
    /// messages are then the wall clock at the exposure of the frames. Without it they are later by
    /// the age of the first frame.
    pub fn set_clock(&self, clock: LiveClock) {
        self.feed.set_clock(clock);
    }
}

impl Observer for Ros2Output {
    fn frame(&mut self, record: &FrameRecord) {
        self.feed.frame(record);
    }

    fn event(&mut self, record: &EventRecord) {
        self.feed.event(&record.event);
    }

    fn end(&mut self, summary: &Summary) {
        self.feed.end(summary);
    }
}

impl Drop for Ros2Output {
    fn drop(&mut self) {
        self.feed.close();
        if self.left.recv_timeout(LEAVE) == Err(RecvTimeoutError::Timeout) {
            tracing::warn!("ROS 2 has not been left within {LEAVE:?}");
        }
    }
}
