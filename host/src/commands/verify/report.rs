//! What is found of a kind of rigs, for people and for programs.

use plumb_protocol::config::SIGNS;
use plumb_verify::{
    Descent, Family, Interval, Magnitudes, Rigs, RouthHurwitz, over_rigs, over_way, rough,
    routh_hurwitz, sign_descent,
};
use serde::Serialize;

use super::Question;
use crate::commands::print::tell;

/// Least λ for which β/α is told beside the one that was asked for.
const LAMBDAS: [f64; 4] = [0.10, 0.05, 0.023, 0.01];

/// α, β and their ratio, which is absent where α is 0.
#[derive(Clone, Copy, Serialize)]
struct Ratio {
    alpha: f64,
    beta: f64,
    ratio: Option<f64>,
}

impl From<Magnitudes> for Ratio {
    fn from(found: Magnitudes) -> Self {
        Self {
            alpha: found.alpha,
            beta: found.beta,
            ratio: (found.alpha > 0.0).then(|| found.ratio()),
        }
    }
}

impl std::fmt::Display for Ratio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "α = {:.4}, β = {:.4}", self.alpha, self.beta)?;
        match self.ratio {
            Some(ratio) => write!(f, ", β/α = {ratio:.1}"),
            None => f.write_str(", no bound on β/α"),
        }
    }
}

#[derive(Serialize)]
struct ByLambda {
    least_lambda: f64,
    #[serde(flatten)]
    bounds: Ratio,
}

#[derive(Serialize)]
struct ByWay {
    target: [f64; 3],
    #[serde(flatten)]
    bounds: Ratio,
}

/// Monomials of each condition.
#[derive(Serialize)]
struct Monomials {
    trace: usize,
    minors: usize,
    determinant: usize,
    difference: usize,
}

impl From<RouthHurwitz> for Monomials {
    fn from(found: RouthHurwitz) -> Self {
        let RouthHurwitz { trace, minors, determinant, difference } = found;
        Self { trace, minors, determinant, difference }
    }
}

/// What was found.
#[derive(Serialize)]
pub(super) struct Report {
    depth: [f64; 2],
    width: [f64; 2],
    apex: [f64; 2],
    least_lambda: f64,
    below: [f64; 2],
    #[serde(flatten)]
    exact: Ratio,
    rough: Ratio,
    workspace: Vec<ByLambda>,
    ways: Vec<ByWay>,
    /// Absent where α is 0: no such family is known then.
    nonsingular: Option<bool>,
    /// The least |v|/|e| of law `interval` lies between these.
    least_v: Option<[f64; 2]>,
    /// Absent where a condition is not a sum of positive monomials.
    routh_hurwitz: Option<Monomials>,
    /// `null` where it was left open.
    sign_descends: Option<bool>,
    cells: usize,
}

impl Report {
    pub(super) fn new(question: &Question, most_cells: usize) -> Self {
        let rigs = &question.rigs;
        let ends = |side: Interval| [side.lo, side.hi];
        let exact = over_rigs(rigs);
        let family = Family::of_signs(exact.alpha, exact.beta);
        let by_lambda = |least_lambda: f64| ByLambda {
            least_lambda,
            bounds: over_rigs(&Rigs { least_lambda, ..*rigs }).into(),
        };
        let (sign_descends, cells) = match sign_descent(rigs, most_cells) {
            Descent::Holds(cells) => (Some(true), cells),
            Descent::Fails(cells) => (Some(false), cells),
            Descent::Open(cells) => (None, cells),
        };
        Self {
            depth: ends(rigs.depth),
            width: ends(rigs.width),
            apex: ends(rigs.apex),
            least_lambda: rigs.least_lambda,
            below: ends(rigs.below),
            exact: exact.into(),
            rough: rough(rigs).into(),
            workspace: if question.ways.is_empty() {
                Vec::new()
            } else {
                LAMBDAS.map(by_lambda).into()
            },
            ways: question
                .ways
                .iter()
                .map(|(target, way)| ByWay { target: *target, bounds: over_way(way).into() })
                .collect(),
            nonsingular: (exact.alpha > 0.0).then(|| family.nonsingular()),
            least_v: (exact.alpha > 0.0).then(|| ends(family.least_v())),
            routh_hurwitz: routh_hurwitz(SIGNS, SIGNS).map(Into::into),
            sign_descends,
            cells,
        }
    }

    /// Whether everything was proved that there is to prove.
    pub(super) fn proved(&self) -> bool {
        self.nonsingular != Some(false)
            && self.routh_hurwitz.is_some()
            && self.sign_descends == Some(true)
    }

    /// For people.
    pub(super) fn tell(&self) {
        let span = |[lo, hi]: [f64; 2]| {
            if hi - lo < 1e-9 { format!("{lo:.3}") } else { format!("{lo:.3}-{hi:.3}") }
        };
        tell!(
            "rigs with D {} m, W {} m, t {}; the ball where λ >= {}, h {} m:",
            span(self.depth),
            span(self.width),
            span(self.apex),
            self.least_lambda,
            span(self.below),
        );
        tell!("  |dp/du|: {} (by hand from rough geometry: {})", self.exact, self.rough);
        for ByWay { target: [x, y, z], bounds } in &self.ways {
            tell!("  |dp/du| on the straight way to ({x}, {y}, {z}): {bounds}");
        }
        for ByLambda { least_lambda, bounds } in &self.workspace {
            tell!("  |dp/du| where λ >= {least_lambda}: {bounds}");
        }
        self.tell_proofs();
        tell!(
            "not proved: anything of noise, latency, limits of rates, slack or elastic cables, and of `adaptive` and `taut`"
        );
    }

    fn tell_proofs(&self) {
        if let (Some(nonsingular), Some([lo, hi])) = (self.nonsingular, self.least_v) {
            let said = if nonsingular { "proved" } else { "not so" };
            tell!("for every Jacobian with the signs (12) and these α and β:");
            tell!("  none is singular: {said} (determinants of all corners have one sign)");
            tell!(
                "  law `interval` lets |e| fall at least as exp(-{:.2e} γ t): the least |v|/|e| is from {lo:.2e} to {hi:.2e}",
                lo * lo
            );
        } else {
            tell!("no family for law `interval`: |dp/du| may be 0");
        }
        tell!("for every Jacobian with the signs (12), whatever its size:");
        match &self.routh_hurwitz {
            Some(Monomials { trace, minors, determinant, difference }) => tell!(
                "  law `sign` is stable: proved (B = 4 J Σ⁻¹: tr, E2, det, tr E2 - det are {trace}, {minors}, {determinant}, {difference} positive monomials)"
            ),
            None => tell!("  law `sign` is stable: not so"),
        }
        let said = match self.sign_descends {
            Some(true) => "proved",
            Some(false) => "false",
            None => "open",
        };
        tell!("for every rig and place of that box:");
        tell!("  law `sign` lets |e| fall: {said} ({} cells)", self.cells);
    }
}
