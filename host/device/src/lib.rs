//! Devices that execute: CPU, wgpu and CUDA behind one trait.
//!
//! A [`Device`] allocates, copies, launches kernels and times them. It knows no film, scene or
//! denoiser: the renderer of the crate `trisect` decides what is launched, once for all devices.
//! [`open`] chooses a device as `--backend` does.

#![cfg_attr(target_family = "wasm", allow(dead_code, reason = "what CUDA alone uses"))]

mod buffer;
mod command;
pub mod cpu;
#[cfg(not(target_family = "wasm"))]
pub mod cuda;
#[cfg(target_family = "wasm")]
#[path = "cuda/absent.rs"]
pub mod cuda;
mod error;
mod host_memory;
mod method;
mod rows;
mod select;
mod started;
mod target;
pub mod wgpu;

pub use buffer::Buffer;
pub use command::{Command, Dispatch};
pub use error::BackendError;
pub use host_memory::{HostMemory, HostRecords, LentRecords};
pub use method::{MathMode, Schedule, Traversal};
pub use rows::RowSet;
pub use select::{Choice, Selection, list, open};
pub use started::Started;
pub use target::{FrameMemory, HostFrame, RowTarget};

use serde::Serialize;
use std::sync::Arc;
use std::time::Duration;
use trisect_kernels::EntryPoint;
use trisect_shared::features::Features;

/// Kind of a device, which decides how work is divided into submissions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// Threads of this machine's CPU.
    Cpu,
    /// A hardware GPU.
    Gpu,
    /// A graphics driver that computes on the CPU, such as Mesa's lavapipe.
    SoftwareGpu,
}

/// Description of a device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DeviceInfo {
    /// `cpu`, `wgpu` or `cuda`.
    pub backend: &'static str,
    /// Index for `--device`.
    pub index: usize,
    /// Name that the driver gives.
    pub name: String,
    /// Kind of the device.
    pub kind: DeviceKind,
    /// Driver, threads and memory, for people.
    pub details: String,
    /// Timer of [`Device::run`]: `wall clock`, `CUDA events` or `timestamp queries`.
    pub timer: &'static str,
}

/// Boxes a device for the renderer.
impl<D: Device + 'static> From<D> for Box<dyn Device> {
    fn from(device: D) -> Self {
        Box::new(device)
    }
}

/// Device that runs kernels over buffers.
pub trait Device: Send {
    /// Returns the description of the device.
    fn info(&self) -> &DeviceInfo;

    /// Returns the fastest traversal and schedule for a kernel with these features and for this
    /// number of primitives (docs/notebook/specialisation.md). With
    /// [`Traversal::Wide`] a wide BVH is built, and each kernel that traces the binary BVH can
    /// trace it instead.
    fn best_method(&self, _kernel: Features, _primitives: usize) -> (Traversal, Schedule) {
        (Traversal::Stack, Schedule::Regenerate)
    }

    /// Allocates memory whose content is unspecified. `what` names it in an error.
    ///
    /// # Errors
    ///
    /// [`BackendError::TooLarge`] if the device does not have as much.
    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError>;

    /// Allocates memory for `bytes` and copies them there.
    ///
    /// # Errors
    ///
    /// The errors of [`allocate`](Self::allocate) and [`write`](Self::write).
    fn upload(&mut self, bytes: &[u8], what: &'static str) -> Result<Buffer, BackendError> {
        let buffer = self.allocate(bytes.len() as u64, what)?;
        self.write(&buffer, 0, bytes)?;
        Ok(buffer)
    }

    /// Returns a buffer that is the memory of these records, if the device reads host memory in
    /// place. No command may write to it.
    fn adopt(&mut self, _records: &LentRecords) -> Option<Buffer> {
        None
    }

    /// Returns whether a kernel reads several arrays of a scene from one buffer, so that they are
    /// [allocated together](Self::allocate_joined).
    fn joins_arrays(&self) -> bool {
        false
    }

    /// Allocates memory for arrays of so many bytes that a kernel may read from one buffer, which
    /// begins with the first of them.
    ///
    /// # Errors
    ///
    /// The errors of [`allocate`](Self::allocate).
    fn allocate_joined(&mut self, bytes: &[u64], what: &'static str) -> Result<Vec<Buffer>, BackendError> {
        bytes.iter().map(|&bytes| self.allocate(bytes, what)).collect()
    }

