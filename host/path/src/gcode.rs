//! Paths in G-code: straight motions (G0, G1) with their units and feeds. Meaning of the words:
//! NIST IR 6556, "The NIST RS274NGC interpreter, version 3", 2000.
//!
//! | word | meaning |
//! |---|---|
//! | G0, G1 | a straight line to X, Y, Z; with G1 at the feed F. They hold for the lines below |
//! | G20, G21 | inches, millimetres (the default) |
//! | G90, G91 | places (the default), or distances from the place before |
//! | F | feed, millimetres or inches a minute |
//! | M2, M30 | the end |
//! | N, `;`, `( )` | a line's number, comments |
//! | `%` | alone in the first line, and in the line that ends the program then |
//!
//! G17, G40, G49, G54, G80 and G94 change nothing here. Any other word is a mistake: without it the
//! path would be another one.

use nalgebra::{Point3, Vector3};
use plumb_config::mistake::Mistake;

use crate::places::{Kind, Place, Places, Unit};
use crate::table::lines;

/// Length of an inch, metres.
const INCH_M: f64 = 0.0254;
/// Length of a millimetre, metres.
const MILLIMETRE_M: f64 = 0.001;
/// Seconds of a minute.
const MINUTE_S: f64 = 60.0;
/// Codes that choose what Plumb does anyway: the plane XY, no compensation of a tool's radius or
/// length, the first system of coordinates, no cycle, feeds in units a minute.
const WITHOUT_EFFECT: [&str; 6] = ["G17", "G40", "G49", "G54", "G80", "G94"];
/// Mistake of a line of which no code says how the ball goes.
const NO_MOTION: &str = "X, Y or Z without G0 or G1 in this line or above";

/// Mistake of a distance that begins nowhere.
const NO_PLACE: &str = "G91 needs a place to begin at: state X, Y and Z with G90 first";

/// Checks whether a text is G-code: its first line that is no comment has words only, or begins
/// with a code. Where the line has a comma, two words must stand before it: "X1,Y1,Z1" may be names
/// of columns, and "X1;Y1;Z1" too.
pub(crate) fn is_gcode(text: &str) -> bool {
    let mut lines = lines(text);
    let first = lines.find(|line| !(line.is_empty() || line.starts_with([';', '(', '%'])));
    first.is_some_and(|line| match line.split_once(',') {
        Some((before, _)) => words(before).is_ok_and(|words| words.len() >= 2),
        None if begins_with_code(line) => true,
        None => words(line).is_ok_and(|words| are_known(&words)) && !may_be_names(line),
    })
}

/// Returns whether a line may be names of columns: "X1;Y1;Z1".
fn may_be_names(line: &str) -> bool {
    let is_word = |text| words(text).is_ok_and(|words| words.len() == 1);
    line.split(';').count() >= 3 && line.split(';').all(is_word)
}

/// Returns whether the first word of a line is G or M with its number.
fn begins_with_code(line: &str) -> bool {
    let mut characters = line.chars().filter(|character| !character.is_whitespace());
    characters.next().is_some_and(|letter| "GM".contains(letter.to_ascii_uppercase()))
        && characters.next().is_some_and(|next| next.is_ascii_digit())
}

/// Returns whether a line has words, and begins with one that a line may begin with.
fn are_known(words: &[Word]) -> bool {
    words.first().is_some_and(|word| "GMNOTFSXYZ".contains(word.letter))
}

/// Parses G-code. The path begins at the first place of which X, Y and Z are known. Adds all
/// mistakes to `mistakes`, in the order of the lines.
pub(crate) fn parse(text: &str, mistakes: &mut Vec<Mistake>) -> Places {
    let mut machine = Machine::default();
    let mut all = (1..).zip(lines(text)).filter(|(_, line)| !line.is_empty()).peekable();
    let is_tape = all.next_if(|(_, line)| *line == "%").is_some();
    let mut last = 1;
    for (line, text) in all {
        last = line;
        if is_tape && text == "%" {
            machine.has_ended = true;
            break;
        }
        if let Err(problem) = words(text).and_then(|words| machine.read(line, &words)) {
            mistakes.push(Mistake::of_line(line, problem));
            // G0 or G1 may stand in this line.
            machine.motion.get_or_insert(Motion::Rapid);
        }
        if machine.has_ended {
            break;
        }
    }
    if is_tape && !machine.has_ended {
        let missing = "the file begins with `%`, and its end is missing: `%`, M2 or M30";
        mistakes.push(Mistake::of_line(last, missing));
    }
    let (places, speeds) = (machine.places, machine.speeds);
    Places { unit: Unit::Metres, kind: Kind::Path, places, speeds }
}

