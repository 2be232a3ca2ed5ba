//! Listing of the video devices that deliver pictures, with names that stay after a restart.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::WebcamError;
use crate::kernel::KernelNode;

/// Video device that delivers pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CaptureNode {
    /// `/dev/videoN`.
    path: PathBuf,
    /// Name that the camera states.
    pub(crate) name: String,
    /// Path that stays after a restart, where there is one.
    pub(crate) stable: PathBuf,
}

/// Lists the video devices of this computer that deliver pictures.
pub(crate) fn capture_nodes() -> Vec<CaptureNode> {
    list(Path::new("/"), |path| KernelNode::open(path).map(drop))
}

/// Lists the video devices below the folder `root` for which `open` succeeds. Where this user may
/// not open one, it counts if it is the first of its camera: others deliver metadata.
fn list(root: &Path, open: impl Fn(&Path) -> io::Result<()>) -> Vec<CaptureNode> {
    let entries = fs::read_dir(root.join("sys/class/video4linux"));
    let mut nodes: Vec<CaptureNode> = entries
        .into_iter()
        .flatten()
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let text = |name| fs::read_to_string(entry.path().join(name)).unwrap_or_default();
            let path = root.join("dev").join(entry.file_name());
            let delivers = match open(&path) {
                Ok(()) => true,
                Err(error) => {
                    error.kind() == io::ErrorKind::PermissionDenied && text("index").trim() == "0"
                }
            };
            let name = text("name").trim().to_owned();
            delivers.then(|| CaptureNode { stable: path.clone(), path, name })
        })
        .collect();
    nodes.sort_by(|a, b| a.path.cmp(&b.path));
    let by_id: Vec<_> = nodes.iter().map(|node| link(root, "by-id", &node.path)).collect();
    // Cameras of one model without a serial number share a name there, which leads to one of them.
    let names: Vec<_> = nodes.iter().map(|node| node.name.clone()).collect();
    let is_unique =
        |name: &str| names.iter().zip(&by_id).all(|(other, link)| other != name || link.is_some());
    for (node, id) in nodes.iter_mut().zip(&by_id) {
        let id = id.clone().filter(|_| is_unique(&node.name));
        if let Some(link) = id.or_else(|| link(root, "by-path", &node.path)) {
            node.stable = link;
        }
    }
    nodes
}

/// Returns the first link to the device `path` in a folder of `/dev/v4l`.
fn link(root: &Path, folder: &str, path: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(root.join("dev/v4l").join(folder)).ok()?;
    let links = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let target = fs::canonicalize(path).ok()?;
    links.filter(|link| fs::canonicalize(link).is_ok_and(|it| it == target)).min()
}

/// Returns the path of the device that a rig file names: by its number ("0" is `/dev/video0`), by
/// its path, or not at all where there is one camera.
///
/// # Errors
/// Where a number, or no name, could be one of several cameras: the numbers change with a restart.
pub(crate) fn find(device: Option<&str>, nodes: &[CaptureNode]) -> Result<PathBuf, WebcamError> {
    let path = match device {
        Some(name) => match name.parse::<u16>() {
            Ok(number) => PathBuf::from(format!("/dev/video{number}")),
            Err(_) => PathBuf::from(name),
        },
        None => nodes.first().ok_or(WebcamError::NoCamera)?.stable.clone(),
    };
    let is_numbered = path.to_string_lossy().strip_prefix("/dev/video").is_some();
    match nodes {
        [_, _, ..] if device.is_none() || is_numbered => Err(WebcamError::Several {
            paths: nodes.iter().map(|node| node.stable.clone()).collect(),
        }),
        _ => Ok(path),
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use nix::errno::Errno;

    use super::*;

    /// Makes the folders of a computer with these devices: number, index, name, and the names of
    /// its links by id and by path.
    fn computer(devices: &[(u32, &str, &str, Option<&str>, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let links = root.path().join("dev/v4l");
        for folder in ["by-id", "by-path"] {
            fs::create_dir_all(links.join(folder)).unwrap();
        }
        for (number, index, name, id, path) in devices {
            let device = root.path().join(format!("sys/class/video4linux/video{number}"));
            fs::create_dir_all(&device).unwrap();
            fs::write(device.join("index"), format!("{index}\n")).unwrap();
            fs::write(device.join("name"), format!("{name}\n")).unwrap();
            let target = root.path().join(format!("dev/video{number}"));
            fs::write(&target, "").unwrap();
            symlink(&target, links.join("by-path").join(path)).unwrap();
            if let Some(id) = id {
                symlink(&target, links.join("by-id").join(id)).unwrap();
            }
        }
        root
    }

    fn stable(root: &Path, open: impl Fn(&Path) -> io::Result<()>) -> Vec<String> {
        let nodes = list(root, open).into_iter();
        nodes.map(|node| node.stable.strip_prefix(root).unwrap().display().to_string()).collect()
    }

    #[test]
    fn devices_that_deliver_pictures_are_listed_by_a_name_that_stays() {
        let root = computer(&[
            (0, "0", "HD Webcam", Some("usb-HD_0001-index0"), "pci-1-index0"),
            (1, "1", "HD Webcam", Some("usb-HD_0001-index1"), "pci-1-index1"),
            (2, "0", "Twin", None, "pci-2-index0"),
            (4, "0", "Twin", Some("usb-Twin-index0"), "pci-3-index0"),
        ]);
        // The second device of the first camera delivers metadata.
        let open = |path: &Path| match path.ends_with("video1") {
            true => Err(Errno::ENOTTY.into()),
            false => Ok(()),
        };
        let expected = [
            "dev/v4l/by-id/usb-HD_0001-index0",
            "dev/v4l/by-path/pci-2-index0",
            "dev/v4l/by-path/pci-3-index0",
        ];
        assert_eq!(stable(root.path(), open), expected);
        // A user who may not open any.
        assert_eq!(stable(root.path(), |_| Err(Errno::EACCES.into())), expected);
        assert_eq!(stable(root.path(), |_| Err(Errno::ENODEV.into())), [] as [&str; 0]);
        assert_eq!(list(&root.path().join("absent"), open), []);
    }

    fn camera(number: u32) -> CaptureNode {
        let path = PathBuf::from(format!("/dev/video{number}"));
        let stable = PathBuf::from(format!("/dev/v4l/by-id/{number}"));
        CaptureNode { path, name: "A".to_owned(), stable }
    }

    #[test]
    fn a_number_names_a_camera_where_there_is_one() {
        let (one, two) = ([camera(2)], [camera(0), camera(2)]);
        let by_id = "/dev/v4l/by-id/2";
        for (device, nodes, found) in [
            (None, &one[..], by_id),
            (Some("2"), &one, "/dev/video2"),
            (Some("/dev/video2"), &one, "/dev/video2"),
            (Some(by_id), &two, by_id),
            (Some("camera"), &two, "camera"),
            (Some("0"), &[], "/dev/video0"),
        ] {
            assert_eq!(find(device, nodes).unwrap(), Path::new(found), "{device:?}");
        }
        for device in [None, Some("2"), Some("/dev/video0")] {
            let error = find(device, &two).unwrap_err().to_string();
            assert!(error.contains("/dev/v4l/by-id/0, /dev/v4l/by-id/2"), "{error}");
        }
        assert!(matches!(find(None, &[]), Err(WebcamError::NoCamera)));
    }
}
