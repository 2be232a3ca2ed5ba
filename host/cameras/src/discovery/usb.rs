//! Depth cameras among the USB devices that the kernel lists, also those without a driver, and the
//! known models.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::{fmt, fs};

use serde::{Serialize, Serializer};

/// Depth camera at the USB.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UsbCamera {
    /// Vendor and product, "1d27:0609".
    pub id: String,
    /// Name that the device states, else that of its model.
    pub name: String,
    /// Software that Plumb can use the camera through.
    #[serde(rename = "through")]
    pub support: Support,
    /// Path of its device file.
    pub node: PathBuf,
    /// Access to the device file.
    pub access: Access,
    /// Module of the Linux kernel that takes the camera for a webcam.
    #[serde(skip)]
    pub webcam_module: Option<&'static str>,
}

/// Access to a device file for reading and writing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Access {
    /// The file can be opened.
    Open,
    /// This user lacks the permission.
    Forbidden,
    /// The file cannot be opened for another reason.
    Absent,
}

/// Lists the depth cameras at the USB of the system whose root folder is `root`, ordered by device
/// file.
pub(super) fn cameras(root: &Path) -> Vec<UsbCamera> {
    let devices = fs::read_dir(root.join("sys/bus/usb/devices")).into_iter().flatten().flatten();
    let mut cameras: Vec<UsbCamera> =
        devices.filter_map(|entry| camera(root, &entry.path())).collect();
    cameras.sort_by(|a, b| a.node.cmp(&b.node));
    cameras
}

/// Reads the USB device in the folder `device`; `None` where it is no depth camera.
fn camera(root: &Path, device: &Path) -> Option<UsbCamera> {
    let text = |name: &str| Some(fs::read_to_string(device.join(name)).ok()?.trim().to_owned());
    let hex = |name: &str| u16::from_str_radix(&text(name)?, 16).ok();
    let number = |name: &str| text(name)?.parse::<u16>().ok();
    let (vendor, product) = (hex("idVendor")?, hex("idProduct")?);
    let model = model(vendor, product)?;
    let node = root.join(format!("dev/bus/usb/{:03}/{:03}", number("busnum")?, number("devnum")?));
    Some(UsbCamera {
        id: format!("{vendor:04x}:{product:04x}"),
        name: text("product").unwrap_or_else(|| model.name.to_owned()),
        support: model.support,
        access: access(&node),
        node,
        webcam_module: model.webcam_module,
    })
}

/// Checks whether a device file can be opened.
fn access(node: &Path) -> Access {
    match fs::OpenOptions::new().read(true).write(true).open(node) {
        Ok(_) => Access::Open,
        Err(error) if error.kind() == ErrorKind::PermissionDenied => Access::Forbidden,
        Err(_) => Access::Absent,
    }
}

/// Returns the obstacles to the use of these cameras, each with its remedy.
pub(super) fn missing(root: &Path, cameras: &[UsbCamera]) -> Vec<String> {
    let mut missing: Vec<String> =
        cameras.iter().flat_map(|camera| obstacles(root, camera)).collect();
    let modules = fs::read_to_string(root.join("proc/modules")).unwrap_or_default();
    let mut webcam_modules: Vec<&str> = cameras.iter().filter_map(|c| c.webcam_module).collect();
    webcam_modules.dedup();
    for module in webcam_modules {
        if modules.lines().any(|line| line.starts_with(module)) {
            missing.push(format!(
                "the kernel takes the Kinect for a webcam: as root, modprobe -r {module}"
            ));
        }
    }
    missing
}

/// Returns the obstacles to the use of one camera.
fn obstacles(root: &Path, camera: &UsbCamera) -> Vec<String> {
    let UsbCamera { id, name, node, support, .. } = camera;
    let camera_text = format!("{name} ({id}) at {}", node.display());
    let access = match camera.access {
        Access::Open => None,
        Access::Forbidden => {
            Some(format!("{camera_text}: this user may not open it. {}", permission(root, support)))
        }
        Access::Absent => Some(format!(
            "{camera_text}: its device file cannot be opened; in a container, hand it in \
             (--device /dev/bus/usb)"
        )),
    };
    let software = match support {
        Support::Openni | Support::Realsense => None,
        Support::OpenniDriver(_) | Support::None => {
            Some(format!("{camera_text}: works through {support}"))
        }
    };
    access.into_iter().chain(software).collect()
}

