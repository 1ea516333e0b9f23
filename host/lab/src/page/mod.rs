//! Report pages: one HTML file each, which loads nothing, is readable without scripts, in light and
//! dark, and on paper.
//!
//! `Document` is the frame of a page with its style and script. The other modules make its parts:
//! sortable tables, charts with tooltips, and images with a slider between two of them.

mod bars;
mod chart;
mod check;
mod colors;
mod labels;
mod raster;
mod slider;
mod table;

pub(crate) use bars::inline_plot;
pub(crate) use chart::{Figure, Mark, Marks, inline};
pub use check::check;
pub(crate) use colors::{DIVERGING, INFERNO, MAGMA, NOT_FINITE, Ramp};
pub(crate) use raster::{Raster, reduction};
pub(crate) use slider::{Gallery, slider};
pub(crate) use table::{Cell, Column, Row, Table};

use std::fmt::Write;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("script.js");

/// Policy of the page: images are those inside it, style and script are its own, and nothing else
/// is loaded from anywhere.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; \
                      script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// A page that is being written, part by part.
pub(crate) struct Document {
    body: String,
    title: String,
}

impl Document {
    /// Starts a page with this title, which is also its heading.
    pub fn new(title: &str) -> Self {
        let title = escape(title);
        Self { body: format!("<h1>{title}</h1>\n"), title }
    }

    /// Adds HTML.
    pub fn add(&mut self, html: &str) {
        self.body.push_str(html);
        self.body.push('\n');
    }

    /// Adds a heading of a section.
    pub fn section(&mut self, heading: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(heading));
    }

    /// Adds a paragraph of plain text, with this class.
    pub fn paragraph(&mut self, class: &str, text: &str) {
        let _ = writeln!(self.body, "<p class=\"{class}\">{}</p>", escape(text));
    }

    /// Adds a list of lines of plain text.
    pub fn list(&mut self, lines: impl IntoIterator<Item = String>) {
        self.body.push_str("<ul>\n");
        for line in lines {
            let _ = writeln!(self.body, "<li>{}</li>", escape(&line));
        }
        self.body.push_str("</ul>\n");
    }

    /// Returns the whole page.
    pub fn finish(self) -> String {
        let Self { body, title } = self;
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n\
             <script>\n{SCRIPT}</script>\n</body>\n</html>\n"
        )
    }
}

/// Returns a command line as code that a button copies, and whose words are not broken.
pub(crate) fn command(text: &str) -> String {
    let words: Vec<String> = text.split(' ').map(|word| format!("<span>{}</span>", escape(word))).collect();
    format!("<div class=\"command\"><code>{}</code></div>", words.join(" "))
}

/// Escapes text for HTML: for the content of elements, and for attributes in quotes. Control
/// characters, which HTML has no form for, become U+FFFD.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\n' | '\t' => escaped.push(character),
            control if control.is_control() => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text that would be markup, a script or the end of an attribute.
    const BAD: &str = "<script>alert(1)</script>\"' onload=x&amp;\u{7}</style>-->.ron";

    #[test]
    fn text_stays_text() {
        let mut page = Document::new(BAD);
        page.section(BAD);
        page.paragraph("lead", BAD);
        page.list([BAD.to_owned()]);
        page.add(&command(BAD));
        let page = page.finish();
        check(&page).unwrap_or_else(|fault| panic!("{fault}"));
        assert_eq!(page.matches("<script>").count(), 1);
        let escaped = "&lt;script&gt;alert(1)&lt;/script&gt;&quot;&#39;";
        assert_eq!(page.matches(&format!("{escaped} onload")).count(), 5);
        assert!(page.contains(&format!("<span>{escaped}</span> <span>onload")));
        assert!(page.contains("&amp;amp;\u{fffd}&lt;/style&gt;"));
        // Negative control: the same text as HTML.
        let mut page = Document::new("a");
        page.add(BAD);
        assert!(check(&page.finish()).is_err());
    }

    #[test]
    fn light_dark_and_paper() {
        let page = Document::new("a").finish();
        for part in ["prefers-color-scheme: dark", "color-scheme: light dark", "@media print", POLICY] {
            assert!(page.contains(part), "{part}");
        }
    }
}
