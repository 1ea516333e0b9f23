//! Results of an evaluation as a table for people.

use super::columns::aligned;
use super::frames::{FramesEvaluation, FramesRow};
use super::result::{Evaluation, Row};
use super::spectrum_table;
use crate::accuracy::Bias;
use crate::statistics::Interval;

/// Headings of the columns of frames.
const FRAME_COLUMNS: [&str; 7] =
    ["configuration", "frames", "seconds", "error", "HDR-FLIP", "flicker", "of independent noise"];

/// Headings of the columns.
const COLUMNS: [&str; 8] =
    ["configuration", "images", "seconds", "error", "noise", "bias", "HDR-FLIP", "noise at 1 s"];

impl Evaluation {
    /// Returns the results as a table with a line on the reference.
    pub fn table(&self) -> String {
        let mut text = match self.reference.error {
            Some(error) => format!(
                "reference: {} images, own error {:.3} %, which the figures do not contain\n",
                self.reference.images,
                100.0 * error
            ),
            None => {
                "reference: one image, whose own noise is unknown; error and difference contain it\n".into()
            }
        };
        let is_known = self.reference.error.is_some();
        let mut columns = COLUMNS.map(str::to_owned);
        if !is_known {
            columns[5] = "difference".to_owned();
        }
        text += &aligned([columns].into_iter().chain(self.rows.iter().map(|row| row.cells(is_known))));
        text += &spectrum_table::of(&self.rows);
        text
    }
}

impl Row {
    fn cells(&self, is_known: bool) -> [String; 8] {
        let errors = &self.errors;
        let bias = match errors.bias() {
            Bias::NotSeen if !is_known => "not seen".to_owned(),
            bias if !is_known => bias.to_string().replacen("bias ", "", 1),
            bias => bias.to_string(),
        };
        let nothing = || "-".to_owned();
        let at_one_second = |noise: Interval| {
            let [value, low, high] = [noise.value, noise.low, noise.high].map(|share| 100.0 * share);
            format!("{value:.3} % ({low:.3} to {high:.3})")
        };
        [
            self.name.clone(),
            errors.seeds.to_string(),
            self.seconds.map_or_else(nothing, |seconds| format!("{:.3}", seconds.median)),
            errors.rel_mse.root_percent(),
            errors.variance.root_percent(),
            bias,
            format!("{:.4}", self.hdr_flip.value),
            self.noise_at_one_second.map_or_else(nothing, at_one_second),
        ]
    }
}

impl FramesEvaluation {
    /// Returns the results as a table.
    pub fn table(&self) -> String {
        aligned([FRAME_COLUMNS.map(str::to_owned)].into_iter().chain(self.rows.iter().map(FramesRow::cells)))
    }
}

impl FramesRow {
    fn cells(&self) -> [String; 7] {
        let percent = |squared: f64| format!("{:.3} %", 100.0 * squared.sqrt());
        [
            self.name.clone(),
            self.each.len().to_string(),
            self.seconds.map_or_else(|| "-".to_owned(), |seconds| format!("{:.3}", seconds.median)),
            percent(self.rel_mse),
            format!("{:.4}", self.hdr_flip),
            percent(self.flicker),
            format!("{:.2}", self.flicker_ratio),
        ]
    }
}
