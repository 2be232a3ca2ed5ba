//! Discovery of cameras, and of what is missing to use them (`plumb cameras`).

mod usb;

use std::collections::BTreeMap;
use std::path::Path;

use plumb_frame::driver::{DriverListing, FoundCamera, LibraryState, LibraryStatus};
use serde::Serialize;

use crate::settings::{CameraSettings, SourceName};

pub use usb::{Access, Support, UsbCamera};

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
    let settings = CameraSettings::new("");
    let listed = |&name: &SourceName| settings.driver(name).map(|driver| (name, driver.list()));
    let listings = SourceName::ALL.iter().filter_map(listed).collect();
    let (cameras, libraries, mut missing) = merge(listings, &usb);
    missing.extend(usb::missing(root, &usb));
    if missing.is_empty() && cameras.is_empty() {
        missing.push(nothing_found(&usb).to_owned());
    }
    Discovery { libraries, cameras, usb, missing }
}

/// Returns the cameras and libraries of all drivers, and what is missing: a library where no depth
/// camera can be opened, or where one of those at the USB needs it.
fn merge(
    listings: Vec<(SourceName, DriverListing)>,
    usb: &[UsbCamera],
) -> (Vec<FoundCamera>, BTreeMap<SourceName, LibraryStatus>, Vec<String>) {
    let (mut cameras, mut libraries, mut missing) = (Vec::new(), BTreeMap::new(), Vec::new());
    let has_depth_camera = listings
        .iter()
        .any(|(_, listing)| listing.library.is_some() && !listing.cameras.is_empty());
    for (name, listing) in listings {
        if let Some(LibraryStatus { state: LibraryState::Absent { error }, .. }) = &listing.library
            && (!has_depth_camera || is_wanted(name, usb))
        {
            missing.push(error.clone());
        }
        cameras.extend(listing.cameras);
        missing.extend(listing.missing);
        libraries.extend(listing.library.map(|library| (name, library)));
    }
    (cameras, libraries, missing)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_webcam_does_not_hide_what_a_depth_camera_needs() {
        let found = |name: &str| FoundCamera { uri: name.to_owned(), name: name.to_owned() };
        let absent = LibraryState::Absent { error: "install it".to_owned() };
        let library = Some(LibraryStatus { name: "librealsense2", state: absent });
        let realsense = DriverListing { library, ..DriverListing::default() };
        let webcams = DriverListing { cameras: vec![found("webcam")], ..DriverListing::default() };
        let listings = |openni: &DriverListing| {
            vec![
                (SourceName::Openni, openni.clone()),
                (SourceName::Realsense, realsense.clone()),
                (SourceName::Webcam, webcams.clone()),
            ]
        };
        let (cameras, _, missing) = merge(listings(&DriverListing::default()), &[]);
        assert_eq!((cameras, missing), (vec![found("webcam")], vec!["install it".to_owned()]));
        // A depth camera that can be opened needs no other library.
        let (version, drivers) = ("2.2".to_owned(), Vec::new());
        let state = LibraryState::Loaded { version, drivers };
        let library = Some(LibraryStatus { name: "OpenNI2", state });
        let cameras = vec![found("depth")];
        let openni = DriverListing { library, cameras, ..DriverListing::default() };
        assert_eq!(merge(listings(&openni), &[]).2, Vec::<String>::new());
    }
}
