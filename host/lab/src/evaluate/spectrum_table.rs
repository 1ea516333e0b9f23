//! Error by spatial frequency as a table for people.

use super::columns::aligned;
use super::result::Row;
use crate::accuracy::SpectrumBand;

/// Line above the table.
const TITLE: &str =
    "error by spatial frequency in cycles a pixel; 1: as noise that is independent between pixels";

/// Returns the densities of all rows as a table; nothing without rows.
pub(super) fn of(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let headings = ["configuration".to_owned()].into_iter().chain(first.spectrum.iter().map(heading));
    let cells = |row: &Row| -> Vec<String> {
        let density = |band: &SpectrumBand| match band.density.is_finite() {
            true => format!("{:.2}", band.density),
            false => "-".to_owned(),
        };
        let densities = row.spectrum.iter().map(density);
        [row.name.clone()].into_iter().chain(densities).collect()
    };
    format!("\n{TITLE}\n{}", aligned([headings.collect()].into_iter().chain(rows.iter().map(cells))))
}

/// Names a band by the periods in it.
fn heading(band: &SpectrumBand) -> String {
    let end = |frequency: f64| format!("1/{:.0}", 1.0 / frequency);
    match (band.from, band.to) {
        (0.0, to) => format!("below {}", end(to)),
        (from, 0.5..) => format!("above {}", end(from)),
        (from, to) => format!("{} to {}", end(from), end(to)),
    }
}
