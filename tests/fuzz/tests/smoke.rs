//! Every target with its corpus and some changed inputs, for some seconds.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

use plumb_fuzz::corpus;
use plumb_fuzz::target::TARGETS;

/// Most bytes of all corpora.
const MAX_CORPUS: u64 = 500_000;

/// The targets run in a process of their own, because a library prints a line for each damaged
/// picture.
#[test]
fn no_input_makes_a_target_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut fuzz = Command::new(env!("CARGO_BIN_EXE_fuzz"));
    let output = fuzz.arg("--smoke").current_dir(folder.path()).output().unwrap();
    let (table, errors) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{table}\n{errors}");
    for target in TARGETS {
        let row = format!("| {} | {} |", target.name, target.smoke);
        assert!(table.contains(&row), "no {row:?} in\n{table}");
    }
}

#[test]
fn every_target_has_a_corpus() {
    for target in TARGETS {
        let inputs = corpus::read(&corpus::folder(), target).unwrap();
        assert!(!inputs.is_empty(), "{} has no corpus", target.name);
        assert!((inputs.len() as u64) < target.smoke, "{} runs its corpus only", target.name);
    }
}

#[test]
fn corpora_are_small_and_have_a_target() {
    let targets: BTreeSet<_> = TARGETS.iter().map(|target| target.name.to_owned()).collect();
    let mut bytes = 0;
    for folder in fs::read_dir(corpus::folder()).unwrap() {
        let folder = folder.unwrap();
        let name = folder.file_name().into_string().unwrap();
        assert!(targets.contains(&name), "the corpus {name} has no target");
        for file in fs::read_dir(folder.path()).unwrap() {
            bytes += file.unwrap().metadata().unwrap().len();
        }
    }
    assert!(bytes <= MAX_CORPUS, "{bytes} bytes of corpora: `cargo fuzz cmin` makes them smaller");
}

#[test]
fn every_target_has_a_program_for_cargo_fuzz() {
    let manifest = include_str!("../Cargo.toml");
    for target in TARGETS {
        let path = format!("fuzz_targets/{}.rs", target.name);
        let program = format!("name = \"fuzz_{}\"\npath = \"{path}\"\n", target.name);
        assert!(manifest.contains(&program), "Cargo.toml has no program fuzz_{}", target.name);
        let text = fs::read_to_string(corpus::folder().with_file_name(&path)).unwrap();
        let call = format!("plumb_fuzz::target::{}::run(input)", target.name);
        assert!(text.contains(&call), "{path}");
    }
}
