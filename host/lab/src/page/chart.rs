//! Charts inside a page: as SVG with the page's colours, a tooltip for each point, and labels.

use super::escape;
use super::labels::{self, Area};
use crate::plot::{Axis, Plot, Scale, Ticks, number};
use std::fmt::Write;

/// Size of a chart in its own units.
pub(super) const SIZE: (f64, f64) = (960.0, 480.0);

/// Frame of the plot: left, top, right, bottom.
const FRAME: Area = [78.0, 14.0, 944.0, 424.0];

/// Number of styles, each a colour and a shape; further series repeat them.
const STYLES: usize = 8;

/// Point of a chart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mark {
    /// Value on the horizontal axis.
    pub x: f64,
    /// Value on the vertical axis.
    pub y: f64,
    /// True if the mark is hollow.
    pub hollow: bool,
    /// Text of the tooltip; may have several lines.
    pub tip: String,
    /// Label beside the point, if any.
    pub label: Option<String>,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Marks {
    /// Name in the legend.
    pub name: String,
    /// Index of colour and shape, as in [`crate::plot::Series`].
    pub style: usize,
    /// True if each point has a mark.
    pub marks: bool,
    /// True if a line joins the points.
    pub line: bool,
    /// Points in the order of the line.
    pub points: Vec<Mark>,
}

/// Chart with two axes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Figure<'a> {
    /// Title, for those who do not see the chart.
    pub title: &'a str,
    /// Horizontal axis.
    pub x: &'a Axis,
    /// Vertical axis.
    pub y: &'a Axis,
    /// Series, in the order of the legend.
    pub series: Vec<Marks>,
}

/// Returns the path of a mark around a place. Its shape depends on the style, so that series differ
/// in more than colour.
fn shape(style: usize, x: f64, y: f64) -> String {
    let r = 5.0;
    let corners: &[(f64, f64)] = match style % STYLES {
        0 => {
            let left = x - r;
            return format!("M{left:.1} {y:.1}a{r} {r} 0 1 0 {0} 0a{r} {r} 0 1 0 -{0} 0z", 2.0 * r);
        }
        1 => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        2 => &[(0.0, -1.1), (1.1, 0.9), (-1.1, 0.9)],
        3 => &[(0.0, -1.2), (1.2, 0.0), (0.0, 1.2), (-1.2, 0.0)],
        4 => &[(0.0, 1.1), (1.1, -0.9), (-1.1, -0.9)],
        5 => &[(-1.1, 0.0), (0.9, 1.1), (0.9, -1.1)],
        6 => &[(1.1, 0.0), (-0.9, 1.1), (-0.9, -1.1)],
        _ => &[(-1.3, -0.5), (1.3, -0.5), (1.3, 0.5), (-1.3, 0.5)],
    };
    let places: Vec<String> =
        corners.iter().map(|(a, b)| format!("{:.1} {:.1}", x + a * r, y + b * r)).collect();
    format!("M{}z", places.join("L"))
}

/// An axis with its ticks, along an edge of the frame.
struct Edge<'a> {
    axis: &'a Axis,
    ticks: Ticks,
    /// Places of the low and the high end in the chart.
    ends: [f64; 2],
}

impl<'a> Edge<'a> {
    /// Makes an axis that the values fill: a logarithmic one ends near the least and the greatest.
    fn new(axis: &'a Axis, values: impl Iterator<Item = f64>, ends: [f64; 2]) -> Self {
        let shown: Vec<f64> = values.filter(|&value| axis.scale.shows(value)).collect();
        let mut ticks = axis.scale.ticks(shown.iter().copied());
        if axis.scale == Scale::Log && !shown.is_empty() {
            let least = shown.iter().copied().fold(f64::INFINITY, f64::min).log10();
            let greatest = shown.iter().copied().fold(0.0, f64::max).log10();
            let margin = 0.05 * (greatest - least) + 0.02;
            let (low, high) = ((least - margin).max(ticks.low), (greatest + margin).min(ticks.high));
            let factors: &[f64] = if high - low < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let decades = low.floor() as i32..=high.ceil() as i32;
            let all = decades.flat_map(|d| factors.iter().map(move |factor| f64::from(d) + factor.log10()));
            let inside: Vec<f64> = all.filter(|place| (low..=high).contains(place)).collect();
            if inside.len() >= 2 {
                ticks = Ticks { low, high, places: inside };
            }
        }
        Self { axis, ticks, ends }
    }

