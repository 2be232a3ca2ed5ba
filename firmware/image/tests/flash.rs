//! Tests of `scripts/flash` with tools that only record their arguments.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A tool that records its arguments.
const TOOL: &str = r#"#!/bin/sh
echo "$(basename "$0") $*" >>"$FLASH_LOG"
"#;

/// Runs `scripts/flash` by `way`, and returns the calls of the tools if it succeeds.
fn flash(way: &str) -> Option<Vec<String>> {
    flash_board("pico", way)
}

/// The same for a kind of board.
fn flash_board(board: &str, way: &str) -> Option<Vec<String>> {
    let folder: PathBuf =
        std::env::temp_dir().join(format!("plumb-flash-{board}-{way}-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    for tool in ["plumb", "picotool", "probe-rs"] {
        let path = folder.join(tool);
        fs::write(&path, TOOL).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }
    let log = folder.join("log");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scripts/flash");
    let output = Command::new(script)
        .arg(way)
        .env("BOARD", board)
        .env("PATH", format!("{}:/usr/bin:/bin", folder.display()))
        .env("FLASH_LOG", &log)
        .output()
        .unwrap();
    let calls = fs::read_to_string(&log).unwrap_or_default();
    fs::remove_dir_all(&folder).unwrap();
    output.status.success().then(|| calls.lines().map(str::to_owned).collect())
}

#[test]
fn the_drive_is_written_by_plumb_where_it_is_built() {
    assert_eq!(flash("uf2").unwrap(), ["plumb board flash target/firmware/plumb.uf2"]);
}

#[test]
fn picotool_restarts_a_board_that_runs() {
    assert_eq!(flash("picotool").unwrap(), ["picotool load -f -x target/firmware/plumb.uf2"]);
}

/// `probe-rs run` stays attached until it is interrupted; `download` leaves the processor halted.
#[test]
fn probe_rs_writes_and_starts_the_program_and_ends() {
    let image = "target/firmware/plumb.elf";
    let expected =
        [format!("probe-rs download --chip RP2040 {image}"), "probe-rs reset --chip RP2040".into()];
    assert_eq!(flash("probe-rs").unwrap(), expected);
}

#[test]
fn a_pico_2_gets_its_own_firmware() {
    let image = "target/firmware/plumb-pico2";
    assert_eq!(flash_board("pico2", "uf2").unwrap(), [format!("plumb board flash {image}.uf2")]);
    let expected = [
        format!("probe-rs download --chip RP235x {image}.elf"),
        "probe-rs reset --chip RP235x".into(),
    ];
    assert_eq!(flash_board("pico2", "probe-rs").unwrap(), expected);
}
