//! Limits of the board, by the keys of the rig file.

use plumb_protocol::config::Config;
use plumb_protocol::message::{ConfigField, Refusal};
use plumb_protocol::units::Rate;
use plumb_protocol::wiring::Wiring;

use crate::rig::document::{Document, Finding, Severity};
use crate::rig::motors::SENSE;
use crate::rig::quantity::{Conversion, Current, TravelLimit};
use crate::rig::{
    DeadlineSettings, Driver, GrowthRule, JogSettings, LawName, PathSettings, ReachedRule, Rig,
    TimingSettings, UartSettings,
};

/// Check of a wiring and a configuration by the board's own limits: returns every reason to refuse
/// them.
pub type BoardCheck<'a> = &'a dyn Fn(&Wiring, &Config) -> Vec<Refusal>;

/// Returns whether the board refuses this field of `rig`.
fn is_refused(rig: &Rig, field: ConfigField, board: BoardCheck<'_>) -> bool {
    let mut conversion = Conversion::default();
    let (wiring, config) = (rig.convert_wiring(&mut conversion), rig.convert(&mut conversion));
    board(&wiring, &config).contains(&Refusal::Config(field))
}

/// Returns the keys of the rig file that a field of the configuration follows from.
fn keys(field: ConfigField, law: LawName) -> &'static [&'static str] {
    match field {
        ConfigField::Signs => &["law.interval.signs"],
        ConfigField::Bounds => &["law.interval.alpha", "law.interval.beta"],
        ConfigField::Gain if law == LawName::Sign => &["law.sign.gain"],
        ConfigField::Gain => &["law.interval.gamma"],
        ConfigField::MaxRate => &["motors.max_rate"],
        ConfigField::MaxAcceleration => &["motors.max_acceleration"],
        ConfigField::Travel => &["motors.travel"],
        ConfigField::Microsteps => &["motors.microsteps"],
        ConfigField::Workspace => &["workspace.min", "workspace.max"],
        ConfigField::Reached => &["reached.radius", "reached.frames"],
        ConfigField::Deadlines => &["deadlines.host", "deadlines.position", "deadlines.max_age"],
        ConfigField::Growth => &["growth.margin", "growth.time"],
        ConfigField::Following => &["following.turn", "following.movement"],
        ConfigField::Progress => &["progress.margin", "progress.time"],
        ConfigField::Jog => &["jog.max_rate", "jog.max_distance"],
        ConfigField::Path => {
            &["path.max_speed", "path.max_acceleration", "path.max_jerk", "path.deviation"]
        }
        ConfigField::Drivers => &["motors.driver", "motors.timing"],
        ConfigField::Mean => match law {
            LawName::Interval => &["law.interval.mean"],
            LawName::Sign => &["law.sign.mean"],
            LawName::Adaptive => &["law.adaptive.mean"],
            LawName::Taut => &["law.taut.mean"],
        },
        ConfigField::Delay if law == LawName::Adaptive => &["law.adaptive.delay"],
        ConfigField::Delay => &["law.taut.delay"],
        ConfigField::Law => &["law"],
        ConfigField::Motors | ConfigField::Prior => &["motors.count"],
        // The conversion of the rig file tells that it is not below `deadlines.position`.
        ConfigField::MaxAge => &["deadlines.max_age"],
    }
}

/// Keys of drivers on a UART that their settings follow from.
const UART_KEYS: &[&str] = &[
    "motors.driver.tmc2209-uart.run_current",
    "motors.driver.tmc2209-uart.hold_current",
    "motors.driver.tmc2209-uart.sense_resistor",
    "motors.timing",
];

/// Sets a key of drivers on a UART to a value that fits the others' defaults.
fn reset_uart(settings: &mut UartSettings, key: &str) {
    match key.rsplit('.').next() {
        Some("run_current") => settings.run_current = Current::constant(0.8),
        Some("hold_current") => settings.hold_current = None,
        Some("sense_resistor") => settings.sense_resistor = SENSE,
        _ => {}
    }
}

/// Sets a key of a field with several keys to its default.
fn reset(rig: &mut Rig, key: &str) {
    if let Driver::Tmc2209Uart(settings) = &mut rig.motors.driver {
        reset_uart(settings, key);
    }
    let (reached, deadlines) = (ReachedRule::default(), DeadlineSettings::default());
    let (growth, jog) = (GrowthRule::default(), JogSettings::default());
    let path = PathSettings::default();
    match key {
        "reached.radius" => rig.reached.radius = reached.radius,
        "reached.frames" => rig.reached.frames = reached.frames,
        "deadlines.host" => rig.deadlines.host = deadlines.host,
        "deadlines.position" => rig.deadlines.position = deadlines.position,
        "deadlines.max_age" => rig.deadlines.max_age = deadlines.max_age,
        "growth.margin" => rig.growth.margin = growth.margin,
        "growth.time" => rig.growth.time = growth.time,
        "jog.max_rate" => rig.jog.max_rate = jog.max_rate,
        "jog.max_distance" => rig.jog.max_distance = jog.max_distance,
        "path.max_speed" => rig.path.max_speed = path.max_speed,
        "path.max_acceleration" => rig.path.max_acceleration = path.max_acceleration,
        "path.max_jerk" => rig.path.max_jerk = path.max_jerk,
        "motors.timing" => rig.motors.timing = TimingSettings::default(),
        "path.deviation" => rig.path.deviation = path.deviation,
        _ => {}
    }
}

