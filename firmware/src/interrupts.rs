//! Handlers and priorities of the peripherals' interrupts, the table of all vectors, and the
//! executor of the tasks: an interrupt above thread mode and below all others.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use embassy_executor::{InterruptExecutor, SendSpawner, SpawnError, SpawnToken, Spawner};
use embassy_rp::interrupt::typelevel::{self, Binding};
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::{bind_interrupts, i2c, peripherals, pio, uart, usb};

use crate::chip::{self, VECTORS};
use crate::link::usb::errata::FrameHandler;

bind_interrupts!(pub(crate) struct Interrupts {
    USBCTRL_IRQ => FrameHandler, usb::InterruptHandler<peripherals::USB>;
    UART0_IRQ => uart::BufferedInterruptHandler<peripherals::UART0>;
    I2C0_IRQ => i2c::InterruptHandler<peripherals::I2C0>;
});

// SAFETY: the handler wakes tasks that wait for the state machines, and no task does. PIO0's INTE
// stays 0, so that its interrupt never comes, and 1.8 kB of flash are free.
unsafe impl Binding<typelevel::PIO0_IRQ_0, pio::InterruptHandler<peripherals::PIO0>>
    for Interrupts
{
}

/// Puts the peripherals' interrupts above the tasks and below the stepping interrupt.
pub(crate) fn set_priorities() {
    for interrupt in
        [chip::TIME_DRIVER, interrupt::USBCTRL_IRQ, interrupt::UART0_IRQ, interrupt::I2C0_IRQ]
    {
        interrupt.set_priority(Priority::P2);
    }
}

/// Table of the vectors in RAM, at an address that VTOR can have: a multiple of the table's size,
/// rounded up to a power of two, and of 128 or 256 bytes (ARMv6-M Architecture Reference Manual,
/// B3.2.5; Armv8-M, D1.2.268).
#[cfg_attr(feature = "rp2350", repr(align(512)))]
#[cfg_attr(not(feature = "rp2350"), repr(align(256)))]
struct Vectors([AtomicU32; VECTORS]);

/// Copies the vectors into RAM: an interrupt then never waits for the flash.
pub(crate) fn copy_vectors() {
    static COPY: Vectors = Vectors([const { AtomicU32::new(0) }; VECTORS]);
    // SAFETY: nothing else uses VTOR.
    let vtor = unsafe { &(*SCB::PTR).vtor };
    let table = vtor.read() as *const u32;
    for (i, vector) in COPY.0.iter().enumerate() {
        // SAFETY: the table in flash has this many words (cortex-m-rt's link.x).
        vector.store(unsafe { table.add(i).read() }, Ordering::Relaxed);
    }
    cortex_m::asm::dmb();
    // SAFETY: the copy has the same vectors, and stays.
    unsafe { vtor.write(COPY.0.as_ptr() as u32) };
    cortex_m::asm::dsb();
}

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

#[embassy_rp::interrupt]
fn SWI_IRQ_1() {
    // SAFETY: the executor was started with this interrupt, and nothing else calls the function.
    unsafe { EXECUTOR.on_interrupt() }
}

pub(crate) fn start_executor() -> SendSpawner {
    interrupt::SWI_IRQ_1.set_priority(Priority::P3);
    EXECUTOR.start(interrupt::SWI_IRQ_1)
}

/// Starts a task. Each task is started once, so there is always room for it.
pub(crate) fn spawn<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    if let Ok(task) = task {
        spawner.spawn(task);
    }
}
