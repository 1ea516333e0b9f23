//! Trisect: a path tracer whose kernels are written once in Rust and run on the CPU, through wgpu and through CUDA.
//!
//! A frame flows one way: scene file → [`scene`] (validated) → [`bvh`] → [`backend::Backend::upload`] →
//! [`render`] (rows × sample chunks) → kernels → [`film`] → [`output`].
//!
//! ```
//! use trisect::{backend, render, scene};
//!
//! let scene = scene::Scene::hello_world()?;
//! let settings = render::Settings { width: 32, height: 18, samples: 4, ..scene.settings() };
//! let backend = backend::cpu::Cpu::open(None)?;
//! let mut renderer = render::Renderer::new(Box::new(backend), &scene)?;
//! let frame = renderer.render(&settings, &mut ())?;
//! let image = frame.film.image();
//! assert_eq!((image.width, image.height), (32, 18));
//! # Ok::<(), trisect::Error>(())
//! ```

pub mod alias;
pub mod backend;
pub mod bench;
pub mod bvh;
pub mod checkpoint;
pub mod denoise;
pub mod distribute;
pub mod error;
pub mod film;
pub mod image;
pub mod lights;
pub mod limits;
pub mod memory;
pub mod metrics;
pub mod output;
mod plot;
pub mod render;
pub mod sampling;
pub mod scene;
mod sealed;
pub mod statistics;
pub mod stats;
pub mod tradeoff;
pub mod view;

pub use error::Error;
