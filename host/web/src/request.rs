//! Requests of the page.

use serde::Deserialize;
use trisect::denoise::{self, DenoiseSettings};
use trisect::render::{Sampler, Settings};
use trisect::scene::Scene;
use trisect::view::{NavigationMode, Navigator};

/// Request of the page to its session.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Request {
    /// Opens a device, in place of an earlier one.
    Open {
        /// Backend to open.
        backend: BackendName,
    },
    /// Reads a scene and puts it on the device.
    Load {
        /// Path among the files that the page was given.
        path: String,
        /// Panorama around the scene in place of its own, likewise.
        panorama: Option<String>,
    },
    /// Renders the next live frame; answers with RGBA, 8 bits each.
    View {
        /// Image at rest.
        image: ImageRequest,
        /// Factor on width and height, for frames while the camera moves.
        scale: f64,
        /// Movements of the camera since the last frame.
        moves: Vec<Move>,
    },
    /// Begins an image of a fixed number of samples.
    Begin {
        /// Image to render.
        image: ImageRequest,
    },
    /// Renders the next part of the image; answers with RGBA, 8 bits each.
    Part,
    /// Encodes the image in the format of the file `name`; answers with the file's bytes.
    Save {
        /// Name of the file.
        name: String,
    },
    /// Encodes the film as a checkpoint, from which `trisect resume` continues; answers with the
    /// file's bytes.
    Film,
    /// Traces one sample per pixel to its first hit; answers with the primitives, 32 bits each.
    FirstHits {
        /// Image whose camera rays are traced.
        image: ImageRequest,
        /// Index of the sample.
        sample: u32,
    },
}

/// Backend to open.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum BackendName {
    /// WebGPU, else the CPU.
    Auto,
    /// WebGPU.
    Wgpu,
    /// The CPU.
    Cpu,
}

/// Filter of an image.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Filter {
    /// SVGF.
    Svgf,
    /// À-trous filter of one frame.
    Atrous,
}

/// Image that the page asks for.
#[derive(Clone, Debug, Deserialize)]
pub struct ImageRequest {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Number of samples per pixel.
    pub samples: u32,
    /// Maximum number of segments of a path.
    pub depth: u32,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u32,
    /// True for independent samples in place of the Sobol sequence.
    #[serde(default)]
    pub independent: bool,
    /// Filter, if any.
    pub denoise: Option<Filter>,
    /// Exposure in stops.
    #[serde(default)]
    pub stops: f32,
}

impl ImageRequest {
    /// Returns the filter's settings.
    pub fn filter(&self) -> Option<DenoiseSettings> {
        self.denoise.map(|filter| {
            DenoiseSettings::new(match filter {
                Filter::Svgf => denoise::Filter::Svgf,
                Filter::Atrous => denoise::Filter::Atrous,
            })
        })
    }

    /// Returns the settings of a render of `scene`.
    pub fn settings(&self, scene: &Scene) -> Settings {
        let Self { width, height, samples, depth, seed, .. } = *self;
        let settings = Settings::of(scene).size(width, height);
        let sampler = if self.independent { Sampler::Independent } else { settings.sampler };
        Settings { samples, depth, seed, sampler, ..settings }
    }
}

/// Movement of the camera.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Move {
    /// Turns by radians to the right and up.
    Turn(f64, f64),
    /// Shifts to the right and up, in units of the distance to the point looked at.
    Pan(f64, f64),
    /// Divides that distance by e to this power.
    Dolly(f64),
    /// Moves forwards, to the right and up, in units of the distance at the start.
    Fly(f64, f64, f64),
    /// Turns around the point looked at from now on, or around the camera.
    Orbit(bool),
    /// Returns to the start.
    Reset,
}

impl Move {
    /// Moves the camera.
    pub fn apply(self, camera: &mut Navigator) {
        match self {
            Self::Turn(right, up) => camera.turn(right, up),
            Self::Pan(right, up) => camera.pan(right, up),
            Self::Dolly(closer) => camera.dolly(closer),
            Self::Fly(forwards, right, up) => camera.fly(forwards, right, up),
            Self::Orbit(orbit) => {
                camera.mode = if orbit { NavigationMode::Orbit } else { NavigationMode::Fly };
            }
            Self::Reset => camera.reset(),
        }
    }
}
