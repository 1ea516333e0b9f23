//! Options that say which part of the image is rendered, and which layers it has.

use crate::error;
use crate::words::{word, wrong};
use pyo3::prelude::*;
use trisect::layers::Aov;
use trisect::render::Settings;

/// Returns the corners of a part of the image.
pub fn crop(value: &Bound<'_, PyAny>) -> PyResult<[f64; 4]> {
    let remedy = "it must be (x0, y0, x1, y1): shares of width and height from 0 to 1, or pixels";
    let corners: Option<[f64; 4]> = value.extract().ok();
    let fits = |[x0, y0, x1, y1]: &[f64; 4]| {
        [x0, y0, x1, y1].into_iter().all(|of| (0.0..=f64::from(u32::MAX)).contains(of)) && x0 < x1 && y0 < y1
    };
    corners.filter(fits).ok_or_else(|| wrong("crop", value, remedy))
}

/// Returns the settings of a part of an image: shares if none is above 1, else pixels.
pub fn cropped(settings: Settings, [x0, y0, x1, y1]: [f64; 4]) -> PyResult<Settings> {
    let is_share = [x0, y0, x1, y1].iter().all(|of| *of <= 1.0);
    let (wide, high) = (f64::from(settings.width), f64::from(settings.height));
    let (wide, high) = if is_share { (wide, high) } else { (1.0, 1.0) };
    let pixel = |at: f64, scale: f64| (at * scale).round() as u32;
    let cropped = settings.cropped(pixel(x0, wide)..pixel(x1, wide), pixel(y0, high)..pixel(y1, high));
    cropped.map_err(|error| error::of_library(error.into()))
}

/// Returns the layers that a sequence of names asks for, or one name.
pub fn aovs(value: &Bound<'_, PyAny>) -> PyResult<Vec<Aov>> {
    let names: Vec<Bound<'_, PyAny>> = match value.extract::<String>() {
        Ok(_) => vec![value.clone()],
        Err(_) => value.try_iter()?.collect::<PyResult<_>>()?,
    };
    let mut found = Vec::new();
    for name in &names {
        let aov = word("aov", name, &Aov::ALL)?;
        if aov == Aov::Motion {
            return Err(wrong("aov", name, "a frame alone has no motion; take the others"));
        }
        if !found.contains(&aov) {
            found.push(aov);
        }
    }
    Ok(found)
}
