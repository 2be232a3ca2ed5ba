//! What the firmware may take of the chip, and what it takes.

use std::fmt;

use crate::image::Image;

/// The most that the firmware may take, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budgets {
    /// Of the flash's 2 MiB.
    pub flash: u32,
    /// Of the RAM's 264 KiB, by variables and by code that runs from there.
    pub statics: u32,
    /// Least RAM kept for the stack.
    pub stack: u32,
}

/// Room to grow by a third or so: enough to notice when something large slips in.
pub const PICO: Budgets = Budgets { flash: 256 * 1024, statics: 112 * 1024, stack: 32 * 1024 };

/// A firmware's sizes beside its budgets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Usage {
    flash: u32,
    statics: u32,
    stack: u32,
    budgets: Budgets,
}

impl Usage {
    /// What `image` takes.
    pub fn new(image: &Image, budgets: Budgets) -> Self {
        Self {
            flash: image.flash.len() as u32,
            statics: image.statics,
            stack: image.stack,
            budgets,
        }
    }

    /// Whether every budget is kept.
    pub fn within(&self) -> bool {
        let Budgets { flash, statics, stack } = self.budgets;
        self.flash <= flash && self.statics <= statics && self.stack >= stack
    }
}

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Budgets { flash, statics, stack } = self.budgets;
        let verdict = |kept: bool| if kept { "" } else { "   OVER BUDGET" };
        writeln!(
            f,
            "flash       {:>7} of {flash:>7} bytes{}",
            self.flash,
            verdict(self.flash <= flash)
        )?;
        writeln!(
            f,
            "static RAM  {:>7} of {statics:>7} bytes{}",
            self.statics,
            verdict(self.statics <= statics)
        )?;
        write!(
            f,
            "stack       {:>7} kept, at least {stack} bytes{}",
            self.stack,
            verdict(self.stack >= stack)
        )
    }
}
