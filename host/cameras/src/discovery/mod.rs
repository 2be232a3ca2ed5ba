//! What cameras are there, and what they lack (`plumb cameras`).

mod usb;

use std::path::Path;

use plumb_openni::OpenNi;
use serde::Serialize;

pub use usb::{Access, UsbCamera};

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Discovery {
    /// The library OpenNI2.
    pub openni: Library,
    /// Cameras that can be opened now.
    pub cameras: Vec<Found>,
    /// Depth cameras at the USB, whether they can be opened or not.
    pub usb: Vec<UsbCamera>,
    /// What is missing, and what to do about it, in the order to do it in.
    pub missing: Vec<String>,
}

/// The library OpenNI2.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Library {
    /// It is there.
    Loaded {
        /// Its version.
        version: String,
        /// Its drivers' file names.
        drivers: Vec<String>,
    },
    /// It is not, or does not begin.
    Absent {
        /// Why.
        error: String,
    },
}

/// A camera that can be opened now.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// What it is opened by: `uri` in a rig file.
    pub uri: String,
    /// Who made it, and what it is called.
    pub name: String,
}

/// Looks what is there: asks OpenNI2, and looks through the USB devices of the system whose root is
/// `root` ("/").
pub fn discover(root: &Path) -> Discovery {
    let usb = usb::cameras(root);
    let mut missing = Vec::new();
    let (openni, cameras) = match OpenNi::load().and_then(|openni| Ok((openni.devices()?, openni)))
    {
        Ok((devices, openni)) => {
            let drivers: Vec<String> = openni
                .drivers()
                .iter()
                .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
                .collect();
            let found = |device: plumb_openni::DeviceInfo| Found {
                uri: device.uri,
                name: format!("{} {}", device.vendor, device.name).trim().to_owned(),
            };
            let cameras = devices.into_iter().map(found).collect();
            (Library::Loaded { version: openni.version(), drivers }, cameras)
        }
        Err(error) => {
            missing.push(error.to_string());
            (Library::Absent { error: error.to_string() }, Vec::new())
        }
    };
    missing.extend(usb::missing(root, &usb));
    if missing.is_empty() && cameras.is_empty() {
        missing.push(match usb.is_empty() {
            true => "no depth camera is plugged in".to_owned(),
            false => {
                "no driver of OpenNI2 takes the camera that is plugged in; unplug it and plug it in again"
                    .to_owned()
            }
        });
    }
    Discovery { openni, cameras, usb, missing }
}
