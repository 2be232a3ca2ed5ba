//! The table of the campaign.

use std::collections::BTreeMap;

use crate::kind::{KINDS, Traits};
use crate::report::{End, Report};

/// Reports of one kind of fault, or of two at once.
pub struct Row<'a> {
    /// Where the fault acts.
    pub place: String,
    /// Name of the fault.
    pub name: String,
    reports: Vec<&'a Report>,
}

/// Returns the rows of the table of these reports.
pub fn rows<'a>(reports: &[&'a Report]) -> Vec<Row<'a>> {
    let single = |traits: &Traits| {
        let of =
            |report: &&Report| report.plan.faults.iter().map(|fault| fault.kind).eq([traits.kind]);
        let reports = reports.iter().copied().filter(of).collect();
        Row { place: traits.place.to_string(), name: traits.name.to_owned(), reports }
    };
    let two = reports.iter().copied().filter(|report| report.plan.faults.len() > 1).collect();
    let two = Row { place: "any".to_owned(), name: "two at once".to_owned(), reports: two };
    let rows = KINDS.iter().map(single).chain([two]);
    rows.filter(|row| !row.reports.is_empty()).collect()
}

/// Headings of the columns; numbers from the third on, except the causes.
const COLUMNS: [&str; 13] = [
    "where",
    "fault",
    "runs",
    "went on",
    "stopped",
    "undecided",
    "reported as",
    "to detection, s, median",
    "worst",
    "to standstill, s, worst",
    "ball moved, m, median",
    "worst",
    "away from its target, m, worst",
];

/// Returns the heading of the table.
pub fn heading() -> String {
    let rules = COLUMNS.map(|column| match column {
        "where" | "fault" | "reported as" => "---",
        _ => "---:",
    });
    format!("| {} |\n|{}|", COLUMNS.join(" | "), rules.join("|"))
}

impl Row<'_> {
    /// Returns the number of runs.
    pub fn runs(&self) -> usize {
        self.reports.len()
    }

    /// Returns the number of runs with this end.
    fn count(&self, is: impl Fn(End) -> bool) -> usize {
        self.reports.iter().filter(|report| is(report.end)).count()
    }

    /// Returns how often each cause was reported, the most frequent first.
    pub fn causes(&self) -> Vec<(String, usize)> {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for report in &self.reports {
            if let End::Stopped(cause) | End::Recovered(cause) = report.end {
                *counts.entry(cause.to_string()).or_default() += 1;
            }
        }
        let mut counts: Vec<_> = counts.into_iter().collect();
        counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        counts
    }

    /// Returns the values of the runs that were stopped, in order.
    fn stopped(&self, of: impl Fn(&Report) -> Option<f64>) -> Vec<f64> {
        let stopped = self.reports.iter().filter(|report| is_stopped(report.end));
        let mut values: Vec<f64> = stopped.filter_map(|report| of(report)).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// Formats the row.
    pub fn format(&self) -> String {
        let causes: Vec<String> =
            self.causes().iter().map(|(cause, count)| format!("{count}x {cause}")).collect();
        let detected = self.stopped(|report| report.detected_s);
        let moved = self.stopped(|report| Some(report.moved_m));
        format!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            self.place,
            self.name,
            self.runs(),
            self.count(|end| end == End::WentOn),
            self.count(is_stopped),
            self.count(|end| end == End::Undecided),
            causes.join(", "),
            number(median(&detected)),
            number(detected.last().copied()),
            number(self.stopped(|report| report.stop_s).last().copied()),
            number(median(&moved)),
            number(moved.last().copied()),
            number(self.stopped(|report| Some(report.away_m)).last().copied()),
        )
    }
}

fn is_stopped(end: End) -> bool {
    matches!(end, End::Stopped(_) | End::Recovered(_))
}

fn median(sorted: &[f64]) -> Option<f64> {
    sorted.get(sorted.len() / 2).copied()
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.2}"))
}
