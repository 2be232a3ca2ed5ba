use std::fs;
use std::os::unix::fs::symlink;

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_frame::frame::GroundTruth;
use plumb_frame::observation::{BallObservation, Circle, Gaussian3};
use plumb_protocol::message::{DriverReading, Fault, State};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::observer::PathPoint;
use plumb_runtime::record::{observation, telemetry};
use plumb_runtime::rig::MotorPoints;
use serde_json::json;

use super::*;
use crate::LoggedRun;

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
    let points = MotorPoints { places: places.into(), is_approximate: false };
    FigureSettings { title: "interval, γ = 30 /s".into(), threshold_m: 0.01, motors: Some(points) }
}

/// Returns a ball that is measured at `position`.
pub(crate) fn ball(position: Point3<f64>) -> BallObservation {
    BallObservation {
        stamp: 0.0,
        circle: Circle { u: 320.5, v: 240.25, radius: 20.0, covariance: Matrix3::identity() },
        score: 60.0,
        position: Some(Gaussian3 { mean: position, covariance: Matrix3::identity() }),
        depths: None,
    }
}

/// Returns the report of a board that drives the ball, of the k-th frame.
fn report(k: f64) -> BoardReport {
    BoardReport {
        time: k / 30.0,
        state: State::Seeking,
        configuration: None,
        target: None,
        sequence: None,
        motors: [k, -k / 16.0, 0.0].into(),
        rates: [0.0; 3].into(),
        error: [0.0; 3],
        bad_frames: 0,
        late_ticks: 0,
        tensions: None,
        reference: None,
        drivers: None,
    }
}

/// A run like the paper's: y first, then x, z last; the ball is lost now and then.
fn row(frame: u32) -> FrameRecord {
    let k = f64::from(frame);
    let to = |from: f64, to: f64, when: f64| to + (from - to) * (1.0 - k / when).max(0.0);
    let noise = |phase: f64| 0.002 * (k * 12.9 + phase).sin();
    let position = Point3::new(
        to(0.54, 0.4, 220.0) + noise(0.0),
        to(0.22, 0.4, 100.0) + noise(1.0),
        to(0.459, 0.15, 560.0) + noise(2.0),
    );
    let is_lost = frame % 97 > 90;
    FrameRecord {
        number: u64::from(frame),
        time: k / 30.0,
        observation: (!is_lost).then(|| ball(position)),
        target: Some(Point3::new(0.4, 0.4, 0.15)),
        board: Some(report(k)),
        state: Some(State::Seeking),
        ..FrameRecord::default()
    }
}

/// Returns the record of a frame whose report of the board is changed by `change`.
fn with_board(change: impl Fn(&mut BoardReport)) -> FrameRecord {
    let mut board = report(0.0);
    change(&mut board);
    FrameRecord { board: Some(board), ..row(0) }
}

/// Returns the record of a frame with the ball at `position`.
fn at(position: Point3<f64>) -> FrameRecord {
    FrameRecord { observation: Some(ball(position)), ..row(3) }
}

/// Returns the values of the columns `names` in the rows of the run in `folder`.
fn values<const N: usize>(folder: &Path, names: [&str; N]) -> Vec<[String; N]> {
    let mut reader = csv::Reader::from_path(folder.join("run.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let column = |name| header.iter().position(|it| it == name).unwrap();
    let rows = reader.records().map(Result::unwrap);
    rows.map(|row| names.map(|name| row[column(name)].to_owned())).collect()
}

fn lines(folder: &Path) -> Vec<String> {
    fs::read_to_string(folder.join("run.csv")).unwrap().lines().map(String::from).collect()
}

#[test]
fn rows_are_in_the_file_before_the_run_ends() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("deep/run");
    let mut run = create(&path, scene()).unwrap();
    assert_eq!(lines(&path), [columns().join(",")]);
    run.record(&row(0)).unwrap();
    run.record(&row(95)).unwrap();
    let written = lines(&path);
    assert_eq!(written.len(), 3);
    assert!(written[1].starts_with("0,0,320.5,240.25,20,60,0.54,0.22"), "{}", written[1]);
    assert!(written[1].contains(",0.4,0.4,0.15,0.38"), "target and error: {}", written[1]);
    assert!(written[1].contains(",seeking,seeking,,,0,,,,0,0,0,0,0,0,"), "{}", written[1]);
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
    let with = |tensions: [f64; 3]| with_board(|board| board.tensions = Some(tensions.into()));
    let true_tensions = [0.123_456, 0.0, 1.0];
    let truth = GroundTruth { tensions: true_tensions };
    let first = with([0.25, 64.0 / 256.0, 1.0 / 256.0]);
    let first = FrameRecord { ground_truth: Some(truth), ..first };
    for row in [first, with([0.5; 3]), with([0.1; 3])] {
        run.record(&row).unwrap();
    }
    let names = ["a", "b", "c"].map(|cable| format!("tensions_weights_{cable}"));
    let rows = values(&path, names.each_ref().map(String::as_str));
    assert_eq!(rows[0], ["0.25", "0.25", "0.004"]);
    let rows = values(&path, ["near_slack", "true_tensions_weights_a", "true_tensions_weights_c"]);
    assert_eq!(rows, [["C", "0.123", "1"], ["none", "", ""], ["ABC", "", ""]]);
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
        run.record(&with_board(|board| board.drivers = drivers.map(Into::into))).unwrap();
    }
    let names = ["stall_guard_a", "stall_guard_b", "stall_guard_c", "driver_warnings"];
    let rows = values(&path, names);
    assert_eq!(rows[0], ["", "", "", ""], "of other drivers");
    assert_eq!(rows[1], ["300", "300", "300", "none"]);
    assert_eq!(rows[2], ["300", "", "300", "B hot, C open coil"]);
}