/// Letter with its number, such as `X12.5`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Word {
    letter: char,
    number: f64,
}

impl Word {
    /// Returns the code without zeros at its start: `G1` for `G01`.
    fn code(self) -> String {
        format!("{}{}", self.letter, self.number)
    }
}

/// Returns the words of a line without its comments.
fn words(line: &str) -> Result<Vec<Word>, String> {
    let line = without_comments(line)?;
    let mut rest = line.trim_start();
    let mut words = Vec::new();
    while let Some(letter) = rest.chars().next() {
        if letter == '%' {
            return Err(
                "`%` must stand alone in the first line of the file and in the last of the \
                        program"
                    .to_owned(),
            );
        }
        if !letter.is_ascii_alphabetic() {
            return Err(format!(
                "'{letter}' begins no word: a letter and a number with a decimal point, X12.5"
            ));
        }
        let letter = letter.to_ascii_uppercase();
        let after = rest[1..].trim_start();
        let is_part = |character: char| character.is_ascii_digit() || "+-.".contains(character);
        let end = after.find(|character| !is_part(character)).unwrap_or(after.len());
        let number = after[..end].parse().map_err(|_| format!("{letter} has no number"))?;
        words.push(Word { letter, number });
        rest = after[end..].trim_start();
    }
    Ok(words)
}

/// Returns a line without its comments, `( )` and what follows a `;` outside of them.
fn without_comments(line: &str) -> Result<String, &'static str> {
    let (mut kept, mut is_comment) = (String::new(), false);
    for character in line.chars() {
        match (is_comment, character) {
            (false, ';') => break,
            (false, '(') => is_comment = true,
            (true, '(') => {
                return Err("a comment has `(` in it: comments in comments are not read");
            }
            (true, ')') => is_comment = false,
            (true, _) => {}
            (false, character) => kept.push(character),
        }
    }
    if is_comment { Err("a comment has no end: `)` is missing") } else { Ok(kept) }
}

/// Kind of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Motion {
    /// As fast as the limits of the path allow.
    Rapid,
    /// At the feed.
    Feed,
}

/// Returns the mistake of a code that is not read.
fn not_read(word: Word) -> String {
    format!("{} is not read; a path has G0 and G1, G20, G21, G90, G91, F, X, Y, Z", word.code())
}

/// What the lines above have set.
struct Machine {
    places: Vec<Place>,
    /// Speed from each place to the next, m/s; infinite for G0 and where no feed was stated.
    speeds: Vec<f64>,
    /// Length of a unit, metres.
    unit: f64,
    is_relative: bool,
    motion: Option<Motion>,
    /// Speed of G1, m/s; infinite before the first feed.
    feed: f64,
    /// Place along each axis, metres; `None` before it was stated.
    place: [Option<f64>; 3],
    has_ended: bool,
}

impl Default for Machine {
    fn default() -> Self {
        Self {
            places: Vec::new(),
            speeds: Vec::new(),
            unit: MILLIMETRE_M,
            is_relative: false,
            motion: None,
            feed: f64::INFINITY,
            place: [None; 3],
            has_ended: false,
        }
    }
}

impl Machine {
    /// Carries out a line: its settings, then its motion.
    fn read(&mut self, line: usize, words: &[Word]) -> Result<(), String> {
        let mut axes = [None; 3];
        let mut feed = None;
        let state = |value: &mut Option<f64>, word: Word| match value.replace(word.number) {
            Some(_) => Err(format!("{} is there more than once", word.letter)),
            None => Ok(()),
        };
        for (number, &word) in words.iter().enumerate() {
            match word.letter {
                'G' | 'M' => self.set(word)?,
                'F' => state(&mut feed, word)?,
                'X' => state(&mut axes[0], word)?,
                'Y' => state(&mut axes[1], word)?,
                'Z' => state(&mut axes[2], word)?,
                // Elsewhere it may be the digit 0.
                'N' => {}
                'O' if number == 0 => {}
                _ => return Err(not_read(word)),
            }
        }
        if let Some(feed) = feed {
            if feed <= 0.0 {
                return Err(format!("the feed is {feed}: it must be above 0"));
            }
            self.feed = feed * self.unit / MINUTE_S;
        }
        if axes == [None; 3] { Ok(()) } else { Ok(self.go(line, axes)?) }
    }

