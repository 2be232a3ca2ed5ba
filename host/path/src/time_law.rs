//! Arc length over time.
//!
//! A [`Profile`] has an acceleration that jumps. Its moving average over a window of time bounds
//! the jerk: the arc length at a time is the mean of the profile's arc lengths within the window.
//! Speed and acceleration of the mean stay within those of the profile, because a mean does not
//! exceed its largest element. Source: Biagiotti, Melchiorri, "Trajectory planning for automatic
//! machines and robots", Springer 2008 (trajectories by filters).

use crate::profile::{Node, Profile, reachable};

/// Arc length over time, with a continuous acceleration.
#[derive(Debug, Clone)]
pub(crate) struct TimeLaw {
    /// Instants of the profile, between which its acceleration is constant.
    instants: Vec<Instant>,
    /// Length of the moving average, seconds.
    window: f64,
    /// The laps of a loop; `None` where the ball stops at the end.
    pub(crate) laps: Option<Laps>,
}

/// Repetition of a loop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Laps {
    /// Time from which on each lap is as the one before, seconds.
    pub(crate) begin: f64,
    /// Time of a lap, seconds.
    pub(crate) period: f64,
}

/// Instant of a profile.
#[derive(Debug, Clone, Copy, Default)]
struct Instant {
    /// Time, seconds.
    time: f64,
    /// Arc length, metres.
    s: f64,
    /// Speed, m/s.
    speed: f64,
    /// Integral of the arc length over the time, m·s.
    area: f64,
}

/// Arc length and its derivatives by the time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    /// Arc length, metres.
    pub(crate) s: f64,
    /// Speed, m/s.
    pub(crate) speed: f64,
    /// Acceleration along the curve, m/s².
    pub(crate) acceleration: f64,
}

impl Instant {
    /// Returns the instant after another one, at the arc length `s` and with this speed.
    fn after(&self, s: f64, speed: f64) -> Self {
        let time = self.time + 2.0 * (s - self.s) / (self.speed + speed);
        self.at(time, speed)
    }

    /// Returns the instant at a later time with this speed, by a constant acceleration.
    fn at(&self, time: f64, speed: f64) -> Self {
        let elapsed = time - self.time;
        Self {
            time,
            s: self.s + (self.speed + speed) / 2.0 * elapsed,
            speed,
            area: self.area + elapsed * (self.s + elapsed * (self.speed / 3.0 + speed / 6.0)),
        }
    }
}

impl TimeLaw {
    /// Returns the time law of an open curve.
    pub(crate) fn once(profile: &Profile) -> Self {
        let mut law = Self::begin(profile.window);
        law.run(&profile.nodes, 0.0);
        law
    }

    /// Returns the time law of a closed curve, from rest. Where that takes longer than `longest`,
    /// seconds, the laps begin after that time.
    pub(crate) fn round(profile: &Profile, longest: f64) -> Self {
        let mut law = Self::begin(profile.window);
        let length = profile.nodes[profile.nodes.len() - 1].s;
        let (mut lap, mut speed) = (profile.nodes.clone(), 0.0);
        let mut laps = 0.0;
        while speed < profile.nodes[0].speed || laps == 0.0 {
            speed = accelerate(&mut lap, &profile.nodes, speed);
            law.run(&lap, laps * length);
            laps += 1.0;
            if is_longer(law.end().time, longest) {
                law.laps = Some(Laps { begin: law.end().time, period: 0.0 });
                return law;
            }
        }
        let before = law.end().time;
        law.run(&profile.nodes, laps * length);
        let period = law.end().time - before;
        let begin = before + law.window;
        if is_longer(begin + period + law.window, longest) {
            law.laps = Some(Laps { begin: begin + law.window, period });
            return law;
        }
        while law.end().time < begin + period + law.window {
            laps += 1.0;
            law.run(&profile.nodes, laps * length);
        }
        law.laps = Some(Laps { begin, period });
        law
    }

    /// Returns the times at which the acceleration of the profile jumps, seconds, in their order,
    /// and the time of the end.
    pub(crate) fn jumps(&self) -> impl Iterator<Item = f64> {
        self.instants.iter().map(|instant| instant.time).chain([self.duration()])
    }

    fn begin(window: f64) -> Self {
        Self { instants: vec![Instant::default()], window, laps: None }
    }

    fn end(&self) -> Instant {
        self.instants.last().copied().unwrap_or_default()
    }

    /// Adds the nodes of a profile, at arc lengths that begin at `start`. At a stop the ball rests
    /// for the length of the window, so that the mean comes to rest as well.
    fn run(&mut self, nodes: &[Node], start: f64) {
        for pair in nodes.windows(2) {
            if pair[0].stops && self.instants.len() > 1 {
                let end = self.end();
                self.instants.push(end.at(end.time + self.window, 0.0));
            }
            self.instants.push(self.end().after(start + pair[1].s, pair[1].speed));
        }
    }

    /// Returns the time from rest to rest, seconds.
    pub(crate) fn duration(&self) -> f64 {
        self.end().time + self.window
    }

    /// Returns the motion at a time, seconds.
    pub(crate) fn at(&self, time: f64) -> Motion {
        let time = match self.laps {
            Some(Laps { begin, period }) if time > begin + period => {
                begin + (time - begin).rem_euclid(period)
            }
            _ => time.clamp(0.0, self.duration()),
        };
        let (from, to) = (self.instant(time - self.window), self.instant(time));
        Motion {
            s: (to.area - from.area) / self.window,
            speed: (to.s - from.s) / self.window,
            acceleration: (to.speed - from.speed) / self.window,
        }
    }

    /// Returns the profile at a time, seconds: at rest before its start and after its end.
    fn instant(&self, time: f64) -> Instant {
        let next = self.instants.partition_point(|instant| instant.time <= time);
        if next == 0 {
            return Instant::default();
        }
        let from = self.instants[next - 1];
        let Some(to) = self.instants.get(next) else { return from.at(time, 0.0) };
        let share = (time - from.time) / (to.time - from.time);
        from.at(time, from.speed + share * (to.speed - from.speed))
    }
}

/// Returns whether `time` is above `longest`, or no number.
fn is_longer(time: f64, longest: f64) -> bool {
    time.is_nan() || time > longest
}

/// Sets the speeds of `lap` to those of a ball that begins it at `speed`, m/s, and goes as fast as
/// `limit` allows. Returns its speed at the end, m/s.
fn accelerate(lap: &mut [Node], limit: &[Node], speed: f64) -> f64 {
    lap[0].speed = speed.min(limit[0].speed);
    for i in 1..lap.len() {
        lap[i].speed = limit[i].speed.min(reachable(&lap[i - 1], &lap[i]));
    }
    lap[lap.len() - 1].speed
}
