//! What is told to write in place of a mistake.

use super::*;

/// Returns what follows "error: " of the only error about the paper's file with this replacement.
fn error(old: &str, new: &str) -> String {
    let found = findings(&[(old, new)]);
    let errors: Vec<_> = found.iter().filter(|it| it.severity == Severity::Error).collect();
    let [error] = &errors[..] else { panic!("{new}: {found:#?}") };
    error.explanation()
}

#[test]
fn a_law_or_driver_that_is_no_table_is_answered_with_its_line() {
    let only = "only one such table may be there, and without one the law is `taut`";
    let named = "write the line [law.taut] with its keys below it; ";
    for (lines, says, end) in [
        ("[law]\nname = \"taut\"", "`law.name = \"taut\"` is no key of this file: in", named),
        ("[law.taut]\n[law.sign]\ngain = 1", "`law` has more than one table: keep one of", ""),
        ("[law]", "`law` is empty: remove it, or write the line [law.NAME] with its keys", ""),
    ] {
        let text = error("[workspace]", &format!("{lines}\n[workspace]"));
        assert!(text.starts_with(says) && text.ends_with(&format!("{end}{only}")), "{text}");
    }
    let text = error("targets = ", "law = \"taut\"\ntargets = ");
    let says = "must be a table: remove this line, and at the end of the file ";
    assert!(text.ends_with(&format!("{says}{named}{only}")), "{text}");
    let driver = "driver = \"a4988\"";
    let text = error(driver, "[motors.driver]\nname = \"dm542\"");
    assert!(text.contains("write the name alone, for example `driver = \"dm542\"` bel"), "{text}");
    let text = error(driver, "driver = 3");
    assert!(
        text.contains("must be a name, for example `driver = \"a4988\"`, or a table"),
        "{text}"
    );
    let text = error(driver, "driver = {}");
    assert!(text.contains("write the line [motors.driver.NAME] with its keys below it"), "{text}");
}

#[test]
fn an_example_can_be_copied_to_where_its_key_belongs() {
    let driver = "driver = \"a4988\"";
    for (old, new, example) in [
        ("max_rate = 400.0", "max_rate = fast", "`max_rate = 400.0`"),
        ("max_rate = 400.0", "", "`max_rate = 400.0` below [motors]"),
        (driver, "driver = \"coils\"", "`driver.coils = { duty = 0.8 }`"),
        (driver, "driver = { coils = {} }", "`duty = 0.8` in the braces of `motors.driver.coils`"),
        (driver, "driver = { coils = { duty = [] } }", "`duty = 0.8`"),
        (driver, "driver.coils.duty = []", "`driver.coils.duty = 0.8`"),
        ("targets = [[0.400, 0.400, 0.150]]", "", "`targets = [[0.45, 0.3, 0.325]]` at the top"),
        (driver, "driver = coils", "`driver.coils = { duty = 0.8 }`"),
    ] {
        let text = error(old, new);
        assert!(
            text.contains(&format!("for example {example}"))
                || text.contains(&format!("for example, {example}")),
            "{new}: {text}"
        );
    }
}

#[test]
fn every_target_that_cannot_be_read_is_named_with_its_number() {
    let targets = "[[0.4, 0.4, 0.15], [400, 400, 150], [0.4, 0.4]]";
    let text = error("[[0.400, 0.400, 0.150]]", targets);
    let says = "has a wrong place: target 2, [400, 400, 150], must be -100 to 100 m; is it in \
                millimetres or centimetres?; target 3, [0.4, 0.4]: invalid length 2";
    assert!(text.contains(says), "{text}");
}

#[test]
fn a_number_in_the_wrong_form_is_answered_with_the_right_one() {
    for (old, new, says) in [
        (
            "max_rate = 400.0",
            "max_rate = \"110 steps/s\"",
            "must be a number alone, without quotes",
        ),
        ("microsteps = 16", "microsteps = 16.0", "without a point: write 16"),
        ("[-1000, 1500]", "[1500, -1000]", "the lower limit first: write [-1000, 1500]; allowed"),
        ("[-1000, 1500]", "[10, 1500]", "must contain 0, where the board starts; allowed"),
    ] {
        let text = error(old, new);
        assert!(text.contains(says), "{new}: {text}");
    }
}

