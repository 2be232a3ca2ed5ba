//! Discovery of cameras, and of what is missing to use them (`plumb cameras`).

mod models;
mod usb;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use crate::driver::{FoundCamera, LibraryState, LibraryStatus};
use crate::drivers::DRIVERS;
use crate::settings::SourceName;

pub use models::Support;
pub use usb::{Access, UsbCamera};

/// Cameras that are plugged in, and what is missing to use them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Discovery {
    /// Libraries of the drivers that need one.
    #[serde(flatten)]
    pub libraries: BTreeMap<SourceName, LibraryStatus>,
    /// Cameras that can be opened now.
    pub cameras: Vec<FoundCamera>,
    /// Depth cameras at the USB, whether they can be opened or not.
    pub usb: Vec<UsbCamera>,
    /// What is missing and how to mend it, in the order in which to do it.
    pub missing: Vec<String>,
}

/// Lists the cameras of every driver, and the depth cameras among the USB devices of the
/// system whose root folder is `root` ("/").
pub fn discover(root: &Path) -> Discovery {
    let usb = usb::cameras(root);
    let (mut libraries, mut cameras, mut missing) = (BTreeMap::new(), Vec::new(), Vec::new());
    for driver in DRIVERS {
        let listing = driver.list();
        cameras.extend(listing.cameras);
        libraries.extend(listing.library.map(|library| (driver.name(), library)));
    }
    for (&name, library) in &libraries {
        if let LibraryState::Absent { error } = &library.state
            && (cameras.is_empty() || is_wanted(name, &usb))
        {
            missing.push(error.clone());
        }
    }
    missing.extend(usb::missing(root, &usb));
    if missing.is_empty() && cameras.is_empty() {
        missing.push(nothing_found(&usb).to_owned());
    }
    Discovery { libraries, cameras, usb, missing }
}

/// Returns whether a camera at the USB needs the library of the driver `name`.
fn is_wanted(name: SourceName, usb: &[UsbCamera]) -> bool {
    usb.iter().any(|camera| match camera.support {
        Support::Openni | Support::OpenniDriver(_) => name == SourceName::Openni,
        Support::Realsense => name == SourceName::Realsense,
        Support::None => false,
    })
}

/// Returns why no camera can be opened where nothing else is missing.
fn nothing_found(usb: &[UsbCamera]) -> &'static str {
    if usb.is_empty() {
        "no depth camera is plugged in; with `source = \"stream\"` in the rig file, any program \
         that has pictures is a camera"
    } else {
        "no driver takes the camera that is plugged in; unplug it and plug it in again"
    }
}
