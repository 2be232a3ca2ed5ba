use std::fs;
use std::os::unix::fs::symlink;

use plumb_protocol::message::{DriverReading, Fault, State};
use serde_json::json;

use nalgebra::Point3;

use super::*;
use crate::{LogDetection, LogPath, LoggedRun};

/// Creates a log in the folder `path`.
fn create(path: impl Into<PathBuf>, settings: FigureSettings) -> Result<RunLog, RunLogError> {
    RunLog::create(&OutputDir::Path(path.into()), settings)
}

fn scene() -> FigureSettings {
    let places = [
        Point3::new(0.85, 0.61, 0.665),
        Point3::new(0.85, 0.0, 0.665),
        Point3::new(0.0, 0.24, 0.665),
    ];
    let points = MotorPoints { places, is_approximate: false };
    FigureSettings { title: "interval, γ = 30 /s".into(), threshold_m: 0.01, motors: Some(points) }
}

/// A run like the paper's: y first, then x, z last; the ball is lost now and then.
fn row(frame: u32) -> LogRow {
    let (k, target) = (f64::from(frame), Point3::new(0.4, 0.4, 0.15));
    let to = |from: f64, to: f64, when: f64| to + (from - to) * (1.0 - k / when).max(0.0);
    let noise = |phase: f64| 0.002 * (k * 12.9 + phase).sin();
    let ball = Point3::new(
        to(0.54, 0.4, 220.0) + noise(0.0),
        to(0.22, 0.4, 100.0) + noise(1.0),
        to(0.459, 0.15, 560.0) + noise(2.0),
    );
    let lost = frame % 97 > 90;
    LogRow {
        frame: u64::from(frame),
        t_s: k / 30.0,
        detection: (!lost).then_some(LogDetection {
            u: 320.5,
            v: 240.25,
            radius: 20.0,
            score: 60.0,
        }),
        position: (!lost).then_some(ball),
        target: Some(target),
        error_m: (!lost).then_some((ball - target).norm()),
        board: Some(State::Seeking),
        motors_steps: Some([k, -k / 16.0, 0.0]),
        rates_steps_s: None,
        tensions: None,
        true_tensions: None,
        path: None,
        drivers: None,
    }
}

fn lines(folder: &Path) -> Vec<String> {
    fs::read_to_string(folder.join("run.csv")).unwrap().lines().map(String::from).collect()
}

#[test]
fn rows_are_in_the_file_before_the_run_ends() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("deep/run");
    let mut run = create(&path, scene()).unwrap();
    assert_eq!(lines(&path), [LogRow::HEADER.join(",")]);
    run.record(&row(0)).unwrap();
    run.record(&row(95)).unwrap();
    let written = lines(&path);
    assert_eq!(written.len(), 3);
    assert!(written[1].starts_with("0,0,320.5,240.25,20,60,0.54,0.22"), "{}", written[1]);
    assert!(written[1].contains(",0.4,0.4,0.15,0.38"), "target and error: {}", written[1]);
    assert!(written[1].ends_with(",seeking,0,0,0,,,,,,,,,,,,,,,,,,"), "{}", written[1]);
    drop(run);
    assert_eq!(lines(&path), written, "dropped without an end, the rows stay");
    assert!(!path.join("summary.json").exists());
}

/// Returns the event of a lost frame.
fn lost(message: &str) -> EventRecord {
    EventRecord { time: 0.0, event: RunEvent::FrameLost { message: message.to_owned() } }
}

#[test]
fn lost_frames_are_listed_with_their_cause() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    assert!(!path.join("lost.csv").exists(), "no frame is lost");
    run.event(&lost("camera: no frame: colour and depth are out of step"));
    run.record(&row(0)).unwrap();
    run.record(&row(1)).unwrap();
    run.event(&lost("detector: image processing failed, \"no memory\""));
    assert!(Observer::failure(&mut run).is_none());
    assert_eq!(
        fs::read_to_string(path.join("lost.csv")).unwrap(),
        "after_frame,message\n\
         ,camera: no frame: colour and depth are out of step\n\
         1,\"detector: image processing failed, \"\"no memory\"\"\"\n"
    );
}

