//! Charts as data: what is drawn, whatever draws it.

/// How an axis maps its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly, from zero.
    Linear,
    /// By decades.
    Log,
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// How.
    pub scale: Scale,
}

/// A value at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Across.
    pub x: f64,
    /// Up.
    pub y: f64,
    /// Drawn hollow: it is not measured alone.
    pub hollow: bool,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// Which colour and mark: the same for the same thing in all charts.
    pub style: usize,
    /// In the order of their x.
    pub points: Vec<Point>,
    /// Whether each point gets a mark.
    pub marks: bool,
    /// Whether a line joins them.
    pub line: bool,
}

/// Lines and marks over two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// Below it, a line each: device, settings, fits.
    pub notes: Vec<String>,
    /// Across.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// In the legend's order.
    pub series: Vec<Series>,
}

/// A bar for each name.
#[derive(Clone, Debug, PartialEq)]
pub struct Bars {
    /// What it shows.
    pub title: String,
    /// Below it, a line each.
    pub notes: Vec<String>,
    /// What a bar's length is, with its unit.
    pub label: String,
    /// From top to bottom.
    pub bars: Vec<(String, f64)>,
}

/// A chart of either kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Chart {
    /// Lines and marks.
    Plot(Plot),
    /// Bars.
    Bars(Bars),
}

impl Axis {
    pub(crate) fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Linear }
    }

    pub(crate) fn log(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Log }
    }
}

impl Series {
    /// Measured points, joined.
    pub(crate) fn measured(name: &str, style: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().map(|(x, y)| Point { x, y, hollow: false }).collect();
        Self { name: name.to_owned(), style, points, marks: true, line: true }
    }
}
