//! Charts as data, independent of how they are drawn.

/// Mapping of values to places on an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear, and contains zero.
    Linear,
    /// Logarithmic, by decades.
    Log,
}

/// Axis of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity that the axis shows, with its unit.
    pub label: String,
    /// Mapping of values to places.
    pub scale: Scale,
}

/// Point of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Value on the horizontal axis.
    pub x: f64,
    /// Value on the vertical axis.
    pub y: f64,
    /// True if the mark is drawn hollow, as for biased or extrapolated values.
    pub hollow: bool,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Index of colour and mark shape. Equal things have equal styles in all charts.
    pub style: usize,
    /// Points, in the order of their x.
    pub points: Vec<Point>,
    /// True if each point gets a mark.
    pub marks: bool,
    /// True if a line joins the points.
    pub line: bool,
}

/// Plot of lines and marks over two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Lines below the title: device, settings, fits.
    pub notes: Vec<String>,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series, in the order of the legend.
    pub series: Vec<Series>,
}

/// Bar chart with a bar for each name.
#[derive(Clone, Debug, PartialEq)]
pub struct Bars {
    /// Title.
    pub title: String,
    /// Lines below the title.
    pub notes: Vec<String>,
    /// Quantity that the bars' lengths show, with its unit.
    pub label: String,
    /// Names and values, from top to bottom.
    pub bars: Vec<(String, f64)>,
}

/// A plot or a bar chart.
#[derive(Clone, Debug, PartialEq)]
pub enum Chart {
    /// Lines and marks over two axes.
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
    /// Returns a series of measured points, with marks and a line.
    pub(crate) fn measured(name: &str, style: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().map(|(x, y)| Point { x, y, hollow: false }).collect();
        Self { name: name.to_owned(), style, points, marks: true, line: true }
    }
}
