//! The stepping interrupt: a tick of the board every 200 µs, above everything else.
//!
//! It comes [`AHEAD_US`] before the tick that it plans, so that the pulses are in the state
//! machines' queues in time. The board's time is the number of the tick, not the time of the timer:
//! the board's behaviour depends only on which bytes came before which tick. Where a tick is late
//! (while the flash is written), all later ticks are late by as much.

use core::cell::RefCell;

use critical_section::Mutex;
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use plumb_core::board::FlashTask;
use plumb_core::config_store::Stored;
use plumb_core::tmc2209::Event;
use plumb_core::{Board, BuildLimits, Outbox, TICK_US, Tick};
use plumb_protocol::dimension::MOTORS;
use plumb_protocol::message::{DriverFault, StartCause};
use plumb_protocol::units::Micros;
use plumb_protocol::wiring::Drivers;
use static_cell::StaticCell;

use crate::chip::{TIMER, timer};
use crate::coils::Coils;
use crate::enable::Enable;
use crate::flash::{self, FlashWrite};
use crate::generator::Generator;
use crate::hats::{self, HatCommand};
use crate::link::{self, Inbox, Message};
use crate::watchdog::TickWatchdog;
use crate::{chip, diagnostics, info, law_worker, pins, restart, tmc2209, watchdog, witness};

/// Time from the interrupt to the tick that it plans, µs: what planning may take. Measured in the
/// emulated chip, to the last word for the state machines: at most 5852 clocks (47 µs), with a
/// position that reverses three motors and a moving average; 7384 where that is in front of the end
/// of their travel. Besides, interrupts are off in code that waits for flash, and while the links'
/// tasks take bytes from their queues: for up to 839 clocks (6.7 µs), with questions back to back
/// on the UART. 1086 clocks are left for it.
const AHEAD_US: u32 = 60;

/// Time before its beginning from which on a tick is late, µs: giving the state machines their
/// words takes 4.5 µs.
const LATE_US: i32 = 5;

/// Limits of this build; the same as in the emulated board, except `storage` and `chip`.
const BUILD: BuildLimits = BuildLimits {
    max_pulse_rate: 1_250_000,
    storage: true,
    chip: Some(chip::CHIP),
    law_ticks: chip::LAW_TICKS,
};

/// What the drivers get and tell once a tick besides their pulses.
#[derive(Clone, Copy)]
enum DriverLink {
    /// Nothing: the drivers have STEP inputs.
    None,
    /// Drivers with STEP inputs on a UART, whose events go to the board.
    Uart,
    /// Coils on the chip's own pulse-width modulation.
    Coils,
    /// Coils on the Motor HATs, and their last command.
    Hats(HatCommand),
    /// Coils on the Motor HATs, whose current goes off before the bootloader starts.
    Leaving,
}

/// The state, until the interrupt takes it over.
static STEPPING: Mutex<RefCell<Option<&'static mut Stepping>>> = Mutex::new(RefCell::new(None));

/// Resources of the stepping interrupt.
pub(crate) struct SteppingResources {
    pub(crate) inbox: Inbox,
    pub(crate) generator: Generator,
    pub(crate) coils: Coils,
    pub(crate) enable: Enable,
    pub(crate) watchdog: TickWatchdog,
    /// Whether the chip's clock is the one that the board plans with.
    pub(crate) has_planned_clock: bool,
    /// Cause of the start.
    pub(crate) cause: StartCause,
    /// The stored wiring and configuration.
    pub(crate) stored: Option<Stored>,
}

/// State of the stepping interrupt.
///
/// The outputs to the drivers are fields of it, and their methods are in this file: with a type of
/// their own in a file of their own, each tick took 37 clocks more (986 instead of 949).
pub(crate) struct Stepping {
    board: Board,
    inbox: Inbox,
    outbox: Outbox,
    generator: Generator,
    coils: Coils,
    enable: Enable,
    watchdog: TickWatchdog,
    /// The board's wiring generation for which pins and drivers were set up.
    generation: u32,
    driver_link: DriverLink,
    /// The board's time: the beginning of the coming tick.
    now: Micros,
    /// The same on the timer, µs; wraps.
    beginning: u32,
    /// Whether the state machines run.
    running: bool,
    /// Whether the flash is being written.
    storing: bool,
}

