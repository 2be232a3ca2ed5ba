//! Tests of files that a run follows: what they hold decides, and mistakes come with their lines.

use super::*;
use crate::rig::Rig;

fn read(text: &[u8]) -> Result<FollowFile, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("way.csv");
    std::fs::write(&path, text).unwrap();
    let found = FollowFile::read(&path, &Rig::paper().unwrap().motion_rules());
    found.map_err(|error| ErrorChain(&error).to_string())
}

#[test]
fn what_a_file_holds_decides() {
    assert!(matches!(read(b"x,y,z\n0.4,0.3,0.2\n"), Ok(FollowFile::Path(_))));
    // Nothing is said yet of a path's places: a corner is rounded.
    assert!(matches!(read(b"t,x,y,z\n0,9,0.3,0.2\n"), Ok(FollowFile::Path(_))));
    assert!(matches!(read(b"G0 X400 Y300 Z200\n"), Ok(FollowFile::Path(_))));
    let stops =
        Ok(FollowFile::Stops(vec![Waypoint { dwell_s: 2.0, ..Waypoint::new([0.4, 0.3, 0.2]) }]));
    assert_eq!(read(b"x,y,z,dwell\n0.4,0.3,0.2,2\n"), stops);
    let lines = b"{\"t\": 50, \"target\": [0.4, 0.3, 0.2]}\n\n\
                  {\"t\": 50.5, \"target\": [0.4, 0.3, 0.3]}\n";
    let Ok(FollowFile::Targets(targets)) = read(lines) else { panic!("no targets") };
    assert_eq!(targets.iter().map(|it| it.time_s).collect::<Vec<_>>(), [0.0, 0.5]);
}

#[test]
fn mistakes_come_with_their_file_and_lines() {
    let good = r#"{"t": 1, "target": [0.4, 0.3, 0.2]}"#;
    let json = |line: &str| format!("{good}\n{line}\n");
    for (text, says) in [
        (json(r#"{"target": [0.4, 0.3, 0.2]}"#), "way.csv:2: `t` is missing"),
        (json(good), "way.csv:2: `t` must grow"),
        (json(r#"{"t": 2, "target": 1}"#), "way.csv:2: no target: "),
        (json("0.4,0.3,0.2"), "way.csv:2: no target: "),
        (
            json(r#"{"t": 2, "target": [0.9, 0.3, 0.2]}"#),
            "way.csv:2: [0.9000, 0.3000, 0.2000] m: that is outside the workspace",
        ),
        (
            "x,y,z,dwell\n0.4,0.3,0.2\n0.4,0.3,-5\n".to_owned(),
            "way.csv:3: [0.4000, 0.3000, -5.0000] m: that is outside the workspace",
        ),
        ("0.4,o.3,0.2\n".to_owned(), "way.csv:1: `y = o.3` is wrong: must be a number"),
        ("x\0,\0y\0,\0z\0\n\0".to_owned(), "way.csv: is text in UTF-16"),
    ] {
        let error = read(text.as_bytes()).unwrap_err();
        assert!(error.contains(says), "{text}: {error}");
    }
    assert!(read(b"1,\xff,1\n").unwrap_err().contains("way.csv:1: is not UTF-8"));
    let long = "0.4,0.3,0.2\n".repeat(100_000);
    assert!(read(long.as_bytes()).unwrap_err().contains("at most 1048576 are read"));
}

#[test]
fn the_places_of_a_path_that_a_rig_does_not_allow_are_told() {
    let rules = Rig::paper().unwrap().motion_rules();
    let places = parse("0.5,0.3,0.3\n0.5,0.3,3\n").unwrap();
    let mistakes = misplaced(Path::new("up.csv"), &places, &rules).to_string();
    let says = "up.csv:2: [0.5000, 0.3000, 3.0000] m: that is outside the workspace";
    assert!(mistakes.starts_with(says), "{mistakes}");
}