#[test]
fn names_of_pins_and_bare_values_in_braces_are_answered_with_what_to_write() {
    let driver = "driver = \"a4988\"";
    let uart = |keys: &str| format!("driver = {{ tmc2209-uart = {{ {keys} }} }}");
    let several = "must have the numbers of the pins alone: write [10, 11, 12]";
    let one = "must have the number of the pin alone: write 15";
    for (line, says) in [
        ("pins.step = [GP10, GP11, GP12]", several),
        ("pins.step = ['GP10', 'GP11', 'GP12']", several),
        ("pins.emergency = GP15", one),
        ("pins.emergency = \"GP15\"", one),
    ] {
        let text = error("[board]", &format!("[board]\n{line}"));
        assert!(text.contains(says), "{line}: {text}");
    }
    let unit = "must be a number alone, without its unit: write";
    let converted = "must be a number in A, without a unit: write";
    let mark = "must be in ohms, and not the mark on a resistor: write";
    for (key, value, says) in [
        ("run_current", "0.6A", format!("{unit} 0.6")),
        ("run_current", "0.6 A", format!("{unit} 0.6")),
        ("run_current", "\"0.6 A\"", format!("{unit} 0.6")),
        ("run_current", "0,6 A", format!("{unit} 0.6")),
        ("run_current", "600 mA", format!("{converted} 0.6")),
        ("run_current", "6 V", "must be a number alone, without a unit or a fra".to_owned()),
        ("sense_resistor", "R150", format!("{mark} 0.15")),
        ("sense_resistor", "\"R110\"", format!("{mark} 0.11")),
        ("sense_resistor", "Rabc", "must be a number; allowed: 0.05 and more".to_owned()),
    ] {
        let current = if key == "run_current" { "" } else { "run_current = 0.8, " };
        let text = error(driver, &uart(&format!("{current}{key} = {value}")));
        let says = format!("`motors.driver.tmc2209-uart.{key} = {value}` {says}");
        assert!(text.starts_with(&says), "{text}");
    }
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
fn a_number_with_another_unit_is_converted() {
    let metres = "must be a number in m, without a unit: write";
    for (value, says) in [
        ("0,4 cm", format!("{metres} 0.004")),
        ("0.5 cm", format!("{metres} 0.005")),
        ("2,5cm", format!("{metres} 0.025")),
        ("\"0.5 cm\"", format!("{metres} 0.005")),
        ("\"0,7 cm\"", format!("{metres} 0.007")),
        ("40 mm", format!("{metres} 0.04")),
        ("0,04 m", "must be a number alone, without its unit: write 0.04".to_owned()),
        ("0,04 foo", "must be a number alone in m, with a decimal point".to_owned()),
        ("1,100 mm", "must be a number alone in m, with a decimal point".to_owned()),
    ] {
        let text = error("margin = 0.04", &format!("margin = {value}"));
        assert!(text.starts_with(&format!("`growth.margin = {value}` {says}")), "{text}");
    }
    for (unit, number) in [("300 ms", "0.3"), ("300000 µs", "0.3"), ("0,3 s", "0.3")] {
        let text = error("host = 0.3", &format!("host = {unit}"));
        assert!(text.contains(&format!(": write {number}. Other")), "{text}");
    }
}

#[test]
fn what_a_maker_writes_is_answered_in_one_step() {
    let points = "must have decimal points, and commas between";
    let booleans = "must be true or false: write [true, false, false]";
    for (old, new, says) in [
        (
            "[[0.400, 0.400, 0.150]]",
            "[[0,6; 0,3; 0,3], [0,65; 0,3; 0,3]]",
            format!("{points}: write [[0.6, 0.3, 0.3], [0.65, 0.3, 0.3]]"),
        ),
        (
            "[[0.400, 0.400, 0.150]]",
            "[\n[0,6; 0,3; 0,3];\n[0,65; 0,3; 0,3]\n]",
            format!("`targets` {points}: for [0,6; 0,3; 0,3] write [0.6, 0.3, 0.3]"),
        ),
        (
            "[[0.400, 0.400, 0.150]]",
            "[\n[0.6, 0.3, 0.3];\n[0.65, 0.3, 0.3]\n]",
            "for [0.6, 0.3, 0.3]; write [0.6, 0.3, 0.3],".to_owned(),
        ),
        (
            "[[0.400, 0.400, 0.150]]",
            "[\n[0,6, 0,03, 0,3],\n[0,65, 0,3, 0,3]\n]",
            "write points, [0.6, 0.03, 0.3]; allowed".to_owned(),
        ),
        (
            "[[0.400, 0.400, 0.150]]",
            "[\n[0.6, 0.3, 0.3]\n[0.65, 0.3, 0.3]\n]",
            "`targets` must have a comma between 0.3] and [0.65".to_owned(),
        ),
        (
            "travel = [-1000, 1500]",
            "travel = [–1000, 1500]",
            "must have a plain minus sign: write [-1000, 1500]".to_owned(),
        ),
        ("[board]", "[board]\ninverted.step = [1, 0, 0]", booleans.to_owned()),
        (
            "[board]",
            "[board]\ninverted.step = [\"true\", \"false\", \"false\"]",
            booleans.to_owned(),
        ),
        ("[board]", "[board]\ninverted.step = [True; False; False]", booleans.to_owned()),
        ("[board]", "[board]\ninverted.step = [yes, no, no]", booleans.to_owned()),
        (
            "[board]",
            "[board]\nboard.pins.step = [10, 11, 12]",
            "is no key of this file: write `pins.step` below [board]".to_owned(),
        ),
        (
            "max_rate = 400.0",
            "max_rate = 400.0\nmotors.max_rate = 5",
            "is no key of this file: write `max_rate` below [motors]".to_owned(),
        ),
        ("[workspace]", "workspace]", "a `[` is missing: write [workspace]".to_owned()),
        ("max_rate = 400.0", "max_rate = 1,100", "write 1.1 or 1100".to_owned()),
        ("[growth]", "[grow]", "is no table of this file; did you mean [growth]?".to_owned()),
        (
            "[growth]",
            "[sign]\ngain = 1\n[growth]",
            "is no table of this file; did you mean [law.sign]?".to_owned(),
        ),
        (
            "[growth]",
            "[zzz]\ngain = 1\n[growth]",
            "is no table of this file; its tables: board, law, motors, ".to_owned(),
        ),
    ] {
        let text = error(old, new);
        assert!(text.contains(&says), "{new}: {text}");
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
