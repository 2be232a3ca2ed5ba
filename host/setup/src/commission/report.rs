//! Result of an examination: the explanation with the fewest mistakes, and those that look the
//! same.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};
use std::ops::RangeInclusive;

use nalgebra::Point3;
use plumb_runtime::doubt::Doubt;
use plumb_runtime::rig::{Box3, Rig, Size};

use super::explanation::{
    ACCEPTED, Column, Explanation, Frame, Sectors, Wiring, misfit, remaining_yaw,
};
use super::fault::{Fault, Output};
use super::response::{Motion, Response};

/// Misfit that one mistake more in an explanation must remove, variances.
const MISFIT_OF_MISTAKE: f64 = 8.0;

/// Explanations whose score is at most this much above that of the best are named too: a mistake
/// more.
const SCORE_MARGIN: f64 = 9.0;

/// Distance from the workspace within which the ball counts as inside, metres.
const WORKSPACE_MARGIN_M: f64 = 0.05;

/// Cable of a step over that of the rig file that counts as right: jumpers of a driver and motors
/// of 400 steps a turn give powers of 2, and these are half-way to the next ones.
const CABLE_PER_STEP: RangeInclusive<f64> = FRAC_1_SQRT_2..=SQRT_2;

/// Result of an examination.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Place of the ball before the first jog, metres, as measured.
    pub ball: Point3<f64>,
    /// Whether that is inside the workspace.
    pub is_inside: bool,
    /// Responses to outputs A, B, C.
    pub responses: [Response; 3],
    /// Wiring and frame; `None` where no explanation fits.
    pub explanation: Option<Explanation>,
    /// Faults of cables and motors that stand, then those of the explanation.
    pub faults: Vec<Fault>,
    /// Other explanations that fit about as well.
    pub alternatives: Vec<Explanation>,
    /// Turn of the frame about the vertical beyond the explanation, degrees, counter-clockwise.
    pub yaw_deg: f64,
    /// Doubt about the measured positions.
    pub doubt: Option<Doubt>,
}

impl Report {
    /// Returns what explains these responses of the rig.
    pub fn of(rig: &Rig, ball: Point3<f64>, responses: [Response; 3]) -> Self {
        let sectors = rig.size.as_ref().map_or_else(Sectors::unknown, Sectors::of);
        let is_inside = is_inside(&rig.workspace, &ball);
        let mechanical = mechanical_faults(&responses);
        let columns = columns(&responses);
        let has_loose_cable = mechanical.iter().any(|fault| !matches!(fault, Fault::Still(_)));
        // On two taut cables the ball moves in other directions.
        let choice = if has_loose_cable || columns.len() < 2 {
            Choice { best: Some(RIGHT), alternatives: Vec::new() }
        } else {
            choose(&columns, &sectors, is_inside)
        };
        let yaw = match choice.best {
            Some(best) if !has_loose_cable => remaining_yaw(&best, &columns, &sectors),
            _ => 0.0,
        };
        let mut explained = choice.best.map(|best| best.faults()).unwrap_or_default();
        if let Some(size) = &rig.size
            && choice.best == Some(RIGHT)
            && !has_loose_cable
        {
            explained.extend(cable_fault(size, &ball, &columns));
        }
        Self {
            ball,
            is_inside,
            responses,
            explanation: choice.best,
            faults: [mechanical, explained].concat(),
            alternatives: choice.alternatives,
            yaw_deg: yaw.to_degrees(),
            doubt: None,
        }
    }

    /// Returns whether no fault was found.
    pub fn is_right(&self) -> bool {
        self.faults.is_empty() && self.explanation.is_some() && self.doubt.is_none()
    }

    /// Returns `motors.reversed` of the rig file as it should be; `None` where nothing changes. A
    /// motor on the wrong output keeps its direction: after the exchange of the plugs another check
    /// shows it.
    pub fn corrected_directions(&self, reversed: [bool; 3]) -> Option<[bool; 3]> {
        let wiring = self.explanation?.wiring;
        let corrected = [0, 1, 2].map(|output| {
            let is_wrong = wiring.motors[output] == output && wiring.reversed[output];
            reversed[output] != is_wrong
        });
        (corrected != reversed).then_some(corrected)
    }
}

const RIGHT: Explanation = Explanation { wiring: Wiring::RIGHT, frame: Frame::RIGHT };

