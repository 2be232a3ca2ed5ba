//! When telemetry comes.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_protocol::message::*;

use crate::common::bench::Bench;
use crate::common::{self, BUILD, config, wiring};

/// Returns the times of the telemetry received, on the board's clock, µs.
fn times(bench: &Bench) -> Vec<u64> {
    let time = |message: &FromBoard| match message {
        FromBoard::Telemetry(telemetry) => Some(telemetry.time.0),
        _ => None,
    };
    bench.received.iter().filter_map(time).collect()
}

#[test]
fn a_board_that_nobody_has_greeted_sends_nothing() {
    for is_stored in [false, true] {
        let mut bench = Bench::new(BUILD);
        if is_stored {
            bench.harness.board.restore(&wiring(), &config());
        }
        bench.run_ms(1_000);
        assert_eq!(bench.received, []);
    }
}

#[test]
fn telemetry_comes_every_tenth_of_a_second_and_no_more_often() {
    let mut bench = Bench::configured(config());
    bench.run_ms(200);
    bench.received.clear();
    bench.run_ms(1_000);
    let times = times(&bench);
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 100_000), "{times:?}");
    assert_eq!(times.len(), 10);
}

#[test]
fn each_accepted_position_is_acknowledged_by_one_telemetry() {
    let mut bench = Bench::configured(config());
    bench.run_ms(200);
    bench.received.clear();
    for _ in 0..20 {
        bench.send_ball(common::bench::BALL);
        bench.run_ms(20);
    }
    assert_eq!(times(&bench).len(), 20);
}
