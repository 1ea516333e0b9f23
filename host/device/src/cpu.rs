//! CPU backend: runs the shared crate's code natively, on a pool of threads.

mod denoise;
mod instructions;

pub use instructions::InstructionSet;

use super::{Backend, BackendError, Device, DeviceKind, FilmDesc, Launch, SceneRecords};
use crate::{DisplayLaunch, Pass};
use crate::{MathMode, Schedule, Traversal};
use crate::{RowSet, RowTarget};
use instructions::Kernel;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::time::{Duration, Instant};
use trisect_shared::aovs::AovSums;
use trisect_shared::buffer::SharedSlice;
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::features::{AOVS, Features, WIDE, has};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::light::Light;
use trisect_shared::material::Material;
use trisect_shared::path::{self, FirstHit};
use trisect_shared::planar::Planar;
use trisect_shared::scene::Scene;
use trisect_shared::sphere::Sphere;
use trisect_shared::texture::{Texel, Texture};
use trisect_shared::triangle::{Triangle, TriangleShading};
use trisect_shared::wide::{SpherePacket, TrianglePacket, WideChild, WideNode, WideTree};

/// Number of pixels in a task of the thread pool.
const TASK: usize = 64;

/// CPU of this machine, with a thread pool and the film of the current render.
pub struct Cpu {
    device: Device,
    instructions: InstructionSet,
    pool: ThreadPool,
    scene: SceneCopy,
    kernel: Kernel,
    film: Vec<PixelSums>,
    /// Rounding errors of each pixel's unfinished chunk.
    compensations: Vec<Compensation>,
    /// AOV sums of each pixel; empty if the kernel does not write them.
    aovs: Vec<AovSums>,
    denoiser: denoise::Denoiser,
}

impl Cpu {
    /// Opens the CPU with a pool of `threads` threads. `None` takes `RAYON_NUM_THREADS`, or else
    /// one thread for each logical core.
    pub fn open(threads: Option<usize>) -> Result<Self, BackendError> {
        Self::with_instructions(threads, InstructionSet::best())
    }

    /// Opens the CPU with kernels for this instruction set. The image does not depend on it.
    ///
    /// # Errors
    ///
    /// [`BackendError::Device`] if the processor lacks it.
    pub fn with_instructions(
        threads: Option<usize>,
        instructions: InstructionSet,
    ) -> Result<Self, BackendError> {
        if !instructions.is_available() {
            return Err(failed(&format!("this processor has no {}", instructions.name())));
        }
        let pool = trisect_system::threads::pool(threads, "trisect-cpu")?;
        let device = describe_with(pool.current_num_threads(), instructions);
        Ok(Self {
            device,
            instructions,
            pool,
            scene: SceneCopy::default(),
            kernel: instructions::render_pixel::<0>,
            film: Vec::new(),
            compensations: Vec::new(),
            aovs: Vec::new(),
            denoiser: denoise::Denoiser::default(),
        })
    }
}

/// Copy of a scene's arrays.
#[derive(Default)]
struct SceneCopy {
    spheres: Vec<Sphere>,
    nodes: Vec<BvhNode>,
    /// Number of the scene's own nodes; nodes of tile entries follow them.
    scene_nodes: usize,
    materials: Vec<Material>,
    flats: Vec<Planar>,
    triangles: Vec<Triangle>,
    shading: Vec<TriangleShading>,
    lights: Vec<Light>,
    textures: Vec<Texture>,
    texels: Vec<Texel>,
    environment: Vec<EnvironmentTexel>,
    wide_root: Option<WideChild>,
    wide_nodes: Vec<WideNode>,
    sphere_packets: Vec<SpherePacket>,
    triangle_packets: Vec<TrianglePacket>,
}

impl SceneCopy {
    fn copy(scene: Scene) -> Self {
        Self {
            spheres: scene.spheres.to_vec(),
            nodes: scene.nodes.to_vec(),
            scene_nodes: scene.nodes.len(),
            materials: scene.materials.to_vec(),
            flats: scene.planars.to_vec(),
            triangles: scene.triangles.to_vec(),
            shading: scene.shading.to_vec(),
            lights: scene.lights.to_vec(),
            textures: scene.textures.to_vec(),
            texels: scene.texels.to_vec(),
            environment: scene.environment.to_vec(),
            wide_root: Some(scene.wide.root),
            wide_nodes: scene.wide.nodes.to_vec(),
            sphere_packets: scene.wide.spheres.to_vec(),
            triangle_packets: scene.wide.triangles.to_vec(),
        }
    }