#[test]
fn a_list_of_lost_frames_that_cannot_be_written_is_a_failure() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    fs::create_dir(path.join("lost.csv")).unwrap();
    run.event(&lost("camera: no frame"));
    let failure = Observer::failure(&mut run).expect("the failure");
    assert!(failure.to_string().contains("lost.csv"), "{failure}");
}

#[test]
fn tensions_have_three_digits_and_marks_of_cables_near_slack() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    let quarter = [0.25, 64.0 / 256.0, 1.0 / 256.0];
    let with = |tensions| LogRow { tensions: Some(tensions), ..row(0) };
    let true_tensions = Some([0.123_456, 0.0, 1.0]);
    for row in [LogRow { true_tensions, ..with(quarter) }, with([0.5; 3]), with([0.1; 3])] {
        run.record(&row).unwrap();
    }
    let mut reader = csv::Reader::from_path(path.join("run.csv")).unwrap();
    let rows: Vec<Vec<String>> = reader
        .records()
        .map(|record| record.unwrap().iter().skip(20).take(7).map(String::from).collect())
        .collect();
    assert_eq!(rows[0], ["0.25", "0.25", "0.004", "C", "0.123", "0", "1"]);
    assert_eq!(rows[1], ["0.5", "0.5", "0.5", "none", "", "", ""]);
    assert_eq!(rows[2][3], "ABC");
}

#[test]
fn drivers_on_a_uart_have_their_readings_and_warnings_in_the_last_columns() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    let cool = DriverReading { stall_guard: Some(300), ..DriverReading::default() };
    let hot = DriverReading { is_hot: true, stall_guard: None, ..cool };
    let open = DriverReading { has_open_load: true, ..cool };
    for drivers in [None, Some([cool; 3]), Some([cool, hot, open])] {
        run.record(&LogRow { drivers, ..row(0) }).unwrap();
    }
    let mut reader = csv::Reader::from_path(path.join("run.csv")).unwrap();
    let rows: Vec<Vec<String>> = reader
        .records()
        .map(|record| record.unwrap().iter().skip(31).map(String::from).collect())
        .collect();
    assert_eq!(rows[0], ["", "", "", ""], "of other drivers");
    assert_eq!(rows[1], ["300", "300", "300", "none"]);
    assert_eq!(rows[2], ["300", "", "300", "B hot, C open coil"]);
}

#[test]
fn a_run_along_a_path_has_its_deviation_in_rows_and_in_a_figure() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    let deviation = |frame: u32| LogPath {
        time: 1.5,
        pace: 0.9961,
        along_m: Some(-0.001 * f64::from(frame)),
        cross_m: (frame != 1).then_some(0.0005),
    };
    run.record(&row(0)).unwrap();
    for frame in 1..4 {
        run.record(&LogRow { path: Some(deviation(frame)), ..row(frame) }).unwrap();
    }
    let written = lines(&path);
    // The columns of drivers on a UART follow.
    assert!(written[0].contains(",path_time_s,path_pace,along_track_m,cross_track_m,"));
    assert!(written[1].ends_with(",,,,,,,,"), "{}", written[1]);
    assert!(written[2].ends_with(",1.5,0.996,-0.001,,,,,"), "{}", written[2]);
    assert!(written[3].ends_with(",1.5,0.996,-0.002,0.0005,,,,"), "{}", written[3]);
    run.finish("the end").unwrap();
    let figure = fs::read_to_string(path.join("deviation.svg")).unwrap();
    for words in ["across the path (mm)", "along the path (mm)"] {
        assert!(figure.contains(words), "{words}");
    }
    // The targets on the path are a line and have no numbers.
    let space = fs::read_to_string(path.join("figure5.svg")).unwrap();
    assert!(!space.contains("\n2\n"), "{space}");
    assert_eq!(LoggedRun::read(&path).unwrap().redraw().unwrap().len(), 3);
}

#[test]
fn a_run_along_no_path_has_no_figure_of_a_deviation() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    run.record(&row(0)).unwrap();
    run.finish("the end").unwrap();
    assert!(!path.join("deviation.svg").exists());
}

