//! Two Adafruit Motor HATs, as in the paper: a PCA9685 each on I2C0 (GP16 data, GP17 clock), 400
//! kHz.
//!
//! The bus limits the speed. A channel takes 5 bytes with its address: 47 bits or 0.12 ms. A
//! microstep changes two channels of a motor, four where a coil's current reverses: 0.7 to 1.4 ms
//! for three motors. At 300 full steps/s this is at most half a step at once.

use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use embassy_embedded_hal::shared_bus::asynch::i2c::I2cDevice;
use embassy_rp::Peri;
use embassy_rp::i2c::{Async, Config, I2c};
use embassy_rp::peripherals::{I2C0, PIN_16, PIN_17};
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, NoopRawMutex};
use embassy_sync::mutex::Mutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use plumb_core::coils::Commutation;
use plumb_protocol::dimension::{MOTORS, PerMotor};
use pwm_pca9685::{Channel, Pca9685};
use static_cell::StaticCell;

use crate::interrupts::Interrupts;
use crate::{coils, link};

type Bus = I2c<'static, I2C0, Async>;
/// The bus, shared by the two HATs in one task.
type SharedBus = Mutex<NoopRawMutex, Bus>;
type Chip = Pca9685<I2cDevice<'static, NoopRawMutex, Bus>>;

/// Counts of full drive.
const FULL: u16 = 4095;
/// Addresses of the chips.
const ADDRESSES: [u8; 2] = [0x60, 0x61];
/// Prescaler for the chip's highest frequency: 25 MHz/(4096·4) = 1.5 kHz.
const PRESCALE: u8 = 3;

/// An H-bridge of a HAT: its modulated enable and its two inputs.
struct Bridge {
    enable: Channel,
    forward: Channel,
    backward: Channel,
}

/// The HAT's terminals M1 to M4 (Adafruit's schematic).
const M1: Bridge = Bridge { enable: Channel::C8, forward: Channel::C10, backward: Channel::C9 };
const M2: Bridge = Bridge { enable: Channel::C13, forward: Channel::C11, backward: Channel::C12 };
const M3: Bridge = Bridge { enable: Channel::C2, forward: Channel::C4, backward: Channel::C3 };
const M4: Bridge = Bridge { enable: Channel::C7, forward: Channel::C5, backward: Channel::C6 };

/// Index of each motor's HAT, and the bridges of its two coils.
const OUTPUTS: PerMotor<(usize, [Bridge; 2])> = [(0, [M1, M2]), (0, [M3, M4]), (1, [M1, M2])];

/// Returns the number of the HATs that `motors` motors need.
pub(crate) fn needed(motors: usize) -> usize {
    OUTPUTS.iter().take(motors).next_back().map_or(0, |(hat, _)| hat + 1)
}

/// Drive of the HATs' motors.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct HatCommand {
    /// Highest share of the supply's voltage on a coil, percent.
    pub(crate) duty_percent: u8,
    /// Microsteps of a full step.
    pub(crate) microsteps: u8,
    /// Number of the HATs in use: motor C has the second one.
    pub(crate) hats: usize,
    /// Motor positions, Q4 steps; `None` switches the current off.
    pub(crate) positions: Option<PerMotor<i32>>,
}

/// Longest time for a command, set-up of both chips included: ten times what it takes.
const TIMEOUT: Duration = Duration::from_millis(20);
/// Time after which HATs that did not answer are set up again.
const RETRY: Duration = Duration::from_millis(100);

/// The newest command.
static COMMAND: Signal<CriticalSectionRawMutex, HatCommand> = Signal::new();
/// Whether a HAT did not carry out the last command.
static FAILED: AtomicBool = AtomicBool::new(false);
/// Number of the set of HATs in use; wraps. A failure of another set counts no more.
static SET: AtomicU8 = AtomicU8::new(0);
/// Whether the chip restarts once the current is off.
static LEAVING: AtomicBool = AtomicBool::new(false);

