//! Layers of a frame as arrays.

use crate::array::{channels, plane};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use trisect::cryptomatte;
use trisect::error::Error;
use trisect::film::Film;
use trisect::layers::{Aov, FilmPlace, layers};
use trisect::output::{Channel, Samples};
use trisect::render::{RenderObserver, Renderer, Settings};
use trisect::scene::{PartName, Rebase, Scene};
use trisect::surfaces::{self, SurfaceScenes};

/// Layers of a frame, each with its channels, and the attributes of mattes.
#[derive(Clone, Default)]
pub struct FrameLayers {
    layers: Vec<(Aov, Vec<Channel>)>,
    /// Names and values of the attributes that say how to read mattes.
    pub attributes: Vec<(String, String)>,
}

/// Scene that a renderer has.
pub struct SceneOfLayers<'a> {
    /// Scene of the renderer.
    pub scene: &'a Arc<Scene>,
    /// Space in which the scene was rendered.
    pub space: Rebase,
    /// Names of the objects.
    pub names: &'a [PartName],
}

impl<'a> From<&'a crate::scene::Scene> for SceneOfLayers<'a> {
    fn from(scene: &'a crate::scene::Scene) -> Self {
        Self { scene: &scene.inner, space: scene.space, names: &scene.names }
    }
}

impl FrameLayers {
    /// Makes the layers of a film. Some need further camera rays.
    ///
    /// # Errors
    ///
    /// Those of a render.
    pub fn of(
        renderer: &mut Renderer,
        (settings, film): (&Settings, &Film),
        of: &SceneOfLayers<'_>,
        aovs: &[Aov],
        observer: &mut dyn RenderObserver,
    ) -> Result<Self, Error> {
        let mut found = Self::default();
        for aov in aovs {
            let channels = match aov {
                Aov::Cryptomatte => {
                    let mattes = cryptomatte::render(renderer, settings, of.names, observer)?;
                    found.attributes = mattes.attributes;
                    mattes.channels
                }
                aov if aov.needs_surfaces() => {
                    let scenes = SurfaceScenes { scene: Arc::clone(of.scene), neighbours: None };
                    surfaces::render(renderer, settings, &scenes, &[*aov], observer)?
                }
                aov => {
                    let camera = renderer.camera(settings);
                    let object = |primitive| renderer.object(primitive);
                    let place = FilmPlace { camera: &camera, space: of.space, object };
                    // A film of these settings has the sums.
                    layers(film, &place, &[*aov], 0.0).unwrap_or_default()
                }
            };
            found.layers.push((*aov, channels));
        }
        Ok(found)
    }

    /// Returns all channels, for a file.
    pub fn channels(&self) -> Vec<Channel> {
        self.layers.iter().flat_map(|(_, channels)| channels.iter().cloned()).collect()
    }

    /// Returns a dict of the layers by name: arrays of shape (height, width) or (height, width,
    /// channels), float32 or uint32.
    pub fn arrays<'py>(&self, py: Python<'py>, (height, width): (u32, u32)) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (aov, found) in &self.layers {
            let name = Aov::ALL.iter().find(|(_, of)| of == aov).map_or("", |(name, _)| name);
            match &found[..] {
                [Channel { samples: Samples::U32(values), .. }] => {
                    dict.set_item(name, plane(py, (height, width), values.clone())?)?;
                }
                [Channel { samples: Samples::F32(values) | Samples::Color(values), .. }] => {
                    dict.set_item(name, plane(py, (height, width), values.clone())?)?;
                }
                several => {
                    let values = py.detach(|| interleaved(several));
                    dict.set_item(name, channels(py, (height, width, several.len()), values)?)?;
                }
            }
        }
        Ok(dict)
    }
}

/// Returns the samples of channels of floats, pixel by pixel.
fn interleaved(channels: &[Channel]) -> Vec<f32> {
    let mut values = Vec::new();
    for (index, channel) in channels.iter().enumerate() {
        let (Samples::F32(samples) | Samples::Color(samples)) = &channel.samples else { continue };
        values.resize(samples.len() * channels.len(), 0.0);
        let of_channel = values.iter_mut().skip(index).step_by(channels.len());
        of_channel.zip(samples).for_each(|(value, sample)| *value = *sample);
    }
    values
}
