//! Measurements of the real firmware on the emulated chip. They come from the chip's cycles and
//! pins, so that two runs of an image give the same numbers.
//!
//! Usage: `bench-chip FIRMWARE.elf [--json] [--seconds N] | --profile [LAW]`. Prints a table; with
//! `--json` also the numbers as JSON, on the last line. `--seconds` is the chip's time for the
//! ticks beside traffic, 20 by default. `--profile` prints the processor's time by function
//! instead, for law `interval` or LAW.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a tool for tests: it stops at the first surprise and names it"
)]

mod following;
mod measure;
mod profile;
mod symbols;
mod table;

use std::path::Path;

use measure::BenchLaw;
use serde_json::{Map, Value, json};
use table::Row;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [image, options @ ..] = arguments.as_slice() else {
        panic!("usage: bench-chip FIRMWARE.elf [--json] [--seconds N] | --profile [LAW]");
    };
    let image = Path::new(image);
    match options.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--profile"] => profile::print(image, BenchLaw::Interval),
        ["--profile", law] => {
            profile::print(image, BenchLaw::parse(law).expect("interval, adaptive or taut"));
        }
        _ => {
            let rows = table::table(image, seconds(options));
            print_table(&rows);
            if options.iter().any(|option| option == "--json") {
                print_json(&rows);
            }
        }
    }
}

/// Returns the chip's time for the ticks beside traffic, s.
fn seconds(options: &[String]) -> u64 {
    let given = options.iter().skip_while(|option| *option != "--seconds").nth(1);
    given.map_or(20, |seconds| seconds.parse().expect("a number of seconds"))
}

fn print_table(rows: &[Row]) {
    println!("| {:52} | {:>9} | {:6} | {:56} |", "", "measured", "", "target, or others' figures");
    println!("|{:-<54}|{:->10}:|{:-<8}|{:-<58}|", "", "", "", "");
    for Row { quantity, value, unit, reference, .. } in rows {
        let value = if value.fract() == 0.0 { format!("{value}") } else { format!("{value:.2}") };
        println!("| {quantity:52} | {value:>9} | {unit:6} | {reference:56} |");
    }
}

fn print_json(rows: &[Row]) {
    let numbers: Map<String, Value> =
        rows.iter().map(|row| (row.key.into(), json!(row.value))).collect();
    println!("{}", Value::Object(numbers));
}
