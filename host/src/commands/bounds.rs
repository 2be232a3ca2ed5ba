//! `plumb bounds`: what holds for every rig of a kind.

use std::process::ExitCode;

use clap::Parser;
use plumb::bounds::{Descent, Interval, Rigs, jacobian_bounds, nonsingular, sign_descent};
use serde::Serialize;

use super::{FAILED, Failure, OrFail};

/// α, β, robust non-singularity and descent of the law of signs from rough geometry, rounded outwards
///
/// Without options: the paper's rig with λ >= 0.023, from 0.1 m below the motors to the floor. Ranges are LOW,HIGH in
/// metres; a rig is D = yA - yB, W = xA - xC, t = (yC - yB)/D, and the ball is at barycentric λ and h below the motors.
/// Exit code 1 where descent is not proved.
#[derive(Parser)]
pub(crate) struct Args {
    /// D
    #[arg(long, value_parser = range)]
    depth: Option<Interval>,
    /// W
    #[arg(long, value_parser = range)]
    width: Option<Interval>,
    /// t, within 0,1
    #[arg(long, value_parser = range)]
    apex: Option<Interval>,
    /// The least λ, 0 to 0.33
    #[arg(long)]
    lambda: Option<f64>,
    /// h
    #[arg(long, value_parser = range)]
    below: Option<Interval>,
    /// The box of docs/control.md: D, W 0.5-1.5 m, t 0-1, the closed triangle, h 0.1-1 m
    #[arg(long)]
    wide: bool,
    /// Cells after which descent is left open
    #[arg(long, default_value_t = 20_000_000)]
    cells: usize,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

fn range(text: &str) -> Result<Interval, String> {
    let numbers: Vec<f64> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match numbers[..] {
        [lo, hi] if lo <= hi && lo >= 0.0 && hi <= 100.0 => Ok(Interval::new(lo, hi)),
        _ => Err("two numbers, LOW,HIGH, from 0 to 100".to_owned()),
    }
}

/// What was found.
#[derive(Serialize)]
struct Line {
    depth: [f64; 2],
    width: [f64; 2],
    apex: [f64; 2],
    least_lambda: f64,
    below: [f64; 2],
    alpha: f64,
    beta: f64,
    ratio: Option<f64>,
    nonsingular: bool,
    sign_descends: Option<bool>,
    cells: usize,
}

fn rigs(args: &Args) -> Result<Rigs, Failure> {
    let base = if args.wide { Rigs::wide(0.1) } else { Rigs::paper(0.023) };
    let rigs = Rigs {
        depth: args.depth.unwrap_or(base.depth),
        width: args.width.unwrap_or(base.width),
        apex: args.apex.unwrap_or(base.apex),
        least_lambda: args.lambda.unwrap_or(base.least_lambda),
        below: args.below.unwrap_or(base.below),
    };
    let positive = [rigs.depth, rigs.width, rigs.below].iter().all(|side| side.lo > 0.0);
    if !positive || rigs.apex.hi > 1.0 || !(0.0..=0.33).contains(&rigs.least_lambda) {
        return Err("D, W and h must be above 0, t within 0,1 and λ from 0 to 0.33").or_bad_input();
    }
    Ok(rigs)
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Failure> {
    let rigs = rigs(&args)?;
    let (alpha, beta) = jacobian_bounds(&rigs);
    let (plus, minus) = (Interval::new(alpha, beta), Interval::new(-beta, -alpha));
    let sure = nonsingular(&[[minus, minus, plus], [minus, plus, Interval::point(0.0)], [minus; 3]]);
    eprintln!("|dp/du| is within α = {alpha:.4} and β = {beta:.4}: β/α = {:.1}", beta / alpha);
    eprintln!("no Jacobian of that family is singular: {}", if sure { "proved" } else { "not so" });
    let descent = sign_descent(&rigs, args.cells);
    let (descends, cells, words) = match descent {
        Descent::Holds(cells) => (Some(true), cells, "proved"),
        Descent::Fails(cells) => (Some(false), cells, "false"),
        Descent::Open(cells) => (None, cells, "open"),
    };
    eprintln!("the law of signs lets |e| fall on every one of these rigs: {words} ({cells} cells)");
    if args.json {
        let ends = |side: Interval| [side.lo, side.hi];
        let line = Line {
            depth: ends(rigs.depth),
            width: ends(rigs.width),
            apex: ends(rigs.apex),
            least_lambda: rigs.least_lambda,
            below: ends(rigs.below),
            alpha,
            beta,
            ratio: (alpha > 0.0).then(|| beta / alpha),
            nonsingular: sure,
            sign_descends: descends,
            cells,
        };
        println!("{}", serde_json::to_string(&line).or_failed()?);
    }
    Ok(if descends == Some(true) { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
