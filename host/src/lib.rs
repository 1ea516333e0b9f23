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
//!
//! # A scene of a file, on the device of choice
//!
//! [`scene::Scene::load`] takes the project's own files, glTF, OBJ and PLY, by their extension. [`backend::open`] takes what
//! `--backend` does, and says why it took what it took.
//!
//! ```
//! use trisect::{backend, output, render, scene};
//!
//! # let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/three_spheres.ron"));
//! # if !path.exists() { return Ok(()) } // a published crate has no scenes
//! let scene = scene::Scene::load(path)?;
//! let selection = backend::open(backend::Choice::Auto, None, None)?;
//! let device = selection.backend.device();
//! println!("{}: {} {}", device.backend, device.name, selection.why);
//! let settings = render::Settings { width: 48, height: 27, samples: 16, ..scene.settings() };
//! let frame = render::Renderer::new(selection.backend, &scene)?.render(&settings, &mut ())?;
//! let out = std::env::temp_dir().join(format!("trisect-example-{}.png", std::process::id()));
//! output::write(&frame.film.image(), &out)?;
//! # std::fs::remove_file(&out).ok();
//! # Ok::<(), trisect::Error>(())
//! ```
//!
//! # What a film knows
//!
//! A [`film::Film`] is more than an image: each pixel's exact sums, from which its error follows, and counts of samples, of those left out
//! because they were not finite, and of segments.
//!
//! ```
//! # use trisect::{backend::cpu::Cpu, render, scene};
//! # let scene = scene::Scene::hello_world()?;
//! # let mut renderer = render::Renderer::new(Box::new(Cpu::open(None)?), &scene)?;
//! let settings = render::Settings { width: 32, height: 18, samples: 64, ..scene.settings() };
//! let frame = renderer.render(&settings, &mut ())?;
//! let pixel = &frame.film.pixels[9 * 32 + 16];
//! let (mean, variance) = (pixel.mean(), pixel.variance_of_mean());
//! println!("red: {} ± {}", mean[0], variance[0].sqrt());
//! let counts = frame.film.counts();
//! assert_eq!((counts.samples, counts.rejected, counts.unwritten), (32 * 18 * 64, 0, 0));
//! # Ok::<(), trisect::Error>(())
//! ```
//!
//! # Watching a render, and ending it
//!
//! An [`render::RenderObserver`] is told how far it is, and may end it; then the film is lost. A [`render::FilmObserver`] sees the film grow, and what it ends
//! is not lost: the same film goes on later, elsewhere, to the same bits.
//!
//! ```
//! use std::ops::ControlFlow;
//! use std::sync::atomic::{AtomicU32, Ordering};
//! use trisect::{backend::cpu::Cpu, film::Film, render, scene};
//!
//! struct Percent(u64);
//!
//! impl render::Observer for Percent {
//!     fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
//!         self.0 = 100 * done / total;
//!         ControlFlow::Continue(())
//!     }
//! }
//!
//! /// Ends a render after its first part.
//! struct Once(AtomicU32);
//!
//! impl render::Keeper for Once {
//!     fn goes_on(&self) -> bool {
//!         self.0.load(Ordering::Relaxed) == 0
//!     }
//!
//!     fn added(&self, _: &Film) {
//!         self.0.fetch_add(1, Ordering::Relaxed);
//!     }
//! }
//!
//! let scene = scene::Scene::hello_world()?;
//! let settings = render::Settings { width: 32, height: 18, samples: 600, ..scene.settings() };
//! let mut renderer = render::Renderer::new(Box::new(Cpu::open(None)?), &scene)?;
//! let mut film = Film::new(32, 18);
//! let mut percent = Percent(0);
//! renderer.render_onto(&mut film, &settings, &(0..600), &Once(AtomicU32::new(0)), &mut percent)?;
//! assert!(percent.0 < 100 && !film.coverage.missing(&(0..600)).is_empty());
//! renderer.render_onto(&mut film, &settings, &(0..600), &(), &mut percent)?;
//! assert_eq!(film, renderer.render(&settings, &mut ())?.film);
//! # Ok::<(), trisect::Error>(())
//! ```

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a library returns what it has to say")]

pub mod adaptive;
pub mod alias;
mod atomic_file;
pub mod backend;
pub mod bench;
pub mod bvh;
pub mod checkpoint;
mod checksummed_file;
pub mod cluster;
pub mod denoise;
pub mod error;
pub mod film;
pub mod image;
mod input;
pub mod lights;
pub mod memory;
pub mod metrics;
pub mod output;
mod plot;
pub mod precision;
pub mod render;
pub mod scene;
pub mod statistics;
pub mod stats;
pub mod threads;
pub mod tradeoff;
pub mod view;

pub use error::Error;
