//! Keys that turn motors. A terminal reports no release of a key: a held key repeats, and a motor
//! turns on while the repeats arrive.

use std::time::Duration;

/// Names of the motors in their order.
pub(super) const NAMES: [char; 3] = ['A', 'B', 'C'];

/// Steps of a tap, full steps: about a millimetre of cable.
const TAP_STEPS: f64 = 2.0;

/// Most steps of one jog while a key is held, full steps. The next jog follows while it is held.
const HELD_STEPS: f64 = 200.0;

/// Longest time between two repeats of a held key. Terminals repeat every 20 to 50 ms.
const REPEAT_GAP: Duration = Duration::from_millis(120);

/// Silence of a held key after which the motor stops.
const SILENCE: Duration = Duration::from_millis(150);

/// Key of the dialogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    /// Selects a motor by its index.
    Select(u8),
    /// Pays cable out.
    Out,
    /// Winds cable in.
    In,
    /// Stops the motor.
    Stop,
    /// Ends the dialogue.
    Quit,
}

/// Decoder of the bytes of a terminal. It leaves escape sequences, such as those of the arrow keys,
/// out: their letters select no motor.
#[derive(Debug, Default)]
pub(super) struct KeyDecoder {
    escape: Escape,
}

/// Position in an escape sequence.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum Escape {
    #[default]
    None,
    /// After ESC.
    Begun,
    /// After ESC and `[` or `O`, until a letter or `~`.
    Inside,
}

impl KeyDecoder {
    /// Decodes a byte. Returns `None` for bytes without a meaning.
    pub(super) fn decode(&mut self, byte: u8) -> Option<Key> {
        match (self.escape, byte) {
            (_, 0x1b) => self.escape = Escape::Begun,
            (Escape::Begun, b'[' | b'O') => self.escape = Escape::Inside,
            (Escape::Begun, _) => self.escape = Escape::None,
            (Escape::Inside, 0x40..=0x7e) => self.escape = Escape::None,
            (Escape::Inside, _) => {}
            (Escape::None, byte) => return key(byte),
        }
        None
    }
}

/// Returns the key of a byte.
fn key(byte: u8) -> Option<Key> {
    Some(match byte {
        b'a' | b'A' => Key::Select(0),
        b'b' | b'B' => Key::Select(1),
        b'c' | b'C' => Key::Select(2),
        b'+' | b'=' | b'o' | b'O' => Key::Out,
        b'-' | b'_' | b'i' | b'I' => Key::In,
        b' ' => Key::Stop,
        // Ctrl-C and Ctrl-D, where the terminal makes no signal of them.
        b'q' | b'Q' | 3 | 4 => Key::Quit,
        _ => return None,
    })
}

/// Command to the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Motion {
    /// Begins a jog of the selected motor.
    Jog {
        /// Index of the motor.
        motor: u8,
        /// Distance, full steps; + pays out.
        steps: f64,
    },
    /// Ramps down.
    Stop,
}

/// Key that turns a motor.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Press {
    /// +1 pays out, -1 winds in.
    direction: f64,
    /// Time of the last repeat.
    last: Duration,
    /// Whether repeats have arrived.
    held: bool,
    /// State of the tap's jog.
    tap: Tap,
}

/// State of a tap's jog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tap {
    /// It has not begun.
    Due,
    /// The motor turns.
    Turning,
    /// The motor stands.
    Done,
}

/// State of the keys.
#[derive(Debug, Default)]
pub(super) struct KeyJogger {
    motor: u8,
    press: Option<Press>,
    stop: bool,
}

impl KeyJogger {
    /// Returns the index of the selected motor.
    pub(super) fn motor(&self) -> u8 {
        self.motor
    }

    /// Handles a key at the time `now`.
    pub(super) fn press(&mut self, key: Key, now: Duration) {
        match key {
            Key::Select(motor) => {
                self.halt();
                self.motor = motor;
            }
            Key::Out => self.turn(1.0, now),
            Key::In => self.turn(-1.0, now),
            Key::Stop | Key::Quit => self.halt(),
        }
    }

    fn turn(&mut self, direction: f64, now: Duration) {
        match &mut self.press {
            Some(press) if press.direction != direction && press.tap != Tap::Done => self.halt(),
            Some(press)
                if press.direction == direction && now.saturating_sub(press.last) <= REPEAT_GAP =>
            {
                (press.held, press.last) = (true, now);
            }
            _ => self.press = Some(Press { direction, last: now, held: false, tap: Tap::Due }),
        }
    }

