//! One board, its clock, and what is done to it.

use plumb_core::{Board, LawWorker, Outbox, StepPlan, Tick};
use plumb_protocol::Config;
use plumb_protocol::frame::{Accumulator, FrameError, read};
use plumb_protocol::message::*;
use plumb_protocol::units::Micros;

use super::adversary::{Adversary, Move, View};
use super::count::{count_delivery, count_replies};
use super::event::{Cut, Delivery, Snapshot, TICK, Ticked};
use super::invariants::{Invariants, REPORT, TWIN, UNBROKEN};
use super::thinking::Slowly;
use crate::campaign::Outcome;
use crate::frames::{Decoder, framed};
use crate::generate;
use crate::random::Random;

/// Ticks after the last move, in which what is under way may end.
const LAST_TICKS: u64 = 50;

/// A board and all that belongs to it; a restart begins it anew.
struct Chip {
    board: Board,
    out: Outbox,
    accumulator: Accumulator,
    /// What the board received, by the reference.
    decoder: Decoder,
    invariants: Invariants,
    /// The last command that was carried out and that a repetition of is told from a new one.
    executed: Option<ToBoard>,
    /// Whether the board waits for its configuration to be written.
    storing: bool,
    /// The board restarts into its bootloader in so many ticks.
    leaving: Option<u64>,
}

impl Chip {
    fn new(board: Board) -> Self {
        Self {
            invariants: Invariants::new(&board),
            board,
            out: Outbox::new(),
            accumulator: Accumulator::new(),
            decoder: Decoder::default(),
            executed: None,
            storing: false,
            leaving: None,
        }
    }

    /// Keeps the last request, to recognise its repetition. A Hello begins a new session.
    fn remember(&mut self, accepted: ToBoard) {
        if is_request(&accepted.command) {
            self.executed = Some(accepted);
        } else if matches!(accepted.command, Command::Hello(_)) {
            self.executed = None;
        }
    }

    /// Forgets a Store that has failed: it may be asked for again.
    fn forget_store(&mut self) {
        self.executed.take_if(|executed| executed.command == Command::Store);
    }
}

/// The same board again, that gets the same input in other pieces.
struct Twin {
    board: Board,
    out: Outbox,
    law_worker: LawWorker,
}

/// How the law thinks.
enum Thinking {
    /// At once, in [`Board::tick`].
    AtOnce(Box<LawWorker>),
    /// Late, between [`Board::plan`] and [`Board::report`] of later ticks.
    Slowly(Box<Slowly>),
}

/// One run.
pub(super) struct Session<'a> {
    random: Random,
    outcome: &'a mut Outcome,
    adversary: Adversary,
    thinking: Thinking,
    chip: Chip,
    twin: Option<Twin>,
    storage: bool,
    /// Start of the coming tick, µs.
    now: u64,
    /// Whether the emergency input is open.
    emergency: bool,
    id: u16,
    last_frame: Vec<u8>,
    /// The last frame with a command that must not be carried out twice.
    last_request: Vec<u8>,
    replies: Vec<FromBoard>,
    /// Ticks, of which in motion, seeking, holding, turning in `Ready`.
    ticks: u64,
    moving: u64,
    seeking: u64,
    holding: u64,
    jogging: u64,
}

/// How densely moves follow each other.
struct Pace {
    moves: u64,
    most_ticks: u64,
}

impl<'a> Session<'a> {
    pub(super) fn new(seed: u64, outcome: &'a mut Outcome) -> Self {
        let mut random = Random::new(seed);
        let adversary = Adversary::new(&mut random);
        let thinking = if random.percent(30) {
            Thinking::Slowly(Box::default())
        } else {
            Thinking::AtOnce(Box::default())
        };
        let storage = random.percent(90);
        let board = || Board::new(generate::build(storage));
        let twin = random.one_in(8).then(|| Twin {
            board: board(),
            out: Outbox::new(),
            law_worker: LawWorker::new(),
        });
        Self {
            adversary,
            thinking,
            chip: Chip::new(board()),
            twin,
            storage,
            now: 0,
            emergency: false,
            id: 0,
            last_frame: Vec::new(),
            last_request: Vec::new(),
            replies: Vec::new(),
            ticks: 0,
            moving: 0,
            seeking: 0,
            holding: 0,
            jogging: 0,
            random,
            outcome,
        }
    }

