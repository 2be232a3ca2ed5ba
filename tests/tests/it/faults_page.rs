//! The page of faults against the program: every fault, refusal and cause of a start has its row,
//! with the message that people see.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fmt::{Debug, Display};
use std::time::Duration;

use plumb_protocol::message::{DriverFault, Fault, Refusal, StartCause};
use plumb_runtime::board_fault::{FaultCause, after_fault};
use plumb_tests::source_tree::{read, root};
use serde::de::DeserializeOwned;

/// Characters after which a message names details: a number, a cause, an advice.
const DETAILS: [char; 4] = [':', '(', ';', '?'];

/// Returns the variant with this number on the wire, its fields filled with `field`.
fn variant<T: DeserializeOwned>(number: u8, field: u8) -> Option<T> {
    postcard::from_bytes(&[number, field, field]).ok()
}

/// Returns the beginning that both texts have.
fn common<'a>(one: &'a str, other: &str) -> &'a str {
    let same = one.char_indices().zip(other.chars()).take_while(|((_, a), b)| a == b);
    let end = same.last().map_or(0, |((at, c), _)| at + c.len_utf8());
    &one[..end]
}

/// Returns how the row of each variant begins: "| Name: message", without details.
fn rows<T: DeserializeOwned + Debug + Display>() -> Vec<String> {
    let pairs = (0..=u8::MAX)
        .map_while(|number| Some((variant::<T>(number, 0)?, variant::<T>(number, 1)?)));
    let row = |(one, other): (T, T)| {
        let (text, debug) = (one.to_string(), format!("{one:?}"));
        let name = debug.split(['(', ' ']).next().unwrap_or_default();
        let message = common(&text, &other.to_string()).split(DETAILS).next().unwrap_or_default();
        format!("| {name}: {}", message.trim_end())
    };
    pairs.map(row).collect()
}

/// Returns the lines of a section, by its heading.
fn section<'a>(page: &'a str, heading: &str) -> &'a str {
    let (_, rest) = page.split_once(&format!("\n## {heading}\n")).expect(heading);
    rest.split("\n## ").next().unwrap_or_default()
}

fn assert_rows(heading: &str, expected: &[String]) {
    let page = read(&root().join("docs/use/faults.md"));
    let section = section(&page, heading);
    let lines: Vec<&str> = section.lines().filter(|line| line.contains(": ")).collect();
    let missing: Vec<&String> = expected
        .iter()
        .filter(|row| !lines.iter().any(|line| line.starts_with(row.as_str())))
        .collect();
    assert!(missing.is_empty(), "docs/use/faults.md, {heading}: no row begins with {missing:#?}");
    let names = lines.iter().filter(|line| line.starts_with("| ")).count();
    assert_eq!(names, expected.len(), "docs/use/faults.md, {heading}: a row is of no variant");
}

#[test]
fn every_fault_has_its_row() {
    let rows = rows::<Fault>();
    assert!(rows.contains(&"| LawLate: the control law had no answer in time".to_owned()));
    assert_rows("Faults", &rows);
}

/// The last column begins with the advice that the messages and the page of a run give.
#[test]
fn every_row_of_a_fault_has_the_advice_of_the_program() {
    let page = read(&root().join("docs/use/faults.md"));
    let faults = section(&page, "Faults");
    for (fault, row) in
        (0..=u8::MAX).map_while(|number| variant::<Fault>(number, 0)).zip(rows::<Fault>())
    {
        let line = faults.lines().find(|line| line.starts_with(&row)).expect(&row);
        let advice = line.rsplit(" | ").next().unwrap_or_default();
        assert!(advice.starts_with(after_fault(fault)), "docs/use/faults.md: {line}");
    }
}

/// The last column begins with the advice of the program, as for the faults.
#[test]
fn every_fault_of_a_motor_driver_has_its_row_with_its_advice() {
    let rows = rows::<DriverFault>();
    assert!(rows.contains(&"| Hat: a Motor HAT does not answer".to_owned()), "{rows:?}");
    assert_rows("Motor drivers", &rows);
    let page = read(&root().join("docs/use/faults.md"));
    let drivers = section(&page, "Motor drivers");
    for (fault, row) in
        (0..=u8::MAX).map_while(|number| variant::<DriverFault>(number, 0)).zip(rows)
    {
        let line = drivers.lines().find(|line| line.starts_with(&row)).expect(&row);
        assert!(line.contains(&fault.to_string()), "docs/use/faults.md: {line}");
        let advice = line.rsplit(" | ").next().unwrap_or_default();
        assert!(advice.starts_with(after_fault(Fault::Driver(fault))), "{line}");
    }
}

/// Begins with the text of each cause that this program counts, and ends with its advice.
#[test]
fn every_cause_of_a_fault_has_its_row() {
    let page = read(&root().join("docs/use/faults.md"));
    let seconds = Duration::from_secs;
    let causes = [
        FaultCause::DamagedFrames { damaged: 4, sent: 14 },
        FaultCause::LateHost { times: 1, longest: seconds(1) },
        FaultCause::OldPositions { old: 13, oldest: seconds(1) },
    ];
    for cause in causes {
        let text: String = cause.to_string().chars().filter(|c| !c.is_ascii_digit()).collect();
        let row = page.lines().find(|line| {
            let begin = line.split(" | ").next().unwrap_or_default();
            let words: Vec<&str> = begin.trim_start_matches("| ").split("...").collect();
            line.starts_with("| ") && words.len() > 1 && words.iter().all(|it| text.contains(it))
        });
        let row = row.unwrap_or_else(|| panic!("docs/use/faults.md: no row of: {cause}"));
        assert!(row.contains(cause.advice()), "docs/use/faults.md: {row}");
    }
}

#[test]
fn every_refusal_has_its_row() {
    let rows = rows::<Refusal>();
    assert!(rows.contains(&"| Busy: not while the board is".to_owned()), "{rows:?}");
    assert_rows("Refusals", &rows);
}

#[test]
fn every_cause_of_a_start_has_its_row() {
    assert_rows("Restarts", &rows::<StartCause>());
}
