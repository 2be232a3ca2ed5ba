//! `plumb report`: one file about a rig, to attach to a question.
//!
//! ```text
//! program, computer, board, rig file, run -> parts -> .tar.gz
//! ```

mod archive;
mod parts;

use std::path::PathBuf;

use clap::Parser;
use serde_json::json;

use crate::cli::exit::{Exit, Failure, Work};
use crate::cli::old_file::write_beside_former;
use crate::cli::port_args::PortArgs;
use crate::cli::print;
use crate::cli::rig_path::RigArg;
use parts::Parts;

/// Write one file to attach to a question: versions, board, rig file, camera file, the last run
///
/// The files are in it as they are: paths may have the name of a user, and the first and the last
/// picture of the run show the room. Nothing moves, and nothing is sent: the command prints what is
/// in the file. What is missing is named there and in it, with the reason.
#[derive(Parser)]
#[command(
    after_help = examples![
        "plumb report",
        "plumb report --run runs/run-0007 --out question.tar.gz",
    ]
)]
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
    archive::check_replaceable(&args.out)?;
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
        let packed = archive::pack(&parts)?;
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
