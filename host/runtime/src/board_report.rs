//! Report of the board in SI units, and the cables that are near slack.

use plumb_protocol::message::{DriverReading, State, Telemetry};
use plumb_protocol::units::{Rate, RelativeTension, Steps16};
use plumb_protocol::{MAX_MOTORS, MotorList};

/// Telemetry of the board in SI units. All outputs read it; the link reads the units of the wire.
/// [`record::telemetry`](crate::record::telemetry) has its names in the outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardReport {
    /// Time on the board's clock, seconds.
    pub time: f64,
    /// State of the board.
    pub state: State,
    /// See [`Telemetry::configuration`].
    pub configuration: Option<u16>,
    /// See [`Telemetry::target`].
    pub target: Option<u16>,
    /// See [`Telemetry::sequence`].
    pub sequence: Option<u16>,
    /// Motor positions from the zero of travel, full steps; + pays out.
    pub motors: MotorList<f64>,
    /// Motor rates, full steps/s; + pays out.
    pub rates: MotorList<f64>,
    /// Last accepted position minus target, metres; zero without a target. An output tells it
    /// only where the board has filtered a position of the ball.
    pub error: [f64; 3],
    /// Number of damaged frames that the board received since its start.
    pub bad_frames: u16,
    /// Number of ticks that came late while motors turned, since the board's start.
    pub late_ticks: u16,
    /// The law's estimate of the cables' tensions over the ball's weight; `None` without one.
    pub tensions: Option<MotorList<f64>>,
    /// Place of the reference while the board follows one, metres in the rig frame.
    pub reference: Option<[f64; 3]>,
    /// Newest reading of each motor's driver; `None` of drivers without a UART.
    pub drivers: Option<MotorList<DriverReading>>,
}

impl From<&Telemetry> for BoardReport {
    fn from(telemetry: &Telemetry) -> Self {
        Self {
            time: telemetry.time.0 as f64 / 1e6,
            state: telemetry.state,
            configuration: telemetry.configuration,
            target: telemetry.target,
            sequence: telemetry.sequence,
            motors: telemetry.motors.map(Steps16::to_si),
            rates: telemetry.rates.map(Rate::to_si),
            error: telemetry.error.to_metres(),
            bad_frames: telemetry.bad_frames,
            late_ticks: telemetry.late_ticks,
            tensions: telemetry.tensions.map(|tensions| tensions.map(RelativeTension::to_si)),
            reference: telemetry.reference.map(|reference| reference.position.to_metres()),
            drivers: None,
        }
    }
}

/// Names of the motors in their order.
pub const MOTOR_NAMES: [char; MAX_MOTORS] = ['A', 'B', 'C', 'D'];

/// Text of [`driver_warnings`] of drivers that warn of nothing.
pub const NO_WARNINGS: &str = "none";

/// Returns the warnings of the motors' drivers in words; `none` where there are none.
///
/// ```
/// use plumb_protocol::message::DriverReading;
/// use plumb_runtime::board_report::driver_warnings;
///
/// let cool = DriverReading::default();
/// let hot = DriverReading { is_hot: true, has_open_load: true, ..cool };
/// assert_eq!(driver_warnings(&[hot, cool, cool]), "A hot, A open coil");
/// assert_eq!(driver_warnings(&[cool; 3]), "none");
/// ```
pub fn driver_warnings(drivers: &[DriverReading]) -> String {
    let warnings = drivers.iter().zip(MOTOR_NAMES).flat_map(|(driver, motor)| {
        let hot = driver.is_hot.then(|| format!("{motor} hot"));
        let open = driver.has_open_load.then(|| format!("{motor} open coil"));
        let lost = driver.has_lost_replies.then(|| format!("{motor} lost replies"));
        hot.into_iter().chain(open).chain(lost)
    });
    let text = warnings.collect::<Vec<_>>().join(", ");
    if text.is_empty() { NO_WARNINGS.to_owned() } else { text }
}

/// Returns what to do about the warnings of drivers, in words; `None` where there are none.
pub fn warning_advice(drivers: &[DriverReading]) -> Option<&'static str> {
    if drivers.iter().any(|driver| driver.is_hot) {
        Some("cool the driver, or give its motor less current, before it switches off")
    } else if drivers.iter().any(|driver| driver.has_open_load) {
        Some("check the wires of that motor; fast motion shows an open coil too")
    } else if drivers.iter().any(|driver| driver.has_lost_replies) {
        Some("check the wire of the drivers' UART: the board stops after 0.3 s without a reply")
    } else {
        None
    }
}

/// Estimated tension over the ball's weight below which a cable counts as near slack. The estimate
/// is wrong by 0.06 in the median (docs/understand/taut.md).
pub const NEAR_SLACK: f64 = 0.15;

/// Returns which cables have an estimated tension (over the ball's weight) below [`NEAR_SLACK`].
///
/// ```
/// use plumb_protocol::MotorList;
/// use plumb_runtime::board_report::near_slack;
///
/// assert_eq!(near_slack(MotorList::new([0.4, 0.1, 0.7]))[..], [false, true, false]);
/// ```
pub fn near_slack(tensions: MotorList<f64>) -> MotorList<bool> {
    tensions.map(|tension| tension < NEAR_SLACK)
}
