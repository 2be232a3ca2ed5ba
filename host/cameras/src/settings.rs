//! Table `[camera]` of a rig file, and the registry of all sources of frames.

use std::fmt;
use std::path::{Path, PathBuf};

use plumb_config::book::page;
use plumb_frame::driver::{CameraDriver, IntrinsicsFrom};
use plumb_openni::OpenniSettings;
use plumb_realsense::RealsenseSettings;
use plumb_webcam::WebcamSettings;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::http::HttpSettings;
use crate::recording::RecordingDriver;
use crate::ros2::Ros2CameraSettings;
use crate::stream::StreamAddress;

/// Defines the settings and the names of all sources of frames. A kind of camera has a table of
/// settings, which implements [`CameraDriver`].
macro_rules! registry {
    ($($(#[$about:meta])* $name:ident = $key:literal $($table:ident: $settings:ty)?;)+) => {
        /// Choice of a camera: table `[camera]` of a rig file.
        ///
        /// ```toml
        /// [camera]
        /// file = "camera.toml"
        /// source = "openni"          # or "realsense", "webcam", "http", "ros2", "simulated",
        ///                            # "recording", "stream"
        /// recording = "desk.oni"     # of "recording": an .oni, .bag, .db3 or video file, or a
        ///                            # TUM folder
        /// stream = "unix:cam.sock"   # of "stream": or "tcp:127.0.0.1:5600", or "-", which is
        ///                            # standard input
        /// [camera.openni]            # of "openni", each key with a default
        /// uri = "1d27/0609@2/4"
        /// width = 640
        /// height = 480
        /// rate = 30
        /// latency = 0.045
        /// intrinsics = "device"
        /// [camera.realsense]         # of "realsense", each key with a default
        /// serial = "832112070255"
        /// [camera.webcam]            # of "webcam", each key with a default
        /// device = "/dev/video2"
        /// [camera.http]              # of "http"
        /// url = "http://phone:8080/video"
        /// [camera.ros2]              # of "ros2", each key with a default
        /// colour = "/camera/camera/color/image_raw"
        /// ```
        #[derive(Debug, Clone, PartialEq, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct CameraSettings {
            /// Path of the camera file, relative to the rig file.
            pub file: PathBuf,
            /// Source of the frames. Default: the recording, the stream or the camera in the
            /// network that is named, else the simulated rig where there is one, else a camera
            /// through OpenNI2.
            pub source: Option<SourceName>,
            /// Path of the recording, relative to the rig file: an `.oni`, `.bag`, `.db3` or video
            /// file, or a TUM folder.
            pub recording: Option<PathBuf>,
            /// Address at which a program delivers frames. A Unix socket is relative to the rig
            /// file.
            pub stream: Option<StreamAddress>,
            $($(
                #[doc = concat!("Table `[camera.", $key, "]`.")]
                #[serde(default)]
                pub $table: $settings,
            )?)+
        }

        /// Source of the frames: key `source` of the table `[camera]`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
        pub enum SourceName {
            $($(#[$about])* #[serde(rename = $key)] $name,)+
        }

        impl SourceName {
            /// All names.
            pub const ALL: &[Self] = &[$(Self::$name),+];
        }

        impl fmt::Display for SourceName {
            /// Writes the name as in a rig file.
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    $(Self::$name => $key,)+
                })
            }
        }

        impl CameraSettings {
            /// Returns the settings of the first camera that is plugged in, described by the camera
            /// file `file`.
            pub fn new(file: impl Into<PathBuf>) -> Self {
                Self {
                    file: file.into(),
                    source: None,
                    recording: None,
                    stream: None,
                    $($($table: <$settings>::default(),)?)+
                }
            }

            /// Returns the table of the kind of camera `name`; `None` for other sources.
            fn table(&self, name: SourceName) -> Option<&dyn CameraDriver> {
                match name {
                    $($(SourceName::$name => Some(&self.$table),)?)+
                    _ => None,
                }
            }
        }
    };
}

// A source: its name here, its key in a rig file, and the table of its settings where it has one.
registry! {
    /// Frames of the simulated rig, which the program renders itself: no camera.
    Simulated = "simulated";
    /// A camera through OpenNI2.
    Openni = "openni" openni: OpenniSettings;
    /// An Intel RealSense camera.
    Realsense = "realsense" realsense: RealsenseSettings;
    /// A recording, played at the speed at which it was recorded.
    Recording = "recording";
    /// Frames that another program sends.
    Stream = "stream";
    /// A webcam, without depth.
    Webcam = "webcam" webcam: WebcamSettings;
    /// A camera in the network that sends JPEG pictures, without depth.
    Http = "http" http: HttpSettings;
    /// A camera that another node of ROS 2 publishes.
    Ros2 = "ros2" ros2: Ros2CameraSettings;
}

/// Returns how a Kinect is read, for a person who takes it for a source.
pub fn kinect() -> String {
    format!(
        "a Kinect is read as openni, where OpenNI2 has the driver of libfreenect or libfreenect2, \
         or as stream, where another program sends its pictures ({})",
        page("cameras")
    )
}

/// Contradiction in the table `[camera]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum SettingsError {
    /// The source is the simulated rig, but there is none.
    #[error("the camera is to be simulated, but there is no [simulation] table")]
    NoSimulation,
    /// The source is a recording, but none is named.
    #[error("the camera is to be a recording, but [camera] has no key `recording` with its path")]
    NoRecording,
    /// A recording is named, but the source is another one.
    #[error("[camera] names a recording, but its source is another; leave one of them out")]
    Recording,
    /// The source is a stream, but none is named.
    #[error(
        "the camera is to be a stream, but [camera] has no key `stream` with its address: \
         unix:PATH, tcp:127.0.0.1:PORT, or -"
    )]
    NoStream,
    /// A stream is named, but the source is another one.
    #[error("[camera] names a stream, but its source is another; leave one of them out")]
    Stream,
}

