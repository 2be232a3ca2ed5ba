//! Flashes with folders as drives, and a fake of the ports.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::error::Error;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::Duration;

use plumb_image::chip::{self, Chip};
use plumb_image::uf2;
use plumb_protocol::Provenance;
use plumb_protocol::message::StartCause;
use plumb_runtime::link::LinkError;
use plumb_runtime::rig::BoardPort;
use tempfile::TempDir;

use super::default_firmware;
use super::drive::{self, DriveSearch, Drives, Written};
use super::steps::{Computer, FlashError, Flashed, Greeting, choose, flash};

const GREETING: Greeting =
    Greeting { provenance: Provenance::EMULATED, start: Some(StartCause::Requested) };
const PORT: &str = "/dev/ttyACM0";
/// Texts that boot ROMs show on their drives.
const RP2040: &str = "UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: RPI-RP2\n";
const RP2350: &str = "UF2 Bootloader v1.0\nModel: Raspberry Pi RP2350\nBoard-ID: RP2350\n";

/// A computer whose boards and drives are set by a test.
struct Fake {
    folder: TempDir,
    chip: &'static Chip,
    boards: Vec<String>,
    /// Another name of [`PORT`], until the board is restarted.
    alias: Option<&'static str>,
    now: Duration,
    /// Name of the drive that comes 2 s after a board has gone into its bootloader.
    drive: Option<&'static str>,
    drive_at: Option<Duration>,
    /// Error of a write, instead of a write.
    write_error: Option<ErrorKind>,
    /// Port that the board has 2 s after it has its firmware.
    returns_at: Option<&'static str>,
    back_at: Option<Duration>,
    other_version: bool,
    reports: Vec<String>,
}

impl Fake {
    /// Returns a computer with these boards. A board that is restarted comes back to its port.
    fn new(boards: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("mounts"), "tmpfs /tmp tmpfs rw 0 0\n").unwrap();
        Self {
            folder,
            chip: &chip::RP2040,
            boards: boards.iter().map(|&port| port.to_owned()).collect(),
            alias: None,
            now: Duration::ZERO,
            drive: Some("RPI-RP2"),
            drive_at: None,
            write_error: None,
            returns_at: Some(PORT),
            back_at: None,
            other_version: false,
            reports: Vec::new(),
        }
    }

    fn search(&self) -> DriveSearch {
        let path = self.folder.path();
        DriveSearch { mounts: path.join("mounts"), device: path.join("device"), chip: self.chip }
    }

    /// Mounts a drive with this content of INFO_UF2.TXT.
    fn mount(&self, name: &str, kind: &str, info: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("INFO_UF2.TXT"), info).unwrap();
        let table = self.folder.path().join("mounts");
        let written = path.display().to_string().replace(' ', "\\040");
        let line = format!("/dev/sdb1 {written} {kind} rw,nosuid 0 0\n");
        fs::write(&table, fs::read_to_string(&table).unwrap() + &line).unwrap();
        path
    }

    fn flash(&mut self, named: Option<&str>) -> Result<Flashed, FlashError> {
        let named = named.map(|port| self.board_at(port.to_owned()));
        flash(&firmware(), choose(named, self)?, self)
    }
}

/// Firmware of 40 kB.
fn firmware() -> Vec<u8> {
    uf2::file(&chip::RP2040, &[0x5a; 20_000])
}

impl Computer for Fake {
    fn boards(&mut self) -> Result<Vec<String>, LinkError> {
        if self.back_at.is_some_and(|back| self.now >= back)
            && let Some(port) = self.returns_at.take()
        {
            self.boards.push(port.to_owned());
        }
        Ok(self.boards.clone())
    }

    fn board_at(&self, port: String) -> BoardPort {
        BoardPort { port, baud: 115_200 }
    }

    fn has_port(&mut self, port: &str) -> bool {
        self.alias == Some(port) || self.boards.iter().any(|board| board == port)
    }

    fn enter_bootloader(&mut self, board: &BoardPort) -> Result<(), LinkError> {
        let alias = self.alias.take_if(|alias| *alias == board.port);
        let port = alias.map_or(&*board.port, |_| PORT);
        self.boards.retain(|other| other != port);
        self.drive_at = Some(self.now + Duration::from_secs(2));
        Ok(())
    }

