//! Small copies of images and of their errors, for the report page.

use super::point::Point;
use crate::accuracy::Truth;
use crate::page::{INFERNO, MAGMA, Raster, reduction};
use trisect::image::Image;
use trisect::output::exposure::{Automatic, LightLevel};

/// Maximum edges in pixels: of an image, and of a map of its errors.
const MAX_EDGES: (u32, u32) = (480, 240);

/// Relative difference that is shown with the brightest colour.
pub(super) const BRIGHTEST: f64 = 0.5;

/// Small copies of an image, of its relative difference from the reference, and of its FLIP errors.
pub(super) struct Picture {
    pub image: Raster,
    pub difference: Raster,
    pub flip: Raster,
}

/// Picture of a point.
pub(super) struct Shown {
    pub name: String,
    pub spp: u32,
    pub picture: Picture,
}

/// Pictures for a report page: of the reference and of each point.
#[derive(Default)]
pub struct Pictures {
    /// Reference image; `None` without a reference.
    pub(super) reference: Option<Raster>,
    /// Exposure of all images, in stops.
    pub(super) stops: f32,
    pub(super) shown: Vec<Shown>,
}

impl Pictures {
    /// Starts with the reference, which decides the exposure of all images.
    pub(super) fn new(truth: &Truth) -> Self {
        let stops = Automatic::of(truth.image, LightLevel::Unit).stops;
        Self { reference: Some(shown(truth.image, stops)), stops, shown: Vec::new() }
    }

    /// Adds the picture of a point: an image of it, and the image's FLIP errors by pixel.
    pub(super) fn add(&mut self, point: &Point, image: &Image, flip: &[f32], truth: &Truth) {
        let size = (image.width, image.height);
        let r = truth.image;
        let relative = |pixel: usize| {
            let (x, r) = (image.pixels[pixel], r.pixels[pixel]);
            let of = |c: usize| {
                let (x, r) = (f64::from(x[c]), f64::from(r[c]));
                (x - r).abs() / (r * r + 0.01).sqrt()
            };
            (0..3).map(of).sum::<f64>() / 3.0 / BRIGHTEST
        };
        let step = reduction(size, MAX_EDGES.1);
        let error = |pixel: usize| flip.get(pixel).map_or(f64::NAN, |&error| f64::from(error));
        let picture = Picture {
            image: shown(image, self.stops),
            difference: Raster::of_values(size, step, INFERNO, relative),
            flip: Raster::of_values(size, step, MAGMA, error),
        };
        self.shown.push(Shown { name: point.name(), spp: point.spp, picture });
    }
}

/// Returns a small copy of an image.
fn shown(image: &Image, stops: f32) -> Raster {
    Raster::of_image(image, reduction((image.width, image.height), MAX_EDGES.0), stops.exp2())
}
