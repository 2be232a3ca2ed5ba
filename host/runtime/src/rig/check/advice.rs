//! What to write in place of a mistake, for mistakes that people make in files that they edit.

use plumb_cameras::settings::kinect;
use plumb_config::digit_groups::{thousands, with_point};
use plumb_config::reference::Key;
use plumb_config::toml_file::Mistake;
use plumb_config::word_values::{named_pins, with_numbers};

use super::Document;
use super::targets::unreadable;
use crate::rig::LawSettings;

/// Returns whether a key takes the numbers of pins.
fn is_pin(key: &str) -> bool {
    key.starts_with("board.pins.")
}

/// Returns the resistance of a resistor with this mark, ohms: 0.15 of R150; `None` for other texts.
fn marked_ohms(mark: &str) -> Option<f64> {
    let digits = mark.strip_prefix(['R', 'r'])?;
    let is_mark = !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit());
    is_mark.then(|| format!("0.{digits}").parse().ok())?
}

/// Returns the power of ten between a common unit and that of a key: -3 of `mm` for metres; `None`
/// for other units. A key's own unit has 0.
fn power_of_ten(written: &str, unit: &str) -> Option<i8> {
    match (unit, written) {
        _ if unit == written => Some(0),
        ("m", "cm") | ("m/s", "cm/s") => Some(-2),
        ("m", "mm") | ("s", "ms") | ("m/s", "mm/s") | ("A", "mA") => Some(-3),
        ("s", "µs" | "μs" | "us") => Some(-6),
        _ => None,
    }
}

