//! Writes a trade-off measurement as one HTML page that needs no other file, with the data and
//! charts as files beside it.

use super::picture::Pictures;
use super::point::Tradeoff;
use super::{TradeoffError, advice, charts, gallery, others_table, points_table, table};
use crate::page::{self, Document};
use crate::plot;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns whether [`Tradeoff::write`] writes a file of this name.
pub fn is_output(name: &Path) -> bool {
    const NAMES: [&str; 7] = [
        "report.html",
        "tradeoff.json",
        "tradeoff.csv",
        "error_over_time.svg",
        "error_over_time.png",
        "front.svg",
        "front.png",
    ];
    NAMES.iter().any(|one| name == Path::new(one))
}

impl Tradeoff {
    /// Returns the results as JSON.
    ///
    /// # Errors
    ///
    /// [`TradeoffError`] if they cannot be encoded.
    pub fn json(&self) -> Result<String, TradeoffError> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n").map_err(|error| TradeoffError::encode(Path::new("tradeoff.json"), error))
    }

    /// Writes `report.html`, `tradeoff.json`, `tradeoff.csv` and the charts into a folder, which is
    /// created if necessary. Returns the paths of the files.
    ///
    /// # Errors
    ///
    /// [`TradeoffError`] with the path of the file.
    pub fn write(&self, pictures: &Pictures, folder: &Path) -> Result<Vec<PathBuf>, TradeoffError> {
        fs::create_dir_all(folder).map_err(TradeoffError::io(folder))?;
        let mut files = Vec::new();
        let mut save = |name: &str, bytes: &[u8]| {
            let path = folder.join(name);
            fs::write(&path, bytes).map_err(TradeoffError::io(&path))?;
            files.push(path);
            Ok::<(), TradeoffError>(())
        };
        save("tradeoff.json", self.json()?.as_bytes())?;
        save("tradeoff.csv", table::csv(self).as_bytes())?;
        save("report.html", self.page(pictures)?.as_bytes())?;
        for (stem, chart) in [("error_over_time", charts::over_time(self)), ("front", charts::front(self))] {
            plot::write(&chart, folder, stem)
                .map_err(|error| TradeoffError::encode(&folder.join(stem), error))?;
            files.extend(["svg", "png"].map(|kind| folder.join(format!("{stem}.{kind}"))));
        }
        Ok(files)
    }

    /// Returns the report as an HTML page that needs no other file.
    ///
    /// # Errors
    ///
    /// [`TradeoffError`] if a picture cannot be encoded.
    pub fn page(&self, pictures: &Pictures) -> Result<String, TradeoffError> {
        let mut page = Document::new(&format!("What to use for {}", self.scene));
        advice::write(self, &mut page);
        page.section("Time and error");
        page.paragraph(
            "note",
            "Each point is a setting with a number of samples; those below and left of others are better. The line \
             joins the points that no other beats in both time and error (the Pareto front). Point at one, or press \
             Tab and the arrow keys, for its figures. Hollow: biased.",
        );
        page.add(&charts::inline_front(self));
        page.section("Error over time");
        page.paragraph(
            "note",
            "The settings that most users ask about. In brackets: the slope, which is -0.5 where the error is noise.",
        );
        page.add(&page::inline_plot(&charts::over_time(self)));
        page.section("All points");
        page.add(&points_table::html(self));
        if !self.others.is_empty() {
            page.section("Other renderers");
            page.paragraph(
                "note",
                "Images that were rendered elsewhere, against the same reference. Their bias contains what both \
                 renderers define differently. Efficiency: 1 / (noise² × time), relative to the base with its most \
                 samples.",
            );
            page.add(&others_table::html(&self.others));
        }
        self.list_missing(&mut page);
        let wrong = |error| TradeoffError::encode(Path::new("report.html"), error);
        gallery::write(self, pictures, &mut page).map_err(wrong)?;
        self.write_conditions(&mut page);
        Ok(page.finish())
    }

    fn list_missing(&self, page: &mut Document) {
        if !self.missing.is_empty() {
            page.section("Not measured here");
            page.list(self.missing.iter().map(|missing| {
                let name = format!("{} {}", missing.knob, missing.level);
                format!("{name}: {}", missing.reason)
            }));
        }
    }

    /// Writes how the figures were measured.
    fn write_conditions(&self, page: &mut Document) {
        page.section("How this was measured");
        let reference = self.reference.as_ref().map_or("There is no reference.".to_owned(), |r| {
            format!(
                "The reference has {:.0} samples a pixel, by {}, and an own error of {:.3} %, \
                 which the figures do not contain.",
                r.samples,
                r.device,
                100.0 * r.error
            )
        });
        let mut lines = vec![
            format!(
                "{}, {}×{}, depth {}, on {}, by Trisect {}.",
                self.scene, self.width, self.height, self.depth, self.device, self.version
            ),
            format!(
                "{} images with different seeds for each point; {:.0} s in all. A time is the median of \
                 rendering, denoising and scaling, without loading, compiling and writing.",
                self.seeds, self.seconds
            ),
            reference,
            format!("The time of the base varied by {:.1} % over the measurement.", 100.0 * self.drift),
            "Error: the root of relMSE, with its 95 % interval; that of a black image is at most 100 %. Noise is the \
             part that falls with more samples, bias the part that stays. Efficiency: 1 / (error² × time), relative \
             to the base with as many samples; above 1 the same error takes less time."
                .to_owned(),
        ];
        lines.extend(self.ended.map(|stop| format!("This measurement was {}.", stop.reason())));
        page.list(lines);
    }
}

#[cfg(test)]
mod tests;
