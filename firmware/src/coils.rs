//! Four-wire motors on two H-bridges each, driven by pulse-width modulation at 30.5 kHz.
//!
//! A bridge has two inputs: one is modulated, the other low. Motor A has GP2/GP3 (coil 0) and
//! GP4/GP5 (coil 1), B GP6 to GP9, C GP10 to GP13: the outputs of PWM slices 1 to 6 in this order.
//! The step generator runs too, with its pins disconnected: it counts the steps, and the emergency
//! input stops it.

use embassy_rp::pac;
use micromath::F32Ext;
use plumb_core::coils::Commutation;
use plumb_protocol::dimension::PerMotor;

/// Period of the modulation, clocks; the number of full drive.
const PERIOD: u16 = 4096;
/// Returns the commutation for coils that get at most `percent` of the supply's voltage; `full` is
/// the drive at the whole voltage.
///
/// micromath computes the sine, 17 values for each configuration. A table of 17 numbers would save
/// 420 bytes of flash and cost 108 bytes of RAM; time does not matter here. micromath is used only
/// here: the law `taut` needs `expf`, `logf` and `sqrtf` to the last bits, for which it has libm.
pub(crate) fn commutation(percent: u8, full: u16) -> Commutation {
    let amplitude = f32::from(full) * f32::from(percent) / 100.0;
    // The error of micromath's sine is below 0.002, and the result may not exceed 1.
    let sine = |i: usize| {
        (amplitude * (i as f32 * core::f32::consts::FRAC_PI_2 / 16.0).sin().clamp(0.0, 1.0)) as u16
    };
    Commutation::new(core::array::from_fn(sine))
}

/// The H-bridges of the coils.
pub(crate) struct Coils {
    /// Commutation and microsteps, while coils are configured.
    drive: Option<(Commutation, u8)>,
    /// Motor positions that the outputs show, Q4 steps.
    shown: Option<PerMotor<i32>>,
}

impl Coils {
    /// Sets up the modulation, with the pins disconnected.
    pub(crate) fn new() -> Self {
        pac::RESETS.reset().modify(|w| w.set_pwm(false));
        while !pac::RESETS.reset_done().read().pwm() {}
        for slice in 1..7 {
            pac::PWM.ch(slice).top().write(|w| w.set_top(PERIOD - 1));
            pac::PWM.ch(slice).cc().write(|_| {});
            pac::PWM.ch(slice).csr().write(|w| w.set_en(true));
        }
        Self { drive: None, shown: None }
    }

    /// Begins to drive coils, without current.
    pub(crate) fn begin(&mut self, duty_percent: u8, microsteps: u8) {
        self.release();
        self.drive = Some((commutation(duty_percent, PERIOD), microsteps));
    }

    /// Ends that.
    pub(crate) fn end(&mut self) {
        self.release();
        self.drive = None;
    }

    /// Switches the current off.
    pub(crate) fn release(&mut self) {
        self.shown = None;
        (1..7).for_each(|slice| pac::PWM.ch(slice).cc().write(|_| {}));
    }

    /// Turns the fields to the motor positions, Q4 steps.
    pub(crate) fn show(&mut self, positions: PerMotor<i32>) {
        let Some((commutation, microsteps)) = &self.drive else { return };
        if self.shown == Some(positions) {
            return;
        }
        self.shown = Some(positions);
        for (motor, position) in positions.into_iter().enumerate() {
            for (coil, drive) in commutation.at(position, *microsteps).into_iter().enumerate() {
                let magnitude = drive.unsigned_abs() as u16;
                pac::PWM.ch(1 + 2 * motor + coil).cc().write(|w| {
                    w.set_a(if drive > 0 { magnitude } else { 0 });
                    w.set_b(if drive < 0 { magnitude } else { 0 });
                });
            }
        }
    }
}