impl Document<'_> {
    /// Returns what is wrong with a value of another type, and what to write; `None` where the
    /// message of the mistake is as good.
    pub(super) fn advice(&self, mistake: &Mistake) -> Option<String> {
        if let Some(example) = self.choice(mistake) {
            return Some(format!("has keys of its own: write, for example, `{example}`"));
        }
        if let Some(advice) = self.one_table(mistake) {
            return Some(advice);
        }
        let Mistake { key, value, message, .. } = mistake;
        let bare = value.trim_matches(['"', '\'']);
        if key == "camera.source" && bare.to_lowercase().starts_with("kinect") {
            return Some(format!("is no source: {}", kinect()));
        }
        if bare != value && self.is_number(key) && bare.parse::<f64>().is_ok() {
            return Some(format!("must be a number without quotes: write {bare}"));
        }
        if let Some(advice) = named_pins(&value.replace(['"', '\''], "")).filter(|_| is_pin(key)) {
            return Some(advice);
        }
        if let Some(advice) = self.in_its_unit(key, bare) {
            return Some(advice);
        }
        if let Some(advice) = self.unknown_header(mistake) {
            return Some(advice);
        }
        if let Some(booleans) =
            with_numbers(value).filter(|_| message.ends_with("expected true or false"))
        {
            return Some(format!("must be true or false: write {booleans}"));
        }
        if let Some(ohms) = marked_ohms(bare).filter(|_| key.ends_with(".sense_resistor")) {
            return Some(format!("must be in ohms, and not the mark on a resistor: write {ohms}"));
        }
        if let Some(whole) = value.strip_suffix(".0").filter(|_| message.contains("whole number")) {
            return Some(format!("must be a whole number, without a point: write {whole}"));
        }
        let is_unknown = key == "targets" && !message.contains(": write ");
        if let Some(places) = is_unknown.then(|| unreadable(value)).flatten() {
            return Some(places);
        }
        let is_place = key == "targets" && value.starts_with('[') && !value.starts_with("[[");
        (is_place && message.starts_with("invalid type"))
            .then(|| format!("must be a list of places: write [{value}]"))
    }

    /// Returns what is wrong with a number and its unit, and what to write in the unit of its key:
    /// 0.004 of `0,4 cm` for a key in metres. `None` for other values.
    fn in_its_unit(&self, key: &str, value: &str) -> Option<String> {
        let unit = self.key(key).filter(|_| self.is_number(key))?.unit.as_str();
        let length = value.find(|c: char| !c.is_ascii_digit() && !"+-.,".contains(c))?;
        let (number, written) = (&value[..length], value[length..].trim());
        // A comma before three digits may stand between thousands.
        let point = with_point(number).filter(|_| thousands(number).is_none());
        let point = point.as_deref().unwrap_or(number);
        let in_unit = power_of_ten(written, unit)
            .and_then(|power| format!("{point}e{power}").parse::<f64>().ok());
        match in_unit {
            _ if unit.is_empty() || unit == "1" => None,
            Some(_) if written == unit => {
                Some(format!("must be a number alone, without its unit: write {point}"))
            }
            Some(number) => {
                Some(format!("must be a number in {unit}, without a unit: write {number}"))
            }
            None => with_point(number)
                .filter(|_| !written.is_empty())
                .map(|_| format!("must be a number alone in {unit}, with a decimal point")),
        }
    }

    /// Returns what is wrong with the line of a table that the file does not have; `None` for other
    /// mistakes, and where the message names a similar table.
    fn unknown_header(&self, mistake: &Mistake) -> Option<String> {
        let Mistake { key, line, message, .. } = mistake;
        let line = self.text.lines().nth((*line)? - 1)?;
        if !line.trim().starts_with('[') || !message.starts_with("is no key of this file: remove") {
            return None;
        }
        let name = key.rsplit('.').next()?;
        let mut tables: Vec<&str> = Vec::new();
        for Key { name, .. } in &self.keys {
            let within = name.match_indices('.').map(|(dot, _)| &name[..dot]);
            tables.extend(within.filter(|table| !tables.contains(table)).collect::<Vec<_>>());
        }
        let is_meant = |table: &&&str| {
            name.len() > 2 && table.split('.').next_back().is_some_and(|it| it.starts_with(name))
        };
        if let Some(table) = tables.iter().find(is_meant) {
            return Some(format!("is no table of this file; did you mean [{table}]?"));
        }
        tables.retain(|table| !table.contains('.'));
        Some(format!("is no table of this file; its tables: {}", tables.join(", ")))
    }

    /// Returns what to write in place of a name alone that has required keys: of `driver =
    /// "coils"` it is `driver.coils = { duty = 0.8 }`.
    fn choice(&self, mistake: &Mistake) -> Option<String> {
        let name = mistake.value.trim_matches(['"', '\'']);
        let full = format!("{}.{name}.", mistake.key);
        let keys =
            self.keys.iter().filter(|key| key.is_required).filter_map(|key| {
                Some(format!("{} = {}", key.name.strip_prefix(&full)?, key.value))
            });
        let keys = keys.collect::<Vec<_>>().join(", ");
        let written = self.written(&mistake.key).unwrap_or(&mistake.key);
        (!keys.is_empty()).then(|| format!("{written}.{name} = {{ {keys} }}"))
    }

    /// Returns what is wrong with a key that takes exactly one of several tables, such as `law`,
    /// and what to write; `None` for other keys, and where a table's name is misspelt.
    fn one_table(&self, mistake: &Mistake) -> Option<String> {
        let Mistake { key, value, message, .. } = mistake;
        let meant = value.trim_matches(['"', '\'']);
        let has = |text: &str| message.contains(text);
        let (table, problem) = if message.starts_with("unknown variant") && !has("did you mean") {
            let (table, _) = key.rsplit_once('.')?;
            (table, format!("is no key of this file: in place of [{table}] "))
        } else if has("more than 1 element") {
            (key.as_str(), "has more than one table: keep one of them, or ".to_owned())
        } else if has("found 0 elements") {
            (key.as_str(), "is empty: remove it, or ".to_owned())
        } else if has("variant, expected") || has("string or table") {
            let named =
                self.key(key).map(|it| format!("a name{}, or ", self.example(key, &it.value)));
            let problem = "a table: remove this line, and at the end of the file ";
            (key.as_str(), format!("must be {}{problem}", named.unwrap_or_default()))
        } else {
            return None;
        };
        let names = self.tables(table);
        (!names.is_empty())
            .then(|| format!("{problem}{}", self.line_to_write(table, &names, meant)))
    }

    /// Returns the advice to write the line of one of the tables `names` of `key`: that of the name
    /// `meant`, if it is one. A name that needs no table is a value of `key`.
    fn line_to_write(&self, key: &str, names: &[&str], meant: &str) -> String {
        let default = match self.key(key) {
            Some(described) if described.range.contains(&format!("\"{meant}\"")) => {
                return format!(
                    "write the name alone{}",
                    self.example(key, &format!("\"{meant}\""))
                );
            }
            Some(described) => format!("`{key}` is {}", described.value),
            None => format!("the {key} is `{}`", LawSettings::default().name()),
        };
        let (name, list) = match names.contains(&meant) {
            true => (meant, String::new()),
            false => ("NAME", format!(" (NAME: {})", names.join(", "))),
        };
        format!(
            "write the line [{key}.{name}] with its keys below it{list}; only one such table may \
             be there, and without one {default}"
        )
    }

    /// Returns the names of the tables of which `key` takes exactly one; none for other keys.
    fn tables(&self, key: &str) -> Vec<&str> {
        let prefix = format!("{key}.");
        let below = self.keys.iter().filter_map(|key| key.name.strip_prefix(&prefix));
        let names: Option<Vec<&str>> = below.map(|it| Some(it.split_once('.')?.0)).collect();
        let mut names = names.unwrap_or_default();
        names.dedup();
        names
    }
}
