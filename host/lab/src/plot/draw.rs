//! Draws charts as SVG and PNG. The output depends on the chart alone: it contains no date, and no
//! font of the system.

use super::chart::{Bars, Chart, Plot, Series};
use super::ticks::{Ticks, number};
use crate::error::BenchError;
use plotters::chart::ChartBuilder;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::series::LineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    BLACK, Color, FontStyle, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE, register_font,
};
use std::fs;
use std::ops::Range;
use std::path::Path;
use std::sync::OnceLock;
use trisect::output::encode_bytes;

/// DejaVu Sans, reduced to the characters that charts use. Its licence lies beside it.
const FONT: &[u8] = include_bytes!("../../assets/DejaVuSans-subset.ttf");

/// Font family: the generic one of SVG, for which a viewer uses its own font. Bitmaps use [`FONT`].
const FAMILY: &str = "sans-serif";

/// Size of the SVG in pixels. The PNG has [`PNG_SCALE`] times as many along each axis.
const SIZE: (u32, u32) = (960, 560);

const PNG_SCALE: u32 = 2;

/// Width of the legend on the right, in pixels of the SVG.
const LEGEND: u32 = 215;

/// Palette of Okabe and Ito, whose colours people with any common colour vision can tell apart
/// (jfly.uni-koeln.de/color, 2008), without its yellow, which is too light on white.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

type Failure = String;

/// Writes `STEM.svg` and `STEM.png` into a folder.
pub(crate) fn write(chart: &Chart, folder: &Path, stem: &str) -> Result<(), BenchError> {
    let path = folder.join(format!("{stem}.svg"));
    let draw = |path: &Path, message| BenchError::Draw { path: path.to_owned(), message };
    let text = svg(chart).map_err(|message| draw(&path, message))?;
    fs::write(&path, text).map_err(BenchError::io(&path))?;
    let path = folder.join(format!("{stem}.png"));
    let bytes = png(chart).map_err(|message| draw(&path, message))?;
    fs::write(&path, bytes).map_err(BenchError::io(&path))
}

pub(super) fn svg(chart: &Chart) -> Result<String, Failure> {
    let mut text = String::new();
    paint(SVGBackend::with_string(&mut text, SIZE).into_drawing_area(), chart, 1)?;
    Ok(text)
}

pub(super) fn png(chart: &Chart) -> Result<Vec<u8>, Failure> {
    let (width, height) = (SIZE.0 * PNG_SCALE, SIZE.1 * PNG_SCALE);
    let mut pixels = vec![255; (width * height * 3) as usize];
    paint(BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area(), chart, PNG_SCALE)?;
    encode_bytes(width, height, &pixels)
}

fn paint<DB: DrawingBackend>(area: DrawingArea<DB, Shift>, chart: &Chart, scale: u32) -> Result<(), Failure> {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    if !REGISTERED.get_or_init(|| register_font(FAMILY, FontStyle::Normal, FONT).is_ok()) {
        return Err("the built-in font is broken".to_owned());
    }
    let failed = |error: DrawingAreaErrorKind<DB::ErrorType>| error.to_string();
    area.fill(&WHITE).map_err(failed)?;
    let pen = Pen { scale };
    let (title, notes) = match chart {
        Chart::Plot(plot) => (&plot.title, &plot.notes),
        Chart::Bars(bars) => (&bars.title, &bars.notes),
    };
    let at = |x: u32, y: u32| ((x * scale) as i32, (y * scale) as i32);
    area.draw(&Text::new(title.as_str(), at(16, 14), pen.text(20, BLACK))).map_err(failed)?;
    for (line, note) in (0..).zip(notes) {
        let place = at(16, 44 + 17 * line);
        area.draw(&Text::new(note.as_str(), place, pen.text(13, GREY))).map_err(failed)?;
    }
    let (_, below) = area.split_vertically(((50 + 17 * notes.len() as u32) * scale) as i32);
    match chart {
        Chart::Plot(plot) => pen.plot(&below, plot),
        Chart::Bars(bars) => pen.bars(&below, bars),
    }
    .map_err(failed)?;
    area.present().map_err(failed)
}

const GREY: RGBColor = RGBColor(80, 80, 80);

const GRID: RGBColor = RGBColor(225, 225, 225);