    fn borrow(&self) -> Scene<'_> {
        Scene {
            spheres: &self.spheres,
            nodes: &self.nodes,
            materials: &self.materials,
            planars: &self.flats,
            triangles: &self.triangles,
            shading: &self.shading,
            lights: &self.lights,
            textures: &self.textures,
            texels: &self.texels,
            environment: &self.environment,
            wide: WideTree {
                root: self.wide_root.unwrap_or(WideChild::EMPTY),
                nodes: &self.wide_nodes,
                spheres: &self.sphere_packets,
                triangles: &self.triangle_packets,
            },
        }
    }
}

/// Describes this machine's processor, with the best of its instruction sets.
pub fn describe(threads: usize) -> Device {
    describe_with(threads, InstructionSet::best())
}

fn describe_with(threads: usize, instructions: InstructionSet) -> Device {
    let mut system = sysinfo::System::new();
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    let name = system.cpus().first().map(|cpu| cpu.brand().trim().to_owned()).filter(|name| !name.is_empty());
    Device {
        backend: "cpu",
        index: 0,
        name: name.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        kind: DeviceKind::Cpu,
        details: format!("{threads} thread{}, {}", if threads == 1 { "" } else { "s" }, instructions.name()),
        timer: "wall clock",
    }
}

/// AOV sums that all tasks write, each those of its own pixels.
#[derive(Clone, Copy)]
struct SharedAovs {
    first: *mut AovSums,
    length: usize,
}

// SAFETY: callers of `slots` promise that no two threads touch the same pixel.
#[allow(unsafe_code, reason = "a pointer for several threads")]
unsafe impl Sync for SharedAovs {}

#[allow(unsafe_code, reason = "see trisect_shared::buffer")]
impl SharedAovs {
    /// # Safety
    ///
    /// No two threads touch the same pixel at the same time, and the vector outlives the slice.
    unsafe fn slots<'a>(&self) -> SharedSlice<'a, AovSums> {
        // SAFETY: the caller's promise.
        unsafe { SharedSlice::new(self.first, self.length) }
    }
}

/// Moves rows of an image's per-pixel records to `to`, packed, and fills their place with
/// `nothing`.
fn take<T: Copy>(rows: &RowSet, of: &mut [T], to: &mut [T], nothing: T) -> Result<(), BackendError> {
    let width = to.len() / (rows.len() as usize).max(1);
    let mut done = 0;
    for block in rows.blocks() {
        let from = of.get_mut(block.start as usize * width..block.end as usize * width);
        let (Some(from), Some(to)) = (from, to.get_mut(done..done + block.len() * width)) else {
            return Err(failed("the rows are outside the prepared film"));
        };
        to.copy_from_slice(from);
        from.fill(nothing);
        done += to.len();
    }
    Ok(())
}

fn failed(message: &str) -> BackendError {
    BackendError::Device { backend: "cpu", action: "rendering", message: message.to_owned() }
}

impl Backend for Cpu {
    fn device(&self) -> &Device {
        &self.device
    }

    fn best_method(&self, _kernel: Features, _math: MathMode) -> (Traversal, Schedule) {
        let traversal = match self.instructions {
            InstructionSet::Baseline => Traversal::Stack,
            InstructionSet::Avx2 | InstructionSet::Avx512 => Traversal::Wide,
        };
        (traversal, Schedule::Regenerate)
    }

    fn upload(&mut self, scene: &SceneRecords) -> Result<(), BackendError> {
        self.scene = SceneCopy::copy(scene.scene());
        Ok(())
    }

    fn upload_tile_entries(&mut self, nodes: &[BvhNode]) -> Result<(), BackendError> {
        self.scene.nodes.truncate(self.scene.scene_nodes);
        self.scene.nodes.extend_from_slice(nodes);
        Ok(())
    }

