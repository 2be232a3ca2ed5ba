//! The pins of the drivers: what PIO0 gives at STEP and DIR.

use plumb_protocol::wiring::Pins;

/// Pulses at one motor's pins.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pulses {
    /// Rising edges.
    pub count: u64,
    /// Sum of the pulses, + with DIR high.
    pub position: i64,
    /// Cycle of the last rising edge.
    pub rise: Option<u64>,
}

/// Counter of the pulses at a board's pins, which are not inverted.
#[derive(Debug, Clone)]
pub struct Counter {
    /// STEP and DIR of each motor, a bit each.
    pins: [[u32; 2]; 3],
    /// The last levels.
    levels: u32,
    /// The pulses so far.
    pub motors: [Pulses; 3],
    /// Rising edges of each motor, cycles, while they are listed.
    pub rises: Option<[Vec<u64>; 3]>,
}

impl Counter {
    /// Creates the counter for a board's pins.
    pub fn new(pins: &Pins) -> Self {
        let bit = |number: u8| 1 << number;
        let pins = pins.motors.map(|m| [bit(m.step.number), bit(m.direction.number)]);
        let pins = pins.steppable([0; 2]);
        Self { pins, levels: 0, motors: [Pulses::default(); 3], rises: None }
    }

    /// Looks at the levels of all pins, at a cycle.
    pub fn look(&mut self, levels: u32, cycle: u64) {
        let rising = levels & !self.levels;
        self.levels = levels;
        for (i, ([step, direction], motor)) in self.pins.iter().zip(&mut self.motors).enumerate() {
            if rising & step != 0 {
                motor.count += 1;
                motor.position += if levels & direction != 0 { 1 } else { -1 };
                motor.rise = Some(cycle);
                if let Some(rises) = &mut self.rises {
                    rises[i].push(cycle);
                }
            }
        }
    }
}
