//! Values of the registers for a wiring.

use plumb_protocol::dimension::MotorList;
use plumb_protocol::units::Milliamperes;
use plumb_protocol::wiring::{Chopper, Tmc2209};

use super::register;

/// Largest setting of a current: 32 of 32.
const FULL_SCALE: u32 = 32;
/// Root mean square of the voltage at the sense resistor of a step of the current's setting, with
/// `vsense` 0 and 1: 325 mV and 180 mV over 32 √2 (section 9), in halves of a microvolt.
const STEP_HALF_UV: [u32; 2] = [14_363, 7_955];
/// Resistance of the chip's own wires beside the sense resistor, mΩ (section 9).
const WIRES: u32 = 20;
/// Sense resistors, mΩ: from the data sheet's smallest (75 mΩ for 2 A) down and up with room.
const SENSE: core::ops::RangeInclusive<u16> = 50..=1000;

/// GCONF: the UART is in use, microsteps come from CHOPCONF, and pulses are filtered.
const GCONF: u32 = 1 << 6 | 1 << 7 | 1 << 8;
/// GCONF: SpreadCycle.
const SPREAD_CYCLE: u32 = 1 << 2;
/// CHOPCONF without `toff`, which switches the coils on: interpolation to 256 microsteps, and
/// SpreadCycle with a blank time of 32 clocks and the least hysteresis (section 7.1).
const CHOPCONF: u32 = 1 << 28 | 2 << 15 | 5 << 4;
/// CHOPCONF: `toff`.
const ON: u32 = 3;
/// IHOLD_IRUN: steps from the running to the standing current, 2^18 clocks each.
const HOLD_DELAY: u32 = 8 << 16;
/// TPOWERDOWN as after a reset: 0.35 s from the last step to the standing current.
const POWER_DOWN: u32 = 20;
/// PWMCONF as after a reset: StealthChop sets itself (section 5.5.4).
const PWMCONF: u32 = 0xc10d_0024;
/// GSTAT: clears all flags.
const ALL_FLAGS: u32 = 7;
/// NODECONF: a reply comes after three times 8 bits. On a wire with several drivers it must be 2 at
/// least, or the others may take a reply for a damaged request (section 5.1).
pub(super) const SEND_DELAY: u32 = 2 << 8;

/// Values of the registers for drivers of one kind and setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Address of each motor's driver.
    pub(super) addresses: MotorList<u8>,
    pub(super) chopper: Chopper,
    chopconf: u32,
    currents: u32,
}

impl Settings {
    /// Number of the registers that are written.
    pub(super) const WRITES: u8 = 11;

    /// Computes the values for `microsteps` in a full step. Returns `None` where the sense resistor
    /// does not allow the currents, a motor would have no current, or more at rest than in motion.
    #[cold]
    pub fn new(driver: &Tmc2209, microsteps: u8) -> Option<Self> {
        let sense = SENSE.contains(&driver.sense.0).then(|| u32::from(driver.sense.0) + WIRES)?;
        let scale = |current: Milliamperes, high: usize| {
            let step = STEP_HALF_UV[high];
            (2 * u32::from(current.0) * sense + step / 2) / step
        };
        // The finer scale, where it reaches.
        let high = usize::from(scale(driver.run, 1) <= FULL_SCALE);
        let (run, hold) = (scale(driver.run, high), scale(driver.hold, high));
        if !(1..=FULL_SCALE).contains(&run) || hold < 1 || driver.hold > driver.run {
            return None;
        }
        let resolution = 8_u32.checked_sub(u32::from(microsteps).checked_ilog2()?)?;
        Some(Self {
            addresses: driver.addresses,
            chopper: driver.chopper,
            chopconf: CHOPCONF | (high as u32) << 17 | resolution << 24,
            currents: HOLD_DELAY | (run - 1) << 8 | (hold - 1),
        })
    }

