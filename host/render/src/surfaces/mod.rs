//! Layers of the surfaces that camera rays see first, which the film has no sums of: geometric
//! normals, texture coordinates, and motion between frames.
//!
//! The camera rays of the image are traced again, sample by sample. The host finds the place of
//! each hit on its primitive, and where the place is in the frames before and after.

mod point;
#[cfg(test)]
mod tests;
mod view;

use crate::Error;
use crate::camera_rays::for_each_sample;
use crate::layers::Aov;
use crate::render::{RenderObserver, Renderer, Settings};
use glam::{DVec2, DVec3};
use point::SurfacePoint;
use rayon::prelude::*;
use std::sync::Arc;
use trisect_image::output::{Channel, Samples, channels};
use trisect_scene::{CameraPose, Scene};
use view::View;

/// Scene and camera of the frame before or after an image.
#[derive(Clone, Debug)]
pub struct NeighbourFrame {
    /// Scene in the space of the image's; `None` if only the camera moves.
    pub scene: Option<Arc<Scene>>,
    /// Camera of the frame, in the same space.
    pub camera: CameraPose,
}

/// Scenes of an image and of the frames beside it.
#[derive(Clone, Debug)]
pub struct SurfaceScenes {
    /// Scene of the image.
    pub scene: Arc<Scene>,
    /// Frame before and frame after, for [`Aov::Motion`]. Without them all stands still.
    pub neighbours: Option<[NeighbourFrame; 2]>,
}

impl SurfaceScenes {
    /// Returns whether the frames have the same primitives. If not, objects appear or vanish, and
    /// their motion is unknown.
    pub fn can_be_compared(&self) -> bool {
        let counts = |scene: &Scene| {
            let shared = &scene.shared;
            let world = [scene.spheres.len(), scene.flats.len(), scene.triangles.len()];
            (world, shared.triangles.len(), shared.instances.len())
        };
        let scenes = self.neighbours.iter().flatten().filter_map(|frame| frame.scene.as_deref());
        scenes.into_iter().all(|scene| counts(scene) == counts(&self.scene))
    }
}

/// Sums of a pixel over the samples that hit a surface.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSurfaces {
    hits: u32,
    normal: DVec3,
    uv: DVec2,
    /// Motion to the frames before and after, in pixels to the right and upwards.
    motion: [DVec2; 2],
}

