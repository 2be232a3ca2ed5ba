//! The option `--page`: addresses that cannot be used, and what the program prints.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};

use crate::common::{folder, page_address, plumb, stderr};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

#[test]
fn an_address_that_cannot_be_used_is_bad_input_and_nothing_moves() {
    let folder = folder();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let busy = format!("--page-address={}", taken.local_addr().unwrap());
    let output = plumb(&["demo", "--page", &busy, "--out", "run"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("choose another port, or 0"), "{}", stderr(&output));
    assert!(!folder.path().join("run").exists(), "the run did not begin");
    for options in [
        &["--page", "--page-address=here"][..],
        &["--page-address=7811"],
        &["--page", "--virtual-time"],
        &["--page", "--compare"],
    ] {
        let output = plumb(&[&["demo"], options].concat(), folder.path());
        assert_eq!(output.status.code(), Some(2), "{options:?}");
    }
}

#[test]
fn the_address_is_printed_and_serves_until_ctrl_c() {
    let folder = folder();
    let mut demo = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["demo", "--page", "--page-address=127.0.0.1:0", "--out", "run"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(demo.stderr.take().unwrap()).lines().map(Result::unwrap);
    let address = &page_address(&mut lines);
    let mut page = TcpStream::connect(address).unwrap();
    page.write_all(format!("GET / HTTP/1.1\r\nHost: {address}\r\n\r\n").as_bytes()).unwrap();
    let mut reply = String::new();
    page.read_to_string(&mut reply).unwrap();
    assert!(reply.starts_with("HTTP/1.1 200 OK"), "{reply}");
    kill(Pid::from_raw(demo.id() as i32), Signal::SIGINT).unwrap();
    let rest: Vec<String> = lines.collect();
    assert!(rest.iter().any(|line| line.starts_with("interrupted")), "{rest:?}");
    demo.wait().unwrap();
    assert!(TcpStream::connect(address).is_err(), "the page has ended");
    assert!(folder.path().join("run/summary.json").exists());
}
