//! The table of measurements, with targets and published figures of other firmware.

use std::path::Path;

use plumb_core::TICK_US;
use plumb_core::law::{DeferredTicks, LawTicks};

use crate::following;
use crate::measure::{self, BenchLaw};

/// A row of the table.
pub(crate) struct Row {
    /// Key in the JSON output.
    pub(crate) key: &'static str,
    pub(crate) quantity: &'static str,
    pub(crate) value: f64,
    pub(crate) unit: &'static str,
    /// Target, or published figures of others.
    pub(crate) reference: String,
}

fn row(
    key: &'static str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    reference: &str,
) -> Row {
    Row { key, quantity, value, unit, reference: reference.to_owned() }
}

/// Measures everything; the ticks beside traffic for `seconds` of the chip's time.
pub(crate) fn table(image: &Path, seconds: u64) -> Vec<Row> {
    let late = measure::late_ticks(image, seconds);
    let late = row("late_traffic", "late ticks beside traffic on USB", late, "", "0");
    [rates(image), loads(image), motion(image), laws(image), paths(image), vec![late], stops(image)]
        .into_iter()
        .flatten()
        .collect()
}

fn rates(image: &Path) -> Vec<Row> {
    let [one, three] = measure::highest_rates(image);
    let one_reference = "> 1 M; Klipper 4.0 M (200 MHz); grblHAL 0.154 to 0.5 M";
    let three_reference = "> 1 M; Klipper 2.57 M in all (200 MHz, whole processor)";
    vec![
        row("rate_one", "highest step rate, one axis", one, "1/s", one_reference),
        row("rate_three", "highest step rate, each of three axes", three, "1/s", three_reference),
    ]
}

fn loads(image: &Path) -> Vec<Row> {
    let [slow, fast, taut] = measure::processor_load(image);
    let row = |key, quantity, value, reference| row(key, quantity, value, "%", reference);
    let fast_reference = "< 5; Klipper: all of it";
    vec![
        row("busy_fast", "processor, 30 positions/s, 3 x 1 M steps/s", fast, fast_reference),
        row("busy_slow", "processor, 30 positions/s, 3 x 5 k steps/s", slow, ""),
        row("busy_taut", "processor, the same with law taut", taut, ""),
    ]
}

fn motion(image: &Path) -> Vec<Row> {
    let jitter = measure::jitter(image);
    let measure::Latency { median, worst } = measure::latency(image);
    vec![
        row("jitter", "jitter of steps within a segment (200 µs)", jitter, "cycles", "0"),
        row("latency_median", "position's last byte to new rate, median of 200", median, "µs", ""),
        row(
            "latency_worst",
            "position's last byte to new rate, worst of 200",
            worst,
            "µs",
            "< 325",
        ),
    ]
}

/// Returns the reference of a law that responds after this number of ticks.
fn takes_effect(ticks: u16) -> String {
    format!("takes effect after {} ms", u32::from(ticks) * TICK_US / 1000)
}

fn laws(image: &Path) -> Vec<Row> {
    let [interval, adaptive, taut] = [BenchLaw::Interval, BenchLaw::Adaptive, BenchLaw::Taut]
        .map(|law| measure::costs(image, law));
    let row =
        |key, quantity, value, reference: &str| row(key, quantity, value, "cycles", reference);
    let due = |law: DeferredTicks| takes_effect(law.standing);
    let response = "the same with everything that interrupts it";
    let position_tick = "a tick with a position, law interval, maximum";
    let position_tick_taut = "a tick with a position, law taut, maximum";
    vec![
        row("update_interval", "update of law interval, maximum", interval.update, "< 2000"),
        row("position_tick_interval", position_tick, interval.position_tick, ""),
        row("update_adaptive", "update of law adaptive, maximum", adaptive.update, "< 60 000"),
        row("response_adaptive", response, adaptive.response, &due(LawTicks::RP2040.adaptive)),
        row("update_taut", "update of law taut, maximum", taut.update, ""),
        row("response_taut", response, taut.response, &due(LawTicks::RP2040.taut)),
        row("position_tick_taut", position_tick_taut, taut.position_tick, "25 000"),
        row("late_taut", "lateness of ticks with law taut", taut.late, "0"),
        row("tick", "a tick without a position, moving, median", interval.tick, "of 25 000"),
    ]
}

fn paths(image: &Path) -> Vec<Row> {
    let [interval, adaptive, taut] = [BenchLaw::Interval, BenchLaw::Adaptive, BenchLaw::Taut]
        .map(|law| following::costs(image, law));
    let tick = interval.tick.max(adaptive.tick).max(taut.tick);
    let late = interval.late.max(adaptive.late).max(taut.late);
    let row =
        |key, quantity, value, reference: &str| row(key, quantity, value, "cycles", reference);
    let due = |law: DeferredTicks| takes_effect(law.following);
    let response = "the same with everything that interrupts it";
    let latency = following::latency(image);
    vec![
        row("path_tick", "along a path: a tick of any law, maximum", tick, "25 000"),
        row("path_late", "along a path: lateness of ticks with any law", late, "0"),
        row("path_update_adaptive", "along a path: update of adaptive", adaptive.update, ""),
        row("path_response_adaptive", response, adaptive.response, &due(LawTicks::RP2040.adaptive)),
        row("path_update_taut", "along a path: update of taut", taut.update, ""),
        row("path_response_taut", response, taut.response, &due(LawTicks::RP2040.taut)),
        Row {
            unit: "µs",
            ..row("path_latency", "along a path: position to new rate", latency, "< 325")
        },
    ]
}

fn stops(image: &Path) -> Vec<Row> {
    let emergency = measure::emergency(image);
    let emergency_quantity = "emergency input to start of last pulse, worst of 100";
    let measure::Silence { measured, expected } = measure::silence(image);
    let deadline = format!("deadline + ramp: {expected}");
    vec![
        row("emergency", emergency_quantity, emergency, "µs", "filter of 50 + one pulse: 51"),
        row("silence", "silence of the host to standstill", measured, "ms", &deadline),
    ]
}