/// Surfaces and cameras by which the place of a hit is found.
struct Frames<'a> {
    scenes: &'a SurfaceScenes,
    view: View,
    neighbours: [Option<(Option<&'a Scene>, View)>; 2],
}

impl<'a> Frames<'a> {
    fn new(scenes: &'a SurfaceScenes, renderer: &Renderer, settings: &Settings) -> Self {
        let is_comparable = scenes.can_be_compared();
        let neighbour = |index: usize| {
            let frame = &scenes.neighbours.as_ref()?[index];
            let view = View::new(&settings.camera_record(&frame.camera));
            Some((frame.scene.as_deref().filter(|_| is_comparable), view))
        };
        let view = View::new(&renderer.camera(settings));
        Self { scenes, view, neighbours: [neighbour(0), neighbour(1)] }
    }

    /// Adds a hit to a pixel.
    fn add(&self, pixel: &mut PixelSurfaces, point: &SurfacePoint) {
        let scene = self.scenes.scene.as_ref();
        let (Some(position), Some(normal)) = (point.position(scene), point.normal(scene)) else { return };
        pixel.hits += 1;
        let is_away = normal.dot(self.view.direction_to(position)) > 0.0;
        pixel.normal += if is_away { -normal } else { normal };
        pixel.uv += point.uv(scene).unwrap_or_default();
        for (sum, neighbour) in pixel.motion.iter_mut().zip(&self.neighbours) {
            let Some((scene, view)) = neighbour else { continue };
            let there = scene.map_or(Some(position), |scene| point.position(scene));
            *sum += motion(self.view.pixel(position), there.and_then(|there| view.pixel(there)));
        }
    }

    /// Returns the motion of what is infinitely far away behind a place of the image.
    fn motion_of_sky(&self, place: DVec2) -> [DVec2; 2] {
        let direction = self.view.direction(place);
        let of_frame = |frame: &Option<(_, View)>| {
            let there = frame.as_ref().and_then(|(_, view)| view.pixel_of_direction(direction));
            motion(self.view.pixel_of_direction(direction), there)
        };
        self.neighbours.each_ref().map(of_frame)
    }
}

/// Returns the motion between two places of an image, to the right and upwards; 0 for a place that
/// the image has not.
fn motion(from: Option<DVec2>, to: Option<DVec2>) -> DVec2 {
    let Some((from, to)) = from.zip(to) else { return DVec2::ZERO };
    let by = to - from;
    if by.is_finite() { DVec2::new(by.x, 0.0 - by.y) } else { DVec2::ZERO }
}

/// Renders the layers among `aovs` that [need the surfaces](Aov::needs_surfaces) of an image: its
/// camera rays of the first samples, at most [`MAX_SAMPLES`](crate::camera_rays::MAX_SAMPLES) per
/// pixel. `scenes` has the scene of the renderer.
///
/// # Errors
///
/// Those of a render; [`Error::Cancelled`] if `observer` cancels it.
pub fn render(
    renderer: &mut Renderer,
    settings: &Settings,
    scenes: &SurfaceScenes,
    aovs: &[Aov],
    observer: &mut dyn RenderObserver,
) -> Result<Vec<Channel>, Error> {
    let frames = Frames::new(scenes, renderer, settings);
    let mut pixels = vec![PixelSurfaces::default(); settings.pixels() as usize];
    for_each_sample(renderer, settings, observer, |renderer, film| {
        let tree = renderer.tree();
        let find = |(pixel, sums): (usize, &mut PixelSurfaces)| {
            let Some(hit) = film.aovs.get(pixel).filter(|hit| hit.hits > 0) else { return };
            let position = DVec3::from(hit.position());
            let point = hit.primitive().and_then(|of| SurfacePoint::find(&scenes.scene, &tree, of, position));
            if let Some(point) = point {
                frames.add(sums, &point);
            }
        };
        pixels.par_iter_mut().enumerate().for_each(find);
    })?;
    let width = settings.width as usize;
    let mean = |(pixel, sums): (usize, &mut PixelSurfaces)| match sums.hits {
        0 => {
            let middle = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
            sums.motion = frames.motion_of_sky(middle);
        }
        hits => {
            let share = 1.0 / f64::from(hits);
            sums.normal *= share;
            sums.uv *= share;
            sums.motion = sums.motion.map(|motion| motion * share);
        }
    };
    pixels.par_iter_mut().enumerate().for_each(mean);
    Ok(aovs.iter().flat_map(|aov| layer(*aov, &pixels)).collect())
}

/// Returns the channels of a layer, of pixels with means.
fn layer(aov: Aov, pixels: &[PixelSurfaces]) -> Vec<Channel> {
    let column = |of: &(dyn Fn(&PixelSurfaces) -> f64 + Sync)| -> Samples {
        Samples::F32(pixels.par_iter().map(|pixel| of(pixel) as f32).collect())
    };
    match aov {
        Aov::GeometricNormal => {
            let normals: Vec<_> = pixels.par_iter().map(|pixel| pixel.normal.as_vec3().to_array()).collect();
            channels("Ng.", ["X", "Y", "Z"], &normals, Samples::Color)
        }
        Aov::Uv => vec![
            Channel::new("UV.U", column(&|pixel| pixel.uv.x)),
            Channel::new("UV.V", column(&|pixel| pixel.uv.y)),
        ],
        Aov::Motion => vec![
            Channel::new("forward.u", column(&|pixel| pixel.motion[1].x)),
            Channel::new("forward.v", column(&|pixel| pixel.motion[1].y)),
            Channel::new("backward.u", column(&|pixel| pixel.motion[0].x)),
            Channel::new("backward.v", column(&|pixel| pixel.motion[0].y)),
        ],
        _ => Vec::new(),
    }
}
