//! The real firmware in the emulated chip, on a pseudo-terminal, in real time: for `plumb goto` and
//! other programs that connect to a board. The emergency loop is closed.
//!
//! Usage: `chip-terminal FIRMWARE.elf`. Prints the terminal's path and runs until it is stopped.

#![allow(
    clippy::expect_used,
    reason = "a tool for tests: it stops at the first surprise and names it"
)]

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use plumb_emulator::Terminal;
use plumb_tests::chip::EMERGENCY;

/// Sleep of the loop, which adds to the link's latency.
const POLL_INTERVAL: Duration = Duration::from_micros(500);

fn main() {
    let image = std::env::args_os().nth(1).expect("usage: chip-terminal FIRMWARE.elf");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("chip/serve.mjs");
    let mut chip = Command::new("node")
        .arg(script)
        .args(["--bytes", "usb", "--first", &format!(r#"{{"gpio":[{EMERGENCY},0]}}"#)])
        .arg(image)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Node runs the emulated chip (scripts/chip makes it ready)");
    let mut to_chip = chip.stdin.take().expect("its standard input");
    let mut from_chip = chip.stdout.take().expect("its standard output");
    let (sender, receiver) = mpsc::channel::<Vec<u8>>();
    thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = from_chip.read(&mut buffer) {
            if sender.send(buffer[..count].to_vec()).is_err() {
                return;
            }
        }
    });

    let mut terminal = Terminal::open().expect("a pseudo-terminal");
    println!("{}", terminal.path().display());
    let mut buffer = [0; 4096];
    while chip.try_wait().expect("the chip's process").is_none() {
        let count = terminal.read(&mut buffer).expect("the pseudo-terminal");
        if count > 0 {
            to_chip
                .write_all(&buffer[..count])
                .and_then(|()| to_chip.flush())
                .expect("the chip takes bytes");
        }
        for bytes in receiver.try_iter() {
            terminal.write(&bytes).expect("the pseudo-terminal");
        }
        thread::sleep(POLL_INTERVAL);
    }
}
