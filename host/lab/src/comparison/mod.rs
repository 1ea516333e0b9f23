//! The page of `trisect compare --html`: two images with a slider, their difference, their FLIP
//! errors, the measures, and statistics of each image.

mod image_statistics;

use crate::page::{
    Cell, Column, DIVERGING, Document, Gallery, MAGMA, NOT_FINITE, Raster, Row, Table, reduction, slider,
};
use crate::plot::number;
use image_statistics::ImageStatistics;
use trisect::image::Image;
use trisect::metrics::Comparison;
use trisect::metrics::flip::FlipMap;
use trisect::output::exposure::{Automatic, LightLevel};

/// Maximum edge of an embedded image in pixels.
const MAX_EDGE: u32 = 1024;

/// Share of the pixels whose difference is within the colour scale.
const SCALE_SHARE: f64 = 0.99;

/// An image with its name.
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    /// Name, such as the path of its file.
    pub name: &'a str,
    /// The image.
    pub image: &'a Image,
    /// True if the values are colours of a display, as in a PNG, and not radiance.
    pub is_for_display: bool,
}

/// Returns the page that compares an image with a reference of the same size.
///
/// # Errors
///
/// A message if an image cannot be encoded.
pub fn page(
    image: Named<'_>,
    reference: Named<'_>,
    comparison: &Comparison,
    flip: &FlipMap,
) -> Result<String, String> {
    let mut page = Document::new("Comparison of two images");
    page.paragraph("lead", &summary(image, reference, comparison));
    let size = (image.image.width, image.image.height);
    let step = reduction(size, MAX_EDGE);
    let stops = match image.is_for_display || reference.is_for_display {
        true => 0.0,
        false => Automatic::of(reference.image, LightLevel::Unit).stops,
    };
    let differences = Differences::of(image.image, reference.image, step);
    let shown = [image, reference].map(|of| Raster::of_image(of.image, step, stops.exp2()));
    let mut gallery = Gallery::default();
    let (of_image, of_reference) =
        (format!("Image: {}", image.name), format!("Reference: {}", reference.name));
    gallery.add("image", "Image", &shown[0], &of_image, "")?;
    gallery.add("reference", "Reference", &shown[1], &of_reference, "")?;
    gallery.add(
        "difference",
        "Difference",
        &differences.raster,
        &differences.caption(),
        &differences.legend(),
    )?;
    let of_flip = format!("FLIP errors, mean {}", number(comparison.flip_mean));
    let errors = Raster::of_values(size, step, MAGMA, |pixel| f64::from(flip.errors[pixel]));
    gallery.add("flip", "FLIP errors", &errors, &of_flip, &MAGMA.legend("scale-flip", [0.0, 1.0], ""))?;
    page.add(&slider("image", "reference"));
    page.add(&gallery.html(true));
    page.section("Measures");
    page.add(&measures(comparison));
    page.section("Each image");
    page.add(&statistics([("image", image.image), ("reference", reference.image)]));
    page.section("How this is shown");
    page.list(notes(size, step, stops));
    Ok(page.finish())
}

/// Returns the sentence at the top of the page.
fn summary(image: Named<'_>, reference: Named<'_>, comparison: &Comparison) -> String {
    let names = format!("{} and the reference {}", image.name, reference.name);
    let non_finite = match comparison.non_finite {
        0 => String::new(),
        1 => " One pixel is NaN or infinite in either, and counts in FLIP only.".to_owned(),
        count => format!(" {count} pixels are NaN or infinite in either, and count in FLIP only."),
    };
    let equal = comparison.max_difference == 0.0 && comparison.non_finite == 0;
    if equal {
        return format!("{names} are equal in every pixel.");
    }
    format!(
        "{names} differ by a mean FLIP error of {} (0: not visible, 1: largest), a relative error (root of relMSE) of \
         {} % and a PSNR of {} dB.{non_finite}",
        number(comparison.flip_mean),
        number(100.0 * comparison.rel_mse.sqrt()),
        number(comparison.psnr_db)
    )
}

/// Signed differences of an image from a reference, as colours.
struct Differences {
    raster: Raster,
    /// Difference at the ends of the colour scale.
    scale: f64,
}

/// Returns the difference of the channel that differs most, with its sign; NaN if a value is not
/// finite.
fn difference(a: [f32; 3], b: [f32; 3]) -> f64 {
    let each = [0, 1, 2].map(|c| f64::from(a[c]) - f64::from(b[c]));
    if each.iter().any(|difference| !difference.is_finite()) {
        return f64::NAN;
    }
    each.into_iter().fold(0.0, |most: f64, one| if one.abs() > most.abs() { one } else { most })
}