fn is_inside(workspace: &Box3, ball: &Point3<f64>) -> bool {
    (0..3).all(|axis| {
        let [min, max] = [workspace.min[axis], workspace.max[axis]].map(|corner| corner.get());
        (min - WORKSPACE_MARGIN_M..=max + WORKSPACE_MARGIN_M).contains(&ball[axis])
    })
}

fn mechanical_faults(responses: &[Response; 3]) -> Vec<Fault> {
    let fault = |(output, response): (Output, &Response)| match response.motion() {
        Motion::Follows { .. } => None,
        Motion::Still => Some(Fault::Still(output)),
        Motion::OneWay => Some(Fault::Slack(output)),
        Motion::Slips { .. } => Some(Fault::Slips(output)),
    };
    let faults: Vec<Fault> = Output::ALL.into_iter().zip(responses).filter_map(fault).collect();
    let is_slack = |fault: &Fault| matches!(fault, Fault::Slack(_));
    if faults.iter().any(is_slack) {
        // The ball swings on the other two cables, which can look like a slipping one.
        return faults.into_iter().filter(is_slack).collect();
    }
    faults
}

/// Returns the fault of rigs whose drums wind another length of cable in a step than `size` says.
/// The ball moves along cable i by what motor i pays out.
fn cable_fault(size: &Size, ball: &Point3<f64>, columns: &[Column]) -> Option<Fault> {
    let motors = size.motors();
    let paid_out =
        |column: &Column| column.per_step.dot(&(ball - motors[column.output]).normalize());
    let mut lengths: Vec<f64> = columns.iter().map(paid_out).collect();
    lengths.sort_by(f64::total_cmp);
    let median = lengths.get(lengths.len() / 2)?;
    let factor = median / size.cable_per_step.get();
    let percent = (100.0 * factor).round().max(0.0) as u32;
    (!CABLE_PER_STEP.contains(&factor)).then_some(Fault::CablePerStep { percent })
}

fn columns(responses: &[Response; 3]) -> Vec<Column> {
    let column = |(output, response): (usize, &Response)| match response.motion() {
        Motion::Follows { per_step, sd } => Some(Column { output, per_step, sd }),
        _ => None,
    };
    responses.iter().enumerate().filter_map(column).collect()
}

/// Best explanation, and those that cannot be told apart from it.
struct Choice {
    best: Option<Explanation>,
    alternatives: Vec<Explanation>,
}

/// Explanation with its fit.
struct Candidate {
    explanation: Explanation,
    /// Misfit, and that of its mistakes; variances.
    score: f64,
}

/// Chooses the explanation with the lowest score among those that fit.
fn choose(columns: &[Column], sectors: &Sectors, is_inside: bool) -> Choice {
    let candidate = |explanation: Explanation| {
        let misfit = misfit(&explanation, columns, sectors);
        let score = misfit + MISFIT_OF_MISTAKE * f64::from(explanation.cost(is_inside));
        (misfit <= ACCEPTED).then_some(Candidate { explanation, score })
    };
    let mut candidates: Vec<Candidate> =
        explanations(columns, sectors).filter_map(candidate).collect();
    candidates.sort_by(|a, b| a.score.total_cmp(&b.score));
    let mut candidates = candidates.into_iter();
    let Some(best) = candidates.next() else {
        return Choice { best: None, alternatives: Vec::new() };
    };
    let others = candidates
        .take_while(|other| other.score <= best.score + SCORE_MARGIN)
        .map(|candidate| candidate.explanation);
    // A right rig needs no other explanation.
    let alternatives = if best.explanation == RIGHT { Vec::new() } else { others.collect() };
    Choice { best: Some(best.explanation), alternatives }
}

/// Returns the explanations under test: of each wiring, handedness and vertical the frame without a
/// turn, and the turned frame that fits best.
fn explanations(columns: &[Column], sectors: &Sectors) -> impl Iterator<Item = Explanation> {
    let kinds = [(false, false), (true, false), (false, true), (true, true)];
    Wiring::all().flat_map(move |wiring| {
        kinds.into_iter().flat_map(move |(mirrored, inverted)| {
            let mut frames = Frame::turned(mirrored, inverted);
            let explain = move |frame| Explanation { wiring, frame };
            let straight = frames.next().map(explain);
            let by_misfit = |a: &Explanation, b: &Explanation| {
                misfit(a, columns, sectors).total_cmp(&misfit(b, columns, sectors))
            };
            let turned = frames.map(explain).min_by(by_misfit);
            straight.into_iter().chain(turned)
        })
    })
}
