//! `plumb-lab verify --family`: theorem 1 for a polytope of Jacobians, given by its vertices.

use std::path::Path;

use plumb_config::toml_file::read_toml;
use plumb_verify::{Interval, Nonsingularity, Polytope, PolytopeError, Robustness};
use serde::{Deserialize, Serialize};

use crate::output::{self, Failure, bad_input};

/// File that describes a family. The vertices are checked while they are read, so that an error
/// names the line.
#[derive(Deserialize)]
#[serde(try_from = "Vertices")]
struct FamilyFile(Polytope);

/// Table of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Vertices {
    vertices: Vec<[[f64; 3]; 3]>,
}

impl TryFrom<Vertices> for FamilyFile {
    type Error = PolytopeError;

    fn try_from(file: Vertices) -> Result<Self, PolytopeError> {
        Polytope::new(file.vertices).map(Self)
    }
}

/// Result, for programs.
#[derive(Serialize)]
struct Line {
    vertices: usize,
    /// `null` if undecided.
    nonsingular: Option<bool>,
    /// Lower and upper bound of the minimum of |v|/|e|.
    min_v: Interval,
    direction: [f64; 3],
    patches: usize,
}

impl Line {
    fn new(family: &Polytope, found: &Robustness) -> Self {
        Self {
            vertices: family.vertex_count(),
            nonsingular: match found.nonsingularity {
                Nonsingularity::Proved => Some(true),
                Nonsingularity::Refuted => Some(false),
                Nonsingularity::Undecided => None,
            },
            min_v: found.min_v,
            direction: found.direction,
            patches: found.patches,
        }
    }

    /// Prints the result for people.
    fn print(&self) {
        let said = match self.nonsingular {
            Some(true) => "none is singular: proved",
            Some(false) => "one is singular: two have determinants of opposite signs",
            None => "undecided whether one is singular",
        };
        let Interval { lo, hi } = self.min_v;
        tell!("convex hull of {} matrices: {said}", self.vertices);
        tell!(
            "  minimum of |v|/|e| of problem (8): {lo:.5} to {hi:.5}, at e = {:.3?}",
            self.direction
        );
        if self.nonsingular == Some(true) {
            tell!("  with u̇ = -γ v, |e| <= |e(0)| exp(-{:.3e} γ t) for every matrix", lo * lo);
        }
    }
}

/// Returns whether every matrix of the family in the file at `path` is proved nonsingular.
pub(super) fn main(path: &Path, max_patches: usize, json: bool) -> Result<bool, Failure> {
    let FamilyFile(family) = read_toml(path).map_err(bad_input)?;
    let line = Line::new(&family, &family.robustness(max_patches));
    line.print();
    if json {
        output::print(&line)?;
    }
    Ok(line.nonsingular == Some(true))
}