    fn begin_film(&mut self, job: &FilmDesc) -> Result<(), BackendError> {
        if job.math == MathMode::Fast {
            return Err(BackendError::NoFastMath { backend: "cpu" });
        }
        let instructions =
            if has(job.variant.features, WIDE) { self.instructions } else { InstructionSet::Baseline };
        let kernel = instructions::kernel(job.variant.name, instructions);
        self.kernel = kernel.ok_or_else(|| failed("no such kernel"))?;
        self.film.clear();
        self.film.resize(job.pixels(), PixelSums::UNWRITTEN);
        self.compensations.resize(job.pixels(), Compensation::ZERO);
        self.aovs.clear();
        if has(job.variant.features, AOVS) {
            self.aovs.resize(job.pixels(), AovSums::UNWRITTEN);
        }
        Ok(())
    }

    #[allow(unsafe_code, reason = "calls the shared crate, which reads without bounds checks")]
    fn render(&mut self, launch: &Launch) -> Result<Duration, BackendError> {
        let start = Instant::now();
        let params = launch.params();
        let (scene, render) = (self.scene.borrow(), self.kernel);
        let width = params.width as usize;
        let height = self.film.len() / width.max(1);
        let mut wanted = (0..params.rows).map(|index| params.row(index)).peekable();
        let rows = self.film.chunks_mut(width.max(1)).zip(self.compensations.chunks_mut(width.max(1)));
        let rows = (0u32..).zip(rows).filter(|(y, _)| wanted.next_if_eq(y).is_some());
        let tasks: Vec<_> = rows
            .flat_map(|(y, (film, carries))| {
                let parts = film.chunks_mut(TASK).zip(carries.chunks_mut(TASK));
                (0u32..).step_by(TASK).zip(parts).map(move |(x, part)| (x, y, part))
            })
            .collect();
        if wanted.next().is_some() {
            return Err(failed(&format!("the launch has rows beyond the film's {height}")));
        }
        let guides = SharedAovs { first: self.aovs.as_mut_ptr(), length: self.aovs.len() };
        self.pool.install(|| {
            tasks.into_par_iter().for_each(|(first, y, (pixels, carries))| {
                // SAFETY: a task touches the AOV sums of its own pixels only.
                let mut guides = unsafe { guides.slots() };
                for (slot, x) in (0u32..).zip(first..).take(pixels.len()) {
                    // SAFETY: scene and launch come from a renderer, which checked the indices.
                    unsafe { render(params, scene, x, y, pixels, carries, slot, &mut guides) };
                }
            });
        });
        Ok(start.elapsed())
    }

    fn read_film(&mut self, rows: &RowSet, film: &mut [PixelSums]) -> Result<(), BackendError> {
        take(rows, &mut self.film, film, PixelSums::UNWRITTEN)
    }

    fn read_aovs(&mut self, rows: &RowSet, guides: &mut [AovSums]) -> Result<(), BackendError> {
        take(rows, &mut self.aovs, guides, AovSums::UNWRITTEN)
    }

    fn write_film(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError> {
        if film.len() != self.film.len() || guides.len() != self.aovs.len() {
            return Err(failed("the sums are for an image of another size"));
        }
        self.film.copy_from_slice(film);
        self.aovs.copy_from_slice(guides);
        Ok(())
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn denoise(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
        if self.aovs.len() != self.film.len() {
            return Err(failed("the film was prepared without AOV sums"));
        }
        let Self { pool, film, aovs: guides, denoiser, .. } = self;
        pool.install(|| denoiser.run(passes, film, guides))
    }

    fn read_denoised(&mut self, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError> {
        self.denoiser.read(image, pixels)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn display(
        &mut self,
        frame: &DisplayLaunch,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        let Self { pool, film, denoiser, .. } = self;
        pool.install(|| denoiser.display(frame, film, to))
    }

    #[allow(unsafe_code, reason = "calls the shared crate, which reads without bounds checks")]
    fn first_hits(&mut self, launch: &Launch, hits: &mut [FirstHit]) -> Result<(), BackendError> {
        let (scene, params) = (self.scene.borrow(), launch.params());
        self.pool.install(|| {
            hits.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(pixel, hit)| {
                let (x, y) = (pixel as u32 % params.width, pixel as u32 / params.width);
                // SAFETY: scene and launch come from a renderer, which checked the indices.
                *hit = unsafe { path::first_hit(params, scene, x, y) };
            });
        });
        Ok(())
    }
}