/// Begins with the present HATs: a failure of earlier ones is none of theirs. Called by the
/// stepping interrupt before their first command.
pub(crate) fn begin() {
    SET.store(SET.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    FAILED.store(false, Ordering::Relaxed);
}

/// Sets the newest command, which replaces one that is still waiting. Called by the stepping
/// interrupt; never waits.
pub(crate) fn command(command: HatCommand) {
    COMMAND.signal(command);
}

/// Returns whether a HAT did not carry out the last command: it did not answer in time.
pub(crate) fn failed() -> bool {
    FAILED.load(Ordering::Relaxed)
}

/// Switches the current off, and then leaves the program, also where a HAT does not
/// answer. Called by the stepping interrupt; never waits.
pub(crate) fn leave(command: HatCommand) {
    LEAVING.store(true, Ordering::Relaxed);
    COMMAND.signal(HatCommand { positions: None, ..command });
}

pub(crate) struct HatResources {
    pub(crate) bus: Peri<'static, I2C0>,
    pub(crate) data: Peri<'static, PIN_16>,
    pub(crate) clock: Peri<'static, PIN_17>,
    /// Whether HATs were configured before a restart.
    pub(crate) were_configured: bool,
}

/// Executes the commands. The bus has no pins before the first one. HATs keep their current over a
/// restart of the board, so it is switched off first, where HATs were configured before the
/// restart. One that does not answer is set up again every [`RETRY`]; the other one keeps its
/// current.
#[embassy_executor::task]
pub(crate) async fn drive_hats(resources: HatResources) {
    let first = if resources.were_configured { None } else { Some(COMMAND.wait().await) };
    static BUS: StaticCell<SharedBus> = StaticCell::new();
    let mut config = Config::default();
    config.frequency = 400_000;
    let bus = BUS.init(Mutex::new(I2c::new_async(
        resources.bus,
        resources.clock,
        resources.data,
        Interrupts,
        config,
    )));
    let mut hats = Hats {
        bus,
        chips: [None, None],
        percent: 0,
        commutation: coils::commutation(0, FULL),
        shown: [[0; 2]; MOTORS],
    };
    let off = HatCommand { duty_percent: 0, microsteps: 1, hats: ADDRESSES.len(), positions: None };
    let mut command = first.unwrap_or(off);
    loop {
        let set = SET.load(Ordering::Relaxed);
        let result = with_timeout(TIMEOUT, hats.execute(&command)).await;
        if result.is_err() {
            hats.chips = [None, None];
        }
        let done = matches!(result, Ok(Some(())));
        critical_section::with(|_| {
            FAILED.store(!done && set == SET.load(Ordering::Relaxed), Ordering::Relaxed);
        });
        if command.positions.is_none() && LEAVING.load(Ordering::Relaxed) {
            link::reset::restart();
        }
        if done {
            command = COMMAND.wait().await;
        } else {
            Timer::after(RETRY).await;
            command = COMMAND.try_take().unwrap_or(command);
        }
    }
}

/// State of the two HATs.
struct Hats {
    bus: &'static SharedBus,
    /// Each chip, while it answers.
    chips: [Option<Chip>; 2],
    /// Share of the voltage that `commutation` is for, percent.
    percent: u8,
    commutation: Commutation,
    /// Present drive of each coil.
    shown: PerMotor<[i32; 2]>,
}

impl Hats {
    /// Executes a command; `None` where a chip did not answer.
    async fn execute(&mut self, command: &HatCommand) -> Option<()> {
        let Some(positions) = command.positions else {
            return self.show([[0; 2]; MOTORS], command.hats).await;
        };
        if self.percent != command.duty_percent {
            self.percent = command.duty_percent;
            self.commutation = coils::commutation(command.duty_percent, FULL);
        }
        let wanted = positions.map(|position| self.commutation.at(position, command.microsteps));
        self.show(wanted, command.hats).await
    }

    /// Sets up a chip, with all outputs off.
    async fn set_up(&mut self, hat: usize) -> Option<()> {
        self.chips[hat] = set_up(self.bus, ADDRESSES[hat]).await;
        for ((own, _), shown) in OUTPUTS.iter().zip(&mut self.shown) {
            if *own == hat {
                *shown = [0; 2];
            }
        }
        self.chips[hat].is_some().then_some(())
    }

    /// Sets the drive of each coil of the first `hats` that changes; `None` where a chip did not
    /// answer. The other one is driven all the same.
    async fn show(&mut self, wanted: PerMotor<[i32; 2]>, hats: usize) -> Option<()> {
        let mut done = Some(());
        for hat in 0..hats {
            if self.show_on(hat, &wanted).await.is_none() {
                (self.chips[hat], done) = (None, None);
            }
        }
        done
    }

    /// Sets the drive of each coil of a HAT that changes.
    async fn show_on(&mut self, hat: usize, wanted: &PerMotor<[i32; 2]>) -> Option<()> {
        if self.chips[hat].is_none() {
            self.set_up(hat).await?;
        }
        let chip = self.chips[hat].as_mut()?;
        for (((own, bridges), shown), wanted) in OUTPUTS.iter().zip(&mut self.shown).zip(wanted) {
            if *own != hat {
                continue;
            }
            for ((bridge, shown), wanted) in bridges.iter().zip(shown).zip(wanted) {
                drive(chip, bridge, *shown, *wanted).await?;
                *shown = *wanted;
            }
        }
        Some(())
    }
}

/// Sets up a chip: sleep, frequency, all outputs off, wake.
async fn set_up(bus: &'static SharedBus, address: u8) -> Option<Chip> {
    let mut chip = Pca9685::new(I2cDevice::new(bus), address).ok()?;
    chip.disable().await.ok()?;
    chip.set_prescale(PRESCALE).await.ok()?;
    chip.set_all_on_off(&[0; 16], &[0; 16]).await.ok()?;
    chip.enable().await.ok()?;
    Some(chip)
}

/// Changes the drive of a coil.
async fn drive(chip: &mut Chip, bridge: &Bridge, from: i32, to: i32) -> Option<()> {
    if from == to {
        return Some(());
    }
    if from.signum() != to.signum() {
        chip.set_channel_off(bridge.forward, 0).await.ok()?;
        chip.set_channel_off(bridge.backward, 0).await.ok()?;
        if to != 0 {
            let input = if to > 0 { bridge.forward } else { bridge.backward };
            chip.set_channel_off(input, FULL).await.ok()?;
        }
    }
    chip.set_channel_off(bridge.enable, to.unsigned_abs() as u16).await.ok()
}