    pub(super) fn run(mut self, ticks: u64) {
        if self.random.percent(20) {
            self.restart(StartCause::PowerOn);
        }
        self.open();
        while self.ticks < ticks {
            let pace = self.pace();
            for _ in 0..pace.moves {
                let view = self.view();
                let chosen = self.adversary.choose(&mut self.random, &view);
                self.carry_out(chosen);
                for _ in 0..self.random.below(pace.most_ticks + 1) {
                    self.tick();
                }
                if self.ticks >= ticks {
                    break;
                }
            }
        }
        for _ in 0..LAST_TICKS {
            self.tick();
        }
        self.chip.invariants.end(self.outcome);
        self.count();
    }

    /// Brings the board under way, in most runs.
    fn open(&mut self) {
        if self.random.percent(5) {
            return;
        }
        self.send(Command::Hello(Hello::OURS));
        let view = self.view();
        let config = self.adversary.config(&mut self.random, &view);
        self.send(Command::Configure(config));
        let target = generate::point_in(&mut self.random, &config.workspace);
        let view = self.view();
        let position = self.adversary.position(&mut self.random, &view);
        self.send(position);
        self.send(Command::Target(target));
    }

    fn pace(&mut self) -> Pace {
        match self.random.below(20) {
            0 if self.random.one_in(6) => Pace { moves: 1, most_ticks: 26_000 },
            1 => Pace { moves: 200, most_ticks: 1 },
            2 => Pace { moves: 20, most_ticks: 5 },
            3 => Pace { moves: 1, most_ticks: 3_000 },
            _ => Pace { moves: 1 + self.random.below(40), most_ticks: 166 },
        }
    }

    fn view(&self) -> View {
        let board = &self.chip.board;
        View {
            config: board.config().copied(),
            positions: board.positions(),
            state: board.state(),
            moving: board.rates() != [0; 3],
        }
    }

    fn carry_out(&mut self, chosen: Move) {
        match chosen {
            Move::Send(command) => self.send(command),
            Move::Repeat => {
                self.outcome.tally.count("repeated frames");
                let request = self.random.percent(50);
                let frame = if request { &self.last_request } else { &self.last_frame };
                let (frame, at) = (frame.clone(), self.arrival());
                self.receive(&frame, at);
            }
            Move::Bytes(bytes) => {
                let at = self.arrival();
                self.receive(&bytes, at);
            }
            Move::Emergency(ticks) => self.open_emergency(ticks),
            Move::Restart(cause) => self.restart(cause),
        }
    }

    /// Returns when something arrives: a tick early, in the tick, or in the last µs of it.
    fn arrival(&mut self) -> u64 {
        match self.random.below(10) {
            0 => self.now.saturating_sub(TICK),
            1 => self.now + TICK - 1,
            _ => self.now,
        }
    }

    fn send(&mut self, command: Command) {
        let at = self.arrival();
        self.send_at(command, at);
    }

    /// Sends a command as a new request, after a zero that ends what came before.
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

    /// Gives the board bytes, frame by frame.
    fn receive(&mut self, bytes: &[u8], at: u64) {
        for piece in bytes.split_inclusive(|byte| *byte == 0) {
            let message = piece.iter().filter_map(|byte| self.chip.decoder.push(*byte)).next();
            self.receive_piece(piece, at, message);
        }
    }

    /// Gives the board bytes that end at most one frame, which is `message`.
    fn receive_piece(
        &mut self,
        bytes: &[u8],
        at: u64,
        message: Option<Result<Vec<u8>, FrameError>>,
    ) {
        let before = Snapshot::of(&self.chip.board);
        let mut rest = bytes;
        while !rest.is_empty() {
            let whole = !self.random.percent(30);
            let count =
                if whole { rest.len() } else { 1 + self.random.below(rest.len() as u64) as usize };
            self.chip.board.receive(Micros(at), &rest[..count], &mut self.chip.out);
            rest = &rest[count..];
        }
        if let Some(twin) = &mut self.twin {
            for byte in bytes {
                twin.board.receive(Micros(at), &[*byte], &mut twin.out);
            }
        }
        self.collect();
        let Some(message) = message else { return };
        let after = Snapshot::of(&self.chip.board);
        let message = message.and_then(|bytes| read::<ToBoard>(&bytes));
        let repeated = message.is_ok() && message.ok() == self.chip.executed;
        let delivery = Delivery { at, message, repeated, replies: &self.replies, before, after };
        count_delivery(&delivery, self.outcome);
        if delivery.configured()
            && let Thinking::Slowly(slowly) = &mut self.thinking
        {
            slowly.configured();
        }
        let config = self.chip.board.config();
        self.chip.invariants.delivered(&delivery, config, self.outcome);
        if let Some(accepted) = delivery.accepted() {
            self.chip.remember(accepted);
        }
    }

