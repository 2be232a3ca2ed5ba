//! Closed loops over links that take time, lose frames and are interrupted: the real session, drive
//! and link before an emulated board whose wire is the link.

mod camera;
mod check;
mod run;
mod table;

pub use camera::{FixedDetector, TrackingCamera};
pub use check::{Verdict, check_run};
pub use run::{Leg, Outcome, Run, in_real_time, in_virtual_time};
pub use table::{Expected, LinkCase, link, links, usable_links};
