//! A chip that is spoken to in the protocol's words, and what its pulses were.

use plumb_protocol::Config;
use plumb_protocol::config::{Drivers, Growth, Interval, Law, Motor, StepDir, Workspace};
use plumb_protocol::frame::encode;
use plumb_protocol::message::{
    Command, Fault, FromBoard, Hello, Position, Refusal, State, Telemetry, ToBoard,
};
use plumb_protocol::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, Point, Rate, Steps16,
};
use serde_json::{Value, json};

use super::{CYCLES_PER_US, Chip, EMERGENCY, ENABLE};

/// What a driver has seen on its STEP and DIR inputs since it was last asked; times in cycles,
/// `None` where there was none.
#[derive(Debug, Clone, Copy)]
pub struct Pulses {
    /// How many.
    pub count: u64,
    /// Least time high.
    pub high: Option<u64>,
    /// Least time low.
    pub low: Option<u64>,
    /// Least time from a turn of the direction to a pulse.
    pub setup: Option<u64>,
    /// Least time from a pulse's beginning to a turn of the direction.
    pub hold: Option<u64>,
    /// The cycle at which the very last pulse began.
    pub last: Option<u64>,
}

impl Chip {
    /// Greets and configures the board.
    ///
    /// # Panics
    /// Where it refuses.
    pub fn configured(mut self, config: Config) -> Self {
        self.request(Command::Hello(Hello::OURS));
        assert_eq!(self.request(Command::Configure(config)), None);
        self
    }

    /// The bytes of a command, with an id of its own.
    ///
    /// # Panics
    /// Never: all commands fit a frame.
    pub fn frame(&mut self, command: Command) -> Vec<u8> {
        self.id += 1;
        encode(&ToBoard { id: self.id, command }).expect("a frame").to_vec()
    }

    /// Sends a command and lets 2 ms pass; why it was refused, if it was.
    ///
    /// # Panics
    /// Where no answer comes.
    pub fn request(&mut self, command: Command) -> Option<Refusal> {
        let before = self.received.len();
        let frame = self.frame(command);
        self.send(&frame, 2000);
        let id = self.id;
        let answer = self.received[before..].iter().find_map(|message| match message {
            FromBoard::Answer(answer) if answer.id == id => Some(answer.refusal),
            FromBoard::Hello(hello) if hello.id == id => Some(None),
            _ => None,
        });
        answer.unwrap_or_else(|| {
            panic!("{command:?} is not answered: {:?}", &self.received[before..])
        })
    }

    /// Reports the ball, in micrometres, and lets 2 ms pass.
    pub fn send_position(&mut self, ball: [i32; 3]) {
        let frame = self.position_frame(ball);
        self.send(&frame, 2000);
    }

    /// Sends the ball to `target`, and reports it at `ball`; micrometres.
    ///
    /// # Panics
    /// Where the target is refused.
    pub fn seek(&mut self, ball: [i32; 3], target: [i32; 3]) {
        self.send_position(ball);
        assert_eq!(self.request(Command::Target(point(target))), None);
        self.send_position(ball);
    }

    /// The bytes of the next position, micrometres.
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

    /// Where the board says that it is.
    ///
    /// # Panics
    /// Where it does not answer.
    pub fn status(&mut self) -> Telemetry {
        self.request(Command::Status);
        let telemetry = self.received.iter().rev().find_map(|message| match message {
            FromBoard::Telemetry(telemetry) => Some(*telemetry),
            _ => None,
        });
        telemetry.expect("a Status is answered with telemetry")
    }

    /// The board's state.
    pub fn state(&mut self) -> State {
        self.status().state
    }

    /// Stops, and lets time pass until the motors stand; where the board says that they do.
    pub fn stop_and_wait(&mut self) -> Telemetry {
        self.request(Command::Stop);
        loop {
            self.run_us(20_000);
            let telemetry = self.status();
            if telemetry.rates == [Rate(0); 3] {
                return telemetry;
            }
        }
    }

