//! wgpu device: Vulkan gets the SPIR-V kernels unchanged (pass-through), other drivers through
//! naga.

mod adapter;
mod futures;
mod memory;
mod pipeline;
mod run;
mod scene_bindings;
mod storage_params;
mod timer;
mod transfer;
mod waiting;

pub use adapter::devices;

use crate::command::{check_range, handle};
use crate::{BackendError, Buffer, Command, Device, DeviceInfo, DeviceKind};
use crate::{MathMode, Schedule, Traversal};
use adapter::Gpu;
use memory::{Part, Pool, ROW};
use pipeline::Pipelines;
use std::time::Duration;
use timer::Timer;
use trisect_kernels::EntryPoint;
use trisect_shared::features::Features;
use wgpu::BufferUsages;

/// Name of the backend.
pub(crate) const NAME: &str = "wgpu";

/// Route of the kernels to the driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// Unchanged if the adapter supports it (Vulkan), else through naga.
    PassThrough,
    /// Through naga, which reads SPIR-V and writes the driver's language.
    Naga,
    /// Through WGSL, which naga writes and reads, as browsers get the kernels.
    #[cfg(any(feature = "wgsl", target_family = "wasm"))]
    Wgsl,
}

impl Route {
    /// Route of this system: a browser takes WGSL, drivers what they support.
    #[cfg(target_family = "wasm")]
    pub const BEST: Self = Self::Wgsl;
    /// Route of this system: a browser takes WGSL, drivers what they support.
    #[cfg(not(target_family = "wasm"))]
    pub const BEST: Self = Self::PassThrough;
}

/// Usage of the buffers that kernels see.
const STORAGE: BufferUsages =
    BufferUsages::STORAGE.union(BufferUsages::COPY_DST).union(BufferUsages::COPY_SRC);

/// Minimum number of bytes of a buffer: an empty array is bound as one record that no kernel reads.
const MIN_BUFFER: u64 = size_of::<trisect_shared::material::Material>() as u64;

/// Number of bytes up to which wgpu's own writes are faster than a mapped buffer.
const SMALL_WRITE: usize = 1 << 16;

/// A wgpu adapter.
pub struct Wgpu {
    info: DeviceInfo,
    gpu: Gpu,
    pipelines: Pipelines,
    /// Launch parameters of a submission, [`pipeline::PARAMS_STRIDE`] bytes each.
    params: Option<wgpu::Buffer>,
    /// Bytes of ones, from which buffers are filled.
    ones: Option<wgpu::Buffer>,
    /// Buffers through which the host reads.
    readbacks: Pool,
    /// Buffers through which the host writes.
    uploads: Pool,
    /// Timer, if the adapter has timestamp queries.
    timer: Option<Timer>,
}

impl Wgpu {
    /// Opens the adapter with this index, or the best hardware one. A software adapter is opened
    /// only by its index.
    pub fn open(index: Option<usize>, route: Route) -> Result<Self, BackendError> {
        let (mut info, gpu) = adapter::open(index)?;
        let has_timer = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let timer = has_timer.then(|| Timer::new(&gpu, run::LAUNCHES)).transpose()?;
        info.timer = if has_timer { "timestamp queries" } else { "wall clock" };
        let pipelines = Pipelines::new(route, info.kind);
        Ok(Self {
            info,
            gpu,
            pipelines,
            params: None,
            ones: None,
            readbacks: Pool::new(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            uploads: Pool::new(BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC),
            timer,
        })
    }
}

/// A browser keeps a device's memory until it collects its garbage.
#[cfg(target_family = "wasm")]
impl Drop for Wgpu {
    fn drop(&mut self) {
        self.gpu.device.destroy();
    }
}

impl Device for Wgpu {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn best_method(&self, kernel: Features, primitives: usize) -> (Traversal, Schedule) {
        let has_queue = self.info.kind != DeviceKind::SoftwareGpu && self.pipelines.pass_through(&self.gpu);
        let best =
            if has_queue { Schedule::best_on_vulkan(kernel, primitives) } else { Schedule::Regenerate };
        (Traversal::Stack, best)
    }

    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        Ok(Buffer::new(Part::whole(self.gpu.buffer(bytes, STORAGE, what)?), bytes))
    }

    fn joins_arrays(&self) -> bool {
        true
    }

    fn allocate_joined(&mut self, bytes: &[u64], what: &'static str) -> Result<Vec<Buffer>, BackendError> {
        let whole = bytes.iter().fold(0u64, |sum, bytes| sum.saturating_add(bytes.saturating_add(ROW)));
        let buffer = self.gpu.buffer(whole, STORAGE, what)?;
        let mut first = 0;
        let parts = bytes.iter().map(|&bytes| {
            let part = Part { buffer: buffer.clone(), first };
            first += bytes.next_multiple_of(ROW);
            Buffer::new(part, bytes)
        });
        Ok(parts.collect())
    }

    fn upload(&mut self, bytes: &[u8], what: &'static str) -> Result<Buffer, BackendError> {
        let buffer = self.gpu.buffer(bytes.len() as u64, STORAGE, what)?;
        self.gpu.queue.write_buffer(&buffer, 0, bytes);
        self.gpu.check("copying to the device")?;
        Ok(Buffer::new(Part::whole(buffer), bytes.len() as u64))
    }

    fn write(&mut self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError> {
        check_range(NAME, to, first, bytes.len() as u64)?;
        let to: &Part = handle(to, NAME)?;
        let first = to.first + first;
        if bytes.len() > SMALL_WRITE {
            return self.write_through(&to.buffer, first, bytes);
        }
        self.gpu.queue.write_buffer(&to.buffer, first, bytes);
        self.gpu.check("copying to the device")
    }

    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        // The queue needs an atomic operation on a plain word of a buffer, which naga does not
        // support.
        if entry_point.queue && !self.pipelines.pass_through(&self.gpu) {
            return Err(BackendError::NoQueue { backend: NAME });
        }
        self.pipelines.compile(&self.gpu, entry_point, math)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        self.submit(commands)
    }
}
