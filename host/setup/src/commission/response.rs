//! Response of the ball to the jogs of one motor.

use nalgebra::Vector3;

/// Shortest displacement that counts as motion, metres.
const LEAST_MOTION_M: f64 = 0.003;

/// Largest part of a displacement that may remain after the motor has turned back.
const LARGEST_REMAINDER: f64 = 0.3;

/// Largest ratio of the displacements for a step where the ball moves in one direction only.
const ONE_WAY: f64 = 0.2;

/// Largest part of the displacement that may remain there: on a slack cable the ball swings.
const ONE_WAY_REMAINDER: f64 = 0.6;

/// Displacements below this multiple of their standard deviation do not count.
const SIGNIFICANT: f64 = 5.0;

/// One jog away from the start and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Distance of the jog, full steps; + is to pay out.
    pub steps: f64,
    /// Displacement of the ball at the far end, metres.
    pub moved: Vector3<f64>,
    /// Displacement of the ball that remains after the motor has turned back, metres.
    pub remainder: Vector3<f64>,
    /// Standard deviation of a displacement along one axis, metres.
    pub sd: f64,
}

impl Probe {
    fn has_moved(&self) -> bool {
        self.moved.norm() > self.threshold()
    }

    fn threshold(&self) -> f64 {
        LEAST_MOTION_M.max(SIGNIFICANT * self.sd)
    }
}

/// Responses of the ball to the motor of one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Jog in the direction that is to pay out.
    pub out: Probe,
    /// Jog in the direction that is to wind in.
    pub wound: Probe,
}

/// Kind of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// The ball follows the motor both ways.
    Follows {
        /// Displacement of the ball for a step that is to pay out, metres.
        per_step: Vector3<f64>,
        /// Its standard deviation along one axis, metres.
        sd: f64,
    },
    /// The ball does not move.
    Still,
    /// The ball moves in one direction of the motor only: the cable is slack.
    OneWay,
    /// The ball does not come back when the motor turns back: the cable slips.
    Slips {
        /// Distance that remains, metres.
        remainder: f64,
    },
}

impl Response {
    /// Returns the kind of the response.
    pub fn motion(&self) -> Motion {
        let remainder = self.largest_remainder();
        match (self.out.has_moved(), self.wound.has_moved()) {
            (false, false) => Motion::Still,
            _ if self.is_one_way() => Motion::OneWay,
            _ if remainder > 0.0 => Motion::Slips { remainder },
            _ => self.follows(),
        }
    }

    /// Returns whether the ball moves in one direction only, and comes back from there.
    fn is_one_way(&self) -> bool {
        let by_step = |probe: &Probe| probe.moved.norm() / probe.steps.abs();
        let (strong, weak) = if by_step(&self.out) > by_step(&self.wound) {
            (&self.out, &self.wound)
        } else {
            (&self.wound, &self.out)
        };
        by_step(weak) < ONE_WAY * by_step(strong)
            && strong.remainder.norm() < ONE_WAY_REMAINDER * strong.moved.norm()
    }

    fn follows(&self) -> Motion {
        let Self { out, wound } = self;
        let per_step = (out.moved / out.steps + wound.moved / wound.steps) / 2.0;
        let sd = (out.sd / out.steps).hypot(wound.sd / wound.steps) / 2.0;
        Motion::Follows { per_step, sd }
    }

    /// Returns the largest remainder that counts, metres; 0 where none does.
    fn largest_remainder(&self) -> f64 {
        let counts = |probe: &&Probe| {
            let least = probe.threshold().max(LARGEST_REMAINDER * probe.moved.norm());
            probe.remainder.norm() > least
        };
        let probes = [&self.out, &self.wound];
        probes.into_iter().filter(counts).map(|probe| probe.remainder.norm()).fold(0.0, f64::max)
    }
}
