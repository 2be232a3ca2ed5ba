use mio::{Poll, Token, Waker};
use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};
use plumb_frame::camera::{Camera, Intrinsics};
use plumb_frame::image::Image;
use plumb_protocol::message::{DriverReading, Fault, State};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::operator::operator;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::StopReason;
use plumb_runtime::targets::TargetSource;
use serde_json::{json, to_value};

use super::*;

fn feed() -> (Poll, Feed) {
    feed_with(None)
}

fn feed_with(operator: Option<OperatorSender>) -> (Poll, Feed) {
    let poll = Poll::new().unwrap();
    let signal = Signal::new(Waker::new(poll.registry(), Token(0)).unwrap());
    let feed = Feed::new(signal, RigView::of(&Rig::paper().unwrap()), operator).unwrap();
    (poll, feed)
}

fn record_of(event: RunEvent) -> EventRecord {
    EventRecord { time: 0.0, event }
}

fn record(number: u64) -> FrameRecord {
    FrameRecord {
        number,
        time: number as f64 / 30.0,
        target: Some(Point3::new(0.4, 0.4, 0.15)),
        ..FrameRecord::default()
    }
}

fn report(state: State, target: Option<u16>) -> BoardReport {
    BoardReport {
        time: 0.0,
        state,
        configuration: Some(1),
        target,
        sequence: None,
        motors: [1.0, -0.5, 0.0].into(),
        rates: [1.0, -0.098, 0.0].into(),
        error: [0.0; 3],
        bad_frames: 0,
        late_ticks: 0,
        tensions: None,
        reference: None,
        drivers: None,
    }
}

#[test]
fn memory_is_bounded_and_a_late_client_gets_the_newest() {
    let (_poll, feed) = feed();
    for number in 0..10 * SAMPLES as u64 {
        feed.frame(&record(number));
        feed.event(&record_of(RunEvent::FrameLost { message: "torn".into() }));
    }
    let news = feed.shared.lock();
    assert_eq!((news.samples.items.len(), news.events.items.len()), (SAMPLES, EVENTS));
    drop(news);
    let mut cursor = Cursor::default();
    let update = feed.next_update(0, &mut cursor);
    assert_eq!((update.samples.len(), update.missed), (SAMPLES, 0));
    assert_eq!(update.samples.last().unwrap().0, 10 * SAMPLES as u64 - 1);
    let next = feed.next_update(1, &mut cursor);
    assert_eq!((next.samples.len(), next.events.len()), (0, 0));
    for number in 0..SAMPLES as u64 + 7 {
        feed.frame(&record(number));
    }
    let late = feed.next_update(2, &mut cursor);
    assert_eq!((late.samples.len(), late.missed), (SAMPLES, 7));
}

#[test]
fn what_the_board_has_not_said_is_unknown() {
    let (_poll, feed) = feed();
    let mut cursor = Cursor::default();
    let before = feed.next_update(0, &mut cursor);
    assert_eq!((before.observation, before.telemetry, before.goal), (None, None, None));
    feed.frame(&record(0));
    let update = to_value(feed.next_update(1, &mut cursor)).unwrap();
    assert!(update["telemetry"].is_null() && update["observation"]["position_m"].is_null());
    let mut telemetry = |record: FrameRecord| {
        feed.frame(&record);
        to_value(feed.next_update(2, &mut cursor).telemetry).unwrap()
    };
    let board = report(State::Ready, None);
    let with = |board| FrameRecord { board: Some(board), ..record(1) };
    let told = telemetry(with(board));
    assert_eq!(told["state"], "ready");
    assert!(told["filtered_error_m"].is_null() && told["fault"].is_null(), "{told}");
    assert_eq!(told["rates_steps_s"], json!([1.0, -0.098, 0.0]));
    assert_eq!(told["motors_steps"], json!([1.0, -0.5, 0.0]));
    assert!(told["tensions_weights"].is_null() && told["near_slack"].is_null(), "{told}");
    let tensions = Some([128.0, 38.0, 39.0].map(|tension| tension / 256.0).into());
    let told = telemetry(with(BoardReport { tensions, ..board }));
    assert_eq!(told["tensions_weights"], json!([0.5, 0.148, 0.152]));
    assert_eq!(told["near_slack"], json!([false, true, false]));
    let hot = DriverReading { is_hot: true, ..DriverReading::default() };
    let drivers = Some([DriverReading::default(), hot, DriverReading::default()].into());
    assert_eq!(telemetry(with(BoardReport { drivers, ..board }))["driver_warnings"], "B hot");
    let faulted = with(report(State::Fault(Fault::PositionLost), Some(3)));
    let told = telemetry(FrameRecord { filtered_error: Some(0.0015), ..faulted });
    assert_eq!((&told["state"], &told["filtered_error_m"]), (&json!("fault"), &json!(0.0015)));
    assert_eq!(told["fault"], Fault::PositionLost.to_string());
}

