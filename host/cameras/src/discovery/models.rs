//! Known models of USB depth cameras.

use std::fmt;

use serde::{Serialize, Serializer};

/// Model of a depth camera.
pub(super) struct Model {
    /// USB vendor.
    vendor: u16,
    /// USB products; empty for every product of the vendor.
    products: &'static [u16],
    /// Maker and model.
    pub(super) name: &'static str,
    /// Software that Plumb can use the camera through.
    pub(super) support: Support,
    /// Module of the Linux kernel that takes the camera for a webcam.
    pub(super) webcam_module: Option<&'static str>,
}

/// Software that Plumb can use a camera through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// OpenNI2 with the drivers of the package libopenni2-0.
    Openni,
    /// OpenNI2 with this driver, which the package libopenni2-0 lacks.
    OpenniDriver(&'static str),
    /// librealsense2.
    Realsense,
    /// None yet.
    None,
}

impl fmt::Display for Support {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Openni => f.write_str("OpenNI2 (libopenni2-0)"),
            Self::OpenniDriver(driver) => {
                write!(f, "OpenNI2 with {driver}, which is not in libopenni2-0")
            }
            Self::Realsense => f.write_str("librealsense2"),
            Self::None => f.write_str(
                "nothing yet: record a TUM RGB-D folder with it, or add a source \
                 (docs/change/add-camera.md)",
            ),
        }
    }
}

impl Serialize for Support {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Known models. The products are those of the makers' udev rules.
const MODELS: [Model; 6] = [
    Model {
        vendor: 0x1d27,
        products: &[],
        name: "PrimeSense camera (Carmine, ASUS Xtion)",
        support: Support::Openni,
        webcam_module: None,
    },
    Model {
        vendor: 0x045e,
        products: &[0x02ae, 0x02bf],
        name: "Kinect (Xbox 360, for Windows)",
        support: Support::OpenniDriver("libfreenect's driver FreenectDriver"),
        webcam_module: Some("gspca_kinect"),
    },
    Model {
        vendor: 0x045e,
        products: &[0x02c4, 0x02d8, 0x02d9],
        name: "Kinect v2",
        support: Support::OpenniDriver("libfreenect2's driver"),
        webcam_module: None,
    },
    Model {
        vendor: 0x2bc5,
        products: &[],
        name: "Orbbec camera",
        support: Support::OpenniDriver("Orbbec's driver"),
        webcam_module: None,
    },
    Model {
        vendor: 0x8086,
        products: &[0x0ad2, 0x0ad3, 0x0ad4, 0x0b07, 0x0b3a, 0x0b5b, 0x0b5c, 0x0b64],
        name: "RealSense camera",
        support: Support::Realsense,
        webcam_module: None,
    },
    Model {
        vendor: 0x03e7,
        products: &[],
        name: "Luxonis OAK camera",
        support: Support::None,
        webcam_module: None,
    },
];

/// Returns the model with these USB identifiers; `None` for other devices.
pub(super) fn model(vendor: u16, product: u16) -> Option<&'static Model> {
    MODELS.iter().find(|model| {
        model.vendor == vendor && (model.products.is_empty() || model.products.contains(&product))
    })
}
