//! What the real firmware does on the emulated chip, in numbers. They come from the chip's own
//! cycles and pins, so that two runs of an image give the same.
//!
//! Usage: `bench-chip FIRMWARE.elf [--json | --profile [LAW]]`. A table on standard output; with
//! `--json` the numbers once more, on the last line; with `--profile` where the processor's time
//! goes instead, with the law `interval` or the one that is named.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a tool for tests: it stops at the first surprise and says which"
)]

mod measure;
mod profile;
mod symbols;

use std::path::PathBuf;

use measure::BenchLaw;
use plumb_core::TICK_US;
use plumb_core::law::DeferredLawKind;
use serde_json::{Map, Value, json};

/// A line of the table.
struct Row {
    key: &'static str,
    what: &'static str,
    value: f64,
    unit: &'static str,
    /// What it is held against: the target, or others' published figures.
    beside: String,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [image, options @ ..] = arguments.as_slice() else {
        panic!("usage: bench-chip FIRMWARE.elf [--json | --profile [LAW]]");
    };
    if let [profile, law @ ..] = options
        && profile == "--profile"
    {
        let law = law.first().map_or(BenchLaw::Interval, |name| {
            BenchLaw::named(name).expect("interval, adaptive or taut")
        });
        return profile::print(&PathBuf::from(image), law);
    }
    let rows = table(&PathBuf::from(image));
    println!("| {:57} | {:>9} | {:8} | {:60} |", "", "measured", "", "target, or others' figures");
    println!("|{:-<59}|{:->10}:|{:-<10}|{:-<62}|", "", "", "", "");
    for Row { what, value, unit, beside, .. } in &rows {
        let value = if value.fract() == 0.0 { format!("{value}") } else { format!("{value:.2}") };
        println!("| {what:57} | {value:>9} | {unit:8} | {beside:60} |");
    }
    if options.iter().any(|option| option == "--json") {
        let numbers: Map<String, Value> =
            rows.iter().map(|row| (row.key.into(), json!(row.value))).collect();
        println!("{}", Value::Object(numbers));
    }
}

/// All that is measured.
fn table(image: &std::path::Path) -> Vec<Row> {
    let row = |key, what, value, unit, beside: &str| Row {
        key,
        what,
        value,
        unit,
        beside: beside.to_owned(),
    };
    let due = |law: DeferredLawKind| {
        format!("its answer is due after {} ms", law.ticks() * TICK_US / 1000)
    };
    let [one, three] = measure::highest_rates(image);
    let [busy_slow, busy_fast, busy_taut] = measure::busy(image);
    let latency = measure::latency(image);
    let [interval, adaptive, taut] = [BenchLaw::Interval, BenchLaw::Adaptive, BenchLaw::Taut]
        .map(|law| measure::costs(image, law));
    let (silence, expected) = measure::silence(image);
    println!(
        "Silence to standstill is held against the configured deadline and ramp, {expected} ms together.\n"
    );
    vec![
        row(
            "rate_one",
            "highest step rate, one axis",
            one,
            "1/s",
            "> 1 M; Klipper 4.0 M (200 MHz); grblHAL 0.154 to 0.5 M",
        ),
        row(
            "rate_three",
            "highest step rate, each of three axes at once",
            three,
            "1/s",
            "> 1 M; Klipper 2.57 M in all (200 MHz, whole processor)",
        ),
        row(
            "busy_fast",
            "processor, 30 positions/s and 3 x 1 M steps/s",
            busy_fast,
            "%",
            "< 5; Klipper: all of it",
        ),
        row("busy_slow", "processor, 30 positions/s and 3 x 5 k steps/s", busy_slow, "%", ""),
        row("busy_taut", "processor, the same with the law taut", busy_taut, "%", ""),
        row(
            "jitter",
            "jitter of steps within a segment (200 µs)",
            measure::jitter(image),
            "cycles",
            "0",
        ),
        row(
            "latency_median",
            "position's last byte to new rate, median of 200",
            latency.0,
            "µs",
            "",
        ),
        row(
            "latency_worst",
            "position's last byte to new rate, worst of 200",
            latency.1,
            "µs",
            "< 300",
        ),
        row(
            "update_interval",
            "one update of the law interval, at most",
            interval.update,
            "cycles",
            "< 2000",
        ),
        row(
            "step_interval",
            "a tick with a position, law interval, at most",
            interval.step,
            "cycles",
            "",
        ),
        row(
            "update_adaptive",
            "one update of the law adaptive, at most",
            adaptive.update,
            "cycles",
            "< 60 000",
        ),
        row(
            "thought_adaptive",
            "the same with the ticks and links that go before it",
            adaptive.thought,
            "cycles",
            &due(DeferredLawKind::Adaptive),
        ),
        row("update_taut", "one update of the law taut, at most", taut.update, "cycles", ""),
        row(
            "thought_taut",
            "the same with the ticks and links that go before it",
            taut.thought,
            "cycles",
            &due(DeferredLawKind::Taut),
        ),
        row(
            "step_taut",
            "a tick with a position, law taut, at most",
            taut.step,
            "cycles",
            "25 000",
        ),
        row("late_taut", "by how much ticks come late while taut thinks", taut.late, "cycles", "0"),
        row(
            "tick",
            "a tick without, motors under way, median",
            interval.tick,
            "cycles",
            "of 25 000",
        ),
        row(
            "emergency",
            "emergency input to beginning of last pulse, worst of 100",
            measure::emergency(image),
            "µs",
            "one pulse: 1 µs here",
        ),
        row("silence", "silence of the host to standstill", silence, "ms", "deadline + ramp"),
    ]
}
