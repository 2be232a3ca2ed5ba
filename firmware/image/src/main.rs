//! Writes a UF2 file from a linked firmware and prints its sizes with their budgets.
//!
//! Usage: `plumb-image ELF UF2`. Exit codes: 0, the file is written; 1, a size is over its budget
//! and nothing is written; 2, a file cannot be read or written, or is not a firmware.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs, io, iter};

use plumb_image::{Image, ImageError, Usage, budget, image, uf2};
use thiserror::Error;

#[derive(Debug, Error)]
enum Failure {
    #[error("usage: plumb-image ELF UF2")]
    Usage,
    #[error("{}", path.display())]
    File { path: PathBuf, source: io::Error },
    #[error("{}", path.display())]
    Image { path: PathBuf, source: ImageError },
}

/// Writes the UF2 file if all sizes are within their budgets. Returns whether they are.
fn convert(elf: &Path, uf2: &Path) -> Result<bool, Failure> {
    let file = |path: &Path| {
        let path = path.to_owned();
        |source| Failure::File { path, source }
    };
    let bytes = fs::read(elf).map_err(file(elf))?;
    let image =
        Image::read(&bytes).map_err(|source| Failure::Image { path: elf.to_owned(), source })?;
    let usage = Usage::new(&image, budget::PICO);
    println!("{usage}");
    if usage.within() {
        fs::write(uf2, uf2::file(image::FLASH.start, &image.flash)).map_err(file(uf2))?;
    }
    Ok(usage.within())
}

/// Returns the messages of `error` and of its causes, joined by ": ".
fn chain(error: &dyn Error) -> String {
    let causes = iter::successors(Some(error), |&error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let result = match arguments.as_slice() {
        [elf, uf2] => convert(elf, uf2),
        _ => Err(Failure::Usage),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(failure) => {
            eprintln!("plumb-image: {}", chain(&failure));
            ExitCode::from(2)
        }
    }
}
