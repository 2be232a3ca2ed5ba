//! Report on a family of rigs, for people and for programs.

use plumb_protocol::config::SIGNS;
use plumb_verify::{
    Descent, EntryBounds, Interval, IntervalMatrix, RigFamily, RouthHurwitz, bounds_along_path,
    bounds_over_rigs, closed_form_bounds, routh_hurwitz, sign_decay, sign_descent,
};
use serde::Serialize;

use super::{Scope, TargetPath};

/// Minima of λ for which the report lists β/α besides the requested one.
const MIN_LAMBDAS: [f64; 4] = [0.10, 0.05, 0.023, 0.01];

/// Largest number of cells for each value of the decay of law `sign` that is tried. A wide family
/// needs more, and a minute.
const DECAY_CELLS: usize = 1_000_000;

/// α, β and their ratio, which is absent if α is 0.
#[derive(Clone, Copy, Serialize)]
struct BoundsLine {
    alpha: f64,
    beta: f64,
    ratio: Option<f64>,
}

impl From<EntryBounds> for BoundsLine {
    fn from(found: EntryBounds) -> Self {
        Self {
            alpha: found.alpha,
            beta: found.beta,
            ratio: (found.alpha > 0.0).then(|| found.ratio()),
        }
    }
}

impl std::fmt::Display for BoundsLine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "α = {:.4}, β = {:.4}", self.alpha, self.beta)?;
        match self.ratio {
            Some(ratio) => write!(f, ", β/α = {ratio:.1}"),
            None => f.write_str(", no bound on β/α"),
        }
    }
}

/// α and β for a minimum of λ.
#[derive(Serialize)]
struct LambdaLine {
    min_lambda: f64,
    #[serde(flatten)]
    bounds: BoundsLine,
}

/// α and β along the path to a target.
#[derive(Serialize)]
struct PathLine {
    target: [f64; 3],
    #[serde(flatten)]
    bounds: BoundsLine,
}

/// Report on a family of rigs.
#[derive(Serialize)]
pub(super) struct Report {
    #[serde(flatten)]
    rigs: RigFamily,
    #[serde(flatten)]
    exact: BoundsLine,
    closed_form: BoundsLine,
    workspace: Vec<LambdaLine>,
    paths: Vec<PathLine>,
    /// Absent if α is 0: there is no interval family then.
    nonsingular: Option<bool>,
    /// Lower and upper bound of the minimum of |v|/|e| under law `interval`; absent if α is 0.
    min_v: Option<Interval>,
    /// Absent if a condition has a monomial with a negative coefficient.
    routh_hurwitz: Option<RouthHurwitz>,
    /// `null` if undecided.
    sign_descends: Option<bool>,
    /// μ with d|e|/dt <= -g μ |e| under law `sign`; absent if none is found.
    sign_decay: Option<f64>,
    cells: usize,
}

impl Report {
    /// Computes everything in the report, with at most `max_cells` cells for law `sign`.
    pub(super) fn new(scope: &Scope, max_cells: usize) -> Self {
        let rigs = &scope.rigs;
        let exact = bounds_over_rigs(rigs);
        let family =
            (exact.alpha > 0.0).then(|| IntervalMatrix::with_signs(exact.alpha, exact.beta));
        let (sign_descends, cells) = match sign_descent(rigs, max_cells) {
            Descent::Proved(cells) => (Some(true), cells),
            Descent::Refuted(cells) => (Some(false), cells),
            Descent::Undecided(cells) => (None, cells),
        };
        Self {
            rigs: *rigs,
            exact: exact.into(),
            closed_form: closed_form_bounds(rigs).into(),
            workspace: lambda_lines(scope),
            paths: path_lines(&scope.paths),
            nonsingular: family.map(|family| family.is_nonsingular()),
            min_v: family.map(|family| family.min_v()),
            routh_hurwitz: routh_hurwitz(SIGNS, SIGNS),
            sign_descends,
            sign_decay: (sign_descends == Some(true))
                .then(|| sign_decay(rigs, max_cells.min(DECAY_CELLS)))
                .filter(|mu| *mu > 0.0),
            cells,
        }
    }

