//! Writes a UF2 file from a linked firmware and prints its sizes with those in a record, or finds
//! the place of a panic that a board has reported.
//!
//! Usage: `plumb-image CHIP ELF UF2 RECORD`, `plumb-image --place NUMBER ELF`; CHIP is `rp2040` or
//! `rp2350`. Exit codes: 0, the file is written, or the place found; 1, the file is written and a
//! size is more than 2 % above its record, or the firmware has no such place; 2, a file cannot be
//! read or written, or is not a firmware or a record of one.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs, io, iter};

use plumb_image::chip::{Chip, RP2040, RP2350};
use plumb_image::{Image, ImageError, Sizes, Usage, panic_places, recorded, uf2};
use thiserror::Error;

#[derive(Debug, Error)]
enum Failure {
    #[error("usage: plumb-image rp2040|rp2350 ELF UF2 RECORD, or plumb-image --place NUMBER ELF")]
    Usage,
    #[error("{0}: not the number of a place, eight hexadecimal digits")]
    Number(String),
    #[error("{}", path.display())]
    File { path: PathBuf, source: io::Error },
    #[error("{}", path.display())]
    Image { path: PathBuf, source: ImageError },
    #[error("{}: has no line `{chip} FLASH RAM`", path.display())]
    Record { path: PathBuf, chip: String },
}

/// Returns the error about a file.
fn at(path: &Path) -> impl FnOnce(io::Error) -> Failure {
    let path = path.to_owned();
    |source| Failure::File { path, source }
}

fn read(elf: &Path, chip: &Chip) -> Result<Image, Failure> {
    let bytes = fs::read(elf).map_err(at(elf))?;
    Image::read(&bytes, chip).map_err(|source| Failure::Image { path: elf.to_owned(), source })
}

/// Writes the UF2 file. Returns whether no size has grown much since the record.
fn convert(name: &str, elf: &Path, uf2: &Path, record: &Path) -> Result<bool, Failure> {
    let chip = match name {
        "rp2040" => &RP2040,
        "rp2350" => &RP2350,
        _ => return Err(Failure::Usage),
    };
    let image = read(elf, chip)?;
    fs::write(uf2, uf2::file(chip, &image.flash)).map_err(at(uf2))?;
    let no_line = || Failure::Record { path: record.to_owned(), chip: name.to_owned() };
    let sizes = recorded(&fs::read_to_string(record).map_err(at(record))?, name);
    let usage = Usage::new(&image, sizes.ok_or_else(no_line)?);
    println!("{usage}");
    if usage.has_grown() {
        let Sizes { flash, ram } = image.used();
        eprintln!(
            "plumb-image: a size is more than 2 % above its record. Where that is meant, write \
             `{name} {flash} {ram}` into {}",
            record.display()
        );
    }
    Ok(!usage.has_grown())
}

/// Prints the place of a panic. Returns whether the firmware has it. The firmware of any chip is
/// read as that of the largest.
fn find_place(number: &str, elf: &Path) -> Result<bool, Failure> {
    let wanted = u32::from_str_radix(number, 16).map_err(|_| Failure::Number(number.to_owned()))?;
    let places = panic_places(&read(elf, &RP2350)?);
    let found = places.iter().find(|place| place.number() == wanted);
    match found {
        Some(place) => println!("{}:{}", place.file, place.line),
        None => eprintln!(
            "{}: none of its {} places has the number {number}: is it the firmware of the board?",
            elf.display(),
            places.len()
        ),
    }
    Ok(found.is_some())
}

/// Returns the messages of `error` and of its causes, joined by ": ".
fn chain(error: &dyn Error) -> String {
    let causes = iter::successors(Some(error), |&error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let result = match arguments.as_slice() {
        [option, number, elf] if option == "--place" => find_place(&number.to_string_lossy(), elf),
        [chip, elf, uf2, record] => convert(&chip.to_string_lossy(), elf, uf2, record),
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
