//! One run: the adversary's actions on a chip, and the events for the invariants.

use plumb_core::Tick;
use plumb_core::config_store::Stored;
use plumb_protocol::MOTORS;
use plumb_protocol::frame::FrameError;
use plumb_protocol::message::*;

use super::adversary::{Action, Adversary, View};
use super::chip::Chip;
use super::count::{TickCounts, count_delivery, count_replies};
use super::event::{Cut, Delivery, TICK, Ticked};
use super::invariants::Invariants;
use super::requests::{Requests, is_request};
use crate::campaign::Outcome;
use crate::frames::framed;
use crate::generate;
use crate::random::Random;

/// Ticks after the last action, in which pending responses may end.
const LAST_TICKS: u64 = 50;

/// Maximum number of ticks from a Bootloader to the restart.
const MAX_BOOTLOADER_TICKS: u64 = 2000;

/// One run.
pub(super) struct Session<'a> {
    random: Random,
    outcome: &'a mut Outcome,
    adversary: Adversary,
    chip: Chip,
    invariants: Invariants,
    requests: Requests,
    /// Whether the board waits for the end of a Store.
    storing: bool,
    /// Ticks until the restart into the bootloader.
    restart_in: Option<u64>,
    /// Start of the next tick, µs.
    now: u64,
    /// Whether the emergency input is open.
    emergency: bool,
    /// Id of the last command.
    id: u16,
    last_frame: Vec<u8>,
    /// Last frame with a request that must not be executed twice.
    last_request: Vec<u8>,
    counts: TickCounts,
}

/// Density of actions.
struct Pace {
    actions: u64,
    /// Maximum number of ticks after each.
    max_ticks: u64,
}

impl<'a> Session<'a> {
    pub(super) fn new(mut random: Random, outcome: &'a mut Outcome) -> Self {
        let adversary = Adversary::new(&mut random);
        let chip = Chip::new(&mut random);
        Self {
            adversary,
            invariants: Invariants::new(chip.board()),
            chip,
            requests: Requests::default(),
            storing: false,
            restart_in: None,
            now: 0,
            emergency: false,
            id: 0,
            last_frame: Vec::new(),
            last_request: Vec::new(),
            counts: TickCounts::default(),
            random,
            outcome,
        }
    }

    pub(super) fn run(mut self, ticks: u64) {
        if self.random.percent(20) {
            self.restart(StartCause::PowerOn);
        }
        self.open();
        while self.counts.ticks < ticks && !self.random.is_exhausted() {
            let pace = self.pace();
            for _ in 0..pace.actions {
                let view = self.view();
                let action = self.adversary.choose(&mut self.random, &view);
                self.execute(action);
                for _ in 0..self.random.below(pace.max_ticks + 1) {
                    self.tick();
                }
                if self.counts.ticks >= ticks || self.random.is_exhausted() {
                    break;
                }
            }
        }
        for _ in 0..LAST_TICKS {
            self.tick();
        }
        self.invariants.end(self.outcome);
        self.counts.add_to(&mut self.outcome.tally, self.chip.has_twin());
    }

    /// Starts the board with a configuration and a target, in most runs.
    fn open(&mut self) {
        if self.random.percent(5) {
            return;
        }
        self.send(Command::Hello(Hello::OURS));
        let view = self.view();
        let setup = self.adversary.setup(&mut self.random, &view);
        self.configure(setup, true);
        let target = generate::point_in(&mut self.random, &setup.config.workspace);
        let view = self.view();
        let position = self.adversary.position(&mut self.random, &view);
        self.send(position);
        self.send(Command::Target(target));
    }

    fn pace(&mut self) -> Pace {
        match self.random.below(20) {
            0 if self.random.one_in(6) => Pace { actions: 1, max_ticks: 26_000 },
            1 => Pace { actions: 200, max_ticks: 1 },
            2 => Pace { actions: 20, max_ticks: 5 },
            3 => Pace { actions: 1, max_ticks: 3_000 },
            _ => Pace { actions: 1 + self.random.below(40), max_ticks: 166 },
        }
    }

