//! The protocol, the pins and the pulses of a chip.

use std::ops::{Deref, DerefMut};
use std::path::Path;

use plumb_protocol::config::{
    Following, Growth, Interval, JogLimits, Law, Motor, Progress, Workspace,
};
use plumb_protocol::frame::encode;
use plumb_protocol::message::{
    Command, Fault, FromBoard, Hello, Position, Refusal, State, Telemetry, ToBoard,
};
use plumb_protocol::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, Point, Rate, Steps16,
};
use plumb_protocol::wiring::{Drivers, StepDir};
use plumb_protocol::{Config, Wiring};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::{CYCLES_PER_US, Chip, EMERGENCY, ENABLE, symbol_address};

/// Longest time for which the motors turn without a new zero of travel, seconds.
const STRETCH_S: u64 = 20;

/// Pulses on a driver's STEP and DIR inputs since the last query. Times are in cycles, and `None`
/// if there was no such interval.
#[derive(Debug, Clone, Copy)]
pub struct Pulses {
    /// Number of pulses.
    pub count: u64,
    /// Minimum time high.
    pub high: Option<u64>,
    /// Minimum time low.
    pub low: Option<u64>,
    /// Minimum time from a change of direction to a pulse.
    pub setup: Option<u64>,
    /// Minimum time from the start of a pulse to a change of direction.
    pub hold: Option<u64>,
    /// Start of the last pulse, cycle.
    pub last: Option<u64>,
}

impl Chip {
    /// Connects to the board and configures it, as a Pico.
    ///
    /// # Panics
    /// If the board refuses.
    pub fn configured(self, setup: impl Into<Setup>) -> Self {
        let Setup { drivers, config } = setup.into();
        self.wired(Wiring::pico(drivers).of_motors(config.motors.len()), config)
    }

    /// Connects to the board and configures it with this wiring.
    ///
    /// # Panics
    /// If the board refuses.
    pub fn wired(mut self, wiring: Wiring, config: Config) -> Self {
        self.request(Command::Hello(Hello::OURS));
        assert_eq!(self.request(Command::Wire(wiring)), None);
        assert_eq!(self.request(Command::Configure(config)), None);
        self
    }

    /// Returns the frame of a command with a new id.
    ///
    /// # Panics
    /// Never: all commands fit a frame.
    pub fn frame(&mut self, command: Command) -> Vec<u8> {
        self.id += 1;
        encode(&ToBoard { id: self.id, command }).expect("a frame").to_vec()
    }

    /// Sends a command, runs the chip for 4 ms, and returns the refusal, if any. A Configure
    /// whose code is not yet in the flash's cache takes 2 ms.
    ///
    /// # Panics
    /// If there is no answer.
    pub fn request(&mut self, command: Command) -> Option<Refusal> {
        let before = self.received.len();
        let frame = self.frame(command);
        self.send(&frame, 4000);
        let id = self.id;
        let answer = self.received[before..].iter().find_map(|message| match message {
            FromBoard::Answer(answer) if answer.id == id => Some(answer.refusal),
            FromBoard::Hello(hello) if hello.id == id => Some(None),
            _ => None,
        });
        answer.unwrap_or_else(|| panic!("no answer to {command:?}: {:?}", &self.received[before..]))
    }

    /// Sends the position of the ball, µm, and runs the chip for 2 ms.
    pub fn send_position(&mut self, ball: [i32; 3]) {
        let frame = self.position_frame(ball);
        self.send(&frame, 2000);
    }

    /// Sends a target and a position before and after it, µm, so that the board seeks.
    ///
    /// # Panics
    /// If the board refuses the target.
    pub fn seek(&mut self, ball: [i32; 3], target: [i32; 3]) {
        self.send_position(ball);
        assert_eq!(self.request(Command::Target(point(target))), None);
        self.send_position(ball);
    }

    /// Returns the frame of the next position, µm.
    pub fn position_frame(&mut self, ball: [i32; 3]) -> Vec<u8> {
        self.sequence = self.sequence.wrapping_add(1);
        let ball = Some(point(ball));
        self.frame(Command::Position(Position {
            sequence: self.sequence,
            age_us: 10_000,
            ball,
            covariance: None,
        }))
    }

    /// Requests telemetry and returns it.
    ///
    /// # Panics
    /// If there is no answer.
    pub fn status(&mut self) -> Telemetry {
        self.request(Command::Status);
        let telemetry = self.received.iter().rev().find_map(|message| match message {
            FromBoard::Telemetry(telemetry) => Some(*telemetry),
            _ => None,
        });
        telemetry.expect("a Status is answered with telemetry")
    }

    /// Requests the board's state.
    pub fn state(&mut self) -> State {
        self.status().state
    }

