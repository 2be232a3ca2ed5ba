//! A rig of two motors, by its rig file alone.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;

use crate::common::{Emulator, folder, json, plumb, refusal, rig_file, stderr};

/// Writes the rig file of two motors that are where A and B of the paper's rig are, in the plane
/// x = 0, changed by `edit`. Returns its path.
fn planar(folder: &Path, edit: impl Fn(String) -> String) -> String {
    rig_file(folder, |text| {
        let text =
            text.replace("targets = [[0.400, 0.400, 0.150]]", "targets = [[0.0, 0.4, 0.15]]");
        let text = text.replace("[motors]", "[law.adaptive]\nmean = 0.2\n\n[motors]\ncount = 2");
        let text =
            text.replace("min = [0.10,", "min = [0.0,").replace("max = [0.80,", "max = [0.0,");
        let text = text.replace(", [0.0, 0.240, 0.665]]", "]").replace("[0.850,", "[0.0,");
        let text = text.replace("[0.015, 0.015, 0.015]", "[0.015, 0.015]");
        let text = text.replace("start = [0.540,", "start = [0.0,");
        edit(text.replace("reversed = [false, false, false]\n", ""))
    })
}

#[test]
fn two_cables_bring_the_ball_to_its_target_with_each_law_that_knows_them() {
    let folder = folder();
    let rig = planar(folder.path(), |text| text);
    let emulator = Emulator::start();
    for law in ["adaptive", "sign", "interval"] {
        let home = plumb(&["home", "--rig", &rig, "--port", &emulator.port], folder.path());
        assert!(home.status.success(), "{}", stderr(&home));
        let arguments = ["run", "--rig", &rig, "--port", &emulator.port, "--law", law, "--json"];
        let output = plumb(&[&arguments[..], &["--out", law]].concat(), folder.path());
        let line = json(&output);
        assert_eq!(line["ending"], "reached", "{law}: {line} {}", stderr(&output));
        let rows = fs::read_to_string(folder.path().join(law).join("run.csv")).unwrap();
        let columns: Vec<_> = rows.lines().next().unwrap().split(',').collect();
        let of = |name| columns.iter().position(|column| *column == name).unwrap();
        let last: Vec<_> = rows.lines().last().unwrap().split(',').collect();
        assert!(!last[of("motors_steps_b")].is_empty() && last[of("motors_steps_c")].is_empty());
    }
}

#[test]
fn a_law_or_a_list_for_three_motors_is_refused_with_its_key() {
    let folder = folder();
    let check = |from: &str, to: &str| {
        let rig = planar(folder.path(), |text| text.replace(from, to));
        refusal(&["check", "--rig", &rig, "--file-only"], folder.path())
    };
    let law = check("[law.adaptive]\nmean = 0.2\n", "");
    assert!(law.contains("taut") && law.contains("[law.adaptive]"), "{law}");
    let four = check("count = 2", "count = 4");
    assert!(four.contains("motors.count") && four.contains("2 to 3"), "{four}");
    let list = check("count = 2", "count = 2\nreversed = [false, true, false]");
    assert!(list.contains("`motors.count` is 2"), "{list}");
    let wide = check("max = [0.0,", "max = [0.1,");
    assert!(wide.contains("workspace"), "{wide}");
    let aside = check("targets = [[0.0,", "targets = [[0.1,");
    assert!(aside.contains("targets") && aside.contains('x'), "{aside}");
}
