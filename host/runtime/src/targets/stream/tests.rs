use std::io::Write;
use std::os::unix::net::UnixStream;

use super::super::{Arrivals, LeftOut, TargetReceiver, TargetSource, target_channel};
use super::*;

/// Takes what comes until `done` or the end.
fn take_until(receiver: &mut TargetReceiver, done: impl Fn(&Arrivals) -> bool) -> Arrivals {
    let mut all = Arrivals::default();
    loop {
        let Arrivals { targets, problems, left_out, has_ended } = receiver.take(0.0);
        all.targets.extend(targets);
        all.problems.extend(problems);
        (all.left_out, all.has_ended) = (left_out, has_ended);
        if done(&all) || has_ended {
            return all;
        }
        thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn bad_lines_are_told_with_their_number_and_the_good_ones_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.sock");
    let address = format!("unix:{}", path.display()).parse().unwrap();
    let (sender, mut receiver) = target_channel();
    let stream = TargetStream::start(&address, sender).unwrap();
    let mut program = UnixStream::connect(&path).unwrap();
    let long = "x".repeat(100_000);
    let text = format!(
        "{{\"target\": [0.4, 0.3, 0.2]}}\nhere\n{long}\n\n{{\"target\": [0.4, 0.3, 0.3]}}\n"
    );
    program.write_all(text.as_bytes()).unwrap();
    program.write_all(b"\xff\xfe\n{\"target\": [0.4, 0.3, 0.4], \"velocity\": [0, 0, 1]}").unwrap();
    drop(program);
    let Arrivals { targets, problems, left_out, .. } =
        take_until(&mut receiver, |all| all.targets.len() == 3);
    let heights: Vec<f64> = targets.iter().map(|target| target.position.z).collect();
    assert_eq!(heights, [0.2, 0.3, 0.4]);
    assert_eq!(left_out, LeftOut { unreadable: 3, ..LeftOut::default() });
    let expected = ["line 2: no target", "line 3: is too long", "line 6: is not UTF-8 text"];
    for (problem, begin) in problems.iter().zip(expected) {
        assert!(problem.starts_with(begin), "{problem}");
    }
    // Another sender may connect; its lines are counted from 1, and the motion is the same.
    let mut program = UnixStream::connect(&path).unwrap();
    program.write_all(b"{\"t\": 7, \"target\": [0.4, 0.3, 0.5]}\nthere\n").unwrap();
    let next = take_until(&mut receiver, |all| all.problems.len() == 1);
    assert!(next.problems[0].starts_with("line 2: no target"), "{:?}", next.problems);
    assert_eq!(next.targets[0].motion, targets[0].motion);
    drop(stream);
    assert!(receiver.take(0.0).has_ended && !path.exists());
}

#[test]
fn a_file_is_played_by_its_times_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.jsonl");
    let line = |t: f64, z: f64| format!("{{\"t\": {t}, \"target\": [0.4, 0.3, {z}]}}\n");
    std::fs::write(&path, line(50.0, 0.2) + "\n" + &line(50.02, 0.3)).unwrap();
    let (sender, mut receiver) = target_channel();
    let _stream = TargetStream::start(&TargetAddress::File(path), sender).unwrap();
    let all = take_until(&mut receiver, |_| false);
    assert_eq!((all.targets.len(), all.has_ended), (2, true));
    assert_eq!(all.problems, [""; 0]);
}

#[test]
fn a_wrong_file_is_refused_before_it_begins() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.jsonl");
    let message = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let address = TargetAddress::File(path.clone());
        let error = TargetStream::start(&address, target_channel().0).unwrap_err();
        ErrorChain(&error).to_string()
    };
    let good = "{\"t\": 1, \"target\": [0.4, 0.3, 0.2]}\n";
    for (text, named) in [
        (String::new(), "targets.jsonl: has no target"),
        (format!("{good}{{\"target\": [0.4, 0.3, 0.2]}}\n"), "line 2: `t` is missing"),
        (format!("{good}\n{good}"), "line 3: `t` must grow"),
        (format!("{good}{{\"t\": 2, \"target\": 1}}\n"), "line 2: no target: "),
    ] {
        let message = message(&text);
        assert!(message.contains(named), "{message}");
    }
}