    /// Stops the motors, runs the chip until their rates are 0, and returns the telemetry.
    pub fn stop_and_wait(&mut self) -> Telemetry {
        self.request(Command::Stop);
        loop {
            self.run_us(20_000);
            let telemetry = self.status();
            if telemetry.rates.iter().all(|rate| rate.0 == 0) {
                return telemetry;
            }
        }
    }

    /// Turns the motors for some seconds, to and fro, with 31 positions and 10 questions a second
    /// at random times (seeded), and the board's answers and telemetry. After each stretch of
    /// 20 s the motors stop, and their places become the zero of travel: the ball does not
    /// follow them, and they would come to the end of it.
    ///
    /// # Panics
    /// If the motors do not turn, with another configuration than [`fast_config`].
    pub fn turn_beside_traffic(&mut self, seconds: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut left = seconds;
        while left > 0 {
            let stretch = left.min(STRETCH_S);
            self.turn_for(stretch, &mut random);
            left -= stretch;
            if left > 0 {
                self.stop_and_wait();
                assert_eq!(self.request(Command::Home), None);
            }
        }
    }

    /// Turns the motors for some seconds beside traffic.
    fn turn_for(&mut self, seconds: u64, random: &mut ChaCha8Rng) {
        let end = self.cycle + seconds * 1_000_000 * CYCLES_PER_US;
        self.seek(BALL_UM, FAR_TARGET_UM);
        self.pulses();
        for i in 0.. {
            if self.cycle >= end {
                break;
            }
            let ball = if i % 60 < 30 { BALL_UM } else { REVERSING_BALL_UM };
            let frame = self.position_frame(ball);
            let us = random.random_range(0..20_000);
            self.send(&frame, us);
            if i % 3 == 0 {
                self.request(Command::Status);
            }
            self.run_us(30_000 - us);
        }
        let counts = self.pulses().map(|pulses| pulses.count);
        assert!(counts.iter().all(|&count| count > 500 * seconds), "{counts:?} pulses");
    }

    /// Returns the pulses of each motor since the last call: none of one without pins.
    ///
    /// # Panics
    /// If the reply has none.
    pub fn pulses(&mut self) -> [Pulses; 3] {
        let reply = self.execute(json!({ "pulses": true }));
        [0, 1, 2].map(|motor| {
            let own = &reply["pulses"][self.former_steppers + motor];
            let of = |name: &str| own[name].as_u64();
            Pulses {
                count: if own.is_null() { 0 } else { of("count").expect("a count") },
                high: of("high"),
                low: of("low"),
                setup: of("setup"),
                hold: of("hold"),
                last: of("last"),
            }
        })
    }

    /// Connects four TMC2209 drivers to UART1 as on an SKR Pico: X, Z, Y and E have the addresses
    /// 0 to 3. They are numbered X, Y, Z, E.
    pub fn plug_in_skr_drivers(&mut self) {
        let drivers = [[0, 11, 10, 12], [2, 6, 5, 7], [1, 19, 28, 2], [3, 14, 13, 15]];
        self.execute(json!({ "tmc2209": { "uart": [8, 9], "drivers": drivers } }));
    }

    /// Drives a pin from outside; `None` releases it.
    pub fn drive_pin(&mut self, pin: u8, level: Option<u8>) -> Value {
        self.execute(json!({ "gpio": [pin, level] }))
    }

    /// Returns the level of a pin: 0 or 1; 2 if the reply has none.
    pub fn pin_level(&mut self, pin: u8) -> u64 {
        self.execute(json!({ "levels": [pin] }))["levels"][0].as_u64().unwrap_or(2)
    }

    /// Opens or closes the emergency loop.
    pub fn set_emergency(&mut self, open: bool) {
        self.drive_pin(EMERGENCY, Some(u8::from(open)));
    }

    /// Switches the power off and on, and waits for USB.
    pub fn power_cycle(&mut self) {
        self.execute(json!({ "reset": "power" }));
        self.wait_for_usb();
    }

    /// Returns the firmware's counter with this name, a variable of 32 bits in
    /// `firmware/src/diagnostics.rs` or `stack.rs`.
    ///
    /// # Panics
    /// If the image has no such variable.
    pub fn counter(&mut self, image: &Path, name: &str) -> u32 {
        let address = symbol_address(image, &["plumb_firmware", name]);
        let reply = self.execute(json!({ "peek": [address, 4] }));
        let hex = reply["peek"].as_str().expect("bytes");
        u32::from_str_radix(hex, 16).expect("hexadecimal").swap_bytes()
    }

    /// Hangs the processor in an endless loop with interrupts off.
    pub fn hang(&mut self) {
        self.execute(json!({ "hang": true }));
    }

