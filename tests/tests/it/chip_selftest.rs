//! `plumb board selftest` on the real firmware in the emulated chip.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use plumb_protocol::message::Refusal;
use plumb_protocol::wiring::{Coils, Drivers, StepDir};
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::BoardName;
use plumb_setup::selftest::{self, Outcome};
use plumb_tests::chip::{Chip, Setup, fast_config, firmware_image};

#[test]
fn the_chip_passes_its_self_test() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    let mut link = Link::connect(chip.port()).expect("a board");
    let checks = selftest::run(&mut link, BoardName::Pico, |check| println!("{check:?}"))
        .expect("the self-test");
    let failed: Vec<_> = checks.iter().filter(|check| check.outcome != Outcome::Passed).collect();
    assert!(failed.is_empty(), "{failed:?}");
    // Three rates of three motors, flash, clock, ticks, stack.
    assert_eq!(checks.len(), 13);
}

#[test]
fn a_board_with_coils_refuses_the_self_test() {
    let Some(image) = firmware_image() else { return };
    let coils = Drivers::Coils(Coils { duty_percent: 50 });
    let config = Setup { drivers: coils, ..fast_config(100.0, StepDir::A4988) };
    let mut chip = Chip::start(&image).configured(config);
    let mut link = Link::connect(chip.port()).expect("a board");
    let refused = selftest::run(&mut link, BoardName::Pico, |_| ()).expect_err("coils");
    assert!(
        matches!(refused, LinkError::Refused { refusal: Refusal::CoilsConfigured, .. }),
        "{refused}"
    );
}
