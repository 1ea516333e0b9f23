//! Images of other renderers, measured against the reference of a trade-off measurement.

use crate::evaluate::Row;
use crate::statistics::Interval;
use serde::{Deserialize, Serialize};

/// Images of another renderer, or of one of its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct OtherRenderer {
    /// Errors against the same reference, and times.
    #[serde(flatten)]
    pub row: Row,
    /// Efficiency 1 / (variance × seconds) over that of the base with its most samples; `None`
    /// without times, and where a variance is not positive by chance. Only noise counts, because
    /// the bias contains what both renderers define differently.
    pub efficiency_of_base: Option<Interval>,
}

impl OtherRenderer {
    /// Compares evaluated images with the variance and the seconds of the base's most samples.
    pub(super) fn of(row: Row, base: Option<(Interval, f64)>) -> Self {
        let efficiency_of_base = base.and_then(|base| efficiency_of(&row, base));
        Self { row, efficiency_of_base }
    }

    /// Returns one line for people.
    pub fn line(&self) -> String {
        let Self { row, efficiency_of_base } = self;
        let seconds = row.seconds.map_or("no times".to_owned(), |seconds| format!("{:.4} s", seconds.median));
        let against = efficiency_of_base.map_or(String::new(), |of| {
            format!("; efficiency {:.2} ({:.2} to {:.2}) of the base by noise", of.value, of.low, of.high)
        });
        let errors = &row.errors;
        format!(
            "{}: {seconds}, error {}, noise {}, {}, FLIP {:.4}{against}",
            row.name,
            errors.rel_mse.root_percent(),
            errors.variance.root_percent(),
            errors.bias(),
            errors.flip.value
        )
    }

    /// Returns the median seconds of an image, and its relative error in percent.
    pub(super) fn place(&self) -> Option<(f64, f64)> {
        let seconds = self.row.seconds?.median;
        Some((seconds, 100.0 * self.row.errors.rel_mse.value.max(0.0).sqrt()))
    }
}

/// Returns the efficiency by noise of images over that of others with this variance and time.
fn efficiency_of(row: &Row, (of_base, base_seconds): (Interval, f64)) -> Option<Interval> {
    let own = row.errors.variance;
    let seconds = row.seconds?.median;
    if own.value <= 0.0 || of_base.value <= 0.0 {
        return None;
    }
    // Half the width of the interval of the logarithm, to first order.
    let half = |of: Interval| 0.5 * (of.high - of.low) / of.value;
    let half = half(own).hypot(half(of_base)).exp();
    let value = of_base.value * base_seconds / (own.value * seconds);
    Some(Interval { value, low: value / half, high: value * half })
}

#[cfg(test)]
mod tests {
    use super::super::point::Point;
    use super::super::recommend::tests::point;
    use super::*;
    use crate::bench::Summary;

    /// Returns images with the errors of a point, which take twice its time.
    fn other(of: &Point) -> Row {
        Row {
            name: "other".to_owned(),
            seconds: Summary::of(&[2.0 * of.seconds.all.median]),
            processor_seconds: None,
            errors: of.errors.clone(),
            hdr_flip: of.errors.flip,
            efficiency: None,
            noise_at_one_second: None,
            spectrum: Vec::new(),
        }
    }

    #[test]
    fn efficiency_is_that_of_equal_noise() {
        let base = point("base", 64, 1.0, 0.02);
        let of_base = Some((base.errors.variance, base.seconds.all.median));
        let same = OtherRenderer::of(other(&base), of_base);
        let found = same.efficiency_of_base.unwrap();
        assert!((found.value - 0.5).abs() < 1e-9 && found.low < 0.5 && found.high > 0.5, "{found:?}");
        assert!(
            same.line().contains("efficiency 0.50") && same.line().contains("2.0000 s"),
            "{}",
            same.line()
        );
        assert_eq!(same.place().unwrap().0, 2.0);
        // Negative controls: without times, and without a base.
        let untimed = OtherRenderer::of(Row { seconds: None, ..other(&base) }, of_base);
        assert!(untimed.efficiency_of_base.is_none() && untimed.line().contains("no times"));
        assert!(OtherRenderer::of(other(&base), None).efficiency_of_base.is_none());
    }
}
