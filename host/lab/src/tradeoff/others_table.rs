//! Table of the images of other renderers on a report page.

use super::others::OtherRenderer;
use crate::page::{Cell, Column, Row, Table};

/// Returns a table of the images of other renderers.
pub(super) fn html(others: &[OtherRenderer]) -> String {
    let columns = vec![
        Column::text("images"),
        Column::number("seeds"),
        Column::number("time, s"),
        Column::number("error, %"),
        Column::number("noise, %"),
        Column::text("bias"),
        Column::number("brightness, %"),
        Column::number("HDR-FLIP"),
        Column::number("efficiency"),
        Column::number("95 % interval"),
    ];
    let caption = "A heading sorts by its column.".to_owned();
    Table { caption, columns, rows: others.iter().map(row).collect() }.html()
}

fn row(other: &OtherRenderer) -> Row {
    let errors = &other.row.errors;
    let decimals = |value: f64, digits: usize| Cell::number(value, format!("{value:.digits$}"));
    let nothing = || Cell::number(f64::NAN, "");
    let percent = |squared: f64| decimals(100.0 * squared.max(0.0).sqrt(), 3);
    let [efficiency, interval] = match other.efficiency_of_base {
        None => [nothing(), nothing()],
        Some(of) => [decimals(of.value, 2), Cell::number(of.low, format!("{:.2} to {:.2}", of.low, of.high))],
    };
    Row::of(vec![
        Cell::text(other.row.name.clone()),
        Cell::number(errors.seeds as f64, errors.seeds.to_string()),
        other.row.seconds.map_or_else(nothing, |seconds| decimals(seconds.median, 4)),
        percent(errors.rel_mse.value),
        percent(errors.variance.value),
        Cell::text(errors.bias().to_string()),
        Cell::number(100.0 * errors.brightness.value, format!("{:+.3}", 100.0 * errors.brightness.value)),
        decimals(other.row.hdr_flip.value, 4),
        efficiency,
        interval,
    ])
}
