//! Which camera looks, as a rig file says it.

use std::path::{Path, PathBuf};

use plumb_cameras::source::openni;
use plumb_cameras::toml_file::Positive;
use serde::Deserialize;
use thiserror::Error;

/// Which camera looks.
///
/// ```toml
/// [camera]
/// file = "camera.toml"
/// source = "openni"          # or "simulated", or "recording"
/// recording = "desk.oni"     # of "recording": an .oni file or a TUM folder
/// [camera.openni]            # of "openni", each with a default
/// uri = "1d27/0609@2/4"
/// width = 640
/// height = 480
/// rate = 30
/// latency = 0.045
/// intrinsics = "device"
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraChoice {
    /// The camera file, relative to the rig file.
    pub file: PathBuf,
    /// Where the pictures come from; where absent: the recording that is named, or the simulated
    /// rig where there is one, or a camera through OpenNI2.
    pub source: Option<SourceName>,
    /// The recording, relative to the rig file.
    pub recording: Option<PathBuf>,
    /// How a camera is opened through OpenNI2.
    #[serde(default)]
    pub openni: OpenniChoice,
}

/// Where pictures come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceName {
    /// Rendered, of the rig file's simulated rig.
    Simulated,
    /// A camera through OpenNI2.
    Openni,
    /// A recording, in the time in which it was made.
    Recording,
}

/// How a camera is opened through OpenNI2.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OpenniChoice {
    /// Which, as `plumb cameras` lists them; the first where absent.
    pub uri: Option<String>,
    /// Columns of its pictures.
    pub width: u16,
    /// Rows of its pictures.
    pub height: u16,
    /// Pictures a second.
    pub rate: u16,
    /// From exposure to the earliest arrival of a picture, seconds; as [`openni::Settings`] has it
    /// where absent.
    pub latency: Option<Positive>,
    /// Where the intrinsics are from.
    pub intrinsics: IntrinsicsFrom,
}

/// Where a camera's intrinsics are from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum IntrinsicsFrom {
    /// The camera file: as calibrated.
    #[default]
    File,
    /// The field of view that the device tells: as designed.
    Device,
}

impl Default for OpenniChoice {
    /// The first camera, as [`openni::Settings`] are by default, with the camera file's intrinsics.
    fn default() -> Self {
        let settings = openni::Settings::default();
        Self {
            uri: None,
            width: settings.width,
            height: settings.height,
            rate: settings.rate,
            latency: None,
            intrinsics: IntrinsicsFrom::File,
        }
    }
}

/// Why a rig file's camera cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum CameraChoiceError {
    /// Nothing is simulated.
    #[error("the camera is to be simulated, but there is no [simulation] table")]
    NoSimulation,
    /// No recording is named.
    #[error("the camera is to be a recording, but [camera] has no key `recording` that says which")]
    NoRecording,
    /// The recording that is named is not to be used.
    #[error("[camera] names a recording, but its source is another; leave one of them out")]
    Recording,
}

impl CameraChoice {
    /// Where the pictures come from, in a rig file with or without a simulated rig.
    ///
    /// # Errors
    /// Where what is chosen is not there.
    pub fn source(&self, simulation: bool) -> Result<SourceName, CameraChoiceError> {
        let source = self.source.unwrap_or(match (&self.recording, simulation) {
            (Some(_), _) => SourceName::Recording,
            (None, true) => SourceName::Simulated,
            (None, false) => SourceName::Openni,
        });
        match (source, &self.recording) {
            (SourceName::Simulated, _) if !simulation => Err(CameraChoiceError::NoSimulation),
            (SourceName::Recording, None) => Err(CameraChoiceError::NoRecording),
            (SourceName::Simulated | SourceName::Openni, Some(_)) => {
                Err(CameraChoiceError::Recording)
            }
            _ => Ok(source),
        }
    }

    /// Takes the paths to be relative to `folder`.
    pub(super) fn relative_to(&mut self, folder: &Path) {
        self.file = folder.join(&self.file);
        if let Some(recording) = &mut self.recording {
            *recording = folder.join(&*recording);
        }
    }
}

impl OpenniChoice {
    /// What is opened, and how; recorded to `record` where that is said.
    pub fn settings(&self, record: Option<PathBuf>) -> (openni::Target, openni::Settings) {
        let target = self.uri.clone().map_or(openni::Target::First, openni::Target::Uri);
        let usual = openni::Settings::default();
        let settings = openni::Settings {
            width: self.width,
            height: self.height,
            rate: self.rate,
            latency: self.latency.map_or(usual.latency, Positive::get),
            record,
            ..usual
        };
        (target, settings)
    }
}

#[cfg(test)]
mod tests {
    use plumb_cameras::toml_file::parse_toml;

    use super::*;

    fn choice(text: &str) -> CameraChoice {
        parse_toml(Path::new("rig.toml"), &format!("file = 'camera.toml'\n{text}")).unwrap()
    }

    #[test]
    fn without_a_word_it_is_the_simulated_rig_or_a_real_camera() {
        assert_eq!(choice("").source(true), Ok(SourceName::Simulated));
        assert_eq!(choice("").source(false), Ok(SourceName::Openni));
        assert_eq!(choice("recording = 'a.oni'").source(true), Ok(SourceName::Recording));
        assert_eq!(choice("source = 'openni'").source(true), Ok(SourceName::Openni));
    }

    #[test]
    fn what_cannot_be_is_said() {
        assert_eq!(
            choice("source = 'simulated'").source(false),
            Err(CameraChoiceError::NoSimulation)
        );
        assert_eq!(
            choice("source = 'recording'").source(true),
            Err(CameraChoiceError::NoRecording)
        );
        let both = choice("source = 'openni'\nrecording = 'a.oni'");
        assert_eq!(both.source(false), Err(CameraChoiceError::Recording));
    }

    #[test]
    fn what_is_left_out_is_as_the_library_has_it() {
        let (target, settings) = choice("[openni]\nrate = 60").openni.settings(None);
        assert_eq!(target, openni::Target::First);
        assert_eq!(settings, openni::Settings { rate: 60, ..openni::Settings::default() });
        let mut chosen = choice("recording = 'a.oni'\n[openni]\nuri = 'x'");
        chosen.relative_to(Path::new("rigs"));
        assert_eq!(chosen.recording.as_deref(), Some(Path::new("rigs/a.oni")));
        assert_eq!(chosen.openni.settings(None).0, openni::Target::Uri("x".to_owned()));
    }
}