#[test]
fn a_run_along_a_path_has_its_deviation_in_rows_and_in_a_figure() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut run = create(&path, scene()).unwrap();
    let path_point = PathPoint {
        time: 1.5,
        pace: 0.9961,
        position: Point3::new(0.401, 0.4, 0.15),
        velocity: Vector3::x(),
    };
    let on_path = |number, position| FrameRecord {
        number,
        observation: position,
        path: Some(path_point),
        ..row(0)
    };
    run.record(&row(0)).unwrap();
    run.record(&on_path(1, Some(ball(Point3::new(0.4, 0.4005, 0.15))))).unwrap();
    run.record(&on_path(2, None)).unwrap();
    let names = ["path_time_s", "path_pace", "along_track_m", "cross_track_m"];
    let expected =
        [["", "", "", ""], ["1.5", "0.996", "-0.001", "0.0005"], ["1.5", "0.996", "", ""]];
    assert_eq!(values(&path, names), expected);
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
    let mut odd = with_board(|board| board.state = State::Fault(Fault::HostSilent));
    odd.target = Some(Point3::new(0.399_999_999_999_999_97, -0.1, 0.150_000_04));
    odd.time = 1.0 / 30.0;
    for row in [&odd, &row(95), &FrameRecord::default()] {
        run.record(row).unwrap();
    }
    let targets = values(&path, ["time_s", "target_m_x", "target_m_y", "target_m_z"]);
    assert_eq!(targets[0], ["0.033333", "0.4", "-0.1", "0.15"]);
    let positions = values(&path, ["position_m_x", "position_m_y", "position_m_z"]);
    for (field, value) in positions[0].iter().zip(odd.position().unwrap().iter()) {
        let digits = field.split_once('.').unwrap().1.len();
        assert!(digits <= 6 && (field.parse::<f64>().unwrap() - value).abs() <= 0.5e-6, "{field}");
    }
    let faults = values(&path, ["state", "fault", "motors_steps_b"]);
    assert_eq!(faults[0], ["fault", &Fault::HostSilent.to_string(), "0"]);
    assert_eq!(faults[1], ["seeking", "", "-5.9375"]);
    let empty = values(&path, ["u_px", "score", "position_m_x", "error_m", "path_pace"]);
    assert!(empty[1].iter().all(String::is_empty), "{empty:?}");
    assert_eq!(lines(&path)[3].trim_end_matches(','), "0,0", "nothing is known");
}

/// The table of the book has the fields in their order.
#[test]
fn the_book_has_the_fields_of_a_record() {
    let book = include_str!("../../../../docs/use/logs.md");
    let table = book.split("| field | unit | content |").nth(1).unwrap();
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let cells = rows.map(|row| row.split('|').nth(1).unwrap());
    let names: Vec<&str> = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    let record = FrameRecord::default();
    let fields = observation(&record).0.into_iter().chain(telemetry(&record).0);
    assert_eq!(names, fields.map(|field| field.name).collect::<Vec<_>>());
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
    let blind = FrameRecord { observation: None, target: None, ..row(0) };
    let absurd = at(Point3::new(f64::NAN, 0.0, f64::INFINITY));
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
    let far = |c: f64| at(Point3::new(c, -c, c));
    for threshold_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        let title = "|e| < 10 mm & \"so on\"".into();
        let mut run = create(&path, FigureSettings { title, threshold_m, ..scene() }).unwrap();
        let target = Some(Point3::new(f64::MAX, 0.0, 0.0));
        let end = FrameRecord { number: u64::MAX, target, ..row(4) };
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
