//! Choice of the mutant in a test process. Every changed function of the copy calls [`mutant`].

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::process::exit;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest number of changed functions.
const FUNCTIONS: usize = 4096;

static STATE: OnceLock<State> = OnceLock::new();
static REACHED: [AtomicBool; FUNCTIONS] = [const { AtomicBool::new(false) }; FUNCTIONS];

struct State {
    /// Number of the chosen mutant: 1 or more. With 0, the code is unchanged.
    mutant: usize,
    /// List of the functions that were called.
    reached: Option<File>,
}

fn state() -> State {
    let default = std::panic::take_hook();
    // The process ends at the first panic, because one failed test is enough.
    std::panic::set_hook(Box::new(move |info| {
        default(info);
        exit(101);
    }));
    let number = std::env::var("MUTANT").ok().and_then(|text| text.parse().ok());
    let open = |path| OpenOptions::new().create(true).append(true).open(path).ok();
    State { mutant: number.unwrap_or(0), reached: std::env::var("REACHED").ok().and_then(open) }
}

/// Returns the number of the chosen mutant. `function` is the number of the calling function.
pub fn mutant(function: usize) -> usize {
    let state = STATE.get_or_init(state);
    if let Some(mut file) = state.reached.as_ref() {
        if !REACHED[function].swap(true, Ordering::Relaxed) {
            let _ = writeln!(file, "{function}");
        }
    }
    state.mutant
}
