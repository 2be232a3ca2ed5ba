//! Values, keys and lines as people write them wrongly: the line and the key of each mistake.

use super::*;

/// Mistakes in place of a text of the paper's file: the line of the replacement, from 1, and the
/// key of each error. The key of an error of syntax is empty where no value was read.
type Rows = [(&'static str, &'static [(usize, &'static str)])];

/// Checks the errors about the paper's file with each of the replacements of `old`.
fn check_errors(old: &str, rows: &Rows) {
    let begin = PAPER[..PAPER.find(old).unwrap()].matches('\n').count();
    for (new, expected) in rows {
        let found = findings(&[(old, new)]);
        let found: Vec<_> = found.iter().filter(|it| it.severity == Severity::Error).collect();
        let key = |it: &Finding| it.values.first().map(|(key, _)| key.clone()).unwrap_or_default();
        let errors: Vec<_> = found.iter().map(|it| (it.line.unwrap() - begin, key(it))).collect();
        let expected: Vec<_> = expected.iter().map(|(line, key)| (*line, (*key).into())).collect();
        assert_eq!(errors, expected, "{new}: {found:#?}");
    }
}

#[test]
fn mistakes_in_headers_and_laws_are_named_with_line_and_key() {
    check_errors(
        "[workspace]",
        &[
            ("[law]\nname = \"taut\"\n[workspace]", &[(2, "law.name")]),
            ("[law.taut]\n[law.sign]\ngain = 1\n[workspace]", &[(1, "law")]),
            ("[law]\n[workspace]", &[(1, "law")]),
            ("workspace]", &[(1, "")]),
            ("[workspace", &[(1, "")]),
            ("[workspce]", &[(1, "workspce"), (26, "workspace")]),
        ],
    );
}

#[test]
fn mistakes_in_targets_are_named_with_line_and_key() {
    check_errors(
        "targets = [[0.400, 0.400, 0.150]]",
        &[
            ("law = \"taut\"\ntargets = [[0.400, 0.400, 0.150]]", &[(1, "law")]),
            ("", &[(42, "targets")]),
            ("targets = [[0.4, 0.4, 0.15], [400, 400, 150], [0.4, 0.4]]", &[(1, "targets")]),
            ("targets = [0.4, 0.4, 0.15]", &[(1, "targets")]),
            ("targets = [0,4, 0,4, 0,15]", &[(1, "targets")]),
            ("targets = [[0,626, 0,27, 0,325]]", &[(1, "targets")]),
            ("targets = [[0,6; 0,3; 0,3], [0,65; 0,3; 0,3]]", &[(1, "targets")]),
            (
                "targets = [\n[0,6; 0,3; 0,3];\n[0,65; 0,3; 0,3]\n]",
                &[(2, "targets"), (3, "targets")],
            ),
            (
                "targets = [\n[0.6, 0.3, 0.3];\n[0.65, 0.3, 0.3]\n]",
                &[(2, "targets"), (3, "targets")],
            ),
            ("targets = [\n[0,6, 0,03, 0,3],\n[0,65, 0,3, 0,3]\n]", &[(2, "targets")]),
            ("targets = [\n[0.6, 0.3, 0.3]\n[0.65, 0.3, 0.3]\n]", &[(3, "targets")]),
        ],
    );
}

#[test]
fn mistakes_in_drivers_are_named_with_line_and_key() {
    check_errors(
        "driver = \"a4988\"",
        &[
            ("[motors.driver]\nname = \"dm542\"", &[(2, "motors.driver.name")]),
            ("driver = 3", &[(1, "motors.driver")]),
            ("driver = {}", &[(1, "motors.driver")]),
            ("driver = \"coils\"", &[(1, "motors.driver")]),
            ("driver = { coils = {} }", &[(1, "motors.driver.coils.duty")]),
            ("driver = { coils = { duty = [] } }", &[(1, "motors.driver.coils.duty")]),
            ("driver.coils.duty = []", &[(1, "motors.driver.coils.duty")]),
            ("driver = coils", &[(1, "motors.driver")]),
            (
                "driver = { tmc2209-uart = { run_current = 0.6A } }",
                &[(1, "motors.driver.tmc2209-uart.run_current")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = 0.6 A } }",
                &[(1, "motors.driver.tmc2209-uart.run_current")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = \"0.6 A\" } }",
                &[(1, "motors.driver.tmc2209-uart.run_current")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = 0,6 A } }",
                &[(1, "motors.driver.tmc2209-uart.6")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = 600 mA } }",
                &[(1, "motors.driver.tmc2209-uart.run_current")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = 6 V } }",
                &[(1, "motors.driver.tmc2209-uart.run_current")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = 0.8, sense_resistor = R150 } }",
                &[(1, "motors.driver.tmc2209-uart.sense_resistor")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = 0.8, sense_resistor = \"R110\" } }",
                &[(1, "motors.driver.tmc2209-uart.sense_resistor")],
            ),
            (
                "driver = { tmc2209-uart = { run_current = 0.8, sense_resistor = Rabc } }",
                &[(1, "motors.driver.tmc2209-uart.sense_resistor")],
            ),
        ],
    );
}

#[test]
fn mistakes_in_rates_are_named_with_line_and_key() {
    check_errors(
        "max_rate = 400.0",
        &[
            ("max_rate = fast", &[(1, "motors.max_rate")]),
            ("", &[(0, "motors.max_rate")]),
            ("max_rate = \"110 steps/s\"", &[(1, "motors.max_rate")]),
            ("max_rate = 110,0", &[(1, "motors.max_rate")]),
            ("max_rate = 1,100", &[(1, "motors.max_rate")]),
            ("max_rate = 400.0\nmotors.max_rate = 5", &[(2, "motors.motors")]),
        ],
    );
}

#[test]
fn mistakes_in_microsteps_are_named_with_line_and_key() {
    check_errors("microsteps = 16", &[("microsteps = 16.0", &[(1, "motors.microsteps")])]);
}

#[test]
fn mistakes_in_travels_are_named_with_line_and_key() {
    check_errors(
        "[-1000, 1500]",
        &[
            ("[1500, -1000]", &[(1, "motors.travel")]),
            ("[10, 1500]", &[(1, "motors.travel")]),
            ("[–1000, 1500]", &[(1, "motors.travel")]),
            ("[-1000, 1500 steps]", &[(1, "motors.travel")]),
        ],
    );
}

#[test]
fn mistakes_in_tables_are_named_with_line_and_key() {
    check_errors(
        "[growth]",
        &[
            ("[grow]", &[(1, "grow")]),
            ("[sign]\ngain = 1\n[growth]", &[(1, "sign")]),
            ("[zzz]\ngain = 1\n[growth]", &[(1, "zzz")]),
        ],
    );
}

#[test]
fn mistakes_in_pins_and_truth_values_are_named_with_line_and_key() {
    check_errors(
        "[board]",
        &[
            ("[board]\npins.step = [GP10, GP11, GP12]", &[(2, "board.pins.step")]),
            ("[board]\npins.step = ['GP10', 'GP11', 'GP12']", &[(2, "board.pins.step")]),
            ("[board]\npins.emergency = GP15", &[(2, "board.pins.emergency")]),
            ("[board]\npins.emergency = \"GP15\"", &[(2, "board.pins.emergency")]),
            ("[board]\ninverted.step = [1, 0, 0]", &[(2, "board.inverted.step")]),
            (
                "[board]\ninverted.step = [\"true\", \"false\", \"false\"]",
                &[(2, "board.inverted.step")],
            ),
            ("[board]\ninverted.step = [True; False; False]", &[(2, "board.inverted.step")]),
            ("[board]\ninverted.step = [yes, no, no]", &[(2, "board.inverted.step")]),
            ("[board]\nboard.pins.step = [10, 11, 12]", &[(2, "board.board")]),
        ],
    );
}

#[test]
fn mistakes_in_lengths_are_named_with_line_and_key() {
    check_errors(
        "margin = 0.04",
        &[
            ("margin = 0,4 cm", &[(1, "growth.margin")]),
            ("margin = 0.5 cm", &[(1, "growth.margin")]),
            ("margin = 2,5cm", &[(1, "growth.margin")]),
            ("margin = \"0.5 cm\"", &[(1, "growth.margin")]),
            ("margin = \"0,7 cm\"", &[(1, "growth.margin")]),
            ("margin = 40 mm", &[(1, "growth.margin")]),
            ("margin = 0,04 m", &[(1, "growth.margin")]),
            ("margin = 0,04 foo", &[(1, "growth.margin")]),
            ("margin = 1,100 mm", &[(1, "growth.margin")]),
        ],
    );
}

#[test]
fn mistakes_in_times_are_named_with_line_and_key() {
    check_errors(
        "host = 0.3",
        &[
            ("host = 300 ms", &[(1, "deadlines.host")]),
            ("host = 300000 µs", &[(1, "deadlines.host")]),
            ("host = 0,3 s", &[(1, "deadlines.host")]),
        ],
    );
}

#[test]
fn a_workspace_with_a_mistake_is_compared_with_nothing() {
    let workspace = "[workspace]                # within the triangle's sides, above the floor, \
                     below the motors\nmin = [0.10, 0.10, 0.05]\nmax = [0.80, 0.50, 0.60]\n";
    for (old, new, key) in [
        ("min = [0.10, 0.10, 0.05]", "min = [100, 100, 50]", "workspace.min"),
        (workspace, "", "workspace"),
    ] {
        assert_eq!(keys(&findings(&[(old, new)])), [vec![key], vec![]], "{new}");
    }
}

#[test]
fn the_cable_of_a_turn_for_that_of_a_step_is_one_warning() {
    for (cable, says) in [
        ("0.0942", "with 200 it is 0.000471"),
        ("0.0008", "is not that of the simulated drums: by `simulation.pulley_radii` a step winds"),
    ] {
        let motors = "motors = [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]]";
        let size = format!("[size]\n{motors}\ncable_per_step = {cable}\n\n[camera]");
        let found = findings(&[("[camera]", &size)]);
        assert_eq!(keys(&found)[1], ["workspace.min", "size.cable_per_step"], "{found:#?}");
        assert!(found.iter().any(|it| it.problem.contains(says)), "{found:#?}");
    }
}

#[test]
fn a_default_pin_that_another_key_takes_is_named_with_that_key() {
    for (line, says) in [
        (
            "pins.direction = [6, 7, 8]",
            "`board.pins.step`, `board.pins.direction = [6, 7, 8]` puts STEP of motor C at GP6, \
             where DIR of motor A is too; this is the default of `board.pins.step`",
        ),
        ("pins.direction = [14, 7, 8]", "`board.pins.direction = [14, 7, 8]` puts "),
    ] {
        let found = findings(&[("[board]", &format!("[board]\n{line}"))]);
        let error = found.iter().find(|it| it.explanation().contains(says)).unwrap();
        assert!(error.line.is_some(), "{error}");
    }
}

#[test]
fn a_radius_larger_than_the_workspace_is_named() {
    let found = findings(&[("radius = 0.010", "radius = 0.5")]);
    let of_radius = found.iter().find(|it| it.values[0].0 == "reached.radius").unwrap();
    let says = "is larger than the room for the ball: no place is more than 200 mm from the border";
    assert!(of_radius.problem.starts_with(says), "{of_radius}");
    assert!(found.iter().all(|it| it.values[0].0 != "targets"), "{found:#?}");
}
