//! Hours of virtual time on one emulated board: session after session with random targets and
//! commands, over links and with cameras that fail now and then. The board, its rig and their
//! clock live on from the first session to the last, so that counters wrap and leaks show.

mod disturbance;
mod operator;
mod session;

use std::collections::BTreeMap;

use plumb_runtime::rig::Rig;
use plumb_sim::simulated::VirtualBoard;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use session::{Session, SessionResult};

pub use disturbance::Disturbance;

/// Report of a soak.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SoakReport {
    /// Time on the board's clock, hours.
    pub hours: f64,
    /// Number of sessions.
    pub sessions: usize,
    /// Number of targets that the board drove to until it reached them.
    pub reached: usize,
    /// Number of targets.
    pub targets: usize,
    /// Number of pictures.
    pub frames: u64,
    /// Number of sessions for each disturbance and cause of the end.
    pub causes: BTreeMap<(&'static str, String), usize>,
    /// What should not have happened, with the number of the session.
    pub violations: Vec<String>,
}

/// One emulated board that is driven session after session.
pub struct Soak {
    board: VirtualBoard,
    rig: Rig,
    random: ChaCha8Rng,
    report: SoakReport,
}

impl Soak {
    /// Creates the paper's rig on a board that has just started. `seed` determines everything that
    /// follows.
    ///
    /// # Panics
    /// If the paper's rig cannot be built.
    pub fn new(seed: u64) -> Self {
        let board = VirtualBoard::paper().expect("the paper's rig");
        let rig = Rig::paper().expect("the paper's rig file");
        let random = ChaCha8Rng::seed_from_u64(seed);
        Self { board, rig, random, report: SoakReport::default() }
    }

    /// Drives sessions until the board's clock shows at least `hours`.
    pub fn run_until(&mut self, hours: f64) -> &SoakReport {
        while self.report.hours < hours {
            let session = Session::draw(&mut self.random, self.board.board().borrow().now());
            let result = session.run(&self.board, &self.rig);
            self.note(&session, result);
        }
        &self.report
    }

    fn note(&mut self, session: &Session, result: SessionResult) {
        let report = &mut self.report;
        let number = report.sessions;
        report.hours = self.board.board().borrow().now().0 as f64 / 3.6e9;
        report.sessions += 1;
        report.reached += result.reached;
        report.targets += result.targets;
        report.frames += result.frames;
        let key = (session.disturbance().name(), result.cause);
        *report.causes.entry(key).or_default() += 1;
        let numbered = result.violations.iter().map(|it| format!("session {number}: {it}"));
        report.violations.extend(numbered);
    }
}