/// Starts the interrupt.
#[cold]
pub(crate) fn start(resources: SteppingResources) {
    static PLACE: StaticCell<Stepping> = StaticCell::new();
    let stepping = PLACE.init_with(|| Stepping::new(resources));
    critical_section::with(|cs| STEPPING.borrow_ref_mut(cs).replace(stepping));
    // The highest priority: the interrupt never waits, and everything else waits for it.
    chip::STEPPING.set_priority(Priority::P0);
    TIMER.inte().modify(|w| w.set_alarm(1, true));
    // SAFETY: the handler exists, and its state was stored above.
    unsafe { chip::STEPPING.enable() };
    chip::STEPPING.pend();
}

/// Defines the handler of the interrupt of this name.
macro_rules! stepping_interrupt {
    ($name:ident) => {
        #[embassy_rp::interrupt]
        fn $name() {
            static mut TAKEN: Option<&'static mut Stepping> = None;
            if TAKEN.is_none() {
                *TAKEN = critical_section::with(|cs| STEPPING.borrow_ref_mut(cs).take());
            }
            if let Some(stepping) = TAKEN {
                stepping.interrupt();
            }
        }
    };
}

#[cfg(not(feature = "rp2350"))]
stepping_interrupt!(TIMER_IRQ_1);
#[cfg(feature = "rp2350")]
stepping_interrupt!(TIMER0_IRQ_1);

impl Stepping {
    /// Creates the state before the first tick.
    fn new(resources: SteppingResources) -> Self {
        let SteppingResources { inbox, generator, coils, enable, watchdog, .. } = resources;
        let SteppingResources { has_planned_clock, cause, stored, .. } = resources;
        let mut board = Board::new(BUILD);
        board.set_start_cause(cause);
        board.set_provenance(info::provenance());
        if let Some(Stored { wiring, config }) = &stored {
            board.restore(wiring, config);
        }
        if !has_planned_clock {
            board.refuse_clock();
        }
        Self {
            board,
            inbox,
            outbox: Outbox::new(),
            generator,
            coils,
            enable,
            watchdog,
            generation: 0,
            driver_link: DriverLink::None,
            now: Micros(0),
            beginning: timer().wrapping_add(AHEAD_US),
            running: false,
            storing: false,
        }
    }

    /// Runs the ticks that are due, and sets the alarm for the next one.
    fn interrupt(&mut self) {
        TIMER.intr().write(|w| w.set_alarm(1, true));
        loop {
            self.tick();
            let next = self.beginning.wrapping_sub(AHEAD_US);
            TIMER.alarm(1).write_value(next);
            if (next.wrapping_sub(timer()) as i32) > 0 {
                break;
            }
            // The time has passed already: the alarm would come in 71 minutes, or has come since it
            // was set. Its tick is the next one here.
            TIMER.armed().write(|w| w.set_armed(1 << 1));
            TIMER.intr().write(|w| w.set_alarm(1, true));
            chip::STEPPING.unpend();
        }
    }

    /// Runs a tick, from the next message to the words for the state machines.
    #[inline(never)]
    fn tick(&mut self) {
        self.watchdog.tick();
        if self.generator.check_estop() {
            self.handle_estop();
        }
        if self.inbox.messages.ready() {
            self.take_message();
        }
        if let Some(response) = law_worker::response() {
            self.board.on_law_response(&response);
        }
        if let Some(tick) = self.board.plan(self.now, &mut self.outbox) {
            self.carry_out(tick);
        }
        self.give_words();
        // The rest of the tick is not urgent.
        if self.generator.ran_dry() {
            self.on_late_tick();
        }
        if !matches!(self.driver_link, DriverLink::None) {
            self.serve_drivers();
        }
        self.board.report(self.now, &mut self.outbox);
        if let Some(request) = self.board.take_law_request() {
            law_worker::request(request);
        }
        if !self.outbox.is_empty() {
            link::send(self.outbox.bytes());
            self.outbox.clear();
        }
        if self.watchdog.has_checked() {
            link::set_moving(self.board.rates() != [0; MOTORS]);
        }
        self.now.0 += u64::from(TICK_US);
        self.beginning = self.beginning.wrapping_add(TICK_US);
    }