    fn view(&self) -> View {
        let board = self.chip.board();
        View {
            config: board.config().copied(),
            positions: board.travel_positions(),
            state: board.state(),
        }
    }

    fn execute(&mut self, action: Action) {
        match action {
            Action::Send(command) => self.send(command),
            Action::Configure(setup, is_wired) => self.configure(setup, is_wired),
            Action::Repeat => {
                self.outcome.tally.count("repeated frames");
                let request = self.random.percent(50);
                let frame = if request { &self.last_request } else { &self.last_frame };
                let (frame, at) = (frame.clone(), self.arrival());
                self.receive(&frame, at);
            }
            Action::Bytes(bytes) => {
                let at = self.arrival();
                self.receive(&bytes, at);
            }
            Action::Emergency(ticks) => self.open_emergency(ticks),
            Action::Restart(cause) => self.restart(cause),
        }
    }

    /// Returns a time of arrival: a tick early, at the start of the tick, or in its last µs.
    fn arrival(&mut self) -> u64 {
        match self.random.below(10) {
            0 => self.now.saturating_sub(TICK),
            1 => self.now + TICK - 1,
            _ => self.now,
        }
    }

    /// Configures the board, with the wiring where that is wanted.
    fn configure(&mut self, setup: Stored, is_wired: bool) {
        if is_wired {
            self.send(Command::Wire(setup.wiring));
        }
        self.send(Command::Configure(setup.config));
        if self.random.percent(30) {
            let prior = generate::prior(&mut self.random, &setup.config);
            self.send(Command::Prior(prior));
        }
    }

    fn send(&mut self, command: Command) {
        let at = self.arrival();
        self.send_at(command, at);
    }

    /// Sends a command as a new request, after a zero that ends the previous frame.
    fn send_at(&mut self, command: Command, at: u64) {
        self.adversary.sent(&command);
        self.id = if self.id == u16::MAX { 1 } else { self.id + 1 };
        self.last_frame = framed(&ToBoard { id: self.id, command });
        if is_request(&command) {
            self.last_request.clone_from(&self.last_frame);
        }
        let mut bytes = vec![0];
        bytes.extend_from_slice(&self.last_frame);
        self.receive(&bytes, at);
    }

    /// Sends bytes to the board, frame by frame.
    fn receive(&mut self, bytes: &[u8], at: u64) {
        for piece in bytes.split_inclusive(|byte| *byte == 0) {
            let message = self.chip.decode(piece);
            self.receive_piece(piece, at, message);
        }
    }

    /// Sends bytes that end at most one frame, which has the content `message`.
    fn receive_piece(
        &mut self,
        bytes: &[u8],
        at: u64,
        message: Option<Result<Vec<u8>, FrameError>>,
    ) {
        let before = self.chip.snapshot();
        self.chip.receive(bytes, at, &mut self.random, self.outcome);
        let Some(message) = message else { return };
        let message =
            message.and_then(|bytes| Request::read(&bytes)).map(|request| request.message);
        let repeated = message.is_ok_and(|message| self.requests.is_repetition(&message));
        let (replies, after) = (self.chip.replies(), self.chip.snapshot());
        let delivery = Delivery { at, message, repeated, replies, before, after };
        count_delivery(&delivery, self.outcome);
        let (configured, accepted) = (delivery.configured(), delivery.accepted());
        let config = self.chip.board().config();
        self.invariants.delivered(&delivery, config, self.outcome);
        if configured {
            self.chip.on_configured();
        }
        if let Some(accepted) = accepted {
            self.requests.record(accepted);
        }
    }

    fn tick(&mut self) {
        self.outcome.tick = self.counts.ticks;
        let before = self.chip.snapshot();
        let requests = self.chip.tick(self.now, &mut self.random, self.outcome);
        let (after, plan) = (self.chip.snapshot(), *self.chip.board().pulses());
        let (now, emergency, replies) = (self.now, self.emergency, self.chip.replies());
        let ticked = Ticked { now, before, after, plan, requests, replies, emergency };
        count_replies(replies, self.outcome);
        self.invariants.ticked(&ticked, self.outcome);
        let config = self.chip.board().config();
        let is_planar = config.is_some_and(|config| config.motors.len() < MOTORS);
        self.counts.record(&ticked, is_planar);
        self.adversary.motors_moved([0, 1, 2].map(|i| after.positions[i] - before.positions[i]));
        self.serve(requests);
        self.now += TICK;
    }

