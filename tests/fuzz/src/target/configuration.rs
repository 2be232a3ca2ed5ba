//! Configurations of the board: accepted ones move the motors within their limits, refused ones
//! get every reason.

use plumb_adversary::generate;
use plumb_adversary::random::Random;
use plumb_core::MotorRates;
use plumb_core::config_store::Stored;
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_protocol::frame::read;
use plumb_protocol::{Config, Wiring};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "configuration",
    input: "a configuration, as decisions of a generator or as the bytes of a message",
    run,
    max_length: 400,
    smoke: 5_000,
    words: &[],
};

/// Ticks of a planner at most.
const TICKS: u64 = 500;

/// Checks a configuration. Drives the motors of an accepted one.
pub fn run(input: &[u8]) {
    let Some((kind, bytes)) = input.split_first() else { return };
    let mut random = Random::of_input(bytes);
    let setup = match kind % 4 {
        0 => read::<Config>(bytes).ok().map(|config| Stored { wiring: Wiring::example(), config }),
        1 => Some(generate::invalid(&mut random, [0; 3])),
        _ => Some(generate::accepted(&mut random, [0; 3])),
    };
    let Some(Stored { wiring, config }) = setup else { return };
    let build = generate::build(true);
    let mut wrong = Vec::new();
    Params::each_error(&config, &wiring.drivers, &build, |field| wrong.push(field));
    let mut wrong_lines = Vec::new();
    wiring.each_error(build.chip, |error| wrong_lines.push(error));
    assert_eq!(wiring.check(build.chip).err(), wrong_lines.first().copied());
    match Params::check(&config, &wiring.drivers, &build) {
        Ok(params) => {
            assert_eq!(wrong, [], "an accepted configuration has wrong fields");
            drive(&params, &config, &mut random);
        }
        Err(field) => assert_eq!(wrong.first(), Some(&field), "the first wrong field differs"),
    }
}

/// Drives the motors with changing setpoints. They must stay within their travel.
fn drive(params: &Params, config: &Config, random: &mut Random) {
    let mut planner = Planner::default();
    planner.configure(params);
    for _ in 0..TICKS {
        if random.is_exhausted() {
            break;
        }
        if random.percent(20) {
            let rates = config.motors.map(|motor| {
                let most = i64::from(motor.max_rate.0);
                random.corner(-most, most) as i32
            });
            planner.set_rates(MotorRates(rates.steppable(0)), 0);
        }
        planner.tick();
        for (at, motor) in planner.positions().iter().zip(&config.motors) {
            let is_within = (motor.travel_min.0..=motor.travel_max.0).contains(at);
            assert!(is_within, "{at} is outside the travel of {motor:?}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_in_the_corpus_is_a_configuration_that_the_board_accepts() {
        let message = include_bytes!("../../corpus/configuration/message");
        let config = read::<Config>(&message[1..]).unwrap();
        assert!(Params::check(&config, &Wiring::example().drivers, &generate::build(true)).is_ok());
    }
}