#[test]
fn a_target_is_reached_once_the_run_confirms_it() {
    let (_poll, feed) = feed();
    let goal = |feed: &Feed| feed.next_update(0, &mut Cursor::default()).goal.unwrap();
    let set = RunEvent::TargetSet { number: 0, target: Point3::new(0.4, 0.4, 0.15) };
    feed.event(&record_of(set.clone()));
    // Holding is the board's word; the run compares it with the picture.
    feed.frame(&FrameRecord { board: Some(report(State::Holding, Some(1))), ..record(0) });
    assert!(!goal(&feed).reached && goal(&feed).ending.is_none());
    feed.event(&record_of(RunEvent::TargetEnded { number: 0, reason: StopReason::Reached }));
    assert!(goal(&feed).reached);
    feed.event(&record_of(set.clone()));
    assert!(!goal(&feed).reached, "another target");
    feed.event(&record_of(RunEvent::TargetEnded { number: 1, reason: StopReason::Timeout }));
    assert_eq!(goal(&feed).ending.as_deref(), Some("not reached in time"));
}

#[test]
fn a_gesture_moves_the_target_of_the_run_and_a_new_one_begins_another_motion() {
    let (sender, mut receiver) = operator();
    let mut targets = receiver.take_targets().unwrap();
    let (_poll, feed) = feed_with(Some(sender));
    let move_to =
        |x: f64, more: &str| format!(r#"{{"type":"move","x":{x},"y":0.3,"z":0.2{more}}}"#);
    let first = r#","first":true"#;
    let refused = feed.take(&move_to(0.4, ""), 1).unwrap_err();
    assert!(refused.contains("`first`"), "{refused}");
    for (x, more) in [(0.40, first), (0.41, ""), (0.42, ""), (0.5, first)] {
        assert_eq!(feed.take(&move_to(x, more), 1), Ok(Received::Command));
    }
    // The gesture of one page is none of another.
    assert!(feed.take(&move_to(0.6, ""), 2).is_err());
    let taken = targets.take(10.0).targets;
    let places: Vec<f64> = taken.iter().map(|target| target.position.x).collect();
    assert_eq!(places, [0.40, 0.41, 0.42, 0.5]);
    assert!(taken[0].motion == taken[2].motion && taken[3].motion > taken[2].motion);
    assert_eq!(targets.newest_motion(), taken[3].motion);
    feed.release_absent(&|_| false);
    assert!(feed.take(&move_to(0.4, ""), 1).is_err(), "the page is another one");
}

#[test]
fn a_page_that_only_shows_moves_no_target() {
    let (_poll, feed) = feed();
    let message = r#"{"type":"move","x":0.4,"y":0.3,"z":0.2,"first":true}"#;
    assert_eq!(feed.take(message, 1), Err(SHOWS_ONLY.to_owned()));
}

#[test]
fn a_stop_holds_for_every_page_until_a_resume_names_it() {
    let (sender, _receiver) = operator();
    let (_poll, feed) = feed_with(Some(sender));
    feed.arrive(1, ([127, 0, 0, 1], 4000).into());
    feed.arrive(2, ([192, 168, 1, 7], 4000).into());
    let stop = |feed: &Feed| feed.next_update(0, &mut Cursor::default()).stop;
    let target = r#"{"type":"target","x":0.4,"y":0.3,"z":0.2}"#;
    let first = r#"{"type":"move","x":0.4,"y":0.3,"z":0.2,"first":true}"#;
    let jog = r#"{"type":"jog","motor":"B","steps":5,"rate":5}"#;
    assert_eq!(stop(&feed), None);
    assert_eq!(feed.take(r#"{"type":"stop"}"#, 2), Ok(Received::Command));
    for text in [target, first, jog, r#"{"type":"hold"}"#] {
        for client in [1, 2] {
            let refused = feed.take(text, client).unwrap_err();
            assert!(refused.contains("Resume first"), "{refused}");
        }
    }
    let held = stop(&feed).unwrap();
    assert_eq!((held.number, held.by.as_str(), held.refused), (1, "page 2 at 192.168.1.7", 8));
    let refused = feed.take(r#"{"type":"resume","stop":7}"#, 1).unwrap_err();
    assert!(refused.contains("command 1"), "{refused}");
    for text in [r#"{"type":"clear"}"#, r#"{"type":"end"}"#, r#"{"type":"resume","stop":1}"#] {
        assert_eq!(feed.take(text, 1), Ok(Received::Command));
    }
    assert_eq!(stop(&feed), None);
    let refused = feed.take(target, 1).unwrap_err();
    assert!(refused.contains("begin anew"), "{refused}");
    feed.arrive(3, ([127, 0, 0, 1], 4001).into());
    assert_eq!(feed.take(target, 3), Ok(Received::Command));
}

#[test]
fn a_page_that_vanishes_in_a_jog_ramps_down_without_a_stop_that_holds() {
    let (sender, receiver) = operator();
    let (_poll, feed) = feed_with(Some(sender.clone()));
    feed.take(r#"{"type":"jog","motor":"B","steps":5,"rate":5}"#, 1).unwrap();
    feed.release_absent(&|_| false);
    assert_eq!(sender.stop(), None);
    drop(receiver);
}

/// Returns a feed of a rig that a camera at `x` = 1.7 m sees, with one frame; `watched` where a
/// page is open.
fn seen(watched: bool) -> (Poll, Feed) {
    let intrinsics = Intrinsics {
        fx: 500.0,
        fy: 500.0,
        cx: 319.5,
        cy: 239.5,
        depth_scale: 1000.0,
        distortion: None,
    };
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(0.5, -0.5, -0.5, 0.5));
    let pose = Isometry3::from_parts(Vector3::new(1.7, 0.3, 0.3).into(), turn);
    let camera = Camera::new(intrinsics, pose, 0.08);
    let poll = Poll::new().unwrap();
    let signal = Signal::new(Waker::new(poll.registry(), Token(0)).unwrap());
    signal.set_watchers(usize::from(watched));
    let rig = RigView::of(&Rig::paper().unwrap()).seen_by(&camera);
    let feed = Feed::new(signal, rig, None).unwrap();
    let (colour, depth) = (Image::filled(640, 480, [0; 3]), Image::filled(640, 480, 0));
    let frame = RgbdFrame::new(0.0, colour, depth, intrinsics).unwrap();
    feed.frame(&FrameRecord { frame: Some(Arc::new(frame)), ..record(0) });
    (poll, feed)
}

/// Returns the answer to a question of a page.
fn asked(feed: &Feed, question: &str) -> serde_json::Value {
    match feed.take(question, 1) {
        Ok(Received::Answered(text)) => serde_json::from_str(&text).unwrap(),
        other => panic!("{question}: {other:?}"),
    }
}

#[test]
fn questions_about_the_picture_are_answered_and_move_nothing() {
    let (_poll, feed) = seen(true);
    let hello: serde_json::Value = serde_json::from_str(feed.hello()).unwrap();
    assert_eq!(hello["rig"]["sight"], "x");
    // The target of the frame, (0.4, 0.4, 0.15).
    let update = feed.next_update(0, &mut Cursor::default());
    let target = [319.5 + 500.0 * 0.1 / 1.3, 239.5 + 500.0 * 0.15 / 1.3];
    let found = update.observation.unwrap().target_px.unwrap();
    assert!((found[0] - target[0]).hypot(found[1] - target[1]) < 0.1, "{found:?}");

    let pick = r#"{"type":"pick","u":358,"v":297.2,"x":0.4,"y":0.2,"z":0.5,"depth":true}"#;
    let picked = asked(&feed, pick);
    assert_eq!((&picked["type"], &picked["by"]), (&"picked".into(), &"plane".into()));
    let point: Vec<f64> = serde_json::from_value(picked["point"].clone()).unwrap();
    assert!((point[1] - 0.4).hypot(point[2] - 0.15) < 1e-3 && point[0] == 0.4, "{point:?}");
    let projected = asked(&feed, r#"{"type":"project","x":0.4,"y":0.3,"z":0.3}"#);
    assert_eq!(projected["pixel"], serde_json::json!([319.5, 239.5]));
    assert_eq!(projected["plane"]["axis"], "x");

    for (u, reason) in [("-1", "outside the picture"), ("1e300", "outside the picture")] {
        let question = pick.replace("358", u);
        let refused = asked(&feed, &question);
        assert!(refused["point"].is_null());
        assert!(refused["text"].as_str().unwrap().contains(reason), "{refused}");
    }
    let far = asked(&feed, r#"{"type":"project","x":1e300,"y":-1e300,"z":0.3}"#);
    assert!(far["pixel"].is_null(), "{far}");
    assert_eq!(feed.next_update(0, &mut Cursor::default()).goal, None);
}

#[test]
fn without_a_picture_or_a_pose_a_click_means_nothing() {
    let pick = r#"{"type":"pick","u":1,"v":2,"x":0.4,"y":0.2,"z":0.5,"depth":false}"#;
    let project = r#"{"type":"project","x":0.4,"y":0.3,"z":0.3}"#;
    for ((_poll, feed), reason) in [(seen(false), "no picture"), (feed(), "where the camera is")] {
        let picked = asked(&feed, pick);
        assert!(picked["text"].as_str().unwrap().contains(reason), "{picked}");
        let projected = asked(&feed, project);
        assert!(projected["pixel"].is_null() && projected["plane"].is_null());
    }
}
