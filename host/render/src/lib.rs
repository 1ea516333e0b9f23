//! Trisect: a path tracer whose kernels are written once in Rust and run on the CPU, through wgpu
//! and through CUDA.
//!
//! This library reads a scene, renders it on a backend into a film of exact sums, and denoises,
//! writes or compares the image. The kernels are in `trisect_shared`; `trisect_kernels` has them
//! compiled for GPUs.
//!
//! ```no_run
//! use trisect::prelude::*;
//!
//! fn main() -> Result<()> {
//!     let mut scene = SceneBuilder::new();
//!     let ground = scene.material(Lambertian::rgb(0.5, 0.5, 0.5));
//!     let glass = scene.material(Dielectric { ior: 1.5 });
//!     scene.plane([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], ground);
//!     scene.sphere([0.0, 0.5, 0.0], 0.5, glass);
//!     scene.sky(Gradient::new([1.0, 1.0, 1.0], [0.5, 0.7, 1.0]));
//!     scene.camera(Camera::look_at([0.0, 1.0, 4.0], [0.0, 0.5, 0.0]).fov_degrees(35.0));
//!     let scene = scene.build()?;
//!     let mut renderer = Renderer::new(Device::auto()?, &scene)?;
//!     let frame = renderer.render(&Settings::new(640, 360).spp(256).denoise(Svgf))?;
//!     frame.image().save("out.png")?;
//!     Ok(())
//! }
//! ```
//!
//! A scene may also be loaded, and a device named:
//!
//! ```
//! use trisect::prelude::*;
//!
//! let scene = Scene::hello_world()?;
//! let mut renderer = Renderer::new(Device::of(Choice::Cpu)?, &scene)?;
//! let frame = renderer.render(&Settings::of(&scene).size(32, 18).spp(4))?;
//! assert_eq!((frame.image().width, frame.image().height), (32, 18));
//! # Ok::<(), trisect::Error>(())
//! ```
//!
//! # Modules
//!
//! A frame flows one way: scene file → [`scene`] → [`bvh`] and [`lights`] → [`render`], on a
//! [`device`] → [`film`] → [`denoise`] → [`output`]. A [`render::Renderer`] drives a
//! [`device::Device`]: it uploads the scene once, launches the kernels over rows and chunks of
//! samples, and adds the chunks to the film.
//!
//! | module | contents |
//! |---|---|
//! | [`scene`] | reads and validates scenes: the project's own format, glTF, OBJ and PLY |
//! | [`precision`] | checks whether single precision suffices for a scene |
//! | [`bvh`] | builds the BVH: binary, wide, and its entries by image tile |
//! | [`lights`] | builds the light table, from which next-event estimation chooses |
//! | [`alias`] | alias tables: sampling of a discrete distribution in constant time |
//! | [`device`] | devices behind one trait: CPU, wgpu, CUDA |
//! | [`render`] | settings, and renders of frames, chunks, missing samples and live frames |
//! | [`film`] | exact sums of samples, which can be merged in any order |
//! | [`adaptive`] | renders to a target error or time, with more samples in noisy tiles |
//! | [`denoise`] | à-trous and SVGF filters, and the history of live frames |
//! | [`image`] | images in memory, read from files |
//! | [`output`] | image files: PNG, EXR, PFM, HDR; exposure |
//! | [`layers`] | AOVs as layers of EXR files |
//! | [`surfaces`] | texture coordinates, geometric normals and motion as layers |
//! | [`checkpoint`] | files from which a render resumes to the same bits |
//! | [`view`] | camera navigation and camera paths for live frames |
//! | [`metrics`] | differences of two images: relMSE, RMSE, PSNR, FLIP |
//! | [`stats`] | times and counts of a render, as text and versioned JSON |
//! | [`memory`] | available memory |
//! | [`prelude`] | what most programs need, for one `use` |
//! | [`spin`] | threads that wait without sleeping, as long as the host is not loaded |
//! | [`threads`] | threads, with an error where the system refuses them |
//! | [`time`] | times as people write them |
//! | [`error`] | [`Error`] and the program's exit codes |
//!
//! Above this crate are `trisect_cluster` (one image over several processes, by MPI), `trisect_lab`
//! (benchmarks and the trade-off lab) and the program, `trisect-cli`.
//!
//! # Rendering a scene file on a chosen device
//!
//! [`scene::Scene::load`] reads the project's scene files, glTF, OBJ and PLY, by extension.
//! [`device::open`] chooses a backend as `--backend` does, and says why.
//!
//! ```
//! use trisect::{device, output, render, scene};
//!
//! # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/three_spheres.ron");
//! # let path = std::path::Path::new(path);
//! # if !path.exists() { return Ok(()) } // a published crate has no scenes
//! let scene = scene::Scene::load(path)?;
//! let selection = device::open(device::Choice::Auto, None, None)?;
//! let info = selection.device.info();
//! println!("{}: {} {}", info.backend, info.name, selection.why);
//! let settings = render::Settings::of(&scene).size(48, 27).spp(16);
//! let frame = render::Renderer::new(selection.device, &scene)?.render(&settings)?;
//! let out = std::env::temp_dir().join(format!("trisect-example-{}.png", std::process::id()));
//! output::write(&frame.film.image(), &out)?;
//! # std::fs::remove_file(&out).ok();
//! # Ok::<(), trisect::Error>(())
//! ```
//!
//! # Mean, variance and counts
//!
//! A [`film::Film`] is more than an image. It has each pixel's exact sums, from which the error of
//! the pixel follows, and counts of samples, of samples left out because they were not finite, and
//! of path segments.
//!
//! ```
//! # use trisect::{device::cpu::Cpu, render, scene};
//! # let scene = scene::Scene::hello_world()?;
//! # let mut renderer = render::Renderer::new(Cpu::open(None)?, &scene)?;
//! let settings = render::Settings::of(&scene).size(32, 18).spp(64);
//! let frame = renderer.render(&settings)?;
//! let pixel = frame.film.pixels.get(9 * 32 + 16).unwrap();
//! let (mean, variance) = (pixel.mean(), pixel.variance_of_mean());
//! println!("red: {} ± {}", mean[0], variance[0].sqrt());
//! let counts = frame.film.counts();
//! assert_eq!((counts.samples, counts.rejected, counts.unwritten), (32 * 18 * 64, 0, 0));
//! # Ok::<(), trisect::Error>(())
//! ```
//!
//! # Progress, interrupts and resume
//!
//! A [`render::RenderObserver`] receives the progress of a render and may cancel it. A
//! [`render::FilmObserver`] receives the film after each part and may end the render between parts.
//! What the film holds is kept: [`render::Renderer::render_missing`] completes it later, also in
//! another process, to the same bits.
//!
//! ```
//! use std::ops::ControlFlow;
//! use std::sync::atomic::{AtomicU32, Ordering};
//! use trisect::{device::cpu::Cpu, film::Film, render, scene};
//!
//! struct Percent(u64);
//!
//! impl render::RenderObserver for Percent {
//!     fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
//!         self.0 = 100 * done / total;
//!         ControlFlow::Continue(())
//!     }
//! }
//!
//! /// Ends a render after its first part.
//! struct OnePart(AtomicU32);
//!
//! impl render::FilmObserver for OnePart {
//!     fn should_continue(&self) -> bool {
//!         self.0.load(Ordering::Relaxed) == 0
//!     }
//!
//!     fn part_added(&self, _: &Film) {
//!         self.0.fetch_add(1, Ordering::Relaxed);
//!     }
//! }
//!
//! let scene = scene::Scene::hello_world()?;
//! let settings = render::Settings::of(&scene).size(32, 18).spp(600);
//! let mut renderer = render::Renderer::new(Cpu::open(None)?, &scene)?;
//! let mut film = Film::new(32, 18);
//! let mut percent = Percent(0);
//! let first_part = OnePart(AtomicU32::new(0));
//! renderer.render_missing(&mut film, &settings, &(0..600), &first_part, &mut percent)?;
//! assert!(percent.0 < 100 && !film.coverage.missing(&(0..600)).is_empty());
//! renderer.render_missing(&mut film, &settings, &(0..600), &(), &mut percent)?;
//! assert_eq!(film, renderer.render(&settings)?.film);
//! # Ok::<(), trisect::Error>(())
//! ```

#![warn(clippy::too_many_lines)]
#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a library returns its messages")]

pub mod adaptive;
pub mod bvh;
mod camera;
pub mod camera_rays;
pub mod checkpoint;
pub mod cryptomatte;
pub mod denoise;
pub mod error;
pub mod film;
pub mod layers;
pub mod light_groups;
pub mod lights;
pub mod metadata;
mod passes;
pub mod prelude;
pub mod render;
pub mod settings;
pub mod stats;
pub mod surfaces;
pub mod view;

pub use error::Error;
pub use glam;
pub use trisect_device as device;
pub use trisect_image::{self as image, metrics, output};
pub use trisect_scene::{self as scene, alias, precision};
pub use trisect_system::{input, memory, spin, threads, time};