    /// Carries out the requests of a tick besides its pulses.
    #[inline(never)]
    fn carry_out(&mut self, tick: Tick) {
        if tick.bootloader {
            self.leave();
        }
        if self.board.wiring_generation() != self.generation {
            self.change_wiring();
        }
        if let Some(task) = tick.flash {
            self.write_flash(task);
        }
        if tick.measure {
            self.board.on_measured(
                self.now,
                Some(witness::measure(self.board.wiring())),
                &mut self.outbox,
            );
        }
        if tick.set_up_drivers {
            tmc2209::request_set_up(true);
        }
        if tick.diagnose {
            self.board.on_diagnosed(diagnostics::counts(self.outbox.dropped()), &mut self.outbox);
        }
        self.enable.set(tick.drivers_enabled && !self.generator.estop_tripped());
    }

    /// Restarts into the bootloader, or as picotool asked. HATs would keep their current there, so
    /// theirs is switched off first.
    #[cold]
    fn leave(&mut self) {
        match self.driver_link {
            DriverLink::Hats(last) => {
                self.driver_link = DriverLink::Leaving;
                hats::leave(last);
            }
            DriverLink::Leaving => {}
            DriverLink::None | DriverLink::Uart | DriverLink::Coils => link::reset::restart(),
        }
    }

    /// Changes to the pins and drivers of a new wiring; at standstill. The state machines
    /// start again with the coming tick.
    #[cold]
    #[inline(never)]
    fn change_wiring(&mut self) {
        self.generation = self.board.wiring_generation();
        self.enable.set(false);
        self.serve_drivers();
        if self.running {
            self.generator.finish();
            self.running = false;
        }
        self.generator.halt();
        self.coils.end();
        witness::stop();
        self.enable.disconnect();
        watchdog::set_led(None);
        self.driver_link = DriverLink::None;
        self.connect();
    }

    /// Connects the pins and drivers of the configuration in force.
    #[cold]
    #[inline(never)]
    fn connect(&mut self) {
        let (Some(wiring), Some(timing), Some(config)) =
            (self.board.wiring(), self.board.driver_timing(), self.board.config())
        else {
            return;
        };
        let microsteps = config.microsteps;
        self.generator.set_timing(timing);
        pins::connect(wiring);
        watchdog::set_led(wiring.pins.led);
        self.generator.connect(&wiring.pins);
        self.enable.connect(&wiring.pins);
        restart::keep_hats(matches!(wiring.drivers, Drivers::MotorHats(_)));
        tmc2209::begin(wiring, microsteps);
        match wiring.drivers {
            Drivers::StepDir(_) => {}
            Drivers::Tmc2209(_) => self.driver_link = DriverLink::Uart,
            Drivers::Coils(coils) => {
                self.coils.begin(coils.duty_percent, microsteps);
                self.driver_link = DriverLink::Coils;
            }
            Drivers::MotorHats(coils) => {
                let duty_percent = coils.duty_percent;
                let hats = hats::needed(wiring.pins.motors.len());
                let command = HatCommand { duty_percent, microsteps, hats, positions: None };
                self.driver_link = DriverLink::Hats(command);
            }
        }
    }

    /// Returns what is in force, to be stored.
    fn stored(&self) -> Option<Stored> {
        let (wiring, config) = (*self.board.wiring()?, *self.board.config()?);
        Some(Stored { wiring, config })
    }