    /// Takes in what the board has said.
    fn collect(&mut self) {
        self.replies.clear();
        let Chip { out, accumulator, .. } = &mut self.chip;
        if let Some(twin) = &mut self.twin {
            let same = out.bytes() == twin.out.bytes();
            self.outcome.check(same, TWIN, || {
                format!("says {:?} and {:?}", out.bytes().to_vec(), twin.out.bytes())
            });
            twin.out.clear();
        }
        if out.is_empty() {
            return;
        }
        for byte in out.bytes() {
            match accumulator.push::<FromBoard>(*byte) {
                None => {}
                Some(Ok(message)) => self.replies.push(message),
                Some(Err(error)) => self.outcome.broken(UNBROKEN, || error.to_string()),
            }
        }
        out.clear();
        self.outcome.check(out.dropped() == 0, UNBROKEN, || "a message did not fit".into());
    }

    fn tick(&mut self) {
        self.outcome.tick = self.ticks;
        let before = Snapshot::of(&self.chip.board);
        let told = self.plan_and_report();
        let after = Snapshot::of(&self.chip.board);
        let plan = *self.chip.board.pulses();
        self.compare(plan, after);
        self.collect();
        let (now, emergency, replies) = (self.now, self.emergency, &self.replies[..]);
        let ticked = Ticked { now, before, after, plan, told, replies, emergency };
        count_replies(&self.replies, self.outcome);
        self.chip.invariants.ticked(&ticked, self.outcome);
        self.ticks += 1;
        self.moving += u64::from(ticked.pulses());
        self.seeking += u64::from(after.state == State::Seeking);
        self.holding += u64::from(after.state == State::Holding);
        self.jogging += u64::from(after.state == State::Ready && ticked.pulses());
        self.adversary.motors_moved([0, 1, 2].map(|i| after.positions[i] - before.positions[i]));
        self.serve(told);
        self.now += TICK;
    }

    /// Lets the board, and its twin, plan and report a tick.
    fn plan_and_report(&mut self) -> Option<Tick> {
        let now = Micros(self.now);
        let Chip { board, out, .. } = &mut self.chip;
        match &mut self.thinking {
            Thinking::AtOnce(law_worker) => {
                if let Some(twin) = &mut self.twin {
                    let _ = twin.board.tick(now, &mut twin.law_worker, &mut twin.out);
                }
                board.tick(now, law_worker, out)
            }
            Thinking::Slowly(slowly) => {
                slowly.deliver(self.now, board, self.twin.as_mut().map(|twin| &mut twin.board));
                let told = board.plan(now, out);
                let plan = *board.pulses();
                board.report(now, out);
                self.outcome.check(plan == *board.pulses(), REPORT, || format!("{plan:?}"));
                if let Some(twin) = &mut self.twin {
                    let _ = twin.board.plan(now, &mut twin.out);
                    twin.board.report(now, &mut twin.out);
                }
                let twin = self.twin.as_mut().map(|twin| &mut twin.board);
                slowly.ask(self.now, board, twin, &mut self.random, self.outcome);
                told
            }
        }
    }

    fn compare(&mut self, plan: StepPlan, after: Snapshot) {
        if let Some(twin) = &self.twin {
            let (other, pulses) = (Snapshot::of(&twin.board), *twin.board.pulses());
            let same = other == after && pulses == plan;
            self.outcome
                .check(same, TWIN, || format!("{other:?} {pulses:?} and {after:?} {plan:?}"));
        }
    }