    /// Copies `bytes` to a buffer, from its byte `first` on; both are multiples of 4.
    ///
    /// # Errors
    ///
    /// [`BackendError::Device`] if the buffer is too small, or the device fails.
    fn write(&mut self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError>;

    /// Compiles an entry point, unless that was done before.
    ///
    /// # Errors
    ///
    /// [`BackendError::NoFastMath`] and [`BackendError::NoQueue`] if the device does not have this
    /// build; [`BackendError::Device`] if the driver fails.
    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError>;

    /// Runs commands, one after another, and waits for the last. Returns the device's own measure
    /// of the time of each [`Command::Dispatch`].
    ///
    /// # Errors
    ///
    /// [`BackendError::TooLong`] for a launch with too many threads along an axis;
    /// [`BackendError::Device`] if buffers are too small for copies, or if the device fails.
    ///
    /// # Safety
    ///
    /// The arrays of each launch hold what its kernel reads, with indices in range, and have a
    /// place for what it writes, for all its threads: kernels do not check that. No other device
    /// writes to a buffer meanwhile, nor reads what a command writes.
    #[allow(unsafe_code, reason = "a promise of the caller")]
    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError>;

    /// Starts commands, which begin after all that were started before. A CUDA device returns
    /// before they end, so that it begins them without waiting for the host; others run them.
    ///
    /// # Errors
    ///
    /// The errors of [`run`](Self::run), here or in [`wait`](Self::wait).
    ///
    /// # Safety
    ///
    /// That of [`run`](Self::run). Nothing accesses the memory of a [`Command::Read`] before
    /// [`wait`](Self::wait), or a later [`run`](Self::run), has returned.
    #[allow(unsafe_code, reason = "a promise of the caller")]
    unsafe fn start(&mut self, commands: Vec<Command<'_>>) -> Result<Started, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.run(commands) }.map(Started::ended)
    }

    /// Starts commands, and then a copy of rows of an image to the host, as a
    /// [`Command::Read`]. On a CUDA device the copy runs beside what is started later.
    ///
    /// # Errors
    ///
    /// The errors of [`start`](Self::start).
    ///
    /// # Safety
    ///
    /// That of [`run`](Self::run). Before [`wait`](Self::wait) has returned, nothing accesses the
    /// memory of `to`, and no command that is started writes to `from`. Both may be freed
    /// meanwhile.
    #[allow(unsafe_code, reason = "a promise of the caller")]
    unsafe fn start_with_copy<'a>(
        &mut self,
        mut commands: Vec<Command<'a>>,
        from: &'a Buffer,
        to: RowTarget<'a>,
    ) -> Result<Started, BackendError> {
        commands.push(Command::Read { from, to });
        // SAFETY: the caller's promise.
        unsafe { self.start(commands) }
    }

    /// Waits for commands that this device started. Returns what [`run`](Self::run) returns.
    ///
    /// # Errors
    ///
    /// [`BackendError::Device`] if the device fails, [`BackendError::Misuse`] for commands that
    /// another device started.
    fn wait(&mut self, started: Started) -> Result<Vec<Duration>, BackendError> {
        let name = self.info().backend;
        started.times().map_err(|_| command::misuse(name, "another device started these commands"))
    }

    /// Returns another stream of the same device, which reads the same buffers. Both render at the
    /// same time: while one waits for its last lanes or for the host, the other's lanes fill the
    /// device. Returns `None` if that gains nothing.
    ///
    /// # Errors
    ///
    /// [`BackendError::Device`] if the device fails.
    fn second_stream(&self) -> Result<Option<Box<dyn Device>>, BackendError> {
        Ok(None)
    }

    /// Pins this memory (locks its pages), so that the device copies to it directly:
    /// [`Command::Read`] is then faster. If that is not possible, its speed stays the same.
    fn pin(&mut self, _memory: &Arc<HostMemory>) {}

    /// Returns whether all these bytes are pinned, so that reads to them in [`start`](Self::start)
    /// return before they end.
    fn is_pinned(&self, _bytes: &[u8]) -> bool {
        false
    }

    /// Undoes [`pin`](Self::pin).
    fn unpin(&mut self, _memory: &Arc<HostMemory>) {}
}
