//! Prelude for programs that make and render scenes.
//!
//! [`Device`] is an opened device with the reason for its choice; the trait that devices implement
//! is [`device::Device`](crate::device::Device).

pub use crate::Error;
pub use crate::denoise::Filter::{self, Atrous, Svgf};
pub use crate::denoise::{DenoiseSettings, Denoiser};
pub use crate::device::{Choice, Selection as Device};
pub use crate::film::Film;
pub use crate::image::Image;
pub use crate::render::{Frame, RenderObserver, Renderer, Sampler, Settings};
pub use crate::scene::builder::{
    Camera, Conductor, Dielectric, Emissive, Gradient, Interface, Lambertian, MaterialId, Medium, MediumId,
    MeshId, Metal, RoughDielectric, SceneBuilder, SunSky,
};
pub use crate::scene::{Fresnel, Scene};
pub use glam;

/// Result with the library's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;