/// Returns the keys that make the board refuse `field` of `rig`: those that it refuses with the
/// defaults of the field's other keys, or else all keys of the field.
fn wrong_keys(rig: &Rig, field: ConfigField, board: BoardCheck<'_>) -> Vec<&'static str> {
    let keys = match (field, &rig.motors.driver) {
        (ConfigField::Drivers, Driver::Tmc2209Uart(_)) => UART_KEYS,
        _ => keys(field, rig.law.name()),
    };
    let is_wrong_alone = |key: &&&str| {
        let mut rig = rig.clone();
        keys.iter().filter(|other| *other != *key).for_each(|other| reset(&mut rig, other));
        is_refused(&rig, field, board)
    };
    let wrong: Vec<_> = keys.iter().filter(is_wrong_alone).copied().collect();
    if wrong.is_empty() { keys.to_vec() } else { wrong }
}

/// Returns the findings about a field of `rig` that the board refuses.
pub(super) fn findings(
    document: &Document<'_>,
    field: ConfigField,
    rig: &Rig,
    board: BoardCheck<'_>,
) -> Vec<Finding> {
    let mut rest = rig.clone();
    let mut found = Vec::new();
    if let (ConfigField::Drivers, Driver::Tmc2209Uart(settings)) = (field, &mut rest.motors.driver)
    {
        found.extend(UART_KEYS.iter().filter_map(|key| current(document, rig, key)));
        UART_KEYS.iter().for_each(|key| reset_uart(settings, key));
    }
    if found.is_empty() {
        found.push(finding(document, field, &wrong_keys(rig, field, board), rig, board));
    } else if is_refused(&rest, field, board) {
        found.push(finding(document, field, &wrong_keys(&rest, field, board), &rest, board));
    }
    found
}

/// Returns the finding about `key` where it is the current of drivers on a UART, and beyond what
/// the other settings of the drivers allow.
pub(super) fn current(document: &Document<'_>, rig: &Rig, key: &str) -> Option<Finding> {
    let Driver::Tmc2209Uart(settings) = &rig.motors.driver else { return None };
    let (value, [least, most], cause) = match key.rsplit('.').next()? {
        "run_current" => {
            let cause = format!("`sense_resistor = {}`", settings.sense_resistor.get());
            (settings.run_current, settings.run_range(), cause)
        }
        "hold_current" => {
            let cause = "these `run_current` and `sense_resistor`".to_owned();
            (settings.hold_current?, settings.hold_range(), cause)
        }
        _ => return None,
    };
    let problem = format!("is out of range: with {cause} it is from {least} to {most} A");
    let is_wrong = !(least..=most).contains(&value.get());
    is_wrong.then(|| document.finding(Severity::Error, &[key], problem))
}

/// Returns the finding about a field of `rig` that the board refuses because of these keys.
fn finding(
    document: &Document<'_>,
    field: ConfigField,
    names: &[&str],
    rig: &Rig,
    board: BoardCheck<'_>,
) -> Finding {
    if field != ConfigField::MaxRate {
        return document.out_of_range(names, out_of_range(rig, field));
    }
    let largest = largest_rate(rig, board);
    let problem = format!(
        "is out of range: with this driver and these microsteps the rate is above 0 and at most \
         {largest} full steps/s"
    );
    document.finding(Severity::Error, names, problem)
}

/// Returns what is wrong with a field of `rig` that the board refuses.
fn out_of_range(rig: &Rig, field: ConfigField) -> String {
    match (field, rig.motors.travel.map(TravelLimit::get)) {
        (ConfigField::Law, _) => {
            "is `taut`, which needs three motors: write a table [law.adaptive]".to_owned()
        }
        (ConfigField::Travel, [min, max]) if min > max => {
            format!("must have the lower limit first: write [{max}, {min}]")
        }
        (ConfigField::Travel, [min, max]) if min > 0.0 || max < 0.0 => {
            "must contain 0, where the board starts".to_owned()
        }
        _ => "is out of range".to_owned(),
    }
}

/// Returns the highest rate that the board accepts with the other values of `rig`, whole full
/// steps/s; 0 where it accepts none.
fn largest_rate(rig: &Rig, board: BoardCheck<'_>) -> u32 {
    let mut conversion = Conversion::default();
    let wiring = rig.convert_wiring(&mut conversion);
    let config = rig.convert(&mut conversion);
    let is_accepted = |rate: u32| {
        let mut config = config;
        let Some(rate) = Rate::from_si(f64::from(rate)) else { return false };
        config.motors.iter_mut().for_each(|motor| motor.max_rate = rate);
        !board(&wiring, &config).contains(&Refusal::Config(ConfigField::MaxRate))
    };
    let (mut accepted, mut refused) = (0, 1 << 24);
    while refused - accepted > 1 {
        let middle = accepted + (refused - accepted) / 2;
        if is_accepted(middle) {
            accepted = middle;
        } else {
            refused = middle;
        }
    }
    accepted
}