    /// Carries out a code.
    fn set(&mut self, word: Word) -> Result<(), String> {
        match word.code().as_str() {
            "G0" => self.motion = Some(Motion::Rapid),
            "G1" => self.motion = Some(Motion::Feed),
            "G20" => self.unit = INCH_M,
            "G21" => self.unit = MILLIMETRE_M,
            "G90" => self.is_relative = false,
            "G91" => self.is_relative = true,
            "M2" | "M30" => self.has_ended = true,
            code if WITHOUT_EFFECT.contains(&code) => {}
            _ => return Err(not_read(word)),
        }
        Ok(())
    }

    /// Goes to a place, in units of the program.
    fn go(&mut self, line: usize, axes: [Option<f64>; 3]) -> Result<(), &'static str> {
        let motion = self.motion.ok_or(NO_MOTION)?;
        for (place, stated) in self.place.iter_mut().zip(axes) {
            let Some(stated) = stated.map(|units| units * self.unit) else { continue };
            let from = if self.is_relative { place.ok_or(NO_PLACE)? } else { 0.0 };
            *place = Some(from + stated);
        }
        let [Some(x), Some(y), Some(z)] = self.place else { return Ok(()) };
        let place = Point3::from(Vector3::new(x, y, z));
        match self.places.last() {
            // A line that does not move is no stop.
            Some(last) if last.position == place => return Ok(()),
            Some(_) => self.speeds.push(match motion {
                Motion::Rapid => f64::INFINITY,
                Motion::Feed => self.feed,
            }),
            None => {}
        }
        self.places.push(Place::new(line, place));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(text: &str) -> Places {
        let mut mistakes = Vec::new();
        let program = parse(text, &mut mistakes);
        assert_eq!(mistakes, []);
        assert_eq!(program.speeds.len(), program.places.len().saturating_sub(1));
        program
    }

    fn places(text: &str) -> Vec<[f64; 3]> {
        program(text).places.iter().map(|place| place.position.into()).collect()
    }

    fn mistakes(text: &str) -> Vec<String> {
        let mut mistakes = Vec::new();
        parse(text, &mut mistakes);
        mistakes.iter().map(|mistake| format!("{}: {mistake}", mistake.line)).collect()
    }

    #[test]
    fn a_program_of_a_machinist_is_a_path() {
        let text = "%\nO1 (square)\nN10 G21 G90 G17 G94\nN20 G0 Z300. ; up\nN30 X400 Y200\n\
                    N40 G01 X600 F1200\nN50 Y300.5\nN60 g0x400y200 (back)\nN70 M30\nG2 X0\n%\n";
        let program = program(text);
        let expected = [[0.4, 0.2, 0.3], [0.6, 0.2, 0.3], [0.6, 0.3005, 0.3], [0.4, 0.2, 0.3]];
        for (place, expected) in program.places.iter().zip(expected) {
            assert!((place.position - Point3::from(expected)).norm() < 1e-12, "{place:?}");
        }
        assert_eq!(program.places.len(), 4);
        // 1200 mm a minute are 20 mm/s.
        assert_eq!(program.speeds.len(), 3);
        assert!((program.speeds[0] - 0.02).abs() < 1e-12 && program.speeds[1] == program.speeds[0]);
        assert_eq!(program.speeds[2], f64::INFINITY);
    }

    #[test]
    fn inches_and_distances_are_read() {
        let inches = places("G20 G90\nG1 X10 Y5 Z12\nG91\nX1\nY-1 Z.5\nG90 X10\n");
        let expected = [[10.0, 5.0, 12.0], [11.0, 5.0, 12.0], [11.0, 4.0, 12.5], [10.0, 4.0, 12.5]];
        for (place, expected) in inches.iter().zip(expected) {
            for (metres, inches) in place.iter().zip(expected) {
                assert!((metres - 0.0254 * inches).abs() < 1e-12, "{place:?}");
            }
        }
        assert_eq!(inches.len(), 4);
        // A carriage return alone ends a line too.
        assert_eq!(places("G20 G1 X1 Y2 Z3 ; a\rX2\r").len(), 2);
        // The feed is in the units that hold where it is stated.
        let speeds = program("G20 G1 X1 Y1 Z1 F60\nX2\nG21 X0\nF60 X1\n").speeds;
        for (speed, expected) in speeds.iter().zip([0.0254, 0.0254, 0.001]) {
            assert!((speed - expected).abs() < 1e-12, "{speeds:?}");
        }
    }

