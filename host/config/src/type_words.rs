//! Types of the program in messages of the crate `serde`, in words.

/// Names of types, and what a person writes for them.
const TYPES: [(&str, &str); 18] = [
    ("f64", "a number"),
    ("f32", "a number"),
    ("u8", "a whole number, 0 to 255"),
    ("u16", "a whole number, 0 to 65535"),
    ("u32", "a whole number, 0 or more"),
    ("u64", "a whole number, 0 or more"),
    ("usize", "a whole number, 0 or more"),
    ("i8", "a whole number, -128 to 127"),
    ("i16", "a whole number"),
    ("i32", "a whole number"),
    ("i64", "a whole number"),
    ("i128", "a whole number"),
    ("a boolean", "true or false"),
    ("a sequence", "a list"),
    ("path string", "a path"),
    ("an array of length 3", "a list of 3 values"),
    ("newtype variant", "a table, as in { NAME = { ... } }"),
    ("ident", "JSON, with quotation marks"),
];

/// Returns a message of `serde` with types in words: "expected a number" for "expected f64".
pub fn in_words(message: &str) -> String {
    let Some((before, expected)) = message.rsplit_once("expected ") else {
        return message.to_owned();
    };
    let is_end = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    for (name, words) in TYPES {
        if let Some(rest) = expected.strip_prefix(name).filter(|rest| is_end(rest)) {
            return format!("{before}expected {words}{rest}");
        }
    }
    match expected.strip_prefix("struct ") {
        Some(name) => {
            let rest = name.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_');
            format!("{before}expected its keys with their values{rest}")
        }
        None => message.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_named_in_words() {
        for (message, expected) in [
            (
                "invalid type: string \"x\", expected f64",
                "invalid type: string \"x\", expected a number",
            ),
            ("expected u8", "expected a whole number, 0 to 255"),
            ("expected f64 at line 1 column 3", "expected a number at line 1 column 3"),
            (
                "expected struct TargetLine at line 1",
                "expected its keys with their values at line 1",
            ),
            (
                "invalid length 2, expected an array of length 3",
                "invalid length 2, expected a list of 3 values",
            ),
            ("expected an array of length 30", "expected an array of length 30"),
            ("expected u80", "expected u80"),
            ("missing field `x`", "missing field `x`"),
        ] {
            assert_eq!(in_words(message), expected);
        }
    }
}
