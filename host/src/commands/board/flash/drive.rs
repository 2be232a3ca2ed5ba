//! The drive of the boot ROM's bootloader: where it is mounted, and a file written to it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use plumb_image::uf2::BLOCK;

/// File that the boot ROM shows on its drive.
const INFO: &str = "INFO_UF2.TXT";
/// Line of that file which names the RP2040; an RP2350 has another one.
const BOARD: &str = "Board-ID: RPI-RP2";
/// Bytes between two reports of the progress, each of which is on the drive when it is reported.
const STEP: usize = 32 * BLOCK;

/// Places where drives are looked for.
pub(super) struct DriveSearch {
    /// Table of the mounted file systems.
    pub(super) mounts: PathBuf,
    /// Device file of the drive, by its label.
    pub(super) device: PathBuf,
}

/// The drives of boards in their bootloader.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Drives {
    /// Folders where they are mounted.
    pub(super) mounted: Vec<PathBuf>,
    /// Device file of one, where there is such a drive.
    pub(super) device: Option<PathBuf>,
}

impl DriveSearch {
    /// Returns the places of a Linux system.
    pub(super) fn linux() -> Self {
        Self { mounts: "/proc/mounts".into(), device: "/dev/disk/by-label/RPI-RP2".into() }
    }

    /// Returns the drives that are there now. A mounted drive counts if its file [`INFO`] names the
    /// chip.
    ///
    /// # Errors
    /// Where the table of mounts cannot be read.
    pub(super) fn find(&self) -> io::Result<Drives> {
        let table = fs::read_to_string(&self.mounts)?;
        let mounted =
            table.lines().filter_map(mount_point).filter(|path| is_rp2040(path)).collect();
        let device = self.device.exists().then(|| self.device.clone());
        Ok(Drives { mounted, device })
    }
}

/// Returns the folder of a line of the table of mounts, where it is a FAT file system.
fn mount_point(line: &str) -> Option<PathBuf> {
    let mut fields = line.split(' ').skip(1);
    let (folder, kind) = (fields.next()?, fields.next()?);
    // The table writes these characters in octal (proc_pid_mounts(5), fstab(5)).
    let folder = folder.replace("\\040", " ").replace("\\011", "\t").replace("\\134", "\\");
    matches!(kind, "vfat" | "msdos").then(|| folder.into())
}

/// Returns whether the drive at `folder` belongs to an RP2040 in its bootloader.
fn is_rp2040(folder: &Path) -> bool {
    fs::read_to_string(folder.join(INFO)).is_ok_and(|text| text.lines().any(|line| line == BOARD))
}

/// End of a write.
#[derive(Debug)]
pub(super) enum Written {
    /// The drive has confirmed every byte.
    Confirmed,
    /// The drive went away after the last byte was handed over: the boot ROM restarts the chip as
    /// soon as it has every block.
    Gone(io::Error),
}

/// Writes `firmware` to the drive at `folder`, and reports the bytes written so far.
///
/// # Errors
/// Where the drive refuses the file or goes away before the last byte.
pub(super) fn write(
    folder: &Path,
    firmware: &[u8],
    mut progress: impl FnMut(usize),
) -> io::Result<Written> {
    let mut file = File::create(folder.join("plumb.uf2"))?;
    let mut done = 0;
    for part in firmware.chunks(STEP) {
        file.write_all(part)?;
        done += part.len();
        match file.sync_data() {
            Err(error) if done == firmware.len() && is_gone(&error) => {
                return Ok(Written::Gone(error));
            }
            synced => synced?,
        }
        progress(done);
    }
    Ok(Written::Confirmed)
}

/// Returns whether the device behind a file is gone, rather than full or read-only.
fn is_gone(error: &io::Error) -> bool {
    use io::ErrorKind::{PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
    !matches!(error.kind(), PermissionDenied | QuotaExceeded | ReadOnlyFilesystem | StorageFull)
}