    /// Checks that the watchdog resets the chip within `ms`.
    ///
    /// # Panics
    /// If it does not.
    pub fn assert_watchdog_reset_within(&mut self, ms: u32) {
        let bitten = (0..ms).map(|_| self.run_us(1000)).find(|reply| !reply["resets"].is_null());
        assert_eq!(bitten.expect("a reset")["resets"][0][1], "watchdog");
    }

    /// Checks the board after a reset by the watchdog: it starts, disables the drivers and reports
    /// the fault.
    ///
    /// # Panics
    /// If it does not.
    pub fn assert_stopped_by_watchdog(&mut self) {
        self.wait_for_usb();
        assert_eq!(self.pin_level(ENABLE), 1);
        self.request(Command::Hello(Hello::OURS));
        assert_eq!(self.state(), State::Fault(Fault::Watchdog));
    }

    /// Returns the chip's time, µs.
    pub fn us(&self) -> u64 {
        self.cycle / CYCLES_PER_US
    }
}

/// A configuration with its drivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Setup {
    /// The drivers.
    pub drivers: Drivers,
    /// The configuration.
    pub config: Config,
}

impl Deref for Setup {
    type Target = Config;

    fn deref(&self) -> &Config {
        &self.config
    }
}

impl DerefMut for Setup {
    fn deref_mut(&mut self) -> &mut Config {
        &mut self.config
    }
}

impl From<Config> for Setup {
    /// Returns the configuration with TMC2209 drivers.
    fn from(config: Config) -> Self {
        Self { drivers: Drivers::StepDir(StepDir::TMC2209), config }
    }
}

impl Setup {
    /// Returns the same with another law.
    pub fn with_law(mut self, law: Law) -> Self {
        self.config.law = law;
        self
    }

    /// Returns the same for two motors, with the planar family of the same bounds.
    ///
    /// # Panics
    /// If the law is not `interval`.
    pub fn of_two_motors(mut self) -> Self {
        let Law::Interval(Interval { alpha, beta, gain, .. }) = self.config.law else {
            panic!("{:?}", self.config.law)
        };
        self.config.law = Law::Interval(Interval::planar(alpha[0][0], beta[0][0], gain));
        self.config.motors = self.config.motors.up_to(2);
        let Workspace { min, max } = &mut self.config.workspace;
        (min.0[0], max.0[0]) = Default::default();
        self
    }

    /// Returns the commands that configure a board so, as a Pico.
    pub fn commands(self) -> [Command; 2] {
        let wiring = Wiring::pico(self.drivers).of_motors(self.config.motors.len());
        [Command::Wire(wiring), Command::Configure(self.config)]
    }
}

/// Returns STEP/DIR drivers, and a configuration with a maximum of `rate` full steps/s at 1/16
/// steps and almost no ramp.
/// A ball 2 m from its target needs this rate.
///
/// # Panics
/// If the rate is out of range.
pub fn fast_config(rate: f64, driver: StepDir) -> Setup {
    let motor = Motor {
        max_rate: Rate::from_si(rate).expect("a rate"),
        max_acceleration: Acceleration(4_000_000),
        travel_min: Steps16(-(1 << 29)),
        travel_max: Steps16(1 << 29),
        reversed: false,
    };
    let config = Config {
        law: Law::Interval(Interval::uniform(Bound(65536), Bound(65536), Gain(1 << 20))),
        motors: [motor; 3].into(),
        jog: JogLimits { max_rate: motor.max_rate, max_distance: Steps16(1 << 28) },
        workspace: Workspace { min: point([-1_000_000; 3]), max: point([2_000_000; 3]) },
        growth: Growth { margin: Micrometres(1_000_000), time: Milliseconds(5_000) },
        following: Following { turn: Steps16(1_600_000), movement: Micrometres(1_000_000) },
        progress: Progress { margin: Micrometres(1), time: Milliseconds(60_000) },
        ..Config::example()
    };
    Setup { drivers: Drivers::StepDir(driver), config }
}

/// A target that needs the maximum rate of every motor from [`BALL_UM`], with [`fast_config`]; µm.
pub const FAR_TARGET_UM: [i32; 3] = [2_000_000, 100_000, 1_700_000];

/// A position beyond [`FAR_TARGET_UM`], µm: the motors must reverse.
pub const REVERSING_BALL_UM: [i32; 3] = [2_000_000, 0, 2_000_000];

/// A position of the ball for [`fast_config`], µm.
pub const BALL_UM: [i32; 3] = [500_000, 300_000, 0];

/// Returns a point from µm.
pub fn point(micrometres: [i32; 3]) -> Point {
    Point(micrometres.map(Micrometres))
}
