//! Use of flash, RAM and stack by the firmware, beside its budgets.

use std::fmt;

use crate::chip::Budgets;
use crate::image::Image;

/// Sizes of a firmware with their budgets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Usage {
    flash: u32,
    statics: u32,
    stack: u32,
    budgets: Budgets,
}

impl Usage {
    /// Returns the sizes of `image`, to be compared with `budgets`.
    pub fn new(image: &Image, budgets: Budgets) -> Self {
        Self {
            flash: image.flash.len() as u32,
            statics: image.statics,
            stack: image.stack,
            budgets,
        }
    }

    /// Returns whether all sizes are within their budgets.
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
