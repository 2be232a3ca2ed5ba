//! Cameras through OpenNI2.

use plumb_openni::{DeviceInfo, OpenNi, OpenniError};

use crate::driver::{
    CameraDriver, DriverListing, FoundCamera, LibraryState, LibraryStatus, OpenRequest,
    OpenedCamera,
};
use crate::settings::SourceName;
use crate::source::BoxedError;
use crate::source::openni::{IntrinsicsFrom, IntrinsicsSource, OpenniSource};

/// Driver of the cameras through OpenNI2, which is loaded at run time.
#[derive(Debug, Clone, Copy)]
pub struct OpenniDriver;

impl CameraDriver for OpenniDriver {
    fn name(&self) -> SourceName {
        SourceName::Openni
    }

    fn list(&self) -> DriverListing {
        let (state, cameras) = list().unwrap_or_else(|error| {
            (LibraryState::Absent { error: error.to_string() }, Vec::new())
        });
        let library = Some(LibraryStatus { name: "OpenNI2", state });
        DriverListing { library, cameras, ..DriverListing::default() }
    }

    fn open(&self, request: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError> {
        let settings = &request.settings.openni;
        let intrinsics = match settings.intrinsics {
            IntrinsicsFrom::File => IntrinsicsSource::Calibrated((&request.camera).into()),
            IntrinsicsFrom::Device => IntrinsicsSource::FieldOfView,
        };
        let openni = OpenNi::load()?;
        let device_settings = settings.device_settings(request.device_recording.clone());
        let source = OpenniSource::open(&openni, &settings.target(), device_settings, intrinsics)?;
        let opened = source.opened();
        let description = Some(format!("{} ({}), {}", opened.name, opened.uri, opened.mode));
        let notes = opened.notes.clone();
        let intrinsics = *source.intrinsics();
        let camera = OpenedCamera::start(source, request.camera.clone(), intrinsics)?;
        Ok(OpenedCamera { description, notes, ..camera })
    }
}

/// Lists the cameras that OpenNI2 can open.
fn list() -> Result<(LibraryState, Vec<FoundCamera>), OpenniError> {
    let openni = OpenNi::load()?;
    let cameras = openni.devices()?.into_iter().map(found).collect();
    let drivers = openni.drivers();
    let names = drivers.iter().filter_map(|path| path.file_name());
    let drivers = names.map(|name| name.to_string_lossy().into_owned()).collect();
    Ok((LibraryState::Loaded { version: openni.version(), drivers }, cameras))
}

fn found(device: DeviceInfo) -> FoundCamera {
    let name = format!("{} {}", device.vendor, device.name).trim().to_owned();
    FoundCamera { uri: device.uri, name }
}
