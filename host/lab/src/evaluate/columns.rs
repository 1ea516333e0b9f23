//! Aligns the columns of tables for people.

use std::fmt::Write;

/// Returns rows as lines with columns of the width of their longest cell.
pub(super) fn aligned<R: AsRef<[String]>>(rows: impl Iterator<Item = R>) -> String {
    let rows: Vec<R> = rows.collect();
    let mut widths: Vec<usize> = Vec::new();
    for row in rows.iter().map(AsRef::as_ref) {
        widths.resize(widths.len().max(row.len()), 0);
        let of_row = row.iter().map(|cell| cell.chars().count());
        widths.iter_mut().zip(of_row).for_each(|(width, cell)| *width = cell.max(*width));
    }
    let mut text = String::new();
    for row in &rows {
        let mut line = String::new();
        for (cell, width) in row.as_ref().iter().zip(&widths) {
            let _ = write!(line, "{cell:width$}  ");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}