    /// Executes the board's requests to its chip: writes the configuration, restarts.
    fn serve(&mut self, requests: Option<Tick>) {
        let requests = requests.unwrap_or_default();
        if requests.diagnose {
            self.chip.on_diagnosed(self.outcome);
            self.invariants.diagnosed(self.chip.replies(), self.outcome);
        }
        if requests.measure {
            self.chip.on_measured(self.now, self.outcome);
            self.invariants.measured(self.chip.replies(), self.outcome);
        }
        self.storing |= requests.flash.is_some();
        if self.storing && self.random.percent(20) {
            self.storing = false;
            self.write();
        }
        if requests.bootloader && self.restart_in.is_none() {
            self.outcome.tally.count("restarts into the bootloader");
            // Messages arrive until then.
            self.restart_in = Some(self.random.below(MAX_BOOTLOADER_TICKS));
        }
        match self.restart_in {
            Some(0) => self.restart(StartCause::Requested),
            Some(left) => self.restart_in = Some(left - 1),
            None => {}
        }
    }

    /// Ends a Store, with success or without.
    fn write(&mut self) {
        let written = self.random.percent(60);
        self.chip.on_stored(self.now, written, self.outcome);
        if !written {
            self.requests.forget_write();
        }
        count_replies(self.chip.replies(), self.outcome);
        self.outcome.tally.count(if written { "stored" } else { "store failed" });
        self.invariants.stored(self.chip.replies(), self.outcome);
    }

    /// Opens the emergency input for some ticks, with messages before and after each.
    fn open_emergency(&mut self, ticks: u64) {
        self.outcome.tally.count("emergencies");
        for tick in 0..ticks {
            // Some pulses of the last tick were not executed.
            let missing = if tick == 0 { self.missing() } else { [0; 3] };
            self.cut(missing);
            if self.random.percent(40) {
                let at = self.arrival();
                self.send_at(Command::ClearFault, at);
            }
            let now = self.now;
            self.tick();
            if self.random.percent(20) {
                // Within the tick that has just been planned.
                let at = now + self.random.below(TICK);
                self.send_at(Command::ClearFault, at);
            }
        }
        self.emergency = false;
        self.invariants.closed();
    }

    fn cut(&mut self, missing: [i32; 3]) {
        self.emergency = true;
        let before = self.chip.snapshot();
        self.chip.on_emergency(self.now, missing, self.outcome);
        let (after, replies) = (self.chip.snapshot(), self.chip.replies());
        count_replies(replies, self.outcome);
        self.invariants.cut(&Cut { missing, before, after, replies }, self.outcome);
    }

    /// Returns a random number of pulses of the last plan, + if the direction line is high.
    fn missing(&mut self) -> [i32; 3] {
        self.chip.board().pulses().motors.map(|motor| {
            let count = self.random.range(0, motor.count.into()) as i32;
            if motor.direction { count } else { -count }
        })
    }

    /// Restarts the chip, with a stored configuration or without.
    fn restart(&mut self, cause: StartCause) {
        self.outcome.tally.count("restarts");
        self.adversary.restarted();
        let stored = self.stored_config();
        self.chip.restart(cause, stored.as_ref());
        self.invariants = Invariants::new(self.chip.board());
        self.requests = Requests::default();
        (self.storing, self.restart_in) = (false, None);
        (self.now, self.emergency) = (0, false);
    }

    fn stored_config(&mut self) -> Option<Stored> {
        match self.random.below(3) {
            0 => Some(generate::accepted(&mut self.random, [0; 3])),
            1 => Some(generate::invalid(&mut self.random, [0; 3])),
            _ => None,
        }
    }
}
