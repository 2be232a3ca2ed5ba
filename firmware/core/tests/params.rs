//! Check of a configuration: one field for the board, all of them for a host.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;

use plumb_core::params::Params;
use plumb_protocol::Config;
use plumb_protocol::config::{Coils, Drivers, Law};
use plumb_protocol::message::ConfigField;
use plumb_protocol::units::{Micrometres, Steps16};

use common::{BUILD, config};

fn errors(config: &Config) -> Vec<ConfigField> {
    let mut errors = Vec::new();
    Params::each_error(config, &BUILD, |field| errors.push(field));
    errors
}

#[test]
fn a_valid_configuration_has_no_error() {
    assert_eq!(errors(&config()), []);
}

#[test]
fn every_field_out_of_range_is_reported_and_the_board_names_the_first() {
    let mut config = config();
    let Law::Interval(law) = &mut config.law else { panic!("the law of these tests") };
    law.signs = [[0; 3]; 3];
    law.gain.0 = 0;
    config.microsteps = 17;
    config.drivers = Drivers::Coils(Coils { duty_percent: 0 });
    config.motors[1].travel_min = Steps16(1);
    config.motors[2].max_acceleration.0 = 0;
    config.workspace.min = config.workspace.max;
    config.reached.frames = 0;
    config.deadlines.max_age = config.deadlines.position;
    config.growth.margin = Micrometres(0);
    config.mean.0 = 401;
    let all = errors(&config);
    let expected = [
        ConfigField::Signs,
        ConfigField::Gain,
        ConfigField::Microsteps,
        ConfigField::Drivers,
        ConfigField::Travel,
        ConfigField::MaxAcceleration,
        ConfigField::Workspace,
        ConfigField::Reached,
        ConfigField::MaxAge,
        ConfigField::Growth,
        ConfigField::Mean,
    ];
    assert_eq!(all, expected);
    assert_eq!(Params::check(&config, &BUILD), Err(all[0]));
}