    /// Passes the events of drivers on to the board. Turns the fields of coils to the motor
    /// positions, or switches their current off while the drivers are off.
    #[inline(never)]
    fn serve_drivers(&mut self) {
        let enabled = self.enable.is_on();
        match self.driver_link {
            DriverLink::None | DriverLink::Leaving => {}
            DriverLink::Uart => self.take_driver_event(),
            DriverLink::Coils if enabled => self.coils.show(self.board.positions()),
            DriverLink::Coils => self.coils.release(),
            DriverLink::Hats(last) => {
                if last.positions.is_some() && hats::failed() {
                    let fault = DriverFault::Hat;
                    self.board.on_driver_failure(self.now, fault, &mut self.outbox);
                }
                let positions = enabled.then(|| self.board.positions());
                if last.positions != positions {
                    if last.positions.is_none() {
                        hats::begin();
                    }
                    let command = HatCommand { positions, ..last };
                    self.driver_link = DriverLink::Hats(command);
                    hats::command(command);
                }
            }
        }
    }

    /// Passes an event of drivers on a UART on to the board.
    #[inline(never)]
    fn take_driver_event(&mut self) {
        match tmc2209::event::take() {
            None => {}
            Some(Event::Ready) => self.board.on_drivers_ready(),
            Some(Event::Failed(fault)) => {
                tmc2209::request_set_up(false);
                self.board.on_driver_failure(self.now, fault, &mut self.outbox);
            }
            Some(Event::Readings(readings)) => {
                self.board.on_driver_readings(self.now, readings, &mut self.outbox);
            }
        }
    }

    /// Has the configuration written, or the flash tested, and reports the result to the board.
    #[inline(never)]
    fn write_flash(&mut self, task: FlashTask) {
        if let Some(written) = flash::written() {
            self.storing = false;
            self.board.on_stored(self.now, written, &mut self.outbox);
        } else if !self.storing {
            let wanted = match task {
                FlashTask::Store => self.stored().map(FlashWrite::Setup),
                FlashTask::Test => Some(FlashWrite::Test),
            };
            self.storing = wanted.is_some();
            wanted.into_iter().for_each(flash::write);
        }
    }

    /// Gives the board the next message.
    #[inline(never)]
    fn take_message(&mut self) {
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

/// Control of the step generator.
impl Stepping {
    /// Stops the generator after the emergency input has opened, and reports the missing pulses to
    /// the board; ends the stop once the input is closed. The hardware has stopped the pulses, so
    /// that a tick may be late.
    #[cold]
    #[inline(never)]
    fn handle_estop(&mut self) {
        let mut missing = [0; MOTORS];
        if self.running {
            self.running = false;
            self.enable.set(false);
            missing = self.generator.stop();
        } else if self.generator.estop_closed() {
            self.generator.end_estop();
        }
        self.board.on_emergency_stop(self.now, missing, &mut self.outbox);
    }

    /// Gives the state machines the words of the coming tick; restarts them where they are stopped
    /// or about to run dry.
    #[inline(always)]
    fn give_words(&mut self) {
        if self.running && !self.is_late() {
            self.generator.give(self.board.pulses());
        } else {
            self.restart();
        }
    }

    /// Counts a late tick, and reports one that has delayed pulses to the board.
    #[inline(never)]
    fn on_late_tick(&mut self) {
        let moving = self.board.rates() != [0; MOTORS];
        diagnostics::count_late_tick(moving);
        if moving {
            self.board.on_late_tick(self.now, &mut self.outbox);
        }
    }

    /// Returns whether the coming tick begins now, or has begun.
    fn is_late(&self) -> bool {
        (self.beginning.wrapping_sub(timer()) as i32) < LATE_US
    }

    /// Restarts the state machines with the words of the coming tick.
    #[inline(never)]
    fn restart(&mut self) {
        if !self.running && self.generator.estop_tripped() {
            // The board is in its emergency stop and plans no pulses.
            return;
        }
        let late = self.is_late();
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
