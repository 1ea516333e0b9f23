//! Tables whose rows a reader can sort by any column.

use super::escape;
use std::fmt::Write;

/// Column of a table.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    /// Heading, with the unit.
    pub name: &'static str,
    /// Class of its cells: of numbers, which are aligned to the right, or of a column that is not
    /// printed; empty for text.
    class: &'static str,
}

/// Cell of a table.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    text: String,
    /// Value by which the row is sorted; `None` to sort by the text.
    value: Option<f64>,
}

/// Row of a table.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// Class of the row; empty for none.
    pub class: &'static str,
    /// Cells, one for each column.
    pub cells: Vec<Cell>,
}

/// Table with a heading for each column.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    /// Caption: the content of the table.
    pub caption: String,
    /// Columns; the first one names the row.
    pub columns: Vec<Column>,
    /// Rows, in the order before a reader sorts them.
    pub rows: Vec<Row>,
}

impl Column {
    /// Returns a column of text.
    pub fn text(name: &'static str) -> Self {
        Self { name, class: "" }
    }

    /// Returns a column of numbers.
    pub fn number(name: &'static str) -> Self {
        Self { name, class: "number" }
    }

    /// Returns a column of text for which paper is too narrow.
    pub fn for_screens(name: &'static str) -> Self {
        Self { name, class: "screen" }
    }
}

impl Cell {
    /// Returns a cell of text.
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), value: None }
    }

    /// Returns a cell that shows `text` and is sorted by `value`; one that is not finite is sorted
    /// last.
    pub fn number(value: f64, text: impl Into<String>) -> Self {
        Self { text: text.into(), value: Some(value) }
    }
}

impl Row {
    /// Returns a row without a class.
    pub fn of(cells: Vec<Cell>) -> Self {
        Self { class: "", cells }
    }
}

impl Table {
    /// Returns the table as HTML.
    pub fn html(&self) -> String {
        let mut html = format!(
            "<div class=\"scroll\"><table class=\"sortable\">\n<caption>{}</caption>\n<thead><tr>",
            escape(&self.caption)
        );
        let class = |column: &Column| match column.class {
            "" => String::new(),
            class => format!(" class=\"{class}\""),
        };
        for column in &self.columns {
            let _ = write!(html, "<th scope=\"col\"{}>{}</th>", class(column), escape(column.name));
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            let of_row =
                if row.class.is_empty() { String::new() } else { format!(" class=\"{}\"", row.class) };
            let _ = write!(html, "<tr{of_row}>");
            for (index, (column, cell)) in self.columns.iter().zip(&row.cells).enumerate() {
                let tag = if index == 0 { "th scope=\"row\"" } else { "td" };
                let sort = match cell.value {
                    Some(value) if value.is_finite() => format!(" data-sort=\"{value:e}\""),
                    Some(_) => " data-sort=\"\"".to_owned(),
                    None => String::new(),
                };
                let text = escape(&cell.text);
                let _ = write!(html, "<{tag}{}{sort}>{text}</{}>", class(column), &tag[..2]);
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody>\n</table></div>");
        html
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Document, check};
    use super::*;

    #[test]
    fn rows_have_values_to_sort_by() {
        let row = |value: f64| Row::of(vec![Cell::text("<a>"), Cell::number(value, format!("{value:.1}"))]);
        let table = Table {
            caption: "\"a\" & b".to_owned(),
            columns: vec![Column::text("name"), Column::number("time, s")],
            rows: vec![row(1.25), Row { class: "front", ..row(f64::NAN) }],
        };
        let html = table.html();
        assert!(
            html.contains("<th scope=\"row\">&lt;a&gt;</th><td class=\"number\" data-sort=\"1.25e0\">1.2")
        );
        assert!(html.contains("<tr class=\"front\">") && html.contains("data-sort=\"\">NaN</td>"), "{html}");
        let mut page = Document::new("a");
        page.add(&html);
        check(&page.finish()).unwrap_or_else(|fault| panic!("{fault}"));
    }
}
