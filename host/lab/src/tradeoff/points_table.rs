//! Table of all points of a report page.

use super::point::{Point, Tradeoff};
use crate::accuracy::Bias;
use crate::page::{Cell, Column, Row, Table};

/// Returns a table of all points.
pub(super) fn html(found: &Tradeoff) -> String {
    let columns = vec![
        Column::text("setting"),
        Column::number("samples a pixel"),
        Column::number("time, s"),
        Column::number("error, %"),
        Column::number("95 % interval, %"),
        Column::text("verdict"),
        Column::text("bias, %"),
        Column::number("noise, %"),
        Column::number("brightness, %"),
        Column::number("RMSE"),
        Column::number("FLIP"),
        Column::number("efficiency"),
        Column::number("95 % interval"),
        Column::for_screens("command"),
    ];
    let caption = "Green: on the Pareto front. A heading sorts by its column.".to_owned();
    Table { caption, columns, rows: found.points.iter().map(row).collect() }.html()
}

fn row(point: &Point) -> Row {
    let errors = &point.errors;
    let root = |value: f64| 100.0 * value.max(0.0).sqrt();
    let decimals = |value: f64, digits: usize| Cell::number(value, format!("{value:.digits$}"));
    let all = errors.rel_mse.map(root);
    let [efficiency, interval] = match &point.against {
        None => [Cell::number(1.0, "1"), Cell::number(f64::NAN, "")],
        Some(against) => {
            let e = against.efficiency;
            [decimals(e.value, 2), Cell::number(e.low, format!("{:.2} to {:.2}", e.low, e.high))]
        }
    };
    let bias = match errors.bias() {
        Bias::NotSeen => Cell::number(0.0, "none seen"),
        Bias::Tiny => Cell::number(0.0005, "below 0.001"),
        Bias::Suspected => Cell::number(0.001, "suspected in parts"),
        Bias::Size(size) => {
            let rare = if point.exact { " (rare paths)" } else { "" };
            Cell::number(100.0 * size, format!("{:.3}{rare}", 100.0 * size))
        }
        Bias::Brightness(share) => {
            Cell::number(100.0 * share.abs(), format!("{:+.3} of the brightness", 100.0 * share))
        }
    };
    let cells = vec![
        Cell::text(point.name()),
        Cell::number(point.spp.into(), point.spp.to_string()),
        decimals(point.seconds.all.median, 4),
        decimals(all.value, 3),
        Cell::number(all.low, format!("{:.3} to {:.3}", all.low, all.high)),
        Cell::text(point.verdict()),
        bias,
        decimals(root(errors.variance.value), 3),
        Cell::number(100.0 * errors.brightness.value, format!("{:+.3}", 100.0 * errors.brightness.value)),
        decimals(errors.rmse.value, 5),
        decimals(errors.flip.value, 4),
        efficiency,
        interval,
        Cell::text(point.command.clone().unwrap_or_else(|| "none".to_owned())),
    ];
    Row { class: if point.on_front { "front" } else { "" }, cells }
}
