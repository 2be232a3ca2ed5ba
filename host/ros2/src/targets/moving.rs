//! Targets that move, from a topic: which publisher is followed, and from when to when.

use std::time::{Duration, Instant};

use nalgebra::Point3;
use plumb_runtime::targets::{MotionId, Omission, TargetClock, TargetLine, TargetSender};
use ros2_client::Gid;

use super::admission::TargetRefusal;
use crate::message::Header;
use crate::senders::RECENT;

/// Targets that move between a topic and the control loop: those of one publisher at a time.
#[derive(Debug)]
pub(crate) struct MovingGate {
    targets: TargetSender,
    /// Name of the topic, for messages.
    topic: String,
    /// Zero of the host's clock.
    zero: Instant,
    stream: Option<Stream>,
}

/// Targets of one publisher.
#[derive(Debug)]
struct Stream {
    publisher: Gid,
    clock: TargetClock,
    /// The motion that they belong to; `None` before the first of them.
    motion: Option<MotionId>,
    /// Time of the last message.
    last: Instant,
}

impl Stream {
    /// Returns a stream that begins at `now`.
    fn new(publisher: Gid, now: Instant) -> Self {
        let clock = TargetClock::default();
        Self { publisher, clock, motion: None, last: now }
    }
}

impl MovingGate {
    /// Returns a gate between `topic` and a run that takes targets from `targets`.
    pub(crate) fn new(targets: TargetSender, topic: String) -> Self {
        Self { targets, topic, zero: Instant::now(), stream: None }
    }

    /// Sends a target of `publisher` at `position`, metres in the rig frame, to the run. It came at
    /// `now`, and the publisher `was_silent` before it. A stamp of 0 is none: the time of the
    /// arrival counts.
    ///
    /// # Errors
    /// Where the ball does not follow this publisher, or the target is out of range, out of order
    /// or late.
    pub(crate) fn offer(
        &mut self,
        publisher: Gid,
        header: &Header,
        position: Point3<f64>,
        was_silent: bool,
        now: Instant,
    ) -> Result<(), TargetRefusal> {
        self.check_publisher(publisher, was_silent, now)?;
        let arrival = now.saturating_duration_since(self.zero).as_secs_f64();
        let stream = self.stream.get_or_insert_with(|| Stream::new(publisher, now));
        stream.last = now;
        let t = Some(header.seconds()).filter(|t| *t != 0.0);
        let line = TargetLine::new(t, position, None).map_err(Omission::from);
        let time = line.and_then(|line| stream.clock.time(line.t, arrival));
        let time = time.inspect_err(|Omission { problem, kind }| {
            let problem = format!("{}: {problem}", self.topic);
            self.targets.reject(problem, |left_out| kind.count(left_out));
        })?;
        let motion = *stream.motion.get_or_insert_with(|| self.targets.begin());
        let at = self.zero + Duration::try_from_secs_f64(time).unwrap_or_default();
        self.targets.send(motion, at, position, None);
        Ok(())
    }

