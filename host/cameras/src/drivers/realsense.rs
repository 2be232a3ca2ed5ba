//! Intel RealSense cameras.

use plumb_realsense::{RealSense, RealsenseError};

use crate::driver::{
    CameraDriver, DriverListing, FoundCamera, LibraryState, LibraryStatus, OpenRequest,
    OpenedCamera,
};
use crate::settings::SourceName;
use crate::source::BoxedError;
use crate::source::openni::IntrinsicsFrom;
use crate::source::realsense::RealsenseSource;

/// Driver of the Intel RealSense cameras through librealsense2, which is loaded at run time.
#[derive(Debug, Clone, Copy)]
pub struct RealsenseDriver;

impl CameraDriver for RealsenseDriver {
    fn name(&self) -> SourceName {
        SourceName::Realsense
    }

    fn list(&self) -> DriverListing {
        let (state, cameras) = list().unwrap_or_else(|error| {
            (LibraryState::Absent { error: error.to_string() }, Vec::new())
        });
        let library = Some(LibraryStatus { name: "librealsense2", state });
        DriverListing { library, cameras, ..DriverListing::default() }
    }

    fn open(&self, request: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError> {
        let settings = &request.settings.realsense;
        let calibrated = match settings.intrinsics {
            IntrinsicsFrom::File => Some((&request.camera).into()),
            IntrinsicsFrom::Device => None,
        };
        let (library, target) = (RealSense::load()?, settings.target());
        let device_settings = settings.device_settings();
        let source = RealsenseSource::open(&library, &target, device_settings, calibrated)?;
        let opened = source.opened();
        let description = Some(format!("{} ({}), {}", opened.name, opened.id, opened.mode));
        let intrinsics = *source.intrinsics();
        let camera = OpenedCamera::start(source, request.camera.clone(), intrinsics)?;
        Ok(OpenedCamera { description, ..camera })
    }
}

/// Lists the cameras that librealsense2 can open.
fn list() -> Result<(LibraryState, Vec<FoundCamera>), RealsenseError> {
    let library = RealSense::load()?;
    let found = library.devices()?.into_iter();
    let cameras = found.map(|device| FoundCamera { uri: device.serial, name: device.name });
    let (version, drivers) = (library.version(), Vec::new());
    Ok((LibraryState::Loaded { version, drivers }, cameras.collect()))
}
