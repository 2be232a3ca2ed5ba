//! The drive of the boot ROM's bootloader: where it is mounted, and a file written to it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use plumb_image::chip::Chip;
use plumb_image::uf2::BLOCK;

/// File that the boot ROM shows on its drive.
const INFO: &str = "INFO_UF2.TXT";
/// Beginning of the line of that file which names the chip.
const BOARD: &str = "Board-ID: ";
/// Bytes between two reports of the progress, each of which is on the drive when it is reported.
const STEP: usize = 32 * BLOCK;

/// Places where drives are looked for.
pub(super) struct DriveSearch {
    /// Table of the mounted file systems.
    pub(super) mounts: PathBuf,
    /// Device file of the drive, by its label.
    pub(super) device: PathBuf,
    /// Chip of the board.
    pub(super) chip: &'static Chip,
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
    /// Returns the places of a Linux system, for boards with this chip.
    pub(super) fn linux(chip: &'static Chip) -> Self {
        let device = Path::new("/dev/disk/by-label").join(chip.drive);
        Self { mounts: "/proc/mounts".into(), device, chip }
    }

    /// Returns the drives that are there now. A mounted drive counts if its file [`INFO`] names the
    /// chip.
    ///
    /// # Errors
    /// Where the table of mounts cannot be read.
    pub(super) fn find(&self) -> io::Result<Drives> {
        let table = fs::read_to_string(&self.mounts)?;
        let mounted = table.lines().filter_map(mount_point);
        let mounted = mounted.filter(|path| has_chip(path, self.chip)).collect();
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

/// Returns whether the drive at `folder` belongs to such a chip in its bootloader.
fn has_chip(folder: &Path, chip: &Chip) -> bool {
    let names = |line: &str| line.strip_prefix(BOARD) == Some(chip.drive);
    fs::read_to_string(folder.join(INFO)).is_ok_and(|text| text.lines().any(names))
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
