//! Tests of `scripts/flash` with tools that only record their arguments.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A tool that records its arguments. `picotool` fails while no board is in its bootloader, where
/// `plumb board bootloader` brings it.
const TOOL: &str = r#"#!/bin/sh
echo "$(basename "$0") $*" >>"$FLASH_LOG"
case $(basename "$0") in
  plumb) touch "$FLASH_LOG.bootloader" ;;
  picotool) [ -e "$FLASH_LOG.bootloader" ] ;;
esac
"#;

/// Runs `scripts/flash` by `way`, and returns the calls of the tools if it succeeds.
fn flash(way: &str) -> Option<Vec<String>> {
    let folder: PathBuf =
        std::env::temp_dir().join(format!("plumb-flash-{way}-{}", std::process::id()));
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
        .env("PATH", format!("{}:/usr/bin:/bin", folder.display()))
        .env("FLASH_LOG", &log)
        .output()
        .unwrap();
    let calls = fs::read_to_string(&log).unwrap_or_default();
    fs::remove_dir_all(&folder).unwrap();
    output.status.success().then(|| calls.lines().map(str::to_owned).collect())
}

/// The firmware has no reset interface of the Pico SDK, so that `picotool load -f` finds no board.
#[test]
fn picotool_gets_a_board_that_plumb_has_restarted() {
    let calls = flash("picotool").unwrap();
    let load = "picotool load -x target/firmware/plumb.uf2";
    assert_eq!(calls.first().unwrap(), load, "{calls:?}");
    assert_eq!(calls[1], "plumb board bootloader", "{calls:?}");
    assert_eq!(calls.last().unwrap(), load, "{calls:?}");
    assert!(calls.iter().all(|call| !call.contains(" -f")), "{calls:?}");
}

/// `probe-rs run` stays attached until it is interrupted; `download` leaves the processor halted.
#[test]
fn probe_rs_writes_and_starts_the_program_and_ends() {
    let image = "target/firmware/plumb.elf";
    let expected =
        [format!("probe-rs download --chip RP2040 {image}"), "probe-rs reset --chip RP2040".into()];
    assert_eq!(flash("probe-rs").unwrap(), expected);
}
