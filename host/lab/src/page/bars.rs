//! Bar charts inside a page.

use super::chart::{Figure, SIZE, inline};
use super::escape;
use crate::plot::{Bars, Chart, number};
use std::fmt::Write;

/// Returns a plot or a bar chart as a `figure`.
pub(crate) fn inline_plot(chart: &Chart) -> String {
    match chart {
        Chart::Plot(plot) => inline(&Figure::of(plot)),
        Chart::Bars(all) => bars(all),
    }
}

fn bars(bars: &Bars) -> String {
    let greatest = bars.bars.iter().map(|bar| bar.1).filter(|value| value.is_finite()).fold(0.0, f64::max);
    let (left, right, step) = (240.0, SIZE.0 - 110.0, 44.0);
    let height = step * bars.bars.len() as f64 + 40.0;
    let mut svg = format!(
        "<figure class=\"chart\"><svg viewBox=\"0 0 {} {height}\" role=\"group\" aria-label=\"{}\">\n",
        SIZE.0,
        escape(&bars.title)
    );
    for (index, (name, value)) in bars.bars.iter().enumerate() {
        let top = step * index as f64 + 8.0;
        let share = if greatest > 0.0 && value.is_finite() { (value / greatest).max(0.0) } else { 0.0 };
        let (width, middle) = (share * (right - left), top + 18.0);
        let (name, value) = (escape(name), number(*value));
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{middle}\" text-anchor=\"end\">{name}</text><g class=\"point\" role=\"img\" \
             data-x=\"{index}\"><title>{name}\n{}: {value}</title><path class=\"mark s0\" \
             d=\"M{left} {top}h{width:.1}v28h-{width:.1}z\"/></g><text x=\"{:.1}\" y=\"{middle}\">{value}</text>",
            left - 10.0,
            escape(&bars.label),
            left + width + 8.0
        );
    }
    let _ = writeln!(
        svg,
        "<path class=\"axis\" d=\"M{left} 2V{}\"/><text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
        height - 34.0,
        0.5 * (left + right),
        height - 10.0,
        escape(&bars.label)
    );
    svg + "</svg>\n</figure>"
}

#[cfg(test)]
mod tests {
    use super::super::{Document, check};
    use super::*;

    #[test]
    fn bars_have_tooltips() {
        let all = [("<a>", 4.0), ("b", f64::NAN), ("c", -1.0)];
        let bars = Bars {
            title: "bars".to_owned(),
            notes: Vec::new(),
            label: "ratio, ×".to_owned(),
            bars: all.map(|(name, value)| (name.to_owned(), value)).to_vec(),
        };
        let mut page = Document::new("bars");
        page.add(&inline_plot(&Chart::Bars(bars)));
        let page = page.finish();
        check(&page).unwrap_or_else(|fault| panic!("{fault}"));
        assert!(page.contains("<title>&lt;a&gt;\nratio, ×: 4</title>"));
    }
}