impl CameraSettings {
    /// Returns the driver of the source `name`, with these settings; `None` for the simulated rig,
    /// and where no recording or no stream is named.
    pub fn driver(&self, name: SourceName) -> Option<Box<dyn CameraDriver + '_>> {
        match name {
            SourceName::Recording => {
                let path = self.recording.as_deref()?;
                Some(Box::new(RecordingDriver(path)))
            }
            SourceName::Stream => {
                let address = self.stream.as_ref()?;
                Some(Box::new(address))
            }
            _ => self.table(name).map(|table| Box::new(table) as Box<dyn CameraDriver + '_>),
        }
    }

    /// Returns the source of the frames, where `simulation` is whether there is a simulated rig.
    ///
    /// # Errors
    /// Where the source that is chosen does not exist, or a recording or a stream is named for
    /// another one.
    pub fn source(&self, simulation: bool) -> Result<SourceName, SettingsError> {
        let source = self.source.unwrap_or(match (&self.recording, &self.stream) {
            (Some(_), _) => SourceName::Recording,
            (None, Some(_)) => SourceName::Stream,
            (None, None) if self.http.url.is_some() => SourceName::Http,
            (None, None) if simulation => SourceName::Simulated,
            (None, None) => SourceName::Openni,
        });
        match source {
            SourceName::Simulated if !simulation => Err(SettingsError::NoSimulation),
            SourceName::Recording if self.recording.is_none() => Err(SettingsError::NoRecording),
            SourceName::Stream if self.stream.is_none() => Err(SettingsError::NoStream),
            source if source != SourceName::Recording && self.recording.is_some() => {
                Err(SettingsError::Recording)
            }
            source if source != SourceName::Stream && self.stream.is_some() => {
                Err(SettingsError::Stream)
            }
            source => Ok(source),
        }
    }

    /// Returns whether the pictures of `source` bring the intrinsics of the device: a run then
    /// ignores those of the camera file.
    pub fn has_intrinsics_of_device(&self, source: SourceName) -> bool {
        let from = match source {
            SourceName::Openni => self.openni.intrinsics,
            SourceName::Realsense => self.realsense.intrinsics,
            SourceName::Ros2 => self.ros2.intrinsics,
            _ => return false,
        };
        from == IntrinsicsFrom::Device
    }

    /// Returns the columns and rows of the pictures that the camera of `source` is asked for;
    /// `None` of a source that gives pictures of any size.
    pub fn asked_size(&self, source: SourceName) -> Option<[u16; 2]> {
        match source {
            SourceName::Openni => Some([self.openni.width, self.openni.height]),
            SourceName::Realsense => Some([self.realsense.width, self.realsense.height]),
            SourceName::Webcam => Some([self.webcam.width, self.webcam.height]),
            _ => None,
        }
    }

    /// Makes the paths relative to `folder`.
    pub fn relative_to(&mut self, folder: &Path) {
        self.file = folder.join(&self.file);
        if let Some(recording) = &mut self.recording {
            *recording = folder.join(&*recording);
        }
        if let Some(stream) = &mut self.stream {
            stream.relative_to(folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use plumb_config::toml_file::parse_toml;

    use super::*;

    fn settings(text: &str) -> CameraSettings {
        parse_toml(Path::new("rig.toml"), &format!("file = 'camera.toml'\n{text}")).unwrap()
    }

    #[test]
    fn the_default_source_is_the_recording_then_the_simulated_rig_then_a_camera() {
        assert_eq!(settings("").source(true), Ok(SourceName::Simulated));
        assert_eq!(settings("").source(false), Ok(SourceName::Openni));
        assert_eq!(settings("recording = 'a.oni'").source(true), Ok(SourceName::Recording));
        assert_eq!(settings("source = 'openni'").source(true), Ok(SourceName::Openni));
        assert_eq!(settings("stream = '-'").source(true), Ok(SourceName::Stream));
        let http = "[http]\nurl = 'http://phone:8080/video'";
        assert_eq!(settings(http).source(true), Ok(SourceName::Http));
        assert_eq!(settings(""), CameraSettings::new("camera.toml"));
    }

    #[test]
    fn contradictions_are_refused() {
        let simulated = settings("source = 'simulated'").source(false);
        assert_eq!(simulated, Err(SettingsError::NoSimulation));
        let recording = settings("source = 'recording'").source(true);
        assert_eq!(recording, Err(SettingsError::NoRecording));
        let both = settings("source = 'openni'\nrecording = 'a.oni'");
        assert_eq!(both.source(false), Err(SettingsError::Recording));
        let stream = settings("source = 'stream'").source(false);
        assert_eq!(stream, Err(SettingsError::NoStream));
        for other in ["source = 'openni'\nstream = '-'", "recording = 'a.oni'\nstream = '-'"] {
            assert_eq!(settings(other).source(false), Err(SettingsError::Stream));
        }
    }

    #[test]
    fn paths_are_relative_to_the_rig_file() {
        let mut settings = settings("recording = 'a.oni'\nstream = 'unix:a.sock'");
        settings.relative_to(Path::new("rigs"));
        assert_eq!(settings.file, Path::new("rigs/camera.toml"));
        assert_eq!(settings.recording.as_deref(), Some(Path::new("rigs/a.oni")));
        assert_eq!(settings.stream, Some(StreamAddress::Unix("rigs/a.sock".into())));
    }
}
