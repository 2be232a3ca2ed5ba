//! Closed loops over links with delay, loss and interruption: the real control loop and link, and
//! an emulated board whose wire is the link under test.

mod camera;
mod check;
mod run;
mod table;

pub use camera::{FixedDetector, TrackingCamera, tracking_frame};
pub use check::{Verdict, check_run};
pub use run::{Leg, LinkRun, Outcome, in_real_time, in_virtual_time};
pub use table::{Expected, LinkCase, link, links, usable_links};