impl Ranged for Ticks {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        first + ((value - self.low) / (self.high - self.low) * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.places.clone()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

/// Scales sizes of text, strokes and marks for the SVG or the PNG.
#[derive(Clone, Copy)]
struct Pen {
    scale: u32,
}

type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

impl Pen {
    fn text(self, size: u32, color: RGBColor) -> TextStyle<'static> {
        (FAMILY, size * self.scale).into_font().color(&color)
    }

    fn stroke(self, color: RGBColor, width: u32) -> ShapeStyle {
        color.stroke_width(width * self.scale)
    }

    fn plot<DB: DrawingBackend>(self, area: &DrawingArea<DB, Shift>, plot: &Plot) -> Drawn<DB> {
        let scale = self.scale;
        let (width, _) = area.dim_in_pixel();
        let (left, right) = area.split_horizontally((width - LEGEND * scale) as i32);
        let points = || plot.series.iter().flat_map(|series| &series.points);
        let x = plot.x.scale.ticks(points().map(|point| point.x));
        let y = plot.y.scale.ticks(points().map(|point| point.y));
        let mut chart = ChartBuilder::on(&left)
            .margin(10 * scale)
            .x_label_area_size(48 * scale)
            .y_label_area_size(74 * scale)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .disable_axes()
            .light_line_style(WHITE)
            .bold_line_style(self.stroke(GRID, 1))
            .draw()?;
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(self.stroke(GREY, 1))
            .x_desc(&plot.x.label)
            .y_desc(&plot.y.label)
            .axis_desc_style(self.text(14, BLACK))
            .label_style(self.text(13, BLACK))
            .x_label_formatter(&|place| plot.x.scale.label(*place))
            .y_label_formatter(&|place| plot.y.scale.label(*place))
            .draw()?;
        for series in &plot.series {
            let color = COLORS[series.style % COLORS.len()];
            let shown = series.points.iter().filter(|p| plot.x.scale.shows(p.x) && plot.y.scale.shows(p.y));
            let places = shown.map(|p| ((plot.x.scale.map(p.x), plot.y.scale.map(p.y)), p.hollow));
            if series.line {
                let line = places.clone().map(|(place, _)| place);
                chart.draw_series(LineSeries::new(line, self.stroke(color, 2)))?;
            }
            if series.marks {
                for (place, hollow) in places {
                    let pixel = chart.plotting_area().map_coordinate(&place);
                    let origin = left.get_base_pixel();
                    let pixel = (pixel.0 - origin.0, pixel.1 - origin.1);
                    self.mark(&left, pixel, series.style, hollow)?;
                }
            }
        }
        self.legend(&right, &plot.series)
    }

    fn legend<DB: DrawingBackend>(self, area: &DrawingArea<DB, Shift>, all: &[Series]) -> Drawn<DB> {
        let scale = self.scale as i32;
        for (index, series) in all.iter().enumerate() {
            let y = (24 + 24 * index as i32) * scale;
            let color = COLORS[series.style % COLORS.len()];
            if series.line {
                let ends = vec![(4 * scale, y), (30 * scale, y)];
                area.draw(&PathElement::new(ends, self.stroke(color, 2)))?;
            }
            if series.marks {
                self.mark(area, (17 * scale, y), series.style, false)?;
            }
            let style = self.text(13, BLACK).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(series.name.as_str(), (38 * scale, y), style))?;
        }
        Ok(())
    }

    /// Draws the mark of a point. Its shape depends on the style, so that series differ in more
    /// than colour.
    fn mark<DB: DrawingBackend>(
        self,
        area: &DrawingArea<DB, Shift>,
        place: (i32, i32),
        style: usize,
        hollow: bool,
    ) -> Drawn<DB> {
        let color = COLORS[style % COLORS.len()];
        let ink = if hollow { self.stroke(color, 2) } else { color.filled() };
        let r = 5 * self.scale as i32;
        let corners: &[(i32, i32)] = match style % 7 {
            0 => return area.draw(&Circle::new(place, r, ink)),
            1 => &[(-1, -1), (1, -1), (1, 1), (-1, 1)],
            2 => &[(0, -1), (1, 1), (-1, 1)],
            3 => &[(0, -1), (1, 0), (0, 1), (-1, 0)],
            4 => &[(0, 1), (1, -1), (-1, -1)],
            5 => &[(-1, 0), (1, 1), (1, -1)],
            _ => &[(1, 0), (-1, 1), (-1, -1)],
        };
        let mut corners: Vec<_> = corners.iter().map(|c| (place.0 + c.0 * r, place.1 + c.1 * r)).collect();
        if hollow {
            corners.extend(corners.first().copied());
            return area.draw(&PathElement::new(corners, ink));
        }
        area.draw(&Polygon::new(corners, ink))
    }

    fn bars<DB: DrawingBackend>(self, area: &DrawingArea<DB, Shift>, bars: &Bars) -> Drawn<DB> {
        let scale = self.scale as i32;
        let (width, height) = area.dim_in_pixel();
        let (width, height) = (width as i32, height as i32);
        let (left, right, bottom) = (230 * scale, width - 130 * scale, height - 44 * scale);
        let greatest =
            bars.bars.iter().map(|bar| bar.1).filter(|value| value.is_finite()).fold(0.0, f64::max);
        let step = (bottom - 10 * scale) / (bars.bars.len().max(1) as i32);
        let style = |horizontal, vertical| self.text(14, BLACK).pos(Pos::new(horizontal, vertical));
        for (index, (name, value)) in bars.bars.iter().enumerate() {
            let middle = 10 * scale + step * index as i32 + step / 2;
            let half = (step / 3).min(22 * scale);
            let share = if greatest > 0.0 && value.is_finite() { (value / greatest).max(0.0) } else { 0.0 };
            let end = left + (share * f64::from(right - left)) as i32;
            area.draw(&Rectangle::new([(left, middle - half), (end, middle + half)], COLORS[0].filled()))?;
            let place = (left - 10 * scale, middle);
            area.draw(&Text::new(name.as_str(), place, style(HPos::Right, VPos::Center)))?;
            let place = (end + 8 * scale, middle);
            area.draw(&Text::new(number(*value), place, style(HPos::Left, VPos::Center)))?;
        }
        let axis = vec![(left, 4 * scale), (left, bottom)];
        area.draw(&PathElement::new(axis, self.stroke(GREY, 1)))?;
        let place = ((left + right) / 2, bottom + 12 * scale);
        area.draw(&Text::new(bars.label.as_str(), place, style(HPos::Center, VPos::Top)))
    }
}

#[cfg(test)]
mod tests;
