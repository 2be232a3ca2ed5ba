//! `plumb report`: one file about a rig, to attach to a question.
//!
//! ```text
//! program, computer, board, rig file, run -> parts -> .tar.gz
//! ```

mod parts;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use clap::Parser;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::json;
use tar::{Builder, Header};

use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::old_file::write_beside_former;
use crate::cli::port_args::PortArgs;
use crate::cli::print;
use crate::cli::rig_path::RigArg;
use parts::{Part, Parts};

/// Write one file to attach to a question: versions, board, rig file, camera file, the last run
///
/// The files are in it as they are: paths may have the name of a user, and the first and the last
/// picture of the run show the room. Nothing moves, and nothing is sent: the command prints what is
/// in the file. What is missing is named there and in it, with the reason.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb report",
    "plumb report --run runs/run-0007 --out question.tar.gz",
])]
pub(crate) struct Args {
    #[command(flatten)]
    rig: RigArg,
    #[command(flatten)]
    port: PortArgs,
    /// Folder of a run [default: the newest one in runs]
    #[arg(long, value_name = "FOLDER")]
    run: Option<PathBuf>,
    /// Results of `plumb board selftest` [default: plumb-selftest.json, where there is one]
    #[arg(long, value_name = "FILE")]
    selftest: Option<PathBuf>,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "plumb-report.tar.gz")]
    out: PathBuf,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    check_replaceable(&args.out)?;
    let mut parts = Parts::default();
    let rig = args.rig.found();
    parts.add_board(&args.port, rig.as_deref());
    parts.add_selftest(args.selftest.as_deref())?;
    parts.add_cameras()?;
    parts.add_rig(rig.as_deref())?;
    parts.add_run(args.run.as_deref())?;
    for missing in parts.missing() {
        note!("missing: {missing}");
    }
    let parts = parts.finish();
    Ok(Box::new(move || {
        let packed = pack(&parts)?;
        let former = write_beside_former(&args.out, &packed)?;
        let file = args.out.display();
        note!("{file} contains these files as they are:");
        for part in &parts {
            note!("{:>9} bytes  {}: {}", part.bytes.len(), part.name, part.content);
        }
        if let Some(former) = former {
            note!("The former report is now {}", former.display());
        }
        note!("Look into it before you send it: tar xzf {file}");
        let names: Vec<_> = parts.iter().map(|part| &part.name).collect();
        let line = json!({ "report": args.out, "bytes": packed.len(), "parts": names });
        print::json(args.json, line)?;
        Ok(Exit::Done)
    }))
}

/// Folder of the parts in the archive.
const FOLDER: &str = "plumb-report";

/// First bytes of a file that is compressed with gzip (RFC 1952, section 2.3.1).
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Checks that a report can take the place of what is at `path`: nothing, or a former report.
///
/// # Errors
/// Where another file or a folder is there.
fn check_replaceable(path: &Path) -> Result<(), Failure> {
    if path.is_dir() {
        return Err(failed(format!("{}: is a folder; name a file", path.display())));
    }
    if path.exists() && !is_gzip(path) {
        let why = "exists already and is no report; give another name, or move it away";
        return Err(failed(format!("{}: {why}", path.display())));
    }
    Ok(())
}

/// Returns whether a file begins as one that is compressed with gzip.
fn is_gzip(path: &Path) -> bool {
    let mut begin = [0; GZIP.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut begin));
    read.is_ok() && begin == GZIP
}

/// Returns the archive of some parts.
///
/// # Errors
/// Where a name is too long for the format.
fn pack(parts: &[Part]) -> io::Result<Vec<u8>> {
    let mut archive = Builder::new(GzEncoder::new(Vec::new(), Compression::default()));
    for part in parts {
        let mut header = Header::new_ustar();
        header.set_size(part.bytes.len() as u64);
        header.set_mode(0o644);
        header.set_uid(0);
        header.set_gid(0);
        header.set_mtime(0);
        archive.append_data(
            &mut header,
            format!("{FOLDER}/{}", part.name),
            part.bytes.as_slice(),
        )?;
    }
    archive.into_inner()?.finish()
}