    fn drives(&mut self) -> io::Result<Drives> {
        if self.drive_at.is_some_and(|at| self.now >= at)
            && let Some(name) = self.drive.take()
        {
            self.mount(name, "vfat", RP2040);
        }
        self.search().find()
    }

    fn write(&mut self, folder: &Path, firmware: &[u8]) -> io::Result<Written> {
        if let Some(kind) = self.write_error {
            return Err(kind.into());
        }
        self.back_at = Some(self.now + Duration::from_secs(2));
        drive::write(folder, firmware, |_| ())
    }

    fn greet(&mut self, _: &BoardPort) -> Result<Greeting, LinkError> {
        if self.other_version {
            return Err(LinkError::Version { port: PORT.to_owned(), runs: "another".to_owned() });
        }
        Ok(GREETING)
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn wait(&mut self, duration: Duration) {
        self.now += duration;
    }

    fn report(&mut self, text: &str) {
        self.reports.push(text.to_owned());
    }
}

/// Returns the message of a flash that failed, and checks that nothing is written to `drive`.
fn refused(flashed: Result<Flashed, FlashError>, drive: Option<&Path>) -> String {
    let error = flashed.unwrap_err();
    if let Some(drive) = drive {
        assert!(!drive.join("plumb.uf2").exists(), "{error}");
    }
    error.to_string()
}

#[test]
fn the_board_on_usb_gets_the_firmware_and_comes_back() {
    let mut computer = Fake::new(&[PORT]);
    let flashed = computer.flash(None).unwrap();
    assert_eq!((&*flashed.board.port, flashed.greeting), (PORT, GREETING));
    let drive = computer.folder.path().join("RPI-RP2");
    assert_eq!(fs::read(drive.join("plumb.uf2")).unwrap(), firmware());
    assert_eq!(computer.reports.len(), 3, "{:?}", computer.reports);
}

#[test]
fn a_board_may_come_back_at_another_port() {
    let mut computer = Fake::new(&[PORT, "/dev/ttyACM1"]);
    computer.returns_at = Some("/dev/ttyACM2");
    let flashed = computer.flash(Some(PORT)).unwrap();
    assert_eq!(flashed.board.port, "/dev/ttyACM2");
}

/// The name by the serial number is another one after a firmware that has none.
#[test]
fn a_board_may_come_back_without_the_name_that_it_had() {
    let mut computer = Fake::new(&[PORT, "/dev/ttyACM1"]);
    computer.alias = Some("/dev/serial/by-id/board");
    let flashed = computer.flash(Some("/dev/serial/by-id/board")).unwrap();
    assert_eq!(flashed.board.port, PORT);
}

#[test]
fn a_pico_in_its_bootloader_needs_no_port() {
    // Also beside a board that runs, and where a rig file names a port that has gone.
    for (boards, named) in [(vec![], None), (vec!["/dev/ttyACM7"], None), (vec![], Some(PORT))] {
        let mut computer = Fake::new(&boards);
        let drive = computer.mount("a drive", "vfat", RP2040);
        let flashed = computer.flash(named).unwrap();
        assert_eq!(flashed.board.port, PORT);
        assert_eq!(fs::read(drive.join("plumb.uf2")).unwrap(), firmware());
    }
}

#[test]
fn only_the_drive_of_the_chip_is_written() {
    let mut computer = Fake::new(&[PORT]);
    computer.drive = None;
    let drives = [
        computer.mount("PICO2", "vfat", RP2350),
        computer.mount("copy", "ext4", RP2040),
        computer.mount("stick", "vfat", "Board-ID: other\n"),
    ];
    let message = computer.flash(None).unwrap_err().to_string();
    assert!(message.contains("no drive for this firmware has come within 15 s"), "{message}");
    assert!(drives.iter().all(|drive| !drive.join("plumb.uf2").exists()));
    // The drive of a Pico 2 is that of its own firmware.
    let mut computer = Fake::new(&[]);
    computer.chip = &chip::RP2350;
    let pico = computer.mount("pico", "vfat", RP2040);
    let pico_2 = computer.mount("pico 2", "vfat", RP2350);
    computer.flash(None).unwrap();
    assert!(pico_2.join("plumb.uf2").exists() && !pico.join("plumb.uf2").exists());
}

#[test]
fn a_drive_that_is_not_mounted_is_named_with_the_way_to_mount_it() {
    let mut computer = Fake::new(&[]);
    fs::write(computer.folder.path().join("device"), "").unwrap();
    let message = computer.flash(None).unwrap_err().to_string();
    let device = computer.folder.path().join("device");
    assert!(message.contains(&format!("udisksctl mount -b {}", device.display())), "{message}");
}

#[test]
fn without_a_board_nothing_is_chosen() {
    assert!(refused(Fake::new(&[]).flash(None), None).contains("hold BOOTSEL"));
    let message = refused(Fake::new(&[]).flash(Some(PORT)), None);
    assert!(message.starts_with("/dev/ttyACM0: there is no such serial port, and"), "{message}");
    assert!(message.contains("hold BOOTSEL"), "{message}");
    let message = refused(Fake::new(&[]).flash(Some("ttyACM0")), None);
    assert!(message.ends_with("write /dev/ttyACM0"), "{message}");
    let message = refused(Fake::new(&[PORT, "/dev/ttyACM1"]).flash(None), None);
    assert!(message.contains("choose one with --port: /dev/ttyACM0, /dev/ttyACM1"), "{message}");
}

#[test]
fn of_several_picos_none_is_chosen() {
    let mut computer = Fake::new(&[]);
    let drives = ["one", "two"].map(|name| computer.mount(name, "vfat", RP2040));
    let message = refused(computer.flash(None), Some(&drives[0]));
    assert!(message.contains("unplug all but one"), "{message}");
    assert!(!drives[1].join("plumb.uf2").exists());

    let mut computer = Fake::new(&[PORT]);
    let drive = computer.mount("one", "vfat", RP2040);
    let message = refused(computer.flash(Some(PORT)), Some(&drive));
    assert!(message.contains("another Pico"), "{message}");
    assert_eq!(computer.boards, [PORT], "the board still runs");
}

#[test]
fn a_drive_that_refuses_the_file_says_what_to_do() {
    for (kind, words) in [
        (ErrorKind::ReadOnlyFilesystem, "read-only"),
        (ErrorKind::PermissionDenied, "udisksctl mount"),
        (ErrorKind::StorageFull, "no room"),
        (ErrorKind::Other, "another cable"),
    ] {
        let mut computer = Fake::new(&[PORT]);
        computer.write_error = Some(kind);
        let error = computer.flash(None).unwrap_err();
        assert!(error.to_string().contains(words), "{kind}: {error}");
        assert!(error.source().is_some(), "{kind}");
    }
}

#[test]
fn a_full_drive_is_an_error_of_the_write() {
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink("/dev/full", folder.path().join("plumb.uf2")).unwrap();
    let error = drive::write(folder.path(), &firmware(), |_| ()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::StorageFull);
    let error = drive::write(&folder.path().join("absent"), &firmware(), |_| ()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotFound);
}

#[test]
fn the_progress_grows_to_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut progress = Vec::new();
    let written = drive::write(folder.path(), &firmware(), |done| progress.push(done)).unwrap();
    assert!(matches!(written, Written::Confirmed));
    assert!(progress.len() > 2 && progress.is_sorted(), "{progress:?}");
    assert_eq!(progress.last(), Some(&firmware().len()));
}

#[test]
fn a_board_that_does_not_come_back_or_speaks_another_version_is_a_failure() {
    let mut computer = Fake::new(&[PORT]);
    computer.returns_at = None;
    let message = refused(computer.flash(None), None);
    assert!(message.contains("is written, but no board has answered within 20 s"), "{message}");

    let mut computer = Fake::new(&[PORT]);
    computer.other_version = true;
    let message = refused(computer.flash(None), None);
    assert!(message.contains("runs another, which this program"), "{message}");
}

#[test]
fn the_firmware_of_the_package_is_taken_first() {
    let prefix = tempfile::tempdir().unwrap();
    let program = prefix.path().join("bin/plumb");
    for (chip, name) in [(&chip::RP2040, "plumb.uf2"), (&chip::RP2350, "plumb-pico2.uf2")] {
        let packaged = prefix.path().join("share/plumb/firmware").join(name);
        assert_ne!(default_firmware(chip, &program).ok(), Some(packaged.clone()));
        fs::create_dir_all(packaged.parent().unwrap()).unwrap();
        fs::write(&packaged, firmware()).unwrap();
        assert_eq!(default_firmware(chip, &program).ok(), Some(packaged));
    }
}
