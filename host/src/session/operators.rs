//! Ways to steer a run: the page and ROS 2.

use plumb_frame::clock::LiveClock;
use plumb_page::Page;
use plumb_runtime::observer::Observer;
use plumb_runtime::operator::{OperatorReceiver, OperatorSender};
use plumb_runtime::rig::Rig;
use plumb_vision::camera::Camera;

use crate::cli::exit::Failure;
use crate::session::options::RunOptions;
use crate::session::ros2::Ros2;

/// Ways to steer a run. All of them send to the same operator.
pub(crate) struct Operators {
    page: Option<Page>,
    ros2: Ros2,
    /// Receiver of the commands; `None` where no option asks for a way to steer.
    operator: Option<OperatorReceiver>,
}

impl Operators {
    /// Starts what the options of a run ask for, with the two ends of its operator.
    ///
    /// # Errors
    /// Where the page cannot listen at its address, or ROS 2 cannot be joined.
    pub(crate) fn start(
        options: &RunOptions,
        rig: &Rig,
        camera: &Camera,
        (sender, receiver): (OperatorSender, OperatorReceiver),
    ) -> Result<Self, Failure> {
        let page = options.page.start(rig, camera, &sender)?;
        let mut ros2 = options.ros2.start(camera, &sender)?;
        let is_steered = page.is_some() || ros2.observer().is_some();
        Ok(Self { page, ros2, operator: is_steered.then_some(receiver) })
    }

    /// Removes and returns the receiver of the commands; `None` where nothing steers the run.
    pub(crate) fn take_operator(&mut self) -> Option<OperatorReceiver> {
        self.operator.take()
    }

    /// Removes and returns the page, which may outlive the run to offer its files.
    pub(crate) fn take_page(&mut self) -> Option<Page> {
        self.page.take()
    }

    /// Returns the observers of a run whose frames `clock` stamps; `None` where it stands.
    pub(crate) fn observers(
        &mut self,
        clock: Option<LiveClock>,
    ) -> impl Iterator<Item = &mut dyn Observer> {
        self.ros2.set_clock(clock);
        let page = self.page.as_mut().map(|page| page as &mut dyn Observer);
        page.into_iter().chain(self.ros2.observer())
    }
}
