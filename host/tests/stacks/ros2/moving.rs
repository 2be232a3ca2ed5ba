//! A node publishes a target that moves.

use std::sync::PoisonError;

use serde_json::{Value, json};

use super::peer::{Domain, Peer};
use super::run::{PAPER, Run, TURN, endings, target};

/// Middle of the circle on which the target moves, metres.
const CENTRE: [f64; 3] = [0.45, 0.30, 0.32];

/// Name of the status of targets that move.
const STATUS: &str = "/plumb: moving target";

/// Largest root mean square of the distance of the ball from the target, mm. The target moves 50 mm
/// in a second, so this is a lag of 0.2 s. On a busy machine the ball lags more in some pictures,
/// so the largest distance says little.
const NEAR_MM: f64 = 10.0;

/// Waits until the run has taken `more` targets.
fn follow(peer: &mut Peer, more: u64) {
    let taken = |status: &Value| status["values"]["taken"].as_str().unwrap().parse().unwrap();
    let is_moving = |status: &Value| status["name"] == STATUS;
    let first: u64 = taken(&peer.until("status", is_moving));
    peer.until("status", |status| is_moving(status) && taken(status) >= first + more);
}

/// Returns the place of the ball, metres.
fn ball(peer: &mut Peer) -> [f64; 3] {
    let ball = peer.next("ball");
    [0, 1, 2].map(|k| ball["at"][k].as_f64().unwrap())
}

fn assert_near(summary: &Value) {
    let targets = &summary["targets"];
    let rms = targets["error"]["rms_mm"].as_f64().unwrap();
    assert!(rms < NEAR_MM && targets["frames"].as_u64().unwrap() > 60, "{targets}");
}

#[test]
fn the_ball_follows_a_moving_target_until_a_stop_and_again_after_a_resume() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let mut other = Peer::start(&domain, "/plumb", &["--plain"]);
    let run = Run::start(&domain, "/plumb");
    peer.until_held("/plumb", PAPER);
    peer.send(&json!({"circle": CENTRE, "rate": 30}));
    peer.until_status("/plumb: run", "following");
    follow(&mut peer, 200);
    other.send(&json!({"circle": PAPER, "rate": 30}));
    peer.until_status(STATUS, "another node");
    other.send(&json!({"calm": true}));

    assert_eq!(other.call("stop")["success"], true);
    peer.until_status("/plumb: run", "ready");
    let refused = peer.until_status(STATUS, "/plumb/resume");
    assert_eq!(refused["level"], 1, "{refused}");
    let place = ball(&mut peer);
    // Three more reports, while targets come.
    for _ in 0..3 {
        peer.until_status(STATUS, "/plumb/resume");
    }
    peer.assert_ball_at(place);

    // A node that comes now can see who has stopped the rig, and resume.
    let mut late = Peer::start(&domain, "/plumb", &[]);
    let stop = late.until_stop(|stop| stop["by"] == "ROS 2");
    assert!(stop["values"]["number"].as_str().unwrap() != "0", "{stop}");
    let resumed = late.call("resume");
    assert!(resumed["success"] == true, "{resumed}");
    late.until_stop(|stop| stop["number"] == "0");
    // The node that goes on moves nothing.
    for _ in 0..3 {
        peer.until_status(STATUS, "pause for a second");
    }
    peer.assert_ball_at(place);
    peer.send(&json!({"calm": true}));
    peer.next("circled");
    peer.send(&json!({"circle": CENTRE, "rate": 30}));
    peer.until_status("/plumb: run", "following");
    follow(&mut peer, 200);
    // A set point ends the motion, though the node goes on.
    peer.send(&target(PAPER, "plumb/rig"));
    peer.until_held("/plumb", PAPER);
    peer.until_status(STATUS, "has ended the motion");
    // An interruption is a stop.
    run.pause();
    peer.until_joined_again();
    for _ in 0..3 {
        peer.until_status(STATUS, "the rig is stopped");
    }
    peer.assert_ball_at(PAPER);
    let summary = run.end();
    assert_near(&summary);
    let endings = endings(&summary);
    let expected = ["reached", "stopped by the operator", "replaced by another target", "reached"];
    assert_eq!(endings, expected, "{summary}");
}

#[test]
fn a_best_effort_publisher_at_200_hz_is_followed_until_it_vanishes() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let mut tracker = Peer::start(&domain, "/plumb", &[]);
    let run = Run::start(&domain, "/plumb");
    peer.until_held("/plumb", PAPER);
    tracker.send(&json!({"circle": CENTRE, "rate": 200, "sensor_data": true}));
    follow(&mut peer, 1500);
    // The node ends without any notice.
    drop(tracker);
    peer.until_status(STATUS, "no target for a second");
    peer.until_status("/plumb: run", "holding");
    let place = ball(&mut peer);
    for _ in 0..3 {
        peer.until_status(STATUS, "no target for a second");
    }
    peer.assert_ball_at(place);
    let summary = run.end();
    assert_near(&summary);
    assert!(summary["targets"]["pauses"].as_u64().unwrap() >= 1, "{summary}");
}
