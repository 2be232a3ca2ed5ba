//! The sheet as a PDF document (ISO 32000-1): one page, rectangles and text in Helvetica.

use std::fmt::Write;

use super::Mark;

/// Points, the unit of PDF, in a millimetre.
const POINTS: f64 = 72.0 / 25.4;
/// Size of Helvetica whose capital letters are 1 high.
const FONT_SIZE: f64 = 1.0 / 0.718;

/// Returns a document of one page of the size `size_mm` (millimetres).
pub(super) fn document([width, height]: [f64; 2], marks: &[Mark]) -> Vec<u8> {
    let content = content(marks);
    let media_box = format!("[0 0 {:.4} {:.4}]", width * POINTS, height * POINTS);
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_owned(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox {media_box} /Contents 4 0 R \
             /Resources << /Font << /F1 5 0 R >> >> >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>".to_owned(),
    ];
    let mut text = "%PDF-1.4\n".to_owned();
    let mut table = format!("xref\n0 {}\n0000000000 65535 f \n", objects.len() + 1);
    for (number, object) in (1..).zip(&objects) {
        // Writing to a string cannot fail.
        let _ok = writeln!(table, "{:010} 00000 n ", text.len());
        let _ok = write!(text, "{number} 0 obj\n{object}\nendobj\n");
    }
    let start = text.len();
    let trailer = format!("trailer\n<< /Size {} /Root 1 0 R >>", objects.len() + 1);
    format!("{text}{table}{trailer}\nstartxref\n{start}\n%%EOF\n").into_bytes()
}

/// Returns the operators that draw the marks, in millimetres.
fn content(marks: &[Mark]) -> String {
    let mut content = format!("{POINTS:.8} 0 0 {POINTS:.8} 0 0 cm\n0 g\n");
    for mark in marks {
        let _ok = match mark {
            Mark::Rectangle { corner: [x, y], size: [w, h] } => {
                writeln!(content, "{x:.4} {y:.4} {w:.4} {h:.4} re f")
            }
            Mark::Text { corner: [x, y], height, text } => {
                let size = height * FONT_SIZE;
                let text = text.replace('\\', "\\\\").replace('(', "\\(").replace(')', "\\)");
                writeln!(content, "BT /F1 {size:.4} Tf {x:.4} {y:.4} Td ({text}) Tj ET")
            }
        };
    }
    content
}

#[cfg(test)]
mod tests {
    use super::super::{Paper, pdf};

    #[test]
    fn the_cross_reference_table_points_at_the_objects() {
        let bytes = pdf(Paper::A4);
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains("/MediaBox [0 0 841.8898 595.2756]"));
        let start: usize = text.lines().rev().nth(1).unwrap().parse().unwrap();
        let table: Vec<_> = text[start..].lines().skip(3).take(5).collect();
        for (number, line) in (1..).zip(table) {
            let offset: usize = line[..10].parse().unwrap();
            assert!(text[offset..].starts_with(&format!("{number} 0 obj\n")), "{line}");
        }
    }
}
