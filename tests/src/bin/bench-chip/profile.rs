//! Profile of the processor's time by handler and function.

use std::collections::BTreeMap;
use std::path::Path;

use plumb_tests::chip::BALL_UM;
use serde_json::json;

use crate::measure::{BenchLaw, EQUAL_RATES_TARGET_UM, start_with};
use crate::symbols::functions;

/// Number of positions.
const POSITIONS: i32 = 5;
/// Period of the positions, µs.
const PERIOD_US: u64 = 33_333;

/// Prints the processor's time of each function in each exception (0: thread mode), at
/// 3 x 1 M steps/s and 30 positions/s. The time of an inlined function counts for its caller.
pub(crate) fn print(image: &Path, law: BenchLaw) {
    let mut chip = start_with(image, 62_500.0, law);
    chip.seek(BALL_UM, EQUAL_RATES_TARGET_UM);
    chip.run_us(30_000);
    chip.execute(json!({ "trace": { "profile": true } }));
    for at in 0..POSITIONS {
        chip.send_position([BALL_UM[0], BALL_UM[1], at * 1000]);
        chip.run_us(PERIOD_US - 2000);
    }
    let reply = chip.execute(json!({ "profile": true }));
    let functions = functions(image);
    let (mut handlers, mut shares) =
        (BTreeMap::<u64, u64>::new(), BTreeMap::<(u64, &str), u64>::new());
    for entry in reply["profile"].as_array().into_iter().flatten() {
        let [exception, address, cycles] = [0, 1, 2].map(|i| entry[i].as_u64().expect("a number"));
        let function =
            functions.range(..=address).next_back().filter(|(start, f)| address < *start + f.0);
        *handlers.entry(exception).or_default() += cycles;
        *shares.entry((exception, function.map_or("?", |(_, f)| f.1.as_str()))).or_default() +=
            cycles;
    }
    let all = f64::from(POSITIONS) * PERIOD_US as f64 * 125.0;
    let percent = |cycles: u64| 100.0 * cycles as f64 / all;
    for (handler, cycles) in handlers {
        println!("{:6.2} % exception {handler}", percent(cycles));
        let mut of_it: Vec<_> =
            shares.iter().filter(|((exception, _), _)| *exception == handler).collect();
        of_it.sort_by_key(|(_, cycles)| std::cmp::Reverse(**cycles));
        for ((_, name), cycles) in
            of_it.iter().take(20).filter(|(_, cycles)| percent(**cycles) > 0.005)
        {
            println!(
                "{:12.2} % {:5.0} per tick  {name}",
                percent(**cycles),
                **cycles as f64 / (all / 25_000.0)
            );
        }
    }
}
