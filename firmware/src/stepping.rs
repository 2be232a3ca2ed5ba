//! The stepping interrupt: a tick of the board every 200 µs, above all else.
//!
//! It comes [`AHEAD_US`] before the tick that it plans begins, so that the pulses are in the state
//! machines' queues by then. The board's time is the number of the tick, whatever the timer says:
//! what it does depends on nothing but which bytes came before which tick. Where a tick has come
//! too late after all (while the flash is written), all that follows is later by as much.

use core::cell::RefCell;

use critical_section::Mutex;
use embassy_rp::gpio::Level;
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::pac;
use plumb_core::{Board, BuildLimits, Outbox, TICK_US, Tick};
use plumb_protocol::config::{Config, Drivers};
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;
use static_cell::StaticCell;

use crate::coils::Coils;
use crate::enable::Enable;
use crate::generator::Generator;
use crate::link::{self, Inbox, Message};
use crate::watch::Watch;
use crate::{flash, hats, law_worker, restart};

/// How long before a tick's beginning it is planned: what planning may take. Measured in the
/// emulated chip, to the last word for the state machines: at most 5852 clocks (47 µs), with a
/// position that turns three motors round and a running mean; 7384 where that is in front of the
/// end of their travel: such a tick is late.
const AHEAD_US: u32 = 50;

/// Less than this before its beginning, a tick is late: giving the state machines their words takes
/// 4.5 µs.
const LATE_US: i32 = 5;

/// What this board was built for; the emulated board is built for the same.
const BUILD: BuildLimits = BuildLimits { max_pulse_rate: 1_250_000, storage: true };

/// Motors whose fields are turned here, a tick at a time.
#[derive(Clone, Copy)]
enum Fields {
    /// None: the drivers have STEP inputs.
    None,
    Coils,
    Hats(hats::Order),
}

/// Until the interrupt takes it over.
static STEPPING: Mutex<RefCell<Option<&'static mut Stepping>>> = Mutex::new(RefCell::new(None));

/// What the interrupt is given.
pub(crate) struct Parts {
    pub(crate) inbox: Inbox,
    pub(crate) generator: Generator,
    pub(crate) coils: Coils,
    pub(crate) enable: Enable,
    pub(crate) watch: Watch,
    pub(crate) cause: StartCause,
    /// The configuration that was kept in flash.
    pub(crate) kept: Option<Config>,
}

/// Everything that the interrupt works with.
pub(crate) struct Stepping {
    board: Board,
    inbox: Inbox,
    outbox: Outbox,
    generator: Generator,
    coils: Coils,
    enable: Enable,
    watch: Watch,
    /// How often the board had been configured when the drivers were set up.
    generation: u32,
    fields: Fields,
    /// The board's time: when the coming tick begins.
    now: Micros,
    /// The same on the timer, which wraps.
    beginning: u32,
    /// Whether the state machines run.
    running: bool,
    /// Whether the configuration is being written.
    storing: bool,
}

/// Lets the interrupt take over.
pub(crate) fn start(parts: Parts) {
    static PLACE: StaticCell<Stepping> = StaticCell::new();
    let stepping = PLACE.init_with(|| Stepping::new(parts));
    critical_section::with(|cs| STEPPING.borrow_ref_mut(cs).replace(stepping));
    // Everything else waits for it, and it waits for nothing.
    interrupt::TIMER_IRQ_1.set_priority(Priority::P0);
    pac::TIMER.inte().modify(|w| w.set_alarm(1, true));
    // SAFETY: the handler below is there, and what it works with was put in its place above.
    unsafe { interrupt::TIMER_IRQ_1.enable() };
    interrupt::TIMER_IRQ_1.pend();
}

#[embassy_rp::interrupt]
fn TIMER_IRQ_1() {
    static mut TAKEN: Option<&'static mut Stepping> = None;
    if TAKEN.is_none() {
        *TAKEN = critical_section::with(|cs| STEPPING.borrow_ref_mut(cs).take());
    }
    if let Some(stepping) = TAKEN {
        stepping.interrupt();
    }
}

/// The timer, µs; wraps after 71 minutes.
fn timer() -> u32 {
    pac::TIMER.timerawl().read()
}

impl Stepping {
    /// A board that has not begun yet.
    fn new(parts: Parts) -> Self {
        let Parts { inbox, generator, coils, enable, watch, cause, kept } = parts;
        let mut board = Board::new(BUILD);
        board.set_start_cause(cause);
        if let Some(config) = kept {
            board.restore(&config);
        }
        Self {
            board,
            inbox,
            outbox: Outbox::new(),
            generator,
            coils,
            enable,
            watch,
            generation: 0,
            fields: Fields::None,
            now: Micros(0),
            beginning: timer().wrapping_add(AHEAD_US),
            running: false,
            storing: false,
        }
    }

    /// Does the ticks that are due, and asks to be called for the next.
    fn interrupt(&mut self) {
        pac::TIMER.intr().write(|w| w.set_alarm(1, true));
        loop {
            self.tick();
            let next = self.beginning.wrapping_sub(AHEAD_US);
            pac::TIMER.alarm(1).write_value(next);
            if (next.wrapping_sub(timer()) as i32) > 0 {
                break;
            }
            // It is due already: the alarm would come in 71 minutes.
            pac::TIMER.armed().write(|w| w.set_armed(1 << 1));
        }
    }