    /// Returns the place of a value; `None` for one that the axis cannot show.
    fn place(&self, value: f64) -> Option<f64> {
        self.axis.scale.shows(value).then(|| self.along(self.axis.scale.map(value)))
    }

    fn along(&self, mapped: f64) -> f64 {
        let share = (mapped - self.ticks.low) / (self.ticks.high - self.ticks.low);
        self.ends[0] + share * (self.ends[1] - self.ends[0])
    }

    /// Returns the places of the ticks with their labels.
    fn labels(&self) -> impl Iterator<Item = (f64, String)> {
        let label = |place: &f64| (self.along(*place), escape(&self.axis.scale.label(*place)));
        self.ticks.places.iter().map(label)
    }
}

/// Returns a chart as a `figure`.
pub(crate) fn inline(figure: &Figure) -> String {
    let points = || figure.series.iter().flat_map(|series| &series.points);
    let x = Edge::new(figure.x, points().map(|point| point.x), [FRAME[0], FRAME[2]]);
    let y = Edge::new(figure.y, points().map(|point| point.y), [FRAME[3], FRAME[1]]);
    let place = |point: &Mark| x.place(point.x).zip(y.place(point.y));
    let mut svg = start(figure.title) + &grid(&x, &y);
    for series in figure.series.iter().filter(|series| series.line) {
        let places: Vec<String> =
            series.points.iter().filter_map(place).map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
        if places.len() > 1 {
            let _ = writeln!(
                svg,
                "<path class=\"line s{}\" d=\"M{}\"/>",
                series.style % STYLES,
                places.join("L")
            );
        }
    }
    let all: Vec<(f64, f64)> = points().filter_map(place).collect();
    let named = points().filter_map(|point| {
        let (x, y) = place(point)?;
        Some((x, y, point.label.as_deref()?))
    });
    svg += &names(&named.collect::<Vec<_>>(), &all);
    for series in figure.series.iter().filter(|series| series.marks) {
        for point in &series.points {
            if let Some(place) = place(point) {
                let _ = writeln!(svg, "{}", mark(series.style, place, point.hollow, &point.tip));
            }
        }
    }
    finish(svg, &figure.series)
}

/// Returns lines at the ticks, the axes, and what they show.
fn grid(x: &Edge, y: &Edge) -> String {
    let mut svg = String::new();
    let [left, top, right, bottom] = FRAME;
    for (at, label) in x.labels() {
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/>\
             <text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{label}</text>",
            bottom + 18.0
        );
    }
    for (at, label) in y.labels() {
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/>\
             <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            left - 8.0,
            at + 4.0
        );
    }
    let (x, y) = (escape(&x.axis.label), escape(&y.axis.label));
    let _ = writeln!(
        svg,
        "<path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/>\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{x}</text>\
         <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{y}</text>",
        0.5 * (left + right),
        bottom + 42.0,
        0.5 * (top + bottom)
    );
    svg
}

/// Returns labels beside their points, with a line to those that are far away.
fn names(named: &[(f64, f64, &str)], points: &[(f64, f64)]) -> String {
    let mut svg = String::new();
    for (&(x, y, text), placed) in named.iter().zip(labels::place(named, points, &FRAME)) {
        let Some(placed) = placed else { continue };
        if placed.is_far {
            let [left, top, right, bottom] = placed.area;
            let (to_x, to_y) = (x.clamp(left, right), y.clamp(top, bottom));
            let _ = writeln!(svg, "<path class=\"leader\" d=\"M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}\"/>");
        }
        let (x, y, text) = (placed.x, placed.y, escape(text));
        let _ = writeln!(svg, "<text class=\"name\" x=\"{x:.1}\" y=\"{y:.1}\">{text}</text>");
    }
    svg
}

fn start(title: &str) -> String {
    let (width, height) = SIZE;
    let title = escape(title);
    format!(
        "<figure class=\"chart\"><svg viewBox=\"0 0 {width} {height}\" role=\"group\" aria-label=\"{title}\">\n"
    )
}

fn mark(style: usize, (x, y): (f64, f64), hollow: bool, tip: &str) -> String {
    let hollow = if hollow { " hollow" } else { "" };
    format!(
        "<g class=\"point\" role=\"img\" data-x=\"{x:.1}\"><title>{}</title>\
         <path class=\"mark s{}{hollow}\" d=\"{}\"/></g>",
        escape(tip),
        style % STYLES,
        shape(style, x, y)
    )
}

