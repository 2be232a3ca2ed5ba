//! `plumb verify --family`: theorem 1 for a family given by its vertices.

use std::path::Path;

use plumb_cameras::toml_file::{Finite, read_toml};
use plumb_verify::{Polytope, PolytopeError, Verdict};
use serde::{Deserialize, Serialize};

use crate::commands::print::tell;
use crate::commands::{Failure, OrFail, print};

/// File that describes a family. The vertices are checked while they are read, so that an error
/// names the line.
#[derive(Deserialize)]
#[serde(try_from = "Vertices")]
struct FamilyFile(Polytope);

/// The table as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Vertices {
    vertices: Vec<[[Finite; 3]; 3]>,
}

impl TryFrom<Vertices> for FamilyFile {
    type Error = PolytopeError;

    fn try_from(file: Vertices) -> Result<Self, PolytopeError> {
        let vertices = file.vertices.into_iter().map(|m| m.map(|row| row.map(Finite::get)));
        Polytope::new(vertices.collect()).map(Self)
    }
}

/// What was found.
#[derive(Serialize)]
struct Line {
    vertices: usize,
    /// `null` where it was left open.
    nonsingular: Option<bool>,
    /// The least |v|/|e| lies between these.
    least_v: [f64; 2],
    direction: [f64; 3],
    patches: usize,
}

/// Whether no matrix of the family in the file at `path` is singular.
pub(super) fn main(path: &Path, most_patches: usize, json: bool) -> Result<bool, Failure> {
    let FamilyFile(family) = read_toml(path).or_bad_input()?;
    let found = family.robustness(most_patches);
    let (nonsingular, words) = match found.verdict {
        Verdict::Nonsingular => (Some(true), "none is singular: proved"),
        Verdict::Singular => (
            Some(false),
            "one of them is singular: there are two with determinants of opposite signs",
        ),
        Verdict::Open => (None, "open whether one of them is singular"),
    };
    let [lo, hi] = [found.least_v.lo, found.least_v.hi];
    tell!("{} vertices and every matrix between them: {words}", family.len());
    tell!(
        "the least |v|/|e| of problem (8) is from {lo:.5} to {hi:.5}, at e = {:.3?}",
        found.direction
    );
    if nonsingular == Some(true) {
        tell!(
            "with u̇ = -γ v, |e| falls at least as exp(-{:.3e} γ t), whatever the true one is",
            lo * lo
        );
    }
    if json {
        let line = Line {
            vertices: family.len(),
            nonsingular,
            least_v: [lo, hi],
            direction: found.direction,
            patches: found.patches,
        };
        print::result(serde_json::to_string(&line).or_failed()?)?;
    }
    Ok(nonsingular == Some(true))
}