    /// Checks that the ball may follow `publisher`. Forgets a publisher that another one follows.
    ///
    /// # Errors
    /// Where the motion has ended, or the ball follows another publisher.
    fn check_publisher(
        &mut self,
        publisher: Gid,
        was_silent: bool,
        now: Instant,
    ) -> Result<(), TargetRefusal> {
        let Some(stream) = &self.stream else { return Ok(()) };
        let is_same = stream.publisher == publisher;
        let has_ended = stream.motion.is_some_and(|motion| self.targets.has_ended(motion));
        let is_late = now.saturating_duration_since(stream.last) > RECENT;
        match (has_ended, is_same) {
            // What was sending then, also in vain, begins anew first.
            (true, _) if !was_silent => Err(TargetRefusal::MotionEnded),
            (false, true) => Ok(()),
            (false, false) if !is_late => Err(TargetRefusal::OtherPublisher),
            _ => {
                self.stream = None;
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use plumb_runtime::operator::BEGINS_ANEW_AFTER;
    use plumb_runtime::targets::{
        Arrivals, OmissionKind, TargetReceiver, TargetSource, target_channel,
    };

    use super::*;
    use crate::message::Time;

    /// A gate, its run, and the time.
    struct Bench {
        gate: MovingGate,
        run: TargetReceiver,
        now: Instant,
        /// Times of the publishers' last targets.
        last: HashMap<u8, Instant>,
    }

    impl Bench {
        fn new() -> Self {
            let (sender, mut run) = target_channel();
            // The run has begun: of targets from before only the last would count.
            assert_eq!(run.take(0.0), Arrivals::default());
            let mut gate = MovingGate::new(sender, "/plumb/moving_target".to_owned());
            // The times of the test are past when the run takes the targets.
            gate.zero -= Duration::from_secs(60);
            let now = gate.zero;
            Self { gate, run, now, last: HashMap::new() }
        }

        /// Lets time pass.
        fn wait(&mut self, milliseconds: u64) {
            self.now += Duration::from_millis(milliseconds);
        }

        /// Offers a target with a stamp, milliseconds.
        fn offer(&mut self, publisher: u8, stamp: u64, x: f64) -> Result<(), TargetRefusal> {
            let stamp = Time::from_nanoseconds(stamp * 1_000_000);
            let header = Header { stamp, frame_id: "plumb/rig".to_owned() };
            let last = self.last.insert(publisher, self.now);
            let was_silent = last.is_none_or(|last| self.now - last > BEGINS_ANEW_AFTER);
            let (publisher, place) = (Gid::from([publisher; 16]), Point3::new(x, 0.3, 0.2));
            self.gate.offer(publisher, &header, place, was_silent, self.now)
        }

        /// Returns what has come to the run, with the coordinate x of the targets.
        fn take(&mut self) -> (Vec<f64>, Arrivals) {
            let arrivals = self.run.take(0.0);
            (arrivals.targets.iter().map(|target| target.position.x).collect(), arrivals)
        }
    }

    #[test]
    fn targets_have_the_times_of_their_stamps_and_one_motion() {
        let mut bench = Bench::new();
        bench.offer(1, 5_000, 0.40).unwrap();
        bench.wait(100);
        // 60 ms late.
        bench.offer(1, 5_040, 0.41).unwrap();
        bench.wait(10);
        bench.offer(1, 5_110, 0.42).unwrap();
        let (places, Arrivals { targets, .. }) = bench.take();
        assert_eq!(places, [0.40, 0.41, 0.42]);
        assert!(targets.iter().all(|target| target.motion == targets[0].motion));
        let apart = [1, 2].map(|k| targets[k].time - targets[0].time);
        assert!((apart[0] - 0.04).abs() < 1e-3 && (apart[1] - 0.11).abs() < 1e-3, "{apart:?}");
    }

    #[test]
    fn a_target_without_a_stamp_has_the_time_of_its_arrival() {
        let mut bench = Bench::new();
        for (wait, x) in [(0, 0.40), (70, 0.41)] {
            bench.wait(wait);
            bench.offer(1, 0, x).unwrap();
        }
        let (_, Arrivals { targets, .. }) = bench.take();
        assert!((targets[1].time - targets[0].time - 0.07).abs() < 1e-9);
    }

    #[test]
    fn what_is_late_out_of_order_or_out_of_range_is_left_out_and_counted() {
        let mut bench = Bench::new();
        bench.offer(1, 5_000, 0.40).unwrap();
        let kind = |result: Result<(), TargetRefusal>| match result {
            Err(TargetRefusal::LeftOut(omission)) => omission.kind,
            other => panic!("{other:?}"),
        };
        assert_eq!(kind(bench.offer(1, 4_990, 0.41)), OmissionKind::OutOfOrder);
        bench.wait(700);
        assert_eq!(kind(bench.offer(1, 5_100, 0.42)), OmissionKind::Late);
        assert_eq!(kind(bench.offer(1, 5_700, 420.0)), OmissionKind::Unreadable);
        let (places, Arrivals { left_out, problems, .. }) = bench.take();
        assert_eq!(places, [0.40]);
        assert_eq!((left_out.out_of_order, left_out.late, left_out.unreadable), (1, 1, 1));
        assert_eq!(
            problems[0],
            "/plumb/moving_target: the time stamp is 0.010 s before the newest one"
        );
    }

    #[test]
    fn another_publisher_is_refused_until_the_first_is_silent() {
        let mut bench = Bench::new();
        bench.offer(1, 0, 0.40).unwrap();
        bench.wait(900);
        assert_eq!(bench.offer(2, 0, 0.50), Err(TargetRefusal::OtherPublisher));
        bench.wait(200);
        bench.offer(2, 0, 0.51).unwrap();
        assert_eq!(bench.offer(1, 0, 0.41), Err(TargetRefusal::OtherPublisher));
        let (places, Arrivals { targets, .. }) = bench.take();
        assert_eq!(places, [0.40, 0.51]);
        assert!(targets[0].motion < targets[1].motion);
    }

    #[test]
    fn a_motion_that_was_ended_begins_anew_after_a_second_of_silence_only() {
        let mut bench = Bench::new();
        bench.offer(1, 0, 0.40).unwrap();
        assert_eq!(bench.offer(2, 0, 0.50), Err(TargetRefusal::OtherPublisher));
        bench.run.cancel();
        // Neither the publisher nor one that was there too goes on, however long they send.
        for _ in 0..30 {
            bench.wait(100);
            assert_eq!(bench.offer(1, 0, 0.40), Err(TargetRefusal::MotionEnded));
            assert_eq!(bench.offer(2, 0, 0.50), Err(TargetRefusal::MotionEnded));
        }
        bench.wait(900);
        assert_eq!(bench.offer(2, 0, 0.50), Err(TargetRefusal::MotionEnded));
        assert_eq!(bench.take().0, [0.40]);
        bench.wait(101);
        bench.offer(1, 0, 0.42).unwrap();
        assert_eq!(bench.take().0, [0.42]);
    }

    #[test]
    fn another_motion_ends_the_stream() {
        let mut bench = Bench::new();
        bench.offer(1, 0, 0.40).unwrap();
        let _drag = bench.gate.targets.begin();
        let refused = bench.offer(1, 0, 0.41);
        assert_eq!(refused, Err(TargetRefusal::MotionEnded));
    }
}
