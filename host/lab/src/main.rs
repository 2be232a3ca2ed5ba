//! The program `plumb-lab`: what the tables of the book come from. Nobody who drives a rig needs
//! it.

// These panic where nobody reads what they print.
#![deny(clippy::print_stdout, clippy::print_stderr)]

/// Writes a line for people to standard error. A message that nobody reads is no failure.
macro_rules! tell {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _lost = writeln!(std::io::stderr(), $($text)*);
    }};
}

mod control;
mod output;
mod verify;
mod vision;

use std::process::ExitCode;

use clap::Parser;
use clap::builder::TypedValueParser;
use plumb_config::quantity::Range;

/// Benchmarks that anyone can reproduce from a seed, and proofs about the control laws
///
/// Exit codes: 0 done, 1 it failed or a statement is not proved, 2 the input is wrong. Messages for
/// people go to standard error.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
enum Lab {
    Control(control::Args),
    Paths(control::PathsArgs),
    Paper(control::PaperArgs),
    Vision(vision::Args),
    Verify(verify::Args),
}

fn main() -> ExitCode {
    let lab = Lab::try_parse().unwrap_or_else(|error| {
        if error.use_stderr() {
            output::print_error(output::BAD_INPUT, error.to_string().trim_end());
        }
        error.exit()
    });
    let result = match lab {
        Lab::Control(args) => control::main(&args).map(|()| true),
        Lab::Paths(args) => control::paths(&args).map(|()| true),
        Lab::Paper(args) => control::paper(&args).map(|()| true),
        Lab::Vision(args) => vision::main(&args).map(|()| true),
        Lab::Verify(args) => verify::main(&args),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(output::FAILED),
        Err(failure) => failure.report(),
    }
}

/// Returns the parser of a number of a range.
fn within(range: Range) -> impl TypedValueParser<Value = f64> {
    move |text: &str| range.parse(text)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    /// Every command line of the book is one of the program.
    #[test]
    fn every_command_of_the_book_exists() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
        let mut count = 0;
        for part in ["use", "understand", "change"] {
            for page in fs::read_dir(docs.join(part)).unwrap() {
                let text = fs::read_to_string(page.unwrap().path()).unwrap();
                let codes = text.split(['`', '\n']).filter(|code| code.starts_with("plumb-lab "));
                for code in codes.map(|code| code.split(" #").next().unwrap_or_default()) {
                    let words = code.split_whitespace();
                    let words = words.map(|word| if word == "NAME" { "taut" } else { word });
                    let parsed = Lab::try_parse_from(words).map(drop);
                    assert!(parsed.is_ok() || code.ends_with("--help"), "{code}");
                    count += 1;
                }
            }
        }
        assert!(count > 20, "{count}");
    }
}