impl Differences {
    /// Compares two images. A pixel of the result is the greatest difference in a square with edges
    /// of `step` pixels.
    fn of(image: &Image, reference: &Image, step: u32) -> Self {
        let each: Vec<f64> =
            image.pixels.iter().zip(&reference.pixels).map(|(a, b)| difference(*a, *b)).collect();
        let mut sizes: Vec<f64> =
            each.iter().map(|d| d.abs()).filter(|d| d.is_finite() && *d > 0.0).collect();
        let scale = match sizes.len() {
            0 => 1.0,
            count => {
                let place = ((SCALE_SHARE * count as f64) as usize).min(count - 1);
                *sizes.select_nth_unstable_by(place, f64::total_cmp).1
            }
        };
        let most = |square: &[usize]| {
            let all = square.iter().map(|&pixel| each[pixel]);
            all.fold(0.0, |most: f64, one| match one.is_nan() || one.abs() > most.abs() {
                true if !most.is_nan() => one,
                _ => most,
            })
        };
        let color = |square: &[usize]| DIVERGING.color(0.5 + 0.5 * most(square) / scale);
        Self { raster: Raster::reduced((image.width, image.height), step, color), scale }
    }

    fn caption(&self) -> String {
        "Difference: image minus reference, of the channel that differs most, in radiance. Red: the image is \
         brighter; blue: darker; magenta: NaN or infinite."
            .to_owned()
    }

    fn legend(&self) -> String {
        DIVERGING.legend("scale-difference", [-self.scale, self.scale], "")
    }
}

fn measures(comparison: &Comparison) -> String {
    let (x, y) = comparison.max_pixel;
    let row = |name: &str, value: f64, meaning: &str| {
        Row::of(vec![Cell::text(name), Cell::number(value, number(value)), Cell::text(meaning)])
    };
    let greatest = format!("absolute difference of a channel, at pixel ({x}, {y}) from the top left");
    let rows = vec![
        row(
            "FLIP",
            comparison.flip_mean,
            "mean error that an observer sees when the images alternate, 0 to 1",
        ),
        row("relMSE", comparison.rel_mse, "mean of (a - b)² / (b² + 0.01)"),
        row("RMSE", comparison.rmse, "root of the mean square difference, linear"),
        row("PSNR, dB", comparison.psnr_db, "on the display range: clamped to 0 to 1, sRGB"),
        row("greatest difference", comparison.max_difference, &greatest),
        row("NaN or infinite, pixels", comparison.non_finite as f64, "in either image"),
    ];
    let columns = vec![Column::text("measure"), Column::number("value"), Column::text("meaning")];
    Table { caption: "a: image, b: reference".to_owned(), columns, rows }.html()
}

fn statistics(images: [(&str, &Image); 2]) -> String {
    let mut rows = Vec::new();
    for (name, image) in images {
        let all = ImageStatistics::of(image);
        for (channel, letter) in ["red", "green", "blue"].into_iter().enumerate() {
            let of = all.channels[channel];
            let value = |value: f64| Cell::number(value, number(value));
            let count = |count: usize| Cell::number(count as f64, count.to_string());
            rows.push(Row::of(vec![
                Cell::text(format!("{name}, {letter}")),
                value(of.min),
                value(of.mean),
                value(of.max),
                count(of.negative),
                count(of.above_one),
                count(of.nan),
                count(of.infinite),
            ]));
        }
    }
    let columns = vec![
        Column::text("channel"),
        Column::number("minimum"),
        Column::number("mean"),
        Column::number("maximum"),
        Column::number("below 0"),
        Column::number("above 1"),
        Column::number("NaN"),
        Column::number("infinite"),
    ];
    let caption =
        "Linear values; minimum, mean and maximum of the finite ones. Counts are of pixels.".to_owned();
    Table { caption, columns, rows }.html()
}

fn notes((width, height): (u32, u32), step: u32, stops: f32) -> Vec<String> {
    let size = match step {
        1 => format!("{width}×{height} pixels, all of which are shown."),
        step => format!(
            "{width}×{height} pixels, shown at 1/{step} of the size: a pixel is the mean of a square of {step}×{step}, \
             for the difference its greatest. All figures are of the full size."
        ),
    };
    let exposure = match stops {
        0.0 => "Both images have an exposure of 0 EV; values above 1 are clipped.".to_owned(),
        stops => format!(
            "Both images have an exposure of {stops:+.1} EV, from the median luminance of the reference; brighter \
             values are clipped. The figures, the difference and FLIP are of the values as they are in the files."
        ),
    };
    let [red, green, blue] = NOT_FINITE;
    vec![
        size,
        exposure,
        format!(
            "The colours of the difference end where {:.0} of 100 pixels that differ are within; those of FLIP are \
             magma, as its authors use. A pixel that is NaN or infinite is rgb({red}, {green}, {blue}) in the \
             difference and has a FLIP error of 1.",
            100.0 * SCALE_SHARE
        ),
        "FLIP clamps values to 0 to 1, and assumes 67 pixels per degree of the visual angle.".to_owned(),
    ]
}

#[cfg(test)]
mod tests;
