//! Webcams.

use std::fs;
use std::path::Path;

use crate::driver::{CameraDriver, DriverListing, FoundCamera, OpenRequest, OpenedCamera};
use crate::settings::SourceName;
use crate::source::BoxedError;

/// Folder in which the kernel lists the video devices.
const DEVICES: &str = "/sys/class/video4linux";

/// Driver of webcams through V4L2. A program without the feature `webcam` cannot open them.
#[derive(Debug, Clone, Copy)]
pub struct WebcamDriver;

impl CameraDriver for WebcamDriver {
    fn name(&self) -> SourceName {
        SourceName::Webcam
    }

    fn list(&self) -> DriverListing {
        listing(list(Path::new(DEVICES)))
    }

    #[cfg(feature = "webcam")]
    fn open(&self, request: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError> {
        use crate::source::webcam::WebcamSource;

        let settings = request.settings.webcam.device_settings();
        let source = WebcamSource::open(&settings, &request.camera)?;
        let webcam = source.webcam();
        let description = Some(format!("{}, {}", webcam.path().display(), webcam.mode()));
        let (notes, intrinsics) = (webcam.notes().to_vec(), *source.intrinsics());
        let camera = OpenedCamera::start(source, request.camera.clone(), intrinsics)?;
        Ok(OpenedCamera { description, notes, ..camera })
    }

    #[cfg(not(feature = "webcam"))]
    fn open(&self, _: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError> {
        Err(crate::source::webcam::NotBuilt.into())
    }
}

/// Returns the listing of webcams that can be opened.
#[cfg(feature = "webcam")]
fn listing(cameras: Vec<FoundCamera>) -> DriverListing {
    DriverListing { cameras, ..DriverListing::default() }
}

/// Returns the listing of webcams that this program cannot open.
#[cfg(not(feature = "webcam"))]
fn listing(cameras: Vec<FoundCamera>) -> DriverListing {
    use crate::source::webcam::NotBuilt;

    let missing = cameras.iter().map(|found| format!("{} ({}): {NotBuilt}", found.uri, found.name));
    DriverListing { missing: missing.collect(), ..DriverListing::default() }
}

/// Lists the video devices in the kernel's folder `devices`. A camera may have several devices; the
/// one with the index 0 delivers its pictures.
fn list(devices: &Path) -> Vec<FoundCamera> {
    let Ok(entries) = fs::read_dir(devices) else { return Vec::new() };
    let text = |path: &Path| fs::read_to_string(path).unwrap_or_default().trim().to_owned();
    let mut found: Vec<FoundCamera> = entries
        .filter_map(Result::ok)
        .filter(|entry| text(&entry.path().join("index")) == "0")
        .map(|entry| FoundCamera {
            uri: format!("/dev/{}", entry.file_name().to_string_lossy()),
            name: format!("{} (webcam)", text(&entry.path().join("name"))),
        })
        .collect();
    found.sort_by(|a, b| a.uri.cmp(&b.uri));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_device_of_each_camera_is_listed() {
        let folder = tempfile::tempdir().unwrap();
        for (device, index, name) in
            [("video2", "0", "A"), ("video0", "0", "HD Webcam"), ("video1", "1", "HD Webcam")]
        {
            let device = folder.path().join(device);
            fs::create_dir(&device).unwrap();
            fs::write(device.join("index"), format!("{index}\n")).unwrap();
            fs::write(device.join("name"), format!("{name}\n")).unwrap();
        }
        let found = list(folder.path());
        let found: Vec<_> = found.iter().map(|it| (it.uri.as_str(), it.name.as_str())).collect();
        assert_eq!(found, [("/dev/video0", "HD Webcam (webcam)"), ("/dev/video2", "A (webcam)")]);
        assert_eq!(list(&folder.path().join("absent")), []);
    }

    #[cfg(not(feature = "webcam"))]
    #[test]
    fn a_program_without_webcams_says_how_to_build_them() {
        use crate::camera_file;
        use crate::settings::CameraSettings;

        let settings = &CameraSettings::new("camera.toml");
        let camera = camera_file::paper().unwrap();
        let request = OpenRequest { settings, camera, device_recording: None };
        let error = WebcamDriver.open(&request).err().unwrap().to_string();
        assert!(error.contains("--features webcam"), "{error}");
        let (uri, name) = ("/dev/video0".to_owned(), "A (webcam)".to_owned());
        let listing = listing(vec![FoundCamera { uri, name }]);
        assert_eq!(listing.cameras, []);
        assert!(listing.missing[0].starts_with("/dev/video0 (A (webcam)): "), "{listing:?}");
        assert!(listing.missing[0].contains("--features webcam"), "{listing:?}");
    }
}