    /// Ends the motion.
    pub(super) fn halt(&mut self) {
        (self.press, self.stop) = (None, true);
    }

    /// Returns the command that is due at the time `now`, for a motor that turns or stands.
    pub(super) fn motion(&mut self, now: Duration, is_turning: bool) -> Option<Motion> {
        if std::mem::take(&mut self.stop) {
            return Some(Motion::Stop);
        }
        let motor = self.motor;
        let press = self.press.as_mut()?;
        if press.held && now.saturating_sub(press.last) > SILENCE {
            self.press = None;
            return Some(Motion::Stop);
        }
        if is_turning {
            return None;
        }
        if !press.held && press.tap != Tap::Due {
            press.tap = Tap::Done;
            return None;
        }
        press.tap = Tap::Turning;
        let steps = if press.held { HELD_STEPS } else { TAP_STEPS };
        Some(Motion::Jog { motor, steps: steps * press.direction })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    const TAP: Motion = Motion::Jog { motor: 0, steps: TAP_STEPS };
    const HELD: Motion = Motion::Jog { motor: 0, steps: HELD_STEPS };

    #[test]
    fn a_tap_is_one_short_jog() {
        let mut keys = KeyJogger::default();
        assert_eq!(keys.motion(ms(0), false), None);
        keys.press(Key::Out, ms(10));
        assert_eq!(keys.motion(ms(10), false), Some(TAP));
        assert_eq!(keys.motion(ms(30), true), None);
        assert_eq!(keys.motion(ms(900), false), None);
        keys.press(Key::In, ms(1000));
        let back = Motion::Jog { motor: 0, steps: -TAP_STEPS };
        assert_eq!(keys.motion(ms(1000), false), Some(back));
        keys.press(Key::Out, ms(1010));
        let stop = keys.motion(ms(1010), true);
        assert_eq!(stop, Some(Motion::Stop), "the other direction stops a turning motor");
        assert_eq!(keys.motion(ms(1030), false), None);
    }

    #[test]
    fn a_held_key_turns_on_until_it_is_silent() {
        let mut keys = KeyJogger::default();
        keys.press(Key::Out, ms(0));
        assert_eq!(keys.motion(ms(0), false), Some(TAP));
        // The first repeat comes late, the others every 30 ms.
        keys.press(Key::Out, ms(400));
        assert_eq!(keys.motion(ms(400), false), Some(TAP));
        keys.press(Key::Out, ms(430));
        assert_eq!(keys.motion(ms(430), true), None, "the tap has not ended");
        keys.press(Key::Out, ms(460));
        assert_eq!(keys.motion(ms(480), false), Some(HELD));
        for repeat in 0..100 {
            let now = ms(490 + 30 * repeat);
            keys.press(Key::Out, now);
            assert_eq!(keys.motion(now, repeat % 50 != 49), (repeat % 50 == 49).then_some(HELD));
        }
        assert_eq!(keys.motion(ms(3460 + 150), true), None);
        assert_eq!(keys.motion(ms(3460 + 151), true), Some(Motion::Stop));
        assert_eq!(keys.motion(ms(3700), false), None);
    }

    #[test]
    fn space_and_another_motor_stop() {
        for key in [Key::Stop, Key::Quit, Key::Select(2)] {
            let mut keys = KeyJogger::default();
            keys.press(Key::Out, ms(0));
            keys.press(Key::Out, ms(30));
            assert_eq!(keys.motion(ms(30), false), Some(HELD));
            keys.press(key, ms(40));
            assert_eq!(keys.motion(ms(40), true), Some(Motion::Stop));
            assert_eq!(keys.motion(ms(60), false), None, "{key:?}");
        }
    }

    #[test]
    fn arrow_keys_select_no_motor() {
        let mut decoder = KeyDecoder::default();
        let mut decode = |bytes: &[u8]| -> Vec<Key> {
            bytes.iter().filter_map(|&byte| decoder.decode(byte)).collect()
        };
        assert_eq!(decode(b"\x1b[A\x1b[B\x1bOC\x1b[1;5C\x1b[3~x"), []);
        assert_eq!(decode(b"b+ -q"), [Key::Select(1), Key::Out, Key::Stop, Key::In, Key::Quit]);
    }
}
