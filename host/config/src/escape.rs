//! Control characters in texts of others: names, lines of files, words of the command line. Raw
//! ones would command the terminal of a person who reads the text.

/// Returns `text` with its control characters, but line feeds, escaped: ESC becomes `\u001b`. In a
/// line of JSON this changes no value. Marks that change the direction of writing are escaped too.
///
/// ```
/// use plumb_config::escape::escaped;
///
/// assert_eq!(escaped("größe \u{1b}[2J\n"), "größe \\u001b[2J\n");
/// ```
pub fn escaped(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    for c in text.chars() {
        if is_harmless(c) {
            kept.push(c);
        } else {
            kept += &format!("\\u{:04x}", u32::from(c));
        }
    }
    kept
}

/// Returns whether a character changes nothing but its own place on a terminal.
fn is_harmless(c: char) -> bool {
    // Unicode UAX #9: explicit formatting characters, and implicit marks; line separators.
    let is_direction = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2066}'..='\u{2069}');
    let is_separator_or_embedding = matches!(c, '\u{2028}'..='\u{202e}');
    c == '\n' || !(c.is_control() || is_direction || is_separator_or_embedding)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_control_character_is_escaped_and_letters_stay() {
        let controls =
            (0..0x20).chain(0x7f..0xa0).filter(|&c| c != 0x0a).filter_map(char::from_u32);
        for c in controls.chain("\u{61c}\u{200f}\u{2028}\u{202e}\u{2066}".chars()) {
            assert_eq!(escaped(&c.to_string()), format!("\\u{:04x}", u32::from(c)));
        }
        let text = "größe 20 °C, Ähre, 測定, ball\u{200d} \\u001b\n";
        assert_eq!(escaped(text), text);
    }
}
