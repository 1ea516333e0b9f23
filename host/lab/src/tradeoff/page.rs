//! Writes a trade-off measurement as one HTML page that needs no other file, with the data and
//! charts as files beside it.

use super::bias::Bias;
use super::picture::{Pictures, Thumbnail};
use super::point::{Point, Tradeoff};
use super::{TradeoffError, charts, table};
use crate::plot::{self, Chart};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use trisect::output::encode_bytes;

const STYLE: &str = "body{font:15px/1.45 sans-serif;margin:2em auto;max-width:1240px;padding:0 1em;color:#222}\
table{border-collapse:collapse;font-size:13px}td,th{padding:3px 8px;border-bottom:1px solid #ddd;text-align:right}\
td:first-child,th:first-child,td:last-child{text-align:left}tr.front{background:#e8f4ec}\
.grid{display:grid;grid-template-columns:repeat(3,1fr);gap:4px;margin:0 0 1.2em}img{width:100%;image-rendering:pixelated}\
svg{max-width:100%;height:auto}figcaption{font-size:13px}";

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
        let drawn = [("error_over_time", charts::over_time(self)), ("front", charts::front(self))];
        let mut inline = Vec::new();
        for (stem, chart) in &drawn {
            plot::write(chart, folder, stem)
                .map_err(|error| TradeoffError::encode(&folder.join(stem), error))?;
            inline.push(svg(chart, folder)?);
        }
        let page = self.page(pictures, &inline, folder)?;
        save("report.html", page.as_bytes())?;
        files.extend(
            drawn
                .iter()
                .flat_map(|(stem, _)| ["svg", "png"].map(|kind| folder.join(format!("{stem}.{kind}")))),
        );
        Ok(files)
    }

    fn page(&self, pictures: &Pictures, charts: &[String], folder: &Path) -> Result<String, TradeoffError> {
        let title = escape(&format!("Speed and accuracy: {}", self.scene));
        let mut page = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n"
        );
        let reference = self.reference.as_ref().map_or("There is no reference.".to_owned(), |r| {
            format!(
                "The reference has {:.0} samples a pixel, by {}, and an own error of {:.3} %, \
                 which the figures below do not contain.",
                r.samples,
                escape(&r.device),
                100.0 * r.error
            )
        });
        let ended = self.ended.map_or(String::new(), |stop| {
            format!(" This measurement was {}; what was not measured is listed below.", stop.reason())
        });
        let mut add = |text: String| page.push_str(&text);
        add(format!(
            "<p>{}×{}, depth {}, on {}. Trisect {}. {} seeds per point. {reference}{ended}</p>\n",
            self.width,
            self.height,
            self.depth,
            escape(&self.device),
            escape(&self.version),
            self.seeds,
        ));
        charts.iter().for_each(|chart| add(format!("<figure>{chart}</figure>\n")));
        add("<h2>All points</h2>\n<p>Error: root of relMSE, with its 95 % interval. Noise: the part that falls with more samples; bias: the part that stays. \
             Efficiency: relative to the base with as many samples; above 1 the same error takes less time. Green: on the Pareto front.</p>\n<table><tr>\
             <th>configuration</th><th>spp</th><th>seconds</th><th>error, %</th><th>noise, %</th><th>bias, %</th><th>brightness, %</th><th>RMSE</th><th>FLIP</th>\
             <th>efficiency</th><th></th></tr>\n"
            .to_owned());
        self.points.iter().for_each(|point| add(row(point)));
        add("</table>\n".to_owned());
        if !self.missing.is_empty() {
            add("<h2>Not measured here</h2>\n<ul>".to_owned());
            for missing in &self.missing {
                let line = format!("{} {}: {}", missing.knob, missing.level, missing.reason);
                add(format!("<li>{}</li>", escape(&line)));
            }
            add("</ul>\n".to_owned());
        }
        if let Some(reference) = &pictures.reference {
            add(format!(
                "<h2>Images</h2>\n<p>The image of the first seed; its difference from the reference, divided by the root of the reference's square plus 0.01, \
                 brightest from 50 %; and FLIP. Each configuration has its largest number of samples per pixel.</p>\n<figure><figcaption>Reference</figcaption>\
                 <div class=\"grid\">{}</div></figure>\n",
                picture(reference, folder)?
            ));
        }
        for (name, spp, shown) in &pictures.shown {
            let all = [&shown.image, &shown.difference, &shown.flip];
            let all: Vec<String> =
                all.into_iter().map(|small| picture(small, folder)).collect::<Result<_, _>>()?;
            add(format!(
                "<figure><figcaption>{}, {spp} spp</figcaption><div class=\"grid\">{}</div></figure>\n",
                escape(name),
                all.concat()
            ));
        }
        page.push_str("</body></html>\n");
        Ok(page)
    }
}

fn row(point: &Point) -> String {
    let errors = &point.errors;
    let root = |value: f64| 100.0 * value.max(0.0).sqrt();
    let all = errors.rel_mse;
    let efficiency = point.against.as_ref().map_or("1".to_owned(), |against| {
        let e = against.efficiency;
        format!("{:.2} ({:.2} to {:.2})", e.value, e.low, e.high)
    });
    let mut text = format!("<tr{}>", if point.on_front { " class=\"front\"" } else { "" });
    let cells = [
        escape(&point.name()),
        point.spp.to_string(),
        format!("{:.4}", point.seconds.all.median),
        format!("{:.3} ({:.3} to {:.3})", root(all.value), root(all.low), root(all.high)),
        format!("{:.3}", root(errors.variance.value)),
        match errors.bias() {
            Bias::NotSeen => "none seen".to_owned(),
            Bias::Tiny => "below 0.001".to_owned(),
            Bias::Size(size) => {
                format!("{:.3}{}", 100.0 * size, if point.exact { " (rare paths)" } else { "" })
            }
            Bias::Brightness(_) => "of the brightness".to_owned(),
        },
        format!("{:+.3}", 100.0 * errors.brightness.value),
        format!("{:.5}", errors.rmse.value),
        format!("{:.4}", errors.flip.value),
        efficiency,
        point.verdict().to_owned(),
    ];
    for cell in cells {
        let _ = write!(text, "<td>{cell}</td>");
    }
    text + "</tr>\n"
}

fn svg(chart: &Chart, folder: &Path) -> Result<String, TradeoffError> {
    plot::svg(chart).map_err(|error| TradeoffError::encode(&folder.join("report.html"), error))
}

fn picture(small: &Thumbnail, folder: &Path) -> Result<String, TradeoffError> {
    let wrong = |error: String| TradeoffError::encode(&folder.join("report.html"), error);
    let bytes = encode_bytes(small.width, small.height, &small.bytes).map_err(wrong)?;
    Ok(format!("<img src=\"data:image/png;base64,{}\" alt=\"\">", STANDARD.encode(bytes)))
}

/// Escapes text for HTML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
