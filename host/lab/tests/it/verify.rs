//! Tests of the command `plumb-lab verify`.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;

use super::{json, lab, stderr};

fn verify(arguments: &[&str], folder: &Path) -> Output {
    lab(&[&["verify"], arguments].concat(), folder)
}

/// The paper's laboratory rig: docs/understand/proofs.md has these ratios.
#[test]
fn the_papers_rig_is_proved_with_its_ranges_in_the_output() {
    let output = verify(&["--json"], Path::new("."));
    assert!(output.status.success(), "{}", stderr(&output));
    let line = json(&output);
    let near =
        |value: &Value, expected: f64| (value.as_f64().unwrap() / expected - 1.0).abs() < 0.02;
    for (k, ratio) in [30.0, 42.0, 79.0, 181.0].into_iter().enumerate() {
        assert!(near(&line["workspace"][k]["ratio"], ratio), "{line}");
    }
    assert!(near(&line["ratio"], 79.0) && near(&line["paths"][0]["ratio"], 36.5), "{line}");
    assert!(line["closed_form"]["ratio"].as_f64().unwrap() >= 79.0, "{line}");
    assert_eq!((&line["nonsingular"], &line["sign_descends"]), (&true.into(), &true.into()));
    assert_eq!(line["routh_hurwitz"]["difference"], 72);
    assert!(near(&line["below"][0], 0.1) && near(&line["below"][1], 0.665), "{line}");
    assert!(stderr(&output).contains("h 0.100-0.665 m"), "{}", stderr(&output));
}

#[test]
fn a_refuted_statement_exits_with_1() {
    let output = verify(&["--wide", "--below", "0.02,0.021", "--json"], Path::new("."));
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert_eq!(json(&output)["sign_descends"], false);
}

#[test]
fn a_tolerance_of_the_motors_widens_the_bounds() {
    let known = json(&verify(&["--below", "0.2,0.5", "--json"], Path::new(".")));
    let tolerant =
        json(&verify(&["--below", "0.2,0.5", "--tolerance", "0.01", "--json"], Path::new(".")));
    assert!(
        tolerant["alpha"].as_f64() < known["alpha"].as_f64()
            && tolerant["beta"].as_f64() > known["beta"].as_f64()
    );
    let none = verify(&["--tolerance", "0.5"], Path::new("."));
    assert_eq!(none.status.code(), Some(2));
    assert!(stderr(&none).contains("D = yA - yB must be above 0"), "{}", stderr(&none));
}

#[test]
fn a_family_by_its_vertices_is_decided_and_errors_are_located() {
    let folder = tempfile::tempdir().unwrap();
    let family = |text: &str| {
        fs::write(folder.path().join("family.toml"), text).unwrap();
        verify(&["--family", "family.toml", "--json"], folder.path())
    };
    let regular = family(
        "vertices = [[[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[2, 0, 0], [0, 2, 0], [0, 0, 2.0]]]",
    );
    assert!(regular.status.success(), "{}", stderr(&regular));
    let line = json(&regular);
    assert_eq!((&line["nonsingular"], &line["vertices"]), (&true.into(), &2.into()));
    let min_v = [0, 1].map(|k| line["min_v"][k].as_f64().unwrap());
    assert!(min_v[0] <= 1.0 && 1.0 <= min_v[1] + 1e-6 && min_v[0] > 0.9, "{line}");
    let singular = family(
        "vertices = [[[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]]",
    );
    assert_eq!(singular.status.code(), Some(1));
    assert_eq!(json(&singular)["nonsingular"], false);
    for (text, named) in [
        ("vertices = []", "family.toml:1: "),
        ("\nvertices = [[[1, 0], [0, 1]]]", "family.toml:2: `vertices = "),
        (
            "vertices = [[[1, 0, 0], [0, nan, 0], [0, 0, 1]]]",
            "has the entry NaN; entries are numbers of at most 1e9",
        ),
        ("vertices = [[[1, 0, 0], [0, 1e12, 0], [0, 0, 1]]]", "vertex 1 (from 1) has the entry"),
        ("matrices = 3", "matrices"),
    ] {
        let output = family(text);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(named), "{text}: {}", stderr(&output));
    }
    let absent = verify(&["--family", "absent.toml"], folder.path());
    assert_eq!(absent.status.code(), Some(2));
    assert!(stderr(&absent).contains("absent.toml"), "{}", stderr(&absent));
}