/// Ends a chart, with a legend if there are several series.
fn finish(svg: String, series: &[Marks]) -> String {
    let mut html = svg + "</svg>\n";
    if series.len() > 1 {
        html.push_str("<ul class=\"legend\">\n");
        for series in series {
            let style = series.style % STYLES;
            let line = if series.line {
                format!("<path class=\"line s{style}\" d=\"M0 7H26\"/>")
            } else {
                String::new()
            };
            let mark = match series.marks {
                true => {
                    let hollow = if series.points.iter().all(|point| point.hollow) { " hollow" } else { "" };
                    format!("<path class=\"mark s{style}{hollow}\" d=\"{}\"/>", shape(style, 13.0, 7.0))
                }
                false => String::new(),
            };
            let name = escape(&series.name);
            let _ = writeln!(
                html,
                "<li><svg viewBox=\"0 0 26 14\" aria-hidden=\"true\">{line}{mark}</svg>{name}</li>"
            );
        }
        html.push_str("</ul>\n");
    }
    html + "</figure>"
}

impl<'a> Figure<'a> {
    /// Returns a plot as a chart of a page. A point's tooltip has its series and both values.
    pub fn of(plot: &'a Plot) -> Self {
        let series = |series: &crate::plot::Series| {
            let mark = |point: &crate::plot::Point| {
                let (x, y) = (number(point.x), number(point.y));
                let tip = format!("{}\n{}: {x}\n{}: {y}", series.name, plot.x.label, plot.y.label);
                Mark { x: point.x, y: point.y, hollow: point.hollow, tip, label: None }
            };
            Marks {
                name: series.name.clone(),
                style: series.style,
                marks: series.marks,
                line: series.line,
                points: series.points.iter().map(mark).collect(),
            }
        };
        Self { title: &plot.title, x: &plot.x, y: &plot.y, series: plot.series.iter().map(series).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Document, check};
    use super::*;
    use crate::plot::{Point, Series};

    fn page(html: &str) -> String {
        let mut page = Document::new("chart");
        page.add(html);
        let page = page.finish();
        check(&page).unwrap_or_else(|fault| panic!("{fault}"));
        page
    }

    #[test]
    fn points_have_tooltips_and_labels() {
        let mark = |x: f64, y: f64, label: Option<&str>| Mark {
            x,
            y,
            hollow: label.is_none(),
            tip: format!("<{x}>\n{y} %"),
            label: label.map(str::to_owned),
        };
        let points =
            vec![mark(0.1, 30.0, Some("a & b")), mark(1.0, 10.0, None), mark(f64::NAN, 1.0, Some("no"))];
        let series = Marks { name: "one".to_owned(), style: 1, marks: true, line: true, points };
        let other = Marks { name: "two".to_owned(), points: Vec::new(), ..series.clone() };
        let (x, y) = (Axis::log("seconds"), Axis::log("error, %"));
        let figure = Figure { title: "a \"chart\"", x: &x, y: &y, series: vec![series, other] };
        let page = page(&inline(&figure));
        assert_eq!(page.matches("class=\"point\"").count(), 2, "the point without a place is left out");
        assert!(page.contains("<title>&lt;0.1&gt;\n30 %</title>") && page.contains(">a &amp; b</text>"));
        assert!(page.contains(">error, %</text>") && page.contains(">seconds</text>"));
        assert!(page.contains("mark s1 hollow") && page.contains("</svg>one</li>"));
        assert!(!page.contains("fill=\"#") && !page.contains("stroke=\"#"), "a colour of its own");
    }

    #[test]
    fn series_differ_in_shape() {
        let shapes: Vec<String> = (0..STYLES).map(|style| shape(style, 0.0, 0.0)).collect();
        assert!((1..STYLES).all(|index| !shapes[..index].contains(&shapes[index])));
        let style = include_str!("style.css");
        assert!((0..STYLES).all(|index| style.matches(&format!("--s{index}: ")).count() == 3));
    }

    #[test]
    fn plots_have_tooltips() {
        let point = Point { x: 1.0, y: 2.0, hollow: false };
        let plot = Plot {
            title: "plot".to_owned(),
            notes: Vec::new(),
            x: Axis::linear("samples"),
            y: Axis::linear("time, ms"),
            series: vec![Series::measured("median", 0, [(point.x, point.y)])],
        };
        assert!(page(&inline(&Figure::of(&plot))).contains("<title>median\nsamples: 1\ntime, ms: 2</title>"));
    }
}