    /// NIST IR 6556, 3.2 and 3.3.4: a file may be demarcated with percents; what is behind the
    /// second percent line is ignored, and a file without that line is an error. Comments may not
    /// be nested.
    #[test]
    fn a_tape_ends_with_its_second_percent_line_and_comments_are_not_nested() {
        let first = "G1 X1 Y1 Z1\nX2\n";
        let expected = places(first);
        assert_eq!(expected.len(), 2);
        for text in [
            format!("%\n{first}%\nX9\nG2 I1\n%\n"),
            format!("\n \n % \n{first}\t%\r\n%\nX9\n%"),
            format!("%\n{first}M2\nX9"),
            format!("%\n(a; b) G21 ; (c\n{first}%"),
        ] {
            assert_eq!(places(&text), expected, "{text}");
        }
        let percent = "`%` must stand alone";
        for (text, line, words) in [
            (format!("%\n{first}"), 3, "its end is missing"),
            (format!("{first}%\nX9\n"), 3, percent),
            (format!("G21\n%\n{first}%\n"), 2, percent),
            (format!("(a)\n%\n{first}%\n"), 2, percent),
            (format!("%\n{first}X3 %\n%\n"), 4, percent),
            (format!("%1000\n{first}%\n"), 1, percent),
            (format!("{first}(a (b) c) X9\n"), 3, "comments in comments"),
            (format!("{first}(a (b) X9\n"), 3, "comments in comments"),
            (format!("{first}N3 X9*71\n"), 3, "'*' begins no word"),
        ] {
            let found = mistakes(&text);
            let is_told = found[0].starts_with(&format!("{line}: ")) && found[0].contains(words);
            assert!(is_told, "{text}: {found:?}");
        }
    }

    #[test]
    fn every_mistake_is_told_with_its_line_and_the_name_of_the_code() {
        let found = mistakes(
            "G21\nX1\nG1 X1 Y1 Z1 F0\nG2 X3 I1 J1\nG1 X5 E0.2\nG1 X\nG1 X1,5\nM3 S1000\nG28\n\
             (open\nG38.2 Z1\n",
        );
        let expected = [
            (2, "without G0 or G1"),
            (3, "feed is 0"),
            (4, "G2 is not read"),
            (5, "E0.2 is not read"),
            (6, "X has no number"),
            (7, "',' begins no word"),
            (8, "M3 is not read"),
            (9, "G28 is not read"),
            (10, "no end"),
            (11, "G38.2"),
        ];
        assert_eq!(found.len(), expected.len(), "{found:#?}");
        for (found, (line, words)) in found.iter().zip(expected) {
            assert!(found.starts_with(&format!("{line}: ")), "{found}");
            assert!(found.contains(words), "{found}: {words}");
        }
        assert!(mistakes("G91 G1 X1\n")[0].contains("G90 first"));
        assert_eq!(mistakes("G1 X610 X630 Y1 Z1\n"), ["1: X is there more than once"]);
        // The line with the comma has the G1 of the next one.
        let comma = "1: ',' begins no word: a letter and a number with a decimal point, X12.5";
        assert_eq!(mistakes("G1 X600,5 Y1 Z1\nX610 Y1 Z1\n"), [comma]);
        // The letter O in place of the digit 0.
        assert!(mistakes("G1 X6O0 Y1 Z1\n")[0].contains("O0 is not read"));
    }

    #[test]
    fn tables_are_no_gcode() {
        for text in [
            "x,y,z\n1,2,3\n",
            "t;x;y;z\n",
            "",
            "X1,Y1,Z1\n",
            "X1;Y1;Z1\n",
            "# x\n",
            "x y z\n",
            "0.1,0.2,0.3",
            "X-Position;Y-Position;Z-Position\n0,72;0,26;0,36\n",
            "X-Koordinate\n",
            "X1_soll\n",
            "M-Nr;x;y;z\n",
            "Time\n",
            "x,y,z\r0.7,0.2,0.3\r",
        ] {
            assert!(!is_gcode(text), "{text}");
        }
        for text in [
            "G0 X1",
            "\u{feff}g1x1",
            "; by a slicer\n\nG21",
            "%\n(a)\nN1 G0",
            "M3\n",
            "X-1",
            "G1 X6,5",
            "g1x6,5y2",
            "G1 X",
            "M117 Hello",
            "G21\rG0 X1",
        ] {
            assert!(is_gcode(text), "{text}");
        }
    }
}
