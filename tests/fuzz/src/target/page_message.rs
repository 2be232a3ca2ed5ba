//! Messages of browsers.

use plumb_page::RigView;
use plumb_page::fuzzing::Parsers;
use plumb_runtime::rig::Rig;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "page_message",
    input: "messages of a page, one in each line",
    run,
    max_length: 2000,
    smoke: 500,
    words: &[
        "{\"type\":\"target\",\"x\":",
        "{\"type\":\"jog\",\"motor\":\"A\",\"steps\":",
        "\"rate\":",
        "{\"type\":\"stop\"}",
        "{\"type\":\"resume\",\"stop\":",
        "{\"type\":\"hold\"}",
        "{\"type\":\"click\",\"u\":",
        "\"v\":",
        "{\"type\":\"pick\",\"u\":",
        "{\"type\":\"project\",\"x\":",
        "\"depth\":true}",
        "{\"type\":\"taken\"}",
        "{\"type\":\"seen\",\"update\":",
        "{\"type\":\"end\"}",
        "1e308",
        "-1e400",
        "null",
        "\n",
    ],
};

/// Handles the messages, as those of a run and as those of a calibration.
pub fn run(input: &[u8]) {
    let parsers = Rig::paper().ok().and_then(|rig| Parsers::new(RigView::of(&rig)));
    let Some(parsers) = parsers else { return };
    for line in String::from_utf8_lossy(input).lines() {
        let _taken = parsers.message(line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_messages_in_the_corpus_are_taken() {
        let parsers = Parsers::new(RigView::of(&Rig::paper().unwrap())).unwrap();
        for line in include_str!("../../corpus/page_message/run").lines() {
            assert!(parsers.message(line).0, "{line}");
        }
        for line in include_str!("../../corpus/page_message/calibration").lines() {
            assert!(parsers.message(line).1, "{line}");
        }
    }
}
