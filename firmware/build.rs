//! Hands the linker the chip's memory and the order of things in it.

use std::path::PathBuf;
use std::{env, fs, io};

const SECTIONS: &str = "sections.x";

fn main() -> io::Result<()> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    let is_rp2350 = env::var_os("CARGO_FEATURE_RP2350").is_some();
    let memory = if is_rp2350 { "memory-rp2350.x" } else { "memory-rp2040.x" };
    let script = [fs::read_to_string(memory)?, fs::read_to_string(SECTIONS)?].join("\n");
    fs::write(out.join("memory.x"), script)?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rerun-if-changed={memory}");
    println!("cargo:rerun-if-changed={SECTIONS}");
    // For the chip only: the crate can also be checked, though not run, on a host.
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        // The second boot stage is the RP2040's alone.
        let boot = (!is_rp2350).then_some("-Tlink-rp.x");
        for argument in ["--nmagic", "-Tlink.x"].into_iter().chain(boot) {
            println!("cargo:rustc-link-arg-bins={argument}");
        }
    }
    Ok(())
}
