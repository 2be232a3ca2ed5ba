//! Two Adafruit Motor HATs, as in the paper: a PCA9685 each on I2C0 (GP16 data, GP17 clock), 400
//! kHz.
//!
//! The bus sets the pace. A channel is 5 bytes with its address, 47 bits or 0.12 ms; a microstep
//! changes two channels of a motor, four where a coil turns over: 0.7 to 1.4 ms for three motors
//! under way. The fields follow the motors' positions as fast as that; 300 full steps/s are then at
//! most half a step in one go.

use embassy_embedded_hal::shared_bus::asynch::i2c::I2cDevice;
use embassy_rp::Peri;
use embassy_rp::i2c::{Async, Config, I2c};
use embassy_rp::peripherals::{I2C0, PIN_16, PIN_17};
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, NoopRawMutex};
use embassy_sync::mutex::Mutex;
use embassy_sync::signal::Signal;
use embassy_time::Timer;
use plumb_core::coils::Commutation;
use pwm_pca9685::{Channel, Pca9685};
use static_cell::StaticCell;

use crate::{Interrupts, coils};

type Bus = I2c<'static, I2C0, Async>;
/// Shared by the two HATs alone, of one task.
type SharedBus = Mutex<NoopRawMutex, Bus>;
type Chip = Pca9685<I2cDevice<'static, NoopRawMutex, Bus>>;

/// Counts in the chip's period; this many are fully on.
const FULL: u16 = 4095;
/// The chip's own frequency at most: 25 MHz/(4096·4) = 1.5 kHz.
const PRESCALE: u8 = 3;

/// A bridge of a HAT: its modulated enable and its two inputs.
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

/// Motors A and B on the first HAT, C on the second: which HAT, and the bridges of both coils.
const MOTORS: [(usize, [Bridge; 2]); 3] = [(0, [M1, M2]), (0, [M3, M4]), (1, [M1, M2])];

/// How the fields are to be.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Order {
    /// Share of the voltage that a coil gets at most.
    pub(crate) duty_percent: u8,
    pub(crate) microsteps: u8,
    /// Where, 1/16 steps; `None` is without current.
    pub(crate) positions: Option<[i32; 3]>,
}

static ORDER: Signal<CriticalSectionRawMutex, Order> = Signal::new();

/// Tells the HATs what is wanted now; what they have not got to is dropped. For the stepping: never
/// waits.
pub(crate) fn order(order: Order) {
    ORDER.signal(order);
}

/// What the HATs take of the chip.
pub(crate) struct Parts {
    pub(crate) bus: Peri<'static, I2C0>,
    pub(crate) data: Peri<'static, PIN_16>,
    pub(crate) clock: Peri<'static, PIN_17>,
}

/// Carries orders out. A HAT that does not answer is set up anew until it does.
#[embassy_executor::task]
pub(crate) async fn follow(parts: Parts) {
    static BUS: StaticCell<SharedBus> = StaticCell::new();
    let mut config = Config::default();
    config.frequency = 400_000;
    let bus = BUS.init(Mutex::new(I2c::new_async(
        parts.bus,
        parts.clock,
        parts.data,
        Interrupts,
        config,
    )));
    let mut hats = Hats {
        bus,
        chips: None,
        percent: 0,
        commutation: coils::commutation(0, FULL),
        shown: [[0; 2]; 3],
    };
    let mut order = ORDER.wait().await;
    loop {
        if hats.carry_out(&order).await.is_some() {
            order = ORDER.wait().await;
        } else {
            hats.chips = None;
            Timer::after_millis(100).await;
            order = ORDER.try_take().unwrap_or(order);
        }
    }
}

struct Hats {
    bus: &'static SharedBus,
    /// Both chips, while they answer.
    chips: Option<[Chip; 2]>,
    /// For this share of the voltage.
    percent: u8,
    commutation: Commutation,
    /// The drive that each coil has.
    shown: [[i32; 2]; 3],
}

impl Hats {
    /// `None` where a chip did not answer.
    async fn carry_out(&mut self, order: &Order) -> Option<()> {
        let Some(positions) = order.positions else {
            return self.show([[0; 2]; 3]).await;
        };
        if self.percent != order.duty_percent {
            self.percent = order.duty_percent;
            self.commutation = coils::commutation(order.duty_percent, FULL);
        }
        self.show(positions.map(|position| self.commutation.at(position, order.microsteps))).await
    }

    /// Both chips: asleep, all outputs off, the frequency, awake.
    async fn set_up(&mut self) -> Option<()> {
        self.chips = Some([set_up(self.bus, 0x60).await?, set_up(self.bus, 0x61).await?]);
        self.shown = [[0; 2]; 3];
        Some(())
    }

    /// Changes what is different from before.
    async fn show(&mut self, wanted: [[i32; 2]; 3]) -> Option<()> {
        if self.chips.is_none() {
            self.set_up().await?;
        }
        let chips = self.chips.as_mut()?;
        for (((hat, bridges), shown), wanted) in MOTORS.iter().zip(&mut self.shown).zip(wanted) {
            for ((bridge, shown), wanted) in bridges.iter().zip(shown).zip(wanted) {
                drive(&mut chips[*hat], bridge, *shown, wanted).await?;
                *shown = wanted;
            }
        }
        Some(())
    }
}

/// A chip asleep, all its outputs off, the frequency, and awake.
async fn set_up(bus: &'static SharedBus, address: u8) -> Option<Chip> {
    let mut chip = Pca9685::new(I2cDevice::new(bus), address).ok()?;
    chip.disable().await.ok()?;
    chip.set_prescale(PRESCALE).await.ok()?;
    chip.set_all_on_off(&[0; 16], &[0; 16]).await.ok()?;
    chip.enable().await.ok()?;
    Some(chip)
}

/// Takes a coil from one drive to another.
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
