//! The table of links, with the expected result of a run over each.

use std::time::Duration;

use plumb_emulator::Wire;
use plumb_emulator::wire::{Lane, Line, Reboot, Silence};
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;
use plumb_sim::simulated::VirtualBoard;

/// Expected result of a run over a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Every target is reached.
    Reached,
    /// The run ends early, with a cause that contains one of these phrases.
    Cause(&'static [&'static str]),
    /// One of the two above.
    Either(&'static [&'static str]),
}

/// A link under test.
#[derive(Debug, Clone, Copy)]
pub struct LinkCase {
    /// Name in tables.
    pub name: &'static str,
    /// Returns the wire for a seed.
    pub wire: fn(u64) -> Wire,
    /// Expected result of a run.
    pub expected: Expected,
}

/// Causes over an interrupted link.
const INTERRUPTED: &[&str] =
    &["nothing came from the host", "no answer", "nothing has come from the board"];
/// Causes over a link that may lose enough consecutive frames to miss a deadline of the board.
const DEADLINE_MISSED: &[&str] = &["nothing came from the host", "no fresh position"];
/// Causes over a link that may also lose every repetition of a request.
const REQUEST_LOST: &[&str] =
    &["nothing came from the host", "no fresh position", "no answer", "nothing has come"];
/// Causes after a restart of the board.
const RESTARTED: &[&str] = &["restart"];

const fn case(name: &'static str, wire: fn(u64) -> Wire, expected: Expected) -> LinkCase {
    LinkCase { name, wire, expected }
}

/// Returns the board's clock when the host opens its port. The phase of tick and frame depends on
/// the seed.
fn start_time(seed: u64) -> Micros {
    Micros(10_000 + seed % 20 * 1_700)
}

/// Returns every link of the campaigns.
pub fn links() -> Vec<LinkCase> {
    use Expected::{Cause, Either, Reached};
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
        case("25 % lost", |seed| both(Lane { lost: 0.25, ..usb() }, seed), Either(DEADLINE_MISSED)),
        case("50 % lost", |seed| both(Lane { lost: 0.5, ..usb() }, seed), Either(REQUEST_LOST)),
        case("latency 20 ms", |seed| both(Lane { latency: ms(20), ..usb() }, seed), Reached),
        case("5 % damaged", |seed| both(Lane { damaged: 0.05, ..usb() }, seed), Reached),
        case("10 % doubled", |seed| both(Lane { doubled: 0.1, ..usb() }, seed), Reached),
        case("poor radio", poor_radio, Reached),
        case("silence 0.5 s", |seed| silent(500, seed), Cause(INTERRUPTED)),
        case("silence 5 s", |seed| silent(5000, seed), Cause(INTERRUPTED)),
        case("dead", |seed| both(Lane { lost: 1.0, ..usb() }, seed), Cause(INTERRUPTED)),
        case("reboot watchdog", |seed| rebooted(StartCause::Watchdog, seed), Cause(RESTARTED)),
        case("reboot power", |seed| rebooted(StartCause::PowerOn, seed), Cause(RESTARTED)),
        case("reboot panic", |seed| rebooted(StartCause::Panic(1), seed), Cause(RESTARTED)),
        case(
            "reboot in silence",
            rebooted_in_silence,
            Cause(&["restart", "nothing has come", "nothing came", "no answer"]),
        ),
        case("reboot in greeting", rebooted_in_greeting, Either(RESTARTED)),
    ]
}

/// Returns links that are too slow for the bounds of the campaigns: the laws swing more there.
fn slow_links() -> [LinkCase; 2] {
    let growing = Expected::Either(&["error keeps growing"]);
    [
        case("latency 150 ms", |seed| both(Lane { latency: ms(150), ..usb() }, seed), growing),
        case("latency 200 ms", |seed| both(Lane { latency: ms(200), ..usb() }, seed), growing),
    ]
}

/// Returns the link with this name.
///
/// # Panics
/// If there is none.
pub fn link(name: &str) -> LinkCase {
    let mut all = links().into_iter().chain(slow_links());
    all.find(|link| link.name == name).expect("a link of that name")
}

/// Returns the links over which every target is reached.
pub fn usable_links() -> Vec<LinkCase> {
    links().into_iter().filter(|link| link.expected == Expected::Reached).collect()
}

impl Expected {
    /// Returns whether a run may end with this cause.
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
    /// Returns an emulated board of the paper's rig behind this link, at the time at which the host
    /// opens its port.
    ///
    /// # Panics
    /// If the rig cannot be built; the paper's can.
    pub fn paper_board(&self, seed: u64) -> VirtualBoard {
        let board = VirtualBoard::paper().expect("the paper's rig").with_wire((self.wire)(seed));
        board.board().borrow_mut().run_to(start_time(seed)).expect("a rig at rest");
        board
    }

    /// Returns whether the link is silent for a while. The result of that depends on the board's
    /// deadlines.
    pub fn falls_silent(&self) -> bool {
        !(self.wire)(0).silences.is_empty()
    }

    /// Returns the time of the first disturbance on the board's clock, if the link has one.
    pub fn disturbed_at(&self, seed: u64) -> Option<Micros> {
        let Wire { to_board, silences, reboots, .. } = (self.wire)(seed);
        // The disturbance of a dead link starts when the host opens its port.
        let dead = (to_board.lost >= 1.0).then(|| start_time(seed));
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

/// Returns a full-speed USB lane: one frame per millisecond.
fn usb() -> Lane {
    Lane::on(frame(1000))
}

fn both(lane: Lane, seed: u64) -> Wire {
    Wire::symmetric(lane, seed)
}

fn wire(line: Line, seed: u64) -> Wire {
    both(Lane::on(line), seed)
}

/// Returns a slow wire with delay, loss, damage and duplicates.
fn poor_radio(seed: u64) -> Wire {
    let faults =
        Lane { latency: ms(10), lost: 0.03, damaged: 0.03, doubled: 0.03, ..Lane::default() };
    both(Lane { line: Line::Baud(115_200), ..faults }, seed)
}

/// Returns a time during the run, µs, which depends on the seed: 1.5 s to 2.5 s in steps of 52.6
/// ms.
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

/// Returns a wire with a restart and 300 ms of silence, as at a start over USB.
fn rebooted_in_silence(seed: u64) -> Wire {
    Wire { silences: silent(300, seed).silences, ..rebooted(StartCause::PowerOn, seed) }
}

/// Returns a wire with a restart 1 ms to 20 ms after the host's first Hello: between two requests.
fn rebooted_in_greeting(seed: u64) -> Wire {
    let at = Micros(start_time(seed).0 + 1000 * (1 + seed % 20));
    let reboots = vec![Reboot { at, cause: StartCause::PowerOn }];
    Wire { reboots, ..both(usb(), seed) }
}
