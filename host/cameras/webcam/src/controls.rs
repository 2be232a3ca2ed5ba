//! Controls of a webcam: set and read back at every open, because they outlive it.

use std::io;
use std::path::Path;

use nix::errno::Errno;
use plumb_config::quantity::{CameraGain, CameraTime};

use crate::node::Node;
use crate::settings::WebcamSettings;

/// Control of V4L2: its number, and its name without the prefix V4L2_CID_.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Control {
    pub(crate) id: u32,
    name: &'static str,
}

macro_rules! controls {
    ($($name:ident = $id:expr;)+) => {
        $(pub(crate) const $name: Control = Control { id: $id, name: stringify!($name) };)+
    };
}

controls! {
    AUTO_WHITE_BALANCE = 0x0098_090c;
    GAIN = 0x0098_0913;
    POWER_LINE_FREQUENCY = 0x0098_0918;
    WHITE_BALANCE_TEMPERATURE = 0x0098_091a;
    EXPOSURE_AUTO = 0x009a_0901;
    EXPOSURE_ABSOLUTE = 0x009a_0902;
    EXPOSURE_AUTO_PRIORITY = 0x009a_0903;
    FOCUS_ABSOLUTE = 0x009a_090a;
    FOCUS_AUTO = 0x009a_090c;
}

/// Values of EXPOSURE_AUTO. Cameras have one of the automatic ones: most aperture priority.
const MANUAL: i32 = 1;
const AUTOMATIC: [i32; 2] = [3, 0];

/// Units of EXPOSURE_ABSOLUTE in a second.
const EXPOSURE_UNITS: f64 = 10_000.0;

/// Setting of controls, and what has not worked.
#[derive(Debug, Default)]
pub(crate) struct Controls {
    absent: Vec<&'static str>,
    other: Vec<String>,
}

impl Controls {
    /// Sets all controls. Automatic white balance stays on until [`Self::fix_white_balance`] where
    /// the settings have no other one.
    pub(crate) fn set_all(&mut self, node: &dyn Node, settings: &WebcamSettings) {
        let whole = |gain: CameraGain| gain.get().round() as i32;
        match settings.exposure.map(CameraTime::get) {
            Some(time) => {
                self.set(node, EXPOSURE_AUTO, &[MANUAL]);
                let units = (time * EXPOSURE_UNITS).round().max(1.0) as i32;
                self.set(node, EXPOSURE_ABSOLUTE, &[units]);
            }
            None => self.set(node, EXPOSURE_AUTO, &AUTOMATIC),
        }
        self.set(node, EXPOSURE_AUTO_PRIORITY, &[0]);
        self.set(node, FOCUS_AUTO, &[0]);
        let temperature = settings.white_balance.map(|kelvin| kelvin.get().round() as i32);
        self.set(node, AUTO_WHITE_BALANCE, &[temperature.is_none().into()]);
        let given = [
            (FOCUS_ABSOLUTE, settings.focus.map(whole)),
            (WHITE_BALANCE_TEMPERATURE, temperature),
            (GAIN, settings.gain.map(whole)),
            (POWER_LINE_FREQUENCY, settings.power_line.map(|power_line| power_line as i32)),
        ];
        for (control, value) in given {
            self.set(node, control, value.as_slice());
        }
    }

    /// Fixes the white balance that the camera has found.
    pub(crate) fn fix_white_balance(&mut self, node: &dyn Node) {
        self.set(node, AUTO_WHITE_BALANCE, &[0]);
    }

    /// Returns whether the device has an automatic white balance, and it is on.
    pub(crate) fn finds_white_balance(node: &dyn Node) -> bool {
        node.control(AUTO_WHITE_BALANCE.id).is_ok_and(|value| value != 0)
    }

    /// Sets a control to the first of `values` that the device takes, and reads it back. Nothing
    /// is set without a value.
    fn set(&mut self, node: &dyn Node, control: Control, values: &[i32]) {
        let Control { id, name } = control;
        let Some(first) = values.first() else { return };
        let invalid = |error: io::Error| error.raw_os_error() == Some(Errno::EINVAL as i32);
        if node.control(id).is_err_and(invalid) {
            if !self.absent.contains(&name) {
                self.absent.push(name);
            }
            return;
        }
        let mut refused = None;
        for &value in values {
            refused = node.set_control(id, value).err();
            if refused.is_none() && node.control(id).is_ok_and(|read| read == value) {
                return;
            }
        }
        self.other.push(match (refused, node.control(id)) {
            (Some(error), _) | (None, Err(error)) => format!("{name} is not {first} ({error})"),
            (None, Ok(read)) => format!("{name} is {read} where {first} was set"),
        });
    }

    /// Returns a line for the controls that the device does not have, and one for those that are
    /// not as they were set.
    pub(crate) fn notes(&self, path: &Path) -> Vec<String> {
        let line = |says: &str, list: &str| format!("{}: {says}: {list}", path.display());
        let mut notes = Vec::new();
        if !self.absent.is_empty() {
            notes.push(line("the camera has no control for", &self.absent.join(", ")));
        }
        if !self.other.is_empty() {
            notes.push(line("controls are not as they were set", &self.other.join("; ")));
        }
        notes
    }
}