    /// Returns write number `index` of the set-up: register and value. The first one switches the
    /// coils off, which also ends the shut-down after a short circuit (section 5.5.3).
    #[cold]
    pub(super) fn write(&self, index: u8) -> (u8, u32) {
        match index {
            0 => (register::CHOPCONF, self.chopconf),
            1 if self.chopper == Chopper::SpreadCycle => (register::GCONF, GCONF | SPREAD_CYCLE),
            1 => (register::GCONF, GCONF),
            2 => (register::IHOLD_IRUN, self.currents),
            3 => (register::TPOWERDOWN, POWER_DOWN),
            4 => (register::TPWMTHRS, 0),
            5 => (register::VACTUAL, 0),
            6 => (register::COOLCONF, 0),
            7 => (register::PWMCONF, PWMCONF),
            8 => (register::CHOPCONF, self.chopconf | ON),
            9 => (register::NODECONF, SEND_DELAY),
            _ => (register::GSTAT, ALL_FLAGS),
        }
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::boards::SKR_PICO;
    use plumb_protocol::units::Milliohms;

    use super::*;

    const DRIVER: Tmc2209 = Tmc2209 { hold: Milliamperes(500), ..Tmc2209::of(&SKR_PICO) };

    /// Returns the current of a setting by the equation of section 9, A.
    fn current(scale: u32, high: bool, sense: u16) -> f64 {
        let full = if high { 0.18 } else { 0.325 };
        f64::from(scale + 1) / 32.0 * full
            / (f64::from(sense) * 1e-3 + 0.02)
            / std::f64::consts::SQRT_2
    }

    #[test]
    fn every_current_is_the_nearest_that_the_driver_can_set() {
        for sense in [75, 110, 150, 1000] {
            for milliamperes in 1..=2500 {
                let run = Milliamperes(milliamperes);
                let driver = Tmc2209 { run, hold: run, sense: Milliohms(sense), ..DRIVER };
                let wanted = f64::from(milliamperes) * 1e-3;
                let Some(settings) = Settings::new(&driver, 16) else {
                    let least = current(0, true, sense) / 2.0;
                    let most = current(31, false, sense) + current(0, false, sense) / 2.0;
                    assert!(wanted < least + 0.001 || wanted > most - 0.001, "{driver:?}");
                    continue;
                };
                let high = settings.chopconf >> 17 & 1 == 1;
                let set = current(settings.currents >> 8 & 0x1f, high, sense);
                assert_eq!(settings.currents & 0x1f, settings.currents >> 8 & 0x1f);
                let half_a_step = current(0, high, sense) / 2.0;
                assert!((set - wanted).abs() < half_a_step + 0.001, "{set} A for {driver:?}");
            }
        }
    }

    #[test]
    fn currents_and_resistors_out_of_range_have_no_settings() {
        let with = |run, hold, sense| {
            let (run, hold, sense) = (Milliamperes(run), Milliamperes(hold), Milliohms(sense));
            Settings::new(&Tmc2209 { run, hold, sense, ..DRIVER }, 16).is_some()
        };
        assert!(with(1768, 1768, 110));
        assert!(!with(1900, 800, 110), "above the full scale of 1.77 A");
        assert!(!with(800, 801, 110), "more at rest");
        assert!(!with(800, 0, 110), "no current at rest drops the ball");
        assert!(!with(800, 800, 49) && !with(100, 100, 1001));
    }

    #[test]
    fn the_registers_are_those_of_the_data_sheet() {
        let microsteps = [1, 2, 4, 8, 16].map(|microsteps| {
            let settings = Settings::new(&DRIVER, microsteps).unwrap();
            settings.write(8)
        });
        // MRES: 8 is a full step, 4 is 1/16; vsense 1 for 0.8 A at 0.11 Ω.
        let expected = [8, 7, 6, 5, 4].map(|mres| (0x6c, 0x1003_0053 | mres << 24));
        assert_eq!(microsteps, expected);
        let settings = Settings::new(&DRIVER, 16).unwrap();
        assert_eq!(settings.write(0), (0x6c, 0x1403_0050), "off");
        assert_eq!(settings.write(1), (0x00, 0x1c0));
        // 0.8 A · 0.13 Ω over 3.98 mV is 26, 0.5 A is 16: one less each.
        assert_eq!(settings.write(2), (0x10, 0x0008_190f));
        let spread = Tmc2209 { chopper: Chopper::SpreadCycle, ..DRIVER };
        assert_eq!(Settings::new(&spread, 16).unwrap().write(1), (0x00, 0x1c4));
    }
}
