//! Images side by side, and a slider between two of them.

use super::escape;
use super::raster::{Raster, element};
use std::fmt::Write;

/// Images side by side, of which a reader can put any two under a slider.
#[derive(Default)]
pub(crate) struct Gallery {
    html: String,
    bytes: usize,
}

impl Gallery {
    /// Adds an image with an `id` of its own. `name` is its name in the choices of the slider, and
    /// `more` is HTML below its caption.
    ///
    /// # Errors
    ///
    /// A message of the encoder.
    pub fn add(
        &mut self,
        id: &str,
        name: &str,
        image: &Raster,
        caption: &str,
        more: &str,
    ) -> Result<(), String> {
        let attributes = format!(" id=\"{}\" data-name=\"{}\"", escape(id), escape(name));
        let img = element(&image.data_uri()?, (image.width, image.height), name, &attributes);
        self.bytes += img.len() + more.len();
        let caption = escape(caption);
        let _ = writeln!(self.html, "<figure>{img}<figcaption>{caption}</figcaption>{more}</figure>");
        Ok(())
    }

    /// Returns the bytes of the images so far.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Returns the gallery as HTML.
    pub fn html(&self, is_wide: bool) -> String {
        let class = if is_wide { "gallery wide" } else { "gallery" };
        format!("<div class=\"{class}\">\n{}</div>", self.html)
    }
}

/// Returns the place of a slider between two images of a gallery of the same page, which a reader
/// can change. The script fills it; without one, it stays hidden.
pub(crate) fn slider(left: &str, right: &str) -> String {
    let (left, right) = (escape(left), escape(right));
    format!("<div class=\"compare\" data-left=\"{left}\" data-right=\"{right}\" hidden></div>")
}

#[cfg(test)]
mod tests {
    use super::super::{Document, check};
    use super::*;

    #[test]
    fn images_can_be_chosen_by_name() {
        let image = Raster { width: 1, height: 1, bytes: vec![0; 3] };
        let mut gallery = Gallery::default();
        for (id, name) in [("a", "first \"<one>\""), ("b", "second")] {
            gallery.add(id, name, &image, "caption <i>", "").unwrap_or_else(|error| panic!("{error}"));
        }
        let mut page = Document::new("images");
        page.add(&slider("a", "b"));
        page.add(&gallery.html(true));
        let page = page.finish();
        check(&page).unwrap_or_else(|fault| panic!("{fault}"));
        assert!(page.contains("id=\"a\" data-name=\"first &quot;&lt;one&gt;&quot;\" src=\"data:image/png"));
        assert!(page.contains("data-left=\"a\" data-right=\"b\" hidden"));
        assert!(gallery.bytes() > 100);
    }
}