#[test]
fn rows_have_micrometres_and_what_is_absent_is_empty() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    let mut odd = LogRow { board: Some(State::Fault(Fault::HostSilent)), ..row(1) };
    odd.target = Some(Point3::new(0.399_999_999_999_999_97, -0.1, 0.150_000_04));
    for row in [&odd, &row(95), &LogRow::default()] {
        run.record(row).unwrap();
    }
    let mut reader = csv::Reader::from_path(path.join("run.csv")).unwrap();
    assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>(), LogRow::HEADER);
    let records: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let fields: Vec<&str> = records[0].iter().collect();
    assert_eq!(fields[1], "0.033333", "microseconds");
    assert_eq!(fields[9..12], ["0.4", "-0.1", "0.15"]);
    for (field, value) in fields[6..9].iter().zip(odd.position.unwrap().iter()) {
        let digits = field.split_once('.').unwrap().1.len();
        assert!(digits <= 6 && (field.parse::<f64>().unwrap() - value).abs() <= 0.5e-6, "{field}");
    }
    assert_eq!(&records[0][13], odd.board.unwrap().to_string());
    assert!((2..9).chain([12]).chain(17..27).all(|i| records[1][i].is_empty()), "{:?}", records[1]);
    assert_eq!(&records[1][15], "-5.9375");
    assert!((2..27).all(|i| records[2][i].is_empty()), "{:?}", records[2]);
}

#[test]
fn a_finished_run_has_its_summary_and_figures() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    for frame in 0..600 {
        run.record(&row(frame)).unwrap();
    }
    run.finish(&json!({"reached": true, "frames": 600})).unwrap();
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(path.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["frames"], 600);
    let title = "interval, γ = 30 /s";
    for (figure, words) in [
        (
            "figure4.svg",
            &["x (m)", "y (m)", "z (m)", "|e| (mm)", "time (s)", "measured", title][..],
        ),
        ("figure5.svg", &["start", "target", "x (m)", "z (m)", title][..]),
    ] {
        let svg = fs::read_to_string(path.join(figure)).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{figure} is not whole"
        );
        assert!(
            words.iter().all(|word| svg.lines().any(|line| line == *word)),
            "{figure} lacks one of {words:?}"
        );
        // Seven gaps cut the measured line into as many pieces.
        assert!(svg.matches("#1F61AB").count() >= 7, "{figure} has no measured line");
    }
}

#[test]
fn a_run_that_ended_at_once_can_be_finished() {
    let nothing = FigureSettings { motors: None, ..scene() };
    let blind = LogRow { position: None, error_m: None, target: None, ..row(0) };
    let absurd = LogRow {
        position: Some(Point3::new(f64::NAN, 0.0, f64::INFINITY)),
        error_m: Some(f64::NAN),
        ..row(0)
    };
    for (name, rows) in
        [("empty", vec![]), ("one", vec![row(0)]), ("blind", vec![blind]), ("absurd", vec![absurd])]
    {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join(name);
        let mut run = create(&path, nothing.clone()).unwrap();
        for row in &rows {
            run.record(row).unwrap();
        }
        run.finish("the port is gone").unwrap();
        for file in ["run.csv", "summary.json", "figure4.svg", "figure5.svg"] {
            assert!(path.join(file).metadata().unwrap().len() > 0, "{name}: {file}");
        }
        let figure = fs::read_to_string(path.join("figure5.svg")).unwrap();
        assert_eq!(
            figure.contains("no position was measured"),
            matches!(name, "empty" | "blind"),
            "{name}"
        );
    }
}

