//! The executor of the tasks: an interrupt above thread mode and below all other interrupts.

use embassy_executor::{InterruptExecutor, SendSpawner, SpawnError, SpawnToken, Spawner};
use embassy_rp::interrupt::{self, InterruptExt, Priority};

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

#[embassy_rp::interrupt]
fn SWI_IRQ_1() {
    // SAFETY: the executor was started with this interrupt, and nothing else calls the function.
    unsafe { EXECUTOR.on_interrupt() }
}

/// Starts the executor.
pub(crate) fn start() -> SendSpawner {
    interrupt::SWI_IRQ_1.set_priority(Priority::P3);
    EXECUTOR.start(interrupt::SWI_IRQ_1)
}

/// Starts a task. Each task is started once, so there is always room for it.
pub(crate) fn spawn<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    if let Ok(task) = task {
        spawner.spawn(task);
    }
}
