//! Rig files, up to the board's check.

use std::path::Path;

use plumb_adversary::generate;
use plumb_config::toml_file::parse_toml;
use plumb_core::params::Params;
use plumb_protocol::message::Refusal;
use plumb_protocol::{Config, Wiring};
use plumb_runtime::fuzzing::check_rig_text;
use plumb_runtime::rig::Rig;
use plumb_runtime::rig::check::Severity;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "rig_file",
    input: "the text of a rig file",
    run,
    max_length: 6000,
    smoke: 300,
    words: &[
        "law = ",
        "\"taut\"",
        "\"interval\"",
        "[motors]",
        "[size]",
        "[simulation]",
        "[camera]",
        "inf",
        "nan",
        "-1",
        "0.0",
        "1e308",
        "1e-320",
        "9223372036854775807",
        "[[",
        "]]",
        "\n",
        "= ",
    ],
};

/// Parses the input and checks it. What the program or the board refuses is an error of the check.
pub fn run(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    let findings = check_rig_text(&text, &refusals);
    let is_refused = findings.iter().any(|finding| finding.severity == Severity::Error);
    let problem = match parse_toml::<Rig>(Path::new("rig.toml"), &text) {
        Err(error) => Some(error.to_string()),
        Ok(rig) => match (rig.config(), rig.targets()) {
            (Err(error), _) | (_, Err(error)) => Some(error.to_string()),
            (Ok(config), Ok(_)) => match rig.wiring() {
                Err(error) => Some(error.to_string()),
                Ok(wiring) => refusals(&wiring, &config).first().map(ToString::to_string),
            },
        },
    };
    assert!(is_refused || problem.is_none(), "the check is silent, but: {problem:?}");
}

/// Returns every reason for which a board refuses a wiring and a configuration.
fn refusals(wiring: &Wiring, config: &Config) -> Vec<Refusal> {
    let (build, mut refusals) = (generate::build(true), Vec::new());
    // The check of a file knows the boards of every chip.
    wiring.each_error(None, |error| refusals.push(Refusal::Wiring(error)));
    let drivers = &wiring.drivers;
    Params::each_error(config, drivers, &build, |f| refusals.push(Refusal::Config(f)));
    refusals
}
