//! The links and what a run over each must come to.

use std::time::Duration;

use plumb_emulator::Wire;
use plumb_emulator::wire::{Lane, Line, Reboot, Silence};
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;

/// What a run over a link must come to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Every target is reached.
    Reached,
    /// The run ends early and its cause contains one of these words.
    Cause(&'static [&'static str]),
    /// Every target is reached, or the run ends early with one of these words.
    Either(&'static [&'static str]),
}

/// A link to try.
#[derive(Debug, Clone, Copy)]
pub struct LinkCase {
    /// Its name in tables.
    pub name: &'static str,
    /// Its settings for a seed.
    pub wire: fn(u64) -> Wire,
    /// What a run over it must come to.
    pub expected: Expected,
}

/// Words for a link that is interrupted.
const INTERRUPTED: &[&str] =
    &["nothing came from the host", "no answer", "nothing has come from the board"];
/// Words for a link that may lose enough frames in a row for a deadline of the board to pass.
const UNHEARD: &[&str] = &["nothing came from the host", "no fresh position"];
/// Words for a link that is too bad for requests, too.
const TOO_BAD: &[&str] =
    &["nothing came from the host", "no fresh position", "no answer", "nothing has come"];
/// Words for a board that has restarted.
const RESTARTED: &[&str] = &["restart"];

/// Every link.
pub fn links() -> Vec<LinkCase> {
    use Expected::{Cause, Either, Reached};
    let case = |name, wire, expected| LinkCase { name, wire, expected };
    vec![
        case("ideal", |seed| wire(Line::Instant, seed), Reached),
        case("115200 baud", |seed| wire(Line::Baud(115_200), seed), Reached),
        case("921600 baud", |seed| wire(Line::Baud(921_600), seed), Reached),
        case("0.3 ms", |seed| wire(frame(300), seed), Reached),
        case("0.5 ms", |seed| wire(frame(500), seed), Reached),
        case("1 ms", |seed| wire(frame(1000), seed), Reached),
        case("2 ms", |seed| wire(frame(2000), seed), Reached),
        case("1 % lost", |seed| both(Lane { lost: 0.01, ..usb() }, seed), Reached),
        case("10 % lost", |seed| both(Lane { lost: 0.1, ..usb() }, seed), Reached),
        case("25 % lost", |seed| both(Lane { lost: 0.25, ..usb() }, seed), Either(UNHEARD)),
        case("50 % lost", |seed| both(Lane { lost: 0.5, ..usb() }, seed), Either(TOO_BAD)),
        case("latency 20 ms", |seed| both(Lane { latency: ms(20), ..usb() }, seed), Reached),
        case("5 % damaged", |seed| both(Lane { damaged: 0.05, ..usb() }, seed), Reached),
        case("10 % doubled", |seed| both(Lane { doubled: 0.1, ..usb() }, seed), Reached),
        case("poor radio", poor_radio, Reached),
        case("silence 0.5 s", |seed| silent(500, seed), Cause(INTERRUPTED)),
        case("silence 5 s", |seed| silent(5000, seed), Cause(INTERRUPTED)),
        case("dead", |seed| both(Lane { lost: 1.0, ..usb() }, seed), Cause(INTERRUPTED)),
        case("reboot watchdog", |seed| rebooted(StartCause::Watchdog, seed), Cause(RESTARTED)),
        case("reboot power", |seed| rebooted(StartCause::PowerOn, seed), Cause(RESTARTED)),
        case("reboot panic", |seed| rebooted(StartCause::Panic, seed), Cause(RESTARTED)),
        case(
            "reboot in silence",
            rebooted_in_silence,
            Cause(&["restart", "nothing has come", "nothing came", "no answer"]),
        ),
        case("reboot in greeting", rebooted_in_greeting, Either(RESTARTED)),
    ]
}

/// The link of this name in the table.
///
/// # Panics
/// Where there is none.
pub fn link(name: &str) -> LinkCase {
    links().into_iter().find(|link| link.name == name).expect("a link of that name")
}

/// The links over which every target is reached: slow and lossy ones, but not too lossy.
pub fn usable_links() -> Vec<LinkCase> {
    links().into_iter().filter(|link| link.expected == Expected::Reached).collect()
}

impl Expected {
    /// Whether a run may end with this cause.
    pub fn allows(self, cause: &str) -> bool {
        match self {
            Self::Reached => false,
            Self::Cause(words) | Self::Either(words) => {
                words.iter().any(|word| cause.contains(word))
            }
        }
    }
}

impl LinkCase {
    /// Whether the link falls silent for a while: what comes of that depends on the board's
    /// deadlines.
    pub fn falls_silent(&self) -> bool {
        !(self.wire)(0).silences.is_empty()
    }

    /// When the link is first disturbed on the board's clock, where that is one moment.
    pub fn disturbed_at(&self, seed: u64) -> Option<Micros> {
        let Wire { to_board, silences, reboots, .. } = (self.wire)(seed);
        // A dead link is disturbed from the moment at which the host opens its port.
        let dead = (to_board.lost >= 1.0).then(|| super::run::begin(seed));
        dead.into_iter()
            .chain(silences.iter().map(|silence| silence.from))
            .chain(reboots.iter().map(|reboot| reboot.at))
            .min()
    }
}

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn frame(us: u64) -> Line {
    Line::Frame(Duration::from_micros(us))
}

/// A full-speed USB link: a frame a millisecond.
fn usb() -> Lane {
    Lane::on(frame(1000))
}

fn both(lane: Lane, seed: u64) -> Wire {
    Wire::symmetric(lane, seed)
}

fn wire(line: Line, seed: u64) -> Wire {
    both(Lane::on(line), seed)
}

/// Everything at once: a slow line that delays, loses, damages and doubles.
fn poor_radio(seed: u64) -> Wire {
    let faults =
        Lane { latency: ms(10), lost: 0.03, damaged: 0.03, doubled: 0.03, ..Lane::default() };
    both(Lane { line: Line::Baud(115_200), ..faults }, seed)
}

/// A moment in mid-run, another one for each seed: 1.5 s to 2.5 s, in steps of 52.6 ms.
fn mid_run(seed: u64) -> u64 {
    1_500_000 + seed % 20 * 52_600
}

fn silent(ms: u64, seed: u64) -> Wire {
    let from = mid_run(seed);
    let silences = vec![Silence { from: Micros(from), to: Micros(from + ms * 1000) }];
    Wire { silences, ..both(usb(), seed) }
}

fn rebooted(cause: StartCause, seed: u64) -> Wire {
    let reboots = vec![Reboot { at: Micros(mid_run(seed)), cause }];
    Wire { reboots, ..both(usb(), seed) }
}

/// A restart that takes the board from the link for 300 ms, as a start over USB does.
fn rebooted_in_silence(seed: u64) -> Wire {
    Wire { silences: silent(300, seed).silences, ..rebooted(StartCause::PowerOn, seed) }
}

/// A restart 1 ms to 20 ms after the host begins to greet: between any two requests.
fn rebooted_in_greeting(seed: u64) -> Wire {
    let at = Micros(super::run::begin(seed).0 + 1000 * (1 + seed % 20));
    let reboots = vec![Reboot { at, cause: StartCause::PowerOn }];
    Wire { reboots, ..both(usb(), seed) }
}
