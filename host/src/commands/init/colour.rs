//! Colour of a ball, by name or by its hue.

use plumb_config::quantity::Range;

/// Hue of a ball.
const HUE: Range = Range::new(0.0, 360.0, "degrees");

/// Colours by name, with their hues in degrees. The detector takes hues on either side too.
const COLOURS: [(&str, f64); 9] = [
    ("red", 0.0),
    ("orange", 30.0),
    ("yellow", 60.0),
    ("green", 120.0),
    ("cyan", 180.0),
    ("blue", 240.0),
    ("violet", 270.0),
    ("purple", 285.0),
    ("pink", 330.0),
];

/// Returns the names of the colours, for a person.
pub(super) fn names() -> String {
    COLOURS.map(|(name, _)| name).join(", ")
}

/// Returns the name of a hue, degrees, or the hue itself where it has none.
pub(super) fn name(hue: f64) -> String {
    let colour = COLOURS.iter().find(|(_, of_name)| *of_name == hue);
    colour.map_or_else(|| hue.to_string(), |(name, _)| (*name).to_owned())
}

/// Returns the hue of a colour's name or number, degrees.
pub(super) fn hue(text: &str) -> Result<f64, String> {
    if let Some((_, hue)) = COLOURS.iter().find(|(name, _)| name.eq_ignore_ascii_case(text)) {
        return Ok(*hue);
    }
    HUE.parse(text).map_err(|error| format!("{error}, or one of {}", names()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_a_name_or_a_hue_and_nothing_else() {
        assert_eq!(hue("Blue"), Ok(240.0));
        assert_eq!(hue("violet"), Ok(270.0));
        assert_eq!(hue("217.5"), Ok(217.5));
        for text in ["", "grey", "361", "-1", "NaN"] {
            let error = hue(text).unwrap_err();
            let has_both = error.contains("0 to 360 degrees") && error.contains("purple, pink");
            assert!(has_both, "{text}: {error}");
        }
    }
}