    /// Does what the board asks its chip for: writes its configuration, restarts it.
    fn serve(&mut self, told: Option<Tick>) {
        let Tick { store, bootloader, .. } = told.unwrap_or_default();
        self.chip.storing |= store;
        if self.chip.storing && self.random.percent(20) {
            self.chip.storing = false;
            self.write();
        }
        if bootloader && self.chip.leaving.is_none() {
            self.outcome.tally.count("restarts into the bootloader");
            // Until then, messages still come.
            self.chip.leaving = Some(self.random.below(2000));
        }
        match self.chip.leaving {
            Some(0) => self.restart(StartCause::Requested),
            Some(left) => self.chip.leaving = Some(left - 1),
            None => {}
        }
    }

    fn write(&mut self) {
        let written = self.random.percent(60);
        self.chip.board.on_stored(Micros(self.now), written, &mut self.chip.out);
        if let Some(twin) = &mut self.twin {
            twin.board.on_stored(Micros(self.now), written, &mut twin.out);
        }
        self.collect();
        if !written {
            self.chip.forget_store();
        }
        count_replies(&self.replies, self.outcome);
        self.outcome.tally.count(if written { "stored" } else { "store failed" });
        self.chip.invariants.stored(&self.replies, self.outcome);
    }

    /// Opens the emergency input for some ticks, with messages before and after each.
    fn open_emergency(&mut self, ticks: u64) {
        self.outcome.tally.count("emergencies");
        for tick in 0..ticks {
            // Some pulses of the last tick were not given.
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
        self.chip.invariants.closed();
    }

    fn cut(&mut self, missing: [i32; 3]) {
        self.emergency = true;
        let before = Snapshot::of(&self.chip.board);
        let now = Micros(self.now);
        self.chip.board.on_emergency_stop(now, missing, &mut self.chip.out);
        if let Some(twin) = &mut self.twin {
            twin.board.on_emergency_stop(now, missing, &mut twin.out);
        }
        self.collect();
        count_replies(&self.replies, self.outcome);
        let after = Snapshot::of(&self.chip.board);
        let cut = Cut { missing, before, after, replies: &self.replies };
        self.chip.invariants.cut(&cut, self.outcome);
    }

    /// Returns pulses of the last plan that were not given.
    fn missing(&mut self) -> [i32; 3] {
        self.chip.board.pulses().motors.map(|motor| {
            let count = self.random.range(0, motor.count.into()) as i32;
            if motor.direction { count } else { -count }
        })
    }

    /// Restarts the chip: with its kept configuration, or without one.
    fn restart(&mut self, cause: StartCause) {
        self.outcome.tally.count("restarts");
        self.adversary.restarted();
        let mut board = Board::new(generate::build(self.storage));
        board.set_start_cause(cause);
        let kept = self.kept();
        if let Some(config) = &kept {
            board.restore(config);
        }
        if let Some(twin) = &mut self.twin {
            twin.board = Board::new(generate::build(self.storage));
            twin.board.set_start_cause(cause);
            if let Some(config) = &kept {
                twin.board.restore(config);
            }
            (twin.out, twin.law_worker) = (Outbox::new(), LawWorker::new());
        }
        self.thinking = match self.thinking {
            Thinking::AtOnce(_) => Thinking::AtOnce(Box::default()),
            Thinking::Slowly(_) => Thinking::Slowly(Box::default()),
        };
        self.chip = Chip::new(board);
        (self.now, self.emergency) = (0, false);
    }

    fn kept(&mut self) -> Option<Config> {
        match self.random.below(3) {
            0 => Some(generate::accepted(&mut self.random, [0; 3])),
            1 => Some(generate::absurd(&mut self.random, [0; 3])),
            _ => None,
        }
    }

    fn count(self) {
        let tally = &mut self.outcome.tally;
        tally.add("ticks", self.ticks);
        tally.add("ticks moving", self.moving);
        tally.add("ticks seeking", self.seeking);
        tally.add("ticks holding", self.holding);
        tally.add("ticks jogging", self.jogging);
        tally.add("ticks with a twin", if self.twin.is_some() { self.ticks } else { 0 });
    }
}

/// Whether this command is one whose repetition must not be carried out again.
fn is_request(command: &Command) -> bool {
    match command {
        Command::Hello(_) | Command::Stop | Command::Bootloader => false,
        Command::Position(_) | Command::Status => false,
        Command::Configure(_) | Command::Target(_) | Command::Jog(_) => true,
        Command::Hold | Command::ClearFault | Command::Store => true,
    }
}