/// Returns the remedy for a camera that this user may not open.
fn permission(root: &Path, support: &Support) -> String {
    let (mark, package) = match support {
        Support::Realsense => ("realsense", "librealsense2-udev-rules (Intel's repository)"),
        _ => ("openni", "libopenni2-0"),
    };
    let folders = ["lib/udev/rules.d", "usr/lib/udev/rules.d", "etc/udev/rules.d"]
        .map(|folder| root.join(folder));
    let mut rules = folders.iter().filter_map(|f| fs::read_dir(f).ok()).flatten().flatten();
    if rules.any(|rule| rule.file_name().to_string_lossy().contains(mark)) {
        "There are udev rules for it: unplug it and plug it in again, or join the group video \
         (usermod -aG video USER)"
            .to_owned()
    } else {
        format!(
            "There are no udev rules for it: install {package}, which has them, and plug it in \
             again"
        )
    }
}

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

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// Returns the root folder of a system with the USB devices (vendor, product, name).
    fn system(devices: &[(&str, &str, Option<&str>)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (i, (vendor, product, name)) in devices.iter().enumerate() {
            let folder = root.path().join(format!("sys/bus/usb/devices/1-{i}"));
            fs::create_dir_all(&folder).unwrap();
            let number = (i + 2).to_string();
            let files = [
                ("idVendor", *vendor),
                ("idProduct", *product),
                ("busnum", "1"),
                ("devnum", &number),
            ];
            for (file, text) in files.into_iter().chain(name.map(|name| ("product", name))) {
                fs::write(folder.join(file), format!("{text}\n")).unwrap();
            }
            let bus = root.path().join("dev/bus/usb/001");
            fs::create_dir_all(&bus).unwrap();
            fs::write(bus.join(format!("{:03}", i + 2)), "").unwrap();
        }
        root
    }

    #[test]
    fn only_depth_cameras_are_listed() {
        let root = system(&[
            ("1d6b", "0002", Some("a hub")),
            ("1d27", "0609", Some("PrimeSense Device")),
            ("046d", "c077", Some("a mouse")),
            ("045e", "02ae", None),
            ("8086", "0001", Some("a hub of Intel's")),
        ]);
        let found = cameras(root.path());
        let names: Vec<_> =
            found.iter().map(|camera| (camera.id.as_str(), camera.name.as_str())).collect();
        assert_eq!(
            names,
            [("1d27:0609", "PrimeSense Device"), ("045e:02ae", "Kinect (Xbox 360, for Windows)")]
        );
        assert!(found.iter().all(|camera| camera.access == Access::Open));
        assert!(found[0].node.ends_with("dev/bus/usb/001/003"), "{:?}", found[0].node);
        let texts = missing(root.path(), &found);
        assert_eq!(texts.len(), 1);
        assert!(texts[0].contains("FreenectDriver"), "{texts:?}");
        assert_eq!(cameras(&root.path().join("nowhere")), []);
    }

    #[test]
    fn each_obstacle_is_listed_with_its_remedy() {
        let root = system(&[("1d27", "0601", None)]);
        let forbidden = |rules: bool| {
            let found =
                [UsbCamera { access: Access::Forbidden, ..cameras(root.path())[0].clone() }];
            if rules {
                let folder = root.path().join("lib/udev/rules.d");
                fs::create_dir_all(&folder).unwrap();
                fs::write(folder.join("60-libopenni2-0.rules"), "").unwrap();
            }
            missing(root.path(), &found)[0].clone()
        };
        let text = forbidden(false);
        assert!(text.contains("may not open") && text.contains("install libopenni2-0"), "{text}");
        assert!(forbidden(true).contains("group video"));
        fs::remove_file(root.path().join("dev/bus/usb/001/002")).unwrap();
        let found = cameras(root.path());
        assert_eq!(found[0].access, Access::Absent);
        assert!(missing(root.path(), &found)[0].contains("container"));
    }

    #[test]
    fn a_realsense_camera_has_udev_rules_of_its_own() {
        let root = system(&[("8086", "0b07", None)]);
        let found = [UsbCamera { access: Access::Forbidden, ..cameras(root.path())[0].clone() }];
        let folder = root.path().join("lib/udev/rules.d");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("60-libopenni2-0.rules"), "").unwrap();
        let texts = missing(root.path(), &found);
        assert!(texts[0].contains("install librealsense2-udev-rules"), "{texts:?}");
        fs::write(folder.join("99-realsense-libusb.rules"), "").unwrap();
        let texts = missing(root.path(), &found);
        assert!(texts.len() == 1 && texts[0].contains("group video"), "{texts:?}");
    }

    #[test]
    fn access_without_permission_is_forbidden() {
        let root = system(&[("1d27", "0601", None)]);
        let node = root.path().join("dev/bus/usb/001/002");
        fs::set_permissions(&node, fs::Permissions::from_mode(0o000)).unwrap();
        // Root may open everything.
        let expected = if fs::File::open(&node).is_ok() { Access::Open } else { Access::Forbidden };
        assert_eq!(access(&node), expected);
    }

    #[test]
    fn a_kinect_that_the_kernel_took_is_listed() {
        let root = system(&[("045e", "02ae", None)]);
        fs::create_dir_all(root.path().join("proc")).unwrap();
        fs::write(root.path().join("proc/modules"), "gspca_kinect 16384 0 - Live 0x0\n").unwrap();
        let texts = missing(root.path(), &cameras(root.path()));
        assert!(texts.iter().any(|text| text.contains("modprobe -r gspca_kinect")), "{texts:?}");
    }
}