    /// Returns whether every statement is proved.
    pub(super) fn is_proved(&self) -> bool {
        self.nonsingular != Some(false)
            && self.routh_hurwitz.is_some()
            && self.sign_descends == Some(true)
    }

    /// Prints the report for people.
    pub(super) fn print(&self) {
        self.print_bounds();
        self.print_interval_proofs();
        self.print_sign_proofs();
        tell!(
            "not covered: noise, latency, rate limits, slack or elastic cables, \
             and the laws `adaptive` and `taut`"
        );
    }

    fn print_bounds(&self) {
        let span = |side: Interval| match side.width() < 1e-9 {
            true => format!("{:.3}", side.lo),
            false => format!("{:.3}-{:.3}", side.lo, side.hi),
        };
        let RigFamily { depth, width, apex, min_lambda, below } = self.rigs;
        tell!(
            "rigs with D {} m, W {} m, t {}; the ball where λ >= {min_lambda}, h {} m:",
            span(depth),
            span(width),
            span(apex),
            span(below),
        );
        tell!("  |dp/du|: {} (closed form: {})", self.exact, self.closed_form);
        for PathLine { target: [x, y, z], bounds } in &self.paths {
            tell!(
                "  |dp/du| on the straight path to ({x}, {y}, {z}), in the rig as measured: \
                 {bounds}"
            );
        }
        for LambdaLine { min_lambda, bounds } in &self.workspace {
            tell!("  |dp/du| where λ >= {min_lambda}: {bounds}");
        }
    }

    fn print_interval_proofs(&self) {
        let (Some(nonsingular), Some(Interval { lo, hi })) = (self.nonsingular, self.min_v) else {
            tell!("no family for law `interval`: |dp/du| may be 0");
            return;
        };
        let said = if nonsingular { "proved" } else { "refuted" };
        tell!("for every Jacobian with the signs (12) and these α and β:");
        tell!("  none is singular: {said} (signs of the determinants of all corners)");
        tell!(
            "  law `interval` decreases |e| at least as exp(-{0:.2e} γ t): \
             the minimum of |v|/|e| is {lo:.2e} to {hi:.2e}; \
             the ball lags a target with the speed v by at most v / ({0:.2e} γ)",
            lo * lo
        );
    }

    fn print_sign_proofs(&self) {
        tell!("for every Jacobian with the signs (12) of any size:");
        match &self.routh_hurwitz {
            Some(RouthHurwitz { trace, minors, determinant, difference }) => tell!(
                "  law `sign` is stable: proved (B = 4 J Σ⁻¹: tr, E2, det and tr E2 - det have \
                 {trace}, {minors}, {determinant} and {difference} positive monomials)"
            ),
            None => tell!("  law `sign` is stable: not proved"),
        }
        let said = match self.sign_descends {
            Some(true) => "proved",
            Some(false) => "refuted",
            None => "undecided",
        };
        tell!("for every rig and position in the family:");
        tell!("  law `sign` decreases |e|: {said} ({} cells)", self.cells);
        if let Some(decay) = self.sign_decay {
            tell!(
                "  law `sign` with the gain g decreases |e| at least as exp(-{decay} g t); \
                 the ball lags a target with the speed v by at most v / ({decay} g)"
            );
        }
    }
}

/// Returns the bounds for each of [`MIN_LAMBDAS`]; none if there is no path.
fn lambda_lines(scope: &Scope) -> Vec<LambdaLine> {
    if scope.paths.is_empty() {
        return Vec::new();
    }
    let line = |min_lambda| LambdaLine {
        min_lambda,
        bounds: bounds_over_rigs(&RigFamily { min_lambda, ..scope.rigs }).into(),
    };
    MIN_LAMBDAS.map(line).into()
}

/// Returns the bounds along each path.
fn path_lines(paths: &[TargetPath]) -> Vec<PathLine> {
    let line = |TargetPath { target, path }: &TargetPath| PathLine {
        target: *target,
        bounds: bounds_along_path(path).into(),
    };
    paths.iter().map(line).collect()
}
