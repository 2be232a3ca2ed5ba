//! `plumb demo`: the paper's task, closed loop, without any hardware.

mod compare;
mod task;

use plumb_log::LawCurve;

use crate::cli::exit::{Failure, Work};
use crate::cli::interrupt::interrupt_flag;
use crate::cli::print;
use task::{Demo, chosen};

pub(crate) use task::Args;

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    if args.compare {
        return compare::prepare(args);
    }
    let law = chosen(&args)?;
    let mut curve = LawCurve::new(law.title());
    let demo = Demo::prepare(&args, law, args.options.output_dir("demo"))?;
    Ok(Box::new(move || {
        let interrupted = interrupt_flag(true)?;
        demo.drive(&args, &interrupted, (&mut curve, &mut |line| Ok(print::result(line)?)))
    }))
}
