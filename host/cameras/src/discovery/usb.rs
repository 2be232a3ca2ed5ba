//! Depth cameras at the USB, as the kernel tells of them: also those that no library sees.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Serialize;

/// A depth camera at the USB.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UsbCamera {
    /// Vendor and product, "1d27:0609".
    pub id: String,
    /// What it is.
    pub name: String,
    /// Through what it can be used.
    pub through: &'static str,
    /// Its device file.
    pub node: PathBuf,
    /// Whether it can be opened.
    pub access: Access,
}

/// Whether a device file can be opened for reading and writing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Access {
    /// It can.
    Open,
    /// This user may not.
    Forbidden,
    /// Otherwise not.
    Absent,
}

/// A kind of camera.
struct Kind {
    vendor: u16,
    /// Its products; none for every product of the vendor.
    products: &'static [u16],
    name: &'static str,
    through: &'static str,
}

/// What is known of depth cameras. The products are those of the makers' udev rules.
const KINDS: [Kind; 6] = [
    Kind {
        vendor: 0x1d27,
        products: &[],
        name: "PrimeSense camera (Carmine, ASUS Xtion)",
        through: "OpenNI2 (libopenni2-0)",
    },
    Kind {
        vendor: 0x045e,
        products: &[0x02ae, 0x02bf],
        name: "Kinect (Xbox 360, for Windows)",
        through: "OpenNI2 with libfreenect's driver FreenectDriver, which is not in libopenni2-0",
    },
    Kind {
        vendor: 0x045e,
        products: &[0x02c4, 0x02d8, 0x02d9],
        name: "Kinect v2",
        through: "OpenNI2 with libfreenect2's driver, which is not in libopenni2-0",
    },
    Kind {
        vendor: 0x2bc5,
        products: &[],
        name: "Orbbec camera",
        through: "OpenNI2 with Orbbec's driver, which is not in libopenni2-0",
    },
    Kind {
        vendor: 0x8086,
        products: &[0x0ad2, 0x0ad3, 0x0ad4, 0x0b07, 0x0b3a, 0x0b5b, 0x0b5c, 0x0b64],
        name: "RealSense camera",
        through: "nothing yet: record a TUM RGB-D folder with it, or add a source \
                  (docs/change/add-camera.md)",
    },
    Kind {
        vendor: 0x03e7,
        products: &[],
        name: "Luxonis OAK camera",
        through: "nothing yet: record a TUM RGB-D folder with it, or add a source \
                  (docs/change/add-camera.md)",
    },
];

/// The kernel's module that takes a Kinect for a webcam.
const KINECT_MODULE: &str = "gspca_kinect";

/// The depth cameras at the USB of the system whose root is `root`.
pub(super) fn cameras(root: &Path) -> Vec<UsbCamera> {
    let devices = fs::read_dir(root.join("sys/bus/usb/devices")).into_iter().flatten().flatten();
    let mut cameras: Vec<UsbCamera> =
        devices.filter_map(|entry| camera(root, &entry.path())).collect();
    cameras.sort_by(|a, b| a.node.cmp(&b.node));
    cameras
}

fn camera(root: &Path, device: &Path) -> Option<UsbCamera> {
    let text = |name: &str| Some(fs::read_to_string(device.join(name)).ok()?.trim().to_owned());
    let hex = |name: &str| u16::from_str_radix(&text(name)?, 16).ok();
    let number = |name: &str| text(name)?.parse::<u16>().ok();
    let (vendor, product) = (hex("idVendor")?, hex("idProduct")?);
    let kind = KINDS.iter().find(|kind| {
        kind.vendor == vendor && (kind.products.is_empty() || kind.products.contains(&product))
    })?;
    let node = root.join(format!("dev/bus/usb/{:03}/{:03}", number("busnum")?, number("devnum")?));
    Some(UsbCamera {
        id: format!("{vendor:04x}:{product:04x}"),
        name: text("product").unwrap_or_else(|| kind.name.to_owned()),
        through: kind.through,
        access: access(&node),
        node,
    })
}

fn access(node: &Path) -> Access {
    match fs::OpenOptions::new().read(true).write(true).open(node) {
        Ok(_) => Access::Open,
        Err(error) if error.kind() == ErrorKind::PermissionDenied => Access::Forbidden,
        Err(_) => Access::Absent,
    }
}

/// What keeps these cameras from being used, and what to do.
pub(super) fn missing(root: &Path, cameras: &[UsbCamera]) -> Vec<String> {
    let mut missing = Vec::new();
    for camera in cameras {
        let what = format!("{} ({}) at {}", camera.name, camera.id, camera.node.display());
        match camera.access {
            Access::Open => {}
            Access::Forbidden => {
                missing.push(format!("{what}: this user may not open it. {}", permission(root)))
            }
            Access::Absent => missing.push(format!(
                "{what}: its device file cannot be opened; in a container, hand it in (--device /dev/bus/usb)"
            )),
        }
        if !camera.through.starts_with("OpenNI2 (") {
            missing.push(format!("{what}: works through {}", camera.through));
        }
    }
    let kinect =
        cameras.iter().any(|camera| camera.id.starts_with("045e:02a") || camera.id == "045e:02bf");
    let modules = fs::read_to_string(root.join("proc/modules")).unwrap_or_default();
    if kinect && modules.lines().any(|line| line.starts_with(KINECT_MODULE)) {
        missing.push(format!(
            "the kernel takes the Kinect for a webcam: as root, modprobe -r {KINECT_MODULE}"
        ));
    }
    missing
}

/// What to do about a camera that may not be opened.
fn permission(root: &Path) -> String {
    let folders = ["lib/udev/rules.d", "usr/lib/udev/rules.d", "etc/udev/rules.d"]
        .map(|folder| root.join(folder));
    let rules = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
    let known =
        rules.filter(|rule| rule.file_name().to_string_lossy().contains("openni")).count() > 0;
    if known {
        "There are udev rules for it: unplug it and plug it in again, or join the group video (usermod -aG video USER)"
            .to_owned()
    } else {
        "There are no udev rules for it: install libopenni2-0, which has them, and plug it in again"
            .to_owned()
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// A system with the USB devices (vendor, product, name) and nothing else.
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
    fn depth_cameras_are_told_from_mice() {
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
    fn what_a_camera_lacks_is_said() {
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
    fn a_file_that_this_user_may_not_open_is_forbidden() {
        let root = system(&[("1d27", "0601", None)]);
        let node = root.path().join("dev/bus/usb/001/002");
        fs::set_permissions(&node, fs::Permissions::from_mode(0o000)).unwrap();
        // Root may open everything.
        let expected = if fs::File::open(&node).is_ok() { Access::Open } else { Access::Forbidden };
        assert_eq!(access(&node), expected);
    }

    #[test]
    fn a_kinect_that_the_kernel_took_is_told_of() {
        let root = system(&[("045e", "02ae", None)]);
        fs::create_dir_all(root.path().join("proc")).unwrap();
        fs::write(root.path().join("proc/modules"), "gspca_kinect 16384 0 - Live 0x0\n").unwrap();
        let texts = missing(root.path(), &cameras(root.path()));
        assert!(texts.iter().any(|text| text.contains("modprobe -r gspca_kinect")), "{texts:?}");
    }
}