    /// What each motor's driver has seen since it was last asked.
    ///
    /// # Panics
    /// Where the chip does not tell.
    pub fn pulses(&mut self) -> [Pulses; 3] {
        let reply = self.execute(json!({ "pulses": true }));
        [0, 1, 2].map(|motor| {
            let of = |name: &str| reply["pulses"][motor][name].as_u64();
            Pulses {
                count: of("count").expect("a count"),
                high: of("high"),
                low: of("low"),
                setup: of("setup"),
                hold: of("hold"),
                last: of("last"),
            }
        })
    }

    /// Drives a pin from outside; `None` lets go of it.
    pub fn drive_pin(&mut self, pin: u8, level: Option<u8>) -> Value {
        self.execute(json!({ "gpio": [pin, level] }))
    }

    /// The level of a pin.
    pub fn pin_level(&mut self, pin: u8) -> u64 {
        self.execute(json!({ "levels": [pin] }))["levels"][0].as_u64().unwrap_or(2)
    }

    /// Opens or closes the emergency loop.
    pub fn set_emergency(&mut self, open: bool) {
        self.drive_pin(EMERGENCY, Some(u8::from(open)));
    }

    /// Takes the power away and gives it back; waits for USB.
    pub fn power_cycle(&mut self) {
        self.execute(json!({ "reset": "power" }));
        self.wait_for_usb();
    }

    /// Lets the processor jump to itself for ever, with interrupts off.
    pub fn hang(&mut self) {
        self.execute(json!({ "hang": true }));
    }

    /// The watchdog resets the chip within `ms` from now.
    ///
    /// # Panics
    /// Where it does not.
    pub fn assert_watchdog_reset_within(&mut self, ms: u32) {
        let bitten = (0..ms).map(|_| self.run_us(1000)).find(|reply| !reply["resets"].is_null());
        assert_eq!(bitten.expect("a reset")["resets"][0][1], "watchdog");
    }

    /// After a watchdog's reset: the board comes up, lets the drivers go and says why.
    ///
    /// # Panics
    /// Where it does not.
    pub fn assert_stopped_by_watchdog(&mut self) {
        self.wait_for_usb();
        assert_eq!(self.pin_level(ENABLE), 1);
        self.request(Command::Hello(Hello::OURS));
        assert_eq!(self.state(), State::Fault(Fault::Watchdog));
    }

    /// The chip's time, µs.
    pub fn us(&self) -> u64 {
        self.cycle / CYCLES_PER_US
    }
}

/// A configuration for `rate` full steps/s in sixteenths, which a ball 2 m from its target asks
/// for, with next to no ramp.
///
/// # Panics
/// Where there is no such rate.
pub fn fast_config(rate: f64, driver: StepDir) -> Config {
    let motor = Motor {
        max_rate: Rate::from_si(rate).expect("a rate"),
        max_acceleration: Acceleration(4_000_000),
        travel_min: Steps16(-(1 << 29)),
        travel_max: Steps16(1 << 29),
        reversed: false,
    };
    Config {
        law: Law::Interval(Interval::uniform(Bound(65536), Bound(65536), Gain(1 << 20))),
        motors: [motor; 3],
        workspace: Workspace { min: point([-1_000_000; 3]), max: point([2_000_000; 3]) },
        growth: Growth { margin: Micrometres(1_000_000), time: Milliseconds(60_000) },
        drivers: Drivers::StepDir(driver),
        ..Config::example()
    }
}

/// A target that every motor of [`fast_config`] hurries to from [`BALL_UM`].
pub const FAR_TARGET_UM: [i32; 3] = [2_000_000, 100_000, 1_700_000];

/// A place of the ball for [`fast_config`].
pub const BALL_UM: [i32; 3] = [500_000, 300_000, 0];

/// A point from micrometres.
pub fn point(micrometres: [i32; 3]) -> Point {
    Point(micrometres.map(Micrometres))
}
