//! Benchmarks of control and vision. Every result can be repeated from a seed.
//!
//! - [`control`]: control laws, baselines and references on simulated rigs.
//! - [`vision`]: detectors on synthetic and composited frames.
//!
//! ```
//! use plumb_bench::control::{self, ControllerKind, Suite, SuiteName};
//!
//! let controller: ControllerKind = "adaptive".parse()?;
//! let suite = Suite::new(SuiteName::QuasiStatic);
//! let reports = control::run(&controller, &suite, 0..2, 1, &mut |done| println!("{done} done"))?;
//! assert_eq!(reports[0].converged, 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

/// Defines an enum whose variants have a name in options, reports and JSON, and a description.
macro_rules! named {
    ($(#[$about:meta])* $kind:ident: $($variant:ident $name:literal $text:literal;)+) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $kind {
            $(#[doc = $text] $variant,)+
        }

        impl $kind {
            /// All of them.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Returns the name in options, reports and JSON.
            #[must_use]
            pub const fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ }
            }

            /// Returns a description for people.
            #[must_use]
            pub const fn about(self) -> &'static str {
                match self { $(Self::$variant => $text,)+ }
            }
        }

        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.as_str())
            }
        }

        impl std::str::FromStr for $kind {
            type Err = $crate::UnknownName;

            fn from_str(text: &str) -> Result<Self, $crate::UnknownName> {
                let known = || $crate::UnknownName::new(Self::ALL);
                Self::ALL.into_iter().find(|it| it.as_str() == text).ok_or_else(known)
            }
        }
    };
}

pub mod control;
mod run_id;
pub mod vision;

/// Error of parsing a name that is not in the list of known names.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("one of {0}")]
pub struct UnknownName(String);

impl UnknownName {
    /// Creates the error from the known names.
    fn new<T: ToString>(known: impl IntoIterator<Item = T>) -> Self {
        let known: Vec<String> = known.into_iter().map(|name| name.to_string()).collect();
        Self(known.join(", "))
    }
}
