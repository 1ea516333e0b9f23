//! The CPU: the shared crate, natively, over a pool of threads.

use super::{Backend, BackendError, Device, DeviceKind, Job, Launch, SceneRecords, kernel};
use crate::render::{MathMode, SettingsError};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::time::{Duration, Instant};
use trisect_shared::bvh::BvhNode;
use trisect_shared::features::{Features, ROULETTE, SCHLICK};
use trisect_shared::film::PixelSums;
use trisect_shared::material::Material;
use trisect_shared::params::RenderParams;
use trisect_shared::path::{self, FirstHit};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::Sphere;

/// Pixels that a thread takes at a time.
const TASK: usize = 64;

/// Threads of this machine.
pub struct Cpu {
    device: Device,
    pool: ThreadPool,
    spheres: Vec<Sphere>,
    nodes: Vec<BvhNode>,
    materials: Vec<Material>,
    features: Features,
    film: Vec<PixelSums>,
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
            spheres: Vec::new(),
            nodes: Vec::new(),
            materials: Vec::new(),
            features: 0,
            film: Vec::new(),
        })
    }

    fn scene(&self) -> Scene<'_> {
        Scene { spheres: &self.spheres, nodes: &self.nodes, materials: &self.materials }
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

type Kernel = unsafe fn(&RenderParams, Scene, u32, u32, &mut PixelSums);

/// The shared crate's function for the features of a kernel variant.
fn kernel_function(features: Features) -> Option<Kernel> {
    macro_rules! table {
        ($($name:ident $text:tt: $mask:expr,)*) => {
            [$(($mask, path::render_pixel::<{ $mask }> as Kernel),)*]
        };
    }
    let table = trisect_kernels::for_each_variant!(table);
    table.into_iter().find(|(mask, _)| *mask == features).map(|(_, function)| function)
}

impl Backend for Cpu {
    fn device(&self) -> &Device {
        &self.device
    }

    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError> {
        self.spheres = scene.spheres.to_vec();
        self.nodes = scene.nodes.to_vec();
        self.materials = scene.materials.to_vec();
        Ok(())
    }

    fn prepare(&mut self, job: &Job) -> Result<(), BackendError> {
        if job.math == MathMode::Fast {
            return Err(SettingsError::NoFastMath { backend: "cpu" }.into());
        }
        kernel("cpu", job.features)?;
        self.features = job.features;
        self.film.clear();
        self.film.resize(job.pixels(), PixelSums::UNWRITTEN);
        Ok(())
    }

    #[allow(unsafe_code, reason = "calls the shared crate, which reads without bounds checks")]
    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError> {
        let start = Instant::now();
        let params = launch.params();
        let failed = |message: &str| BackendError::Device {
            backend: "cpu",
            action: "rendering",
            message: message.to_owned(),
        };
        let scene = Scene { spheres: &self.spheres, nodes: &self.nodes, materials: &self.materials };
        let render = kernel_function(self.features).ok_or_else(|| failed("no such kernel"))?;
        let first = params.first_row as usize * params.width as usize;
        let count = params.rows as usize * params.width as usize;
        let film = self.film.get_mut(first..first + count).ok_or_else(|| failed("rows beyond the film"))?;
        self.pool.install(|| {
            film.par_chunks_mut(TASK).enumerate().for_each(|(task, pixels)| {
                for (pixel, slot) in (first + task * TASK..).zip(pixels) {
                    let (x, y) = (pixel as u32 % params.width, pixel as u32 / params.width);
                    let mut sums = if params.resume != 0 { *slot } else { PixelSums::ZERO };
                    // SAFETY: a scene and a launch come from a renderer, which proved the indices.
                    unsafe { render(params, scene, x, y, &mut sums) };
                    *slot = sums;
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
        let (scene, params) = (self.scene(), launch.params());
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