    /// One tick, from the message that has come to the words for the state machines.
    #[inline(never)]
    fn tick(&mut self) {
        self.watch.tick();
        if self.generator.cut_off() {
            self.mind_emergency();
        }
        if self.inbox.messages.ready() {
            self.listen();
        }
        if let Some(response) = law_worker::response() {
            self.board.on_law_response(&response);
        }
        if let Some(tick) = self.board.plan(self.now, &mut self.outbox) {
            self.carry_out(tick);
        }
        if !matches!(self.fields, Fields::None) {
            self.turn_fields();
        }
        self.go_on();
        // From here on there is time.
        self.board.report(self.now, &mut self.outbox);
        if let Some(request) = self.board.take_law_request() {
            law_worker::request(request);
        }
        if !self.outbox.is_empty() {
            link::send(self.outbox.bytes());
            self.outbox.clear();
        }
        self.now.0 += u64::from(TICK_US);
        self.beginning = self.beginning.wrapping_add(TICK_US);
    }

    /// What a tick asks for besides its pulses.
    #[inline(never)]
    fn carry_out(&mut self, tick: Tick) {
        if tick.bootloader {
            restart::bootloader();
        }
        if self.board.generation() != self.generation {
            self.change_drivers();
        }
        if tick.store {
            self.store();
        }
        self.enable.set(tick.drivers_enabled);
    }

    /// Takes up the drivers of a new configuration; the motors stand still.
    #[inline(never)]
    fn change_drivers(&mut self) {
        self.generation = self.board.generation();
        self.enable.set(false);
        self.turn_fields();
        self.coils.disconnect();
        let (Some(drivers), Some(timing), Some(config)) =
            (self.board.drivers(), self.board.driver_timing(), self.board.config())
        else {
            return;
        };
        self.fields = Fields::None;
        self.generator.set_timing(timing);
        match drivers {
            Drivers::StepDir(_) => self.enable.active(Level::Low),
            Drivers::Coils(coils) => {
                self.enable.active(Level::High);
                self.coils.connect(coils.duty_percent, config.microsteps);
                self.fields = Fields::Coils;
            }
            Drivers::MotorHats(coils) => {
                self.enable.active(Level::High);
                let (duty_percent, microsteps) = (coils.duty_percent, config.microsteps);
                self.fields =
                    Fields::Hats(hats::Order { duty_percent, microsteps, positions: None });
            }
        }
    }

    /// Puts the fields of motors without STEP inputs where those are to be, or lets them go.
    #[inline(never)]
    fn turn_fields(&mut self) {
        let enabled = self.enable.is_on();
        match self.fields {
            Fields::None => {}
            Fields::Coils if enabled => self.coils.show(self.board.positions()),
            Fields::Coils => self.coils.release(),
            Fields::Hats(last) => {
                let positions = enabled.then(|| self.board.positions());
                if last.positions != positions {
                    let order = hats::Order { positions, ..last };
                    self.fields = Fields::Hats(order);
                    hats::order(order);
                }
            }
        }
    }

    /// Has the configuration written, and tells the board when that is done.
    #[inline(never)]
    fn store(&mut self) {
        if let Some(written) = flash::written() {
            self.storing = false;
            self.board.on_stored(self.now, written, &mut self.outbox);
        } else if !self.storing
            && let Some(config) = self.board.config()
        {
            self.storing = true;
            flash::write(config);
        }
    }

    /// Hands the board the next message.
    #[inline(never)]
    fn listen(&mut self) {
        let Self { board, inbox, outbox, now, .. } = self;
        match inbox.messages.peek() {
            Some(Message::Position(position)) => {
                board.on_position(*now, position.id, &position.position, outbox)
            }
            Some(Message::Command) => {
                if let Some(command) = inbox.commands.peek() {
                    board.on_frame(*now, Ok(command), outbox);
                }
                let _ = inbox.commands.dequeue();
            }
            Some(Message::Damaged(error)) => board.on_frame(*now, Err(*error), outbox),
            None => {}
        }
        let _ = inbox.messages.dequeue();
    }
}

/// The step generator's part of a tick.
impl Stepping {
    /// Tells the board where its motors are when the emergency input has cut the pulses off; and,
    /// once it has closed again, watches it anew.
    #[inline(never)]
    fn mind_emergency(&mut self) {
        let mut missing = [0; 3];
        if self.running {
            self.running = false;
            self.enable.set(false);
            missing = self.generator.stop();
        } else if self.generator.emergency_closed() {
            self.generator.watch();
        }
        self.board.on_emergency_stop(self.now, missing, &mut self.outbox);
    }

    /// Gives the state machines the coming tick; starts them where they stand, or are about to run
    /// dry.
    #[inline(always)]
    fn go_on(&mut self) {
        if self.running && !self.late() {
            self.generator.give(self.board.pulses());
        } else {
            self.start_anew();
        }
    }

    /// Whether the coming tick begins now, or has begun.
    fn late(&self) -> bool {
        (self.beginning.wrapping_sub(timer()) as i32) < LATE_US
    }

    /// The same where they stand, or are about to run dry.
    #[inline(never)]
    fn start_anew(&mut self) {
        if !self.running && self.generator.cut_off() {
            // The board is in its emergency stop and plans no pulses.
            return;
        }
        let late = self.late();
        if self.running {
            self.generator.finish();
        }
        self.generator.halt();
        self.generator.give(self.board.pulses());
        if late {
            self.beginning = timer().wrapping_add(LATE_US as u32);
        }
        while (self.beginning.wrapping_sub(timer()) as i32) > 0 {}
        self.generator.run();
        self.running = true;
    }
}