#[test]
fn absurd_numbers_do_not_spoil_the_figures() {
    let far = |c: f64| LogRow { position: Some(Point3::new(c, -c, c)), error_m: Some(c), ..row(3) };
    for threshold_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        let title = "|e| < 10 mm & \"so on\"".into();
        let mut run = create(&path, FigureSettings { title, threshold_m, ..scene() }).unwrap();
        let end =
            LogRow { frame: u64::MAX, target: Some(Point3::new(f64::MAX, 0.0, 0.0)), ..row(4) };
        for row in [row(0), row(1), far(f64::MAX), far(1e9), far(f64::NAN), end] {
            run.record(&row).unwrap();
        }
        run.finish(&()).unwrap();
        let figure = fs::read_to_string(path.join("figure5.svg")).unwrap();
        assert!(figure.contains("|e| &lt; 10 mm &amp; "), "the title is escaped");
        assert!(figure.lines().any(|line| line == "0.9"), "the box is that of the rig");
        let error = fs::read_to_string(path.join("figure4.svg")).unwrap();
        assert!(error.lines().any(|line| line == "|e| (mm)"));
    }
}

#[test]
fn a_run_is_never_overwritten() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    create(&path, scene()).unwrap().record(&row(0)).unwrap();
    let before = lines(&path);
    let err = create(&path, scene()).unwrap_err();
    assert!(matches!(&err, RunLogError::Exists(p) if *p == path), "{err}");
    assert_eq!(lines(&path), before);

    let file = parent.path().join("file");
    fs::write(&file, "mine").unwrap();
    assert!(matches!(create(&file, scene()), Err(RunLogError::Exists(_))));
    assert!(matches!(
        create(file.join("under"), scene()),
        Err(RunLogError::Io { .. } | RunLogError::Exists(_))
    ));
    assert_eq!(fs::read(&file).unwrap(), b"mine");

    let empty = parent.path().join("empty");
    fs::create_dir(&empty).unwrap();
    assert!(create(&empty, scene()).is_ok(), "an empty folder can be used");
}

#[test]
fn a_link_to_an_empty_folder_is_that_folder() {
    let parent = tempfile::tempdir().unwrap();
    let [empty, full, link] = ["empty", "full", "link"].map(|name| parent.path().join(name));
    fs::create_dir(&empty).unwrap();
    fs::create_dir_all(full.join("kept")).unwrap();
    symlink(&empty, &link).unwrap();
    create(&link, scene()).unwrap().record(&row(0)).unwrap();
    assert!(empty.join("run.csv").exists());
    // The run in it is not overwritten, and neither is what stands elsewhere.
    for elsewhere in [empty, full, parent.path().join("absent")] {
        fs::remove_file(&link).unwrap();
        symlink(&elsewhere, &link).unwrap();
        let error = create(&link, scene()).unwrap_err();
        assert!(matches!(&error, RunLogError::Exists(path) if *path == link), "{error}");
    }
}

/// As a folder without permission, which root may look into.
#[test]
fn a_folder_that_cannot_be_looked_into_is_no_earlier_run() {
    let parent = tempfile::tempdir().unwrap();
    let error = OutputDir::Path(parent.path().join("x".repeat(300))).check().unwrap_err();
    assert!(matches!(&error, RunLogError::Io { action: "look into", .. }), "{error}");
    let file = parent.path().join("file");
    fs::write(&file, "").unwrap();
    let error = OutputDir::Path(file).check().unwrap_err();
    assert!(matches!(&error, RunLogError::Exists(_)), "{error}");
}

#[test]
fn numbered_runs_go_on_from_the_highest() {
    let parent = tempfile::tempdir().unwrap();
    let runs = parent.path().join("runs");
    let next = |prefix| OutputDir::Numbered { parent: runs.clone(), prefix }.create();
    assert_eq!(next("demo").unwrap(), runs.join("demo-0001"));
    assert_eq!(next("demo").unwrap(), runs.join("demo-0002"));
    assert_eq!(next("bench").unwrap(), runs.join("bench-0001"));
    fs::create_dir(runs.join("demo-0041")).unwrap();
    fs::create_dir(runs.join("demo-later")).unwrap();
    assert_eq!(next("demo").unwrap(), runs.join("demo-0042"));
    fs::create_dir(runs.join("demo-9999")).unwrap();
    assert!(matches!(next("demo"), Err(RunLogError::NoFreeNumber { .. })));
    fs::create_dir(runs.join("demo-4294967295")).unwrap();
    assert!(matches!(next("demo"), Err(RunLogError::NoFreeNumber { .. })));
}
