//! Header of a film's checkpoint, which is made when it is first asked for.

use crate::layers::SceneOfLayers;
use crate::options::RenderOptions;
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};
use trisect::checkpoint::{FORMAT, Header, Identity, arithmetic};
use trisect::metadata;
use trisect::render::{Fingerprint, Renderer};

/// Header that is made once: the hash of a large scene takes time, and few films are saved.
#[derive(Clone)]
pub struct LazyHeader {
    made: Arc<LazyLock<Header, Box<dyn FnOnce() -> Header + Send>>>,
    /// Rendering time in seconds that the header has in addition.
    seconds: f64,
}

impl From<Header> for LazyHeader {
    fn from(header: Header) -> Self {
        Self::of(move || header)
    }
}

impl LazyHeader {
    fn of(make: impl FnOnce() -> Header + Send + 'static) -> Self {
        Self { made: Arc::new(LazyLock::new(Box::new(make))), seconds: 0.0 }
    }

    /// Returns the header of a render that begins. It names no command: the program cannot repeat
    /// what a Python script does.
    pub fn of_render(renderer: &Renderer, scene: &SceneOfLayers<'_>, options: &RenderOptions) -> Self {
        let RenderOptions { settings, samples, .. } = options;
        let whole = settings.clone().uncropped();
        let camera = metadata::camera(&renderer.camera(&whole), scene.space, (whole.width, whole.height));
        let prepared = renderer.prepared_crc(settings.width, settings.height);
        let arithmetic = arithmetic(renderer.device().info(), settings.math);
        let (scene, settings, samples) = (Arc::clone(scene.scene), settings.clone(), samples.clone());
        Self::of(move || {
            // A renderer of this module has a BVH of the default quality.
            let fingerprint = Fingerprint::new(&scene.digest(), &settings, None);
            Header {
                format: FORMAT,
                identity: Identity::of_parts(fingerprint, prepared, arithmetic),
                scene: scene.name.clone(),
                command: Vec::new(),
                folder: PathBuf::new(),
                spp: settings.samples,
                samples,
                seconds: 0.0,
                camera: Some(camera),
            }
        })
    }

    /// Returns the header with this rendering time in addition.
    pub fn after(&self, seconds: f64) -> Self {
        Self { seconds: self.seconds + seconds, ..self.clone() }
    }

    /// Returns the header; it hashes the scene the first time.
    pub fn get(&self) -> Header {
        let header = Header::clone(&self.made);
        Header { seconds: header.seconds + self.seconds, ..header }
    }
}
