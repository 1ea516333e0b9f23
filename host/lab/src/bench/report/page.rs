//! The report as one page: charts with tooltips, and tables of the points.

use super::{Complexity, Conditions, Report, Spp, VsCpu};
use crate::page::{Cell, Column, Document, Row, Table, inline_plot};
use crate::plot::{Chart, number};

fn value(value: f64) -> Cell {
    Cell::number(value, number(value))
}

impl Report {
    /// Returns the report as a page.
    pub(super) fn page(&self) -> String {
        let Conditions { backend, device, .. } = &self.spp.conditions;
        let mut page = Document::new(&format!("Benchmark of {backend}: {device}"));
        page.paragraph("lead", &self.lead());
        let mut chart = |heading: &str, chart: &Chart, table: String| {
            let notes = match chart {
                Chart::Plot(plot) => &plot.notes,
                Chart::Bars(bars) => &bars.notes,
            };
            page.section(heading);
            page.paragraph("note", &notes.join(". "));
            page.add(&inline_plot(chart));
            page.add(&table);
        };
        chart("Time against samples a pixel", &self.spp.chart(), self.spp.table());
        chart("Speed-up against spheres", &self.complexity.speed_up_chart(), self.complexity.table());
        chart("Cost of a sample against spheres", &self.complexity.cost_chart(), String::new());
        chart("Against one thread of the CPU", &self.against.chart(), self.against.table());
        if !self.complexity.left_out.is_empty() {
            page.section("Left out");
            page.list(
                self.complexity
                    .left_out
                    .iter()
                    .map(|left| format!("{} from {} spheres on: {}", left.method, left.spheres, left.why)),
            );
        }
        page.section("How this was measured");
        let Conditions { version, warm_up, frames, .. } = &self.spp.conditions;
        page.list([
            format!(
                "Trisect {version}. Each point is the median of {frames} frames after {warm_up} warm-up frames; the \
                 spread is the range of the middle half of them."
            ),
            "The same figures are in the .json and .csv files beside this page, and the charts as .svg and .png."
                .to_owned(),
        ]);
        page.finish()
    }

    /// Returns the main results in a sentence or two.
    fn lead(&self) -> String {
        let rate = self.spp.line.as_ref().filter(|line| line.slope > 0.0).map_or(String::new(), |line| {
            let Conditions { width, height, .. } = self.spp.conditions;
            let pixels = f64::from(width) * f64::from(height);
            format!(
                "renders {} million samples a second ({})",
                number(1e-6 * pixels / line.slope),
                self.spp.scene
            )
        });
        let ratios = self.against.points.iter().map(|point| point.ratio).filter(|ratio| ratio.is_finite());
        let (least, most) =
            ratios.fold((f64::INFINITY, 0.0f64), |(low, high), ratio| (low.min(ratio), high.max(ratio)));
        let ratio = match most > 0.0 {
            true => format!(
                "is {} to {} times as fast as one thread of {}",
                number(least),
                number(most),
                self.against.cpu
            ),
            false => String::new(),
        };
        let parts: Vec<&str> =
            [&rate, &ratio].into_iter().map(String::as_str).filter(|part| !part.is_empty()).collect();
        match parts.is_empty() {
            true => "Too little was measured for a summary.".to_owned(),
            false => format!("{} {}.", self.spp.conditions.device, parts.join(", and ")),
        }
    }
}

impl Spp {
    fn table(&self) -> String {
        let columns = vec![
            Column::number("samples a pixel"),
            Column::number("median, ms"),
            Column::number("minimum, ms"),
            Column::number("maximum, ms"),
            Column::number("spread, ms"),
        ];
        let row = |point: &super::SppPoint| {
            let time = &point.seconds;
            let mut cells = vec![Cell::number(point.samples.into(), point.samples.to_string())];
            cells.extend([time.median, time.least, time.greatest, time.spread()].map(|s| value(1e3 * s)));
            Row::of(cells)
        };
        let caption = "Device time of a frame".to_owned();
        Table { caption, columns, rows: self.points.iter().map(row).collect() }.html()
    }
}

impl Complexity {
    fn table(&self) -> String {
        let columns = vec![
            Column::text("method"),
            Column::number("spheres"),
            Column::number("samples a pixel"),
            Column::number("median, ns a sample"),
            Column::number("spread, ns"),
            Column::number("segments a sample"),
            Column::number("speed-up"),
            Column::text("baseline"),
            Column::text("kernel"),
        ];
        let row = |point: &super::MethodPoint| {
            let speed_up = point.speed_up.map_or_else(|| Cell::number(f64::NAN, ""), value);
            Row::of(vec![
                Cell::text(point.method.clone()),
                Cell::number(point.spheres.into(), point.spheres.to_string()),
                Cell::number(point.samples.into(), point.samples.to_string()),
                value(point.nanoseconds.median),
                value(point.nanoseconds.spread()),
                value(point.segments),
                speed_up,
                Cell::text(if point.extrapolated { "extrapolated" } else { "measured" }),
                Cell::text(point.kernel.clone()),
            ])
        };
        let caption = "Device time of a sample, for both charts of spheres".to_owned();
        Table { caption, columns, rows: self.points.iter().map(row).collect() }.html()
    }
}

impl VsCpu {
    fn table(&self) -> String {
        let columns = vec![
            Column::text("scene"),
            Column::number("device, ms"),
            Column::number("spread, ms"),
            Column::number("one thread, ms"),
            Column::number("ratio"),
            Column::text("kernel"),
        ];
        let row = |point: &super::VsCpuPoint| {
            Row::of(vec![
                Cell::text(point.scene.clone()),
                value(1e3 * point.device_seconds.median),
                value(1e3 * point.device_seconds.spread()),
                value(1e3 * point.thread_seconds),
                value(point.ratio),
                Cell::text(point.kernel.clone()),
            ])
        };
        let caption = format!("Time of a frame of {} samples a pixel", self.samples);
        Table { caption, columns, rows: self.points.iter().map(row).collect() }.html()
    }
}
