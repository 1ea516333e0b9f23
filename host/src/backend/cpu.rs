//! The CPU: the shared crate, natively, over a pool of threads.

use super::{Backend, BackendError, Device, DeviceKind, Job, Launch, SceneRecords};
use crate::render::{MathMode, SettingsError};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::time::{Duration, Instant};
use trisect_shared::bvh::BvhNode;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::features::{ALL, LINEAR, MICROFACETS, REGENERATE, ROULETTE, SCHLICK, SOBOL, TEXTURES};
use trisect_shared::film::{Carry, PixelSums};
use trisect_shared::flat::Flat;
use trisect_shared::light::Light;
use trisect_shared::material::Material;
use trisect_shared::params::RenderParams;
use trisect_shared::path::{self, FirstHit};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::Sphere;
use trisect_shared::texture::{Texel, Texture};
use trisect_shared::triangle::{Triangle, TriangleShading};

/// Pixels that a thread takes at a time.
const TASK: usize = 64;

/// Threads of this machine.
pub struct Cpu {
    device: Device,
    pool: ThreadPool,
    scene: OwnScene,
    kernel: Kernel,
    film: Vec<PixelSums>,
    /// One for each pixel.
    carries: Vec<Carry>,
}

impl Cpu {
    /// A pool of `threads`, or of one for each logical core.
    pub fn open(threads: Option<usize>) -> Result<Self, BackendError> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads.unwrap_or(0))
            .thread_name(|i| format!("trisect-cpu-{i}"))
            .build()
            .map_err(|error| BackendError::Device {
                backend: "cpu",
                action: "starting threads",
                message: error.to_string(),
            })?;
        let device = describe(pool.current_num_threads());
        Ok(Self {
            device,
            pool,
            scene: OwnScene::default(),
            kernel: path::render_pixel::<0>,
            film: Vec::new(),
            carries: Vec::new(),
        })
    }
}

/// A scene's arrays.
#[derive(Default)]
struct OwnScene {
    spheres: Vec<Sphere>,
    nodes: Vec<BvhNode>,
    materials: Vec<Material>,
    flats: Vec<Flat>,
    triangles: Vec<Triangle>,
    shading: Vec<TriangleShading>,
    lights: Vec<Light>,
    textures: Vec<Texture>,
    texels: Vec<Texel>,
    environment: Vec<EnvironmentTexel>,
}

impl OwnScene {
    fn copy(scene: Scene) -> Self {
        Self {
            spheres: scene.spheres.to_vec(),
            nodes: scene.nodes.to_vec(),
            materials: scene.materials.to_vec(),
            flats: scene.flats.to_vec(),
            triangles: scene.triangles.to_vec(),
            shading: scene.shading.to_vec(),
            lights: scene.lights.to_vec(),
            textures: scene.textures.to_vec(),
            texels: scene.texels.to_vec(),
            environment: scene.environment.to_vec(),
        }
    }

    fn borrow(&self) -> Scene<'_> {
        Scene {
            spheres: &self.spheres,
            nodes: &self.nodes,
            materials: &self.materials,
            flats: &self.flats,
            triangles: &self.triangles,
            shading: &self.shading,
            lights: &self.lights,
            textures: &self.textures,
            texels: &self.texels,
            environment: &self.environment,
        }
    }
}

/// This machine's processor.
pub fn describe(threads: usize) -> Device {
    let mut system = sysinfo::System::new();
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    let name = system.cpus().first().map(|cpu| cpu.brand().trim().to_owned()).filter(|name| !name.is_empty());
    Device {
        backend: "cpu",
        index: 0,
        name: name.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        kind: DeviceKind::Cpu,
        details: format!("{threads} thread{}", if threads == 1 { "" } else { "s" }),
        timer: "wall clock",
    }
}

type Kernel = unsafe fn(&RenderParams, Scene, u32, u32, &mut [PixelSums], &mut [Carry], u32);

/// The shared crate's function for a kernel variant.
fn kernel_function(name: &str) -> Option<Kernel> {
    macro_rules! table {
        ($($name:ident $text:tt: $mask:expr,)*) => {
            [$(($text, path::render_pixel::<{ $mask }> as Kernel),)*]
        };
    }
    let table = trisect_kernels::for_each_variant!(table);
    table.into_iter().find(|(text, _)| *text == name).map(|(_, function)| function)
}

fn failed(message: &str) -> BackendError {
    BackendError::Device { backend: "cpu", action: "rendering", message: message.to_owned() }
}

impl Backend for Cpu {
    fn device(&self) -> &Device {
        &self.device
    }

    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError> {
        self.scene = OwnScene::copy(scene.scene());
        Ok(())
    }

    fn prepare(&mut self, job: &Job) -> Result<(), BackendError> {
        if job.math == MathMode::Fast {
            return Err(SettingsError::NoFastMath { backend: "cpu" }.into());
        }
        let name = job.variant.name;
        self.kernel = kernel_function(name).ok_or_else(|| failed("no such kernel"))?;
        self.film.clear();
        self.film.resize(job.pixels(), PixelSums::UNWRITTEN);
        self.carries.resize(job.pixels(), Carry::ZERO);
        Ok(())
    }

    #[allow(unsafe_code, reason = "calls the shared crate, which reads without bounds checks")]
    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError> {
        let start = Instant::now();
        let params = launch.params();
        let (scene, render) = (self.scene.borrow(), self.kernel);
        let first = params.first_row as usize * params.width as usize;
        let count = params.rows as usize * params.width as usize;
        let beyond = || failed("rows beyond the film");
        let film = self.film.get_mut(first..first + count).ok_or_else(beyond)?;
        let carries = self.carries.get_mut(first..first + count).ok_or_else(beyond)?;
        self.pool.install(|| {
            let tasks = film.par_chunks_mut(TASK).zip(carries.par_chunks_mut(TASK));
            tasks.enumerate().for_each(|(task, (pixels, carries))| {
                for (slot, pixel) in (0u32..).zip(first + task * TASK..).take(pixels.len()) {
                    let (x, y) = (pixel as u32 % params.width, pixel as u32 / params.width);
                    // SAFETY: a scene and a launch come from a renderer, which proved the indices.
                    unsafe { render(params, scene, x, y, pixels, carries, slot) };
                }
            });
        });
        Ok(start.elapsed())
    }

    fn read_film(&mut self, film: &mut [PixelSums]) -> Result<(), BackendError> {
        for (to, from) in film.iter_mut().zip(&mut self.film) {
            *to = std::mem::replace(from, PixelSums::UNWRITTEN);
        }
        Ok(())
    }

    #[allow(unsafe_code, reason = "as above")]
    fn first_hits(&mut self, launch: &Launch, hits: &mut [FirstHit]) -> Result<(), BackendError> {
        let (scene, params) = (self.scene.borrow(), launch.params());
        self.pool.install(|| {
            hits.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(pixel, hit)| {
                let (x, y) = (pixel as u32 % params.width, pixel as u32 / params.width);
                // SAFETY: a scene and a launch come from a renderer, which proved the indices.
                *hit = unsafe { path::first_hit(params, scene, x, y) };
            });
        });
        Ok(())
    }
}
