//! CUDA device, through NVIDIA's driver, which is loaded at run time: one binary works with and
//! without it.
#![allow(
    unsafe_code,
    reason = "launches hand raw device memory to kernels; each block states why it is sound"
)]

mod driver;
mod kernel;
mod memory;
mod pinned;
mod wait;

pub use driver::devices;

use crate::command::misuse;
use crate::{BackendError, Buffer, Command, Device, DeviceInfo, HostMemory, RowTarget, Started};
use crate::{MathMode, Schedule, Traversal};
use cudarc::driver::sys::CUevent_flags;
use cudarc::driver::{CudaContext, CudaEvent, CudaFunction, CudaStream};
use driver::{describe, failed, probe, unavailable};
use pinned::Pinned;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;
use trisect_kernels::EntryPoint;
use trisect_shared::features::Features;
use wait::Waiter;

/// Name of the backend.
pub(crate) const NAME: &str = "cuda";

/// Oldest compute capability, major and minor, that the kernels are compiled for.
const MIN_CAPABILITY: (i32, i32) = (6, 1);

/// Maximum number of copies beside other commands that are waited for one by one.
const MAX_COPIES: usize = 8;

/// Maximum number of blocks down a grid.
const GRID_LIMIT: u32 = 65_535;

/// Maximum number of pixels in a launch of persistent lanes, which count them in 32 bits.
const MAX_QUEUE: u64 = 1 << 31;

/// Opens the device with this index, or the first.
pub(crate) fn open(index: Option<usize>) -> Result<Box<dyn Device>, BackendError> {
    Ok(Box::new(Cuda::open(index)?))
}

/// Stream of a CUDA device.
pub struct Cuda {
    info: DeviceInfo,
    stream: Arc<CudaStream>,
    /// Stream of copies to the host that run beside kernels.
    copies: Arc<CudaStream>,
    /// Buffers that these copies read, each with the number of its submission.
    copied: Vec<(u64, Buffer)>,
    /// Number of submissions with such a copy so far.
    copy_count: u64,
    /// Kernels that were used so far, by entry point and math build.
    kernels: HashMap<(EntryPoint, MathMode), CudaFunction>,
    /// Events that no submission holds.
    events: Vec<CudaEvent>,
    /// Pinned host memory, to which this device copies directly.
    pinned: Vec<Pinned>,
    waiter: Waiter,
}

impl Cuda {
    /// Opens the device with this index, or the first.
    pub fn open(index: Option<usize>) -> Result<Self, BackendError> {
        let count = probe()?;
        let index = index.unwrap_or(0);
        if index >= count {
            return Err(BackendError::NoSuchDevice { backend: NAME, index, devices: count });
        }
        let context = CudaContext::new(index).map_err(failed("creating a context"))?;
        // SAFETY: memory is used by the stream that it was allocated in, except a scene's, which is
        // complete before a second stream begins and is never written afterwards.
        unsafe { context.disable_event_tracking() };
        let capability = context.compute_capability().map_err(failed("asking for an attribute"))?;
        if capability < MIN_CAPABILITY {
            return Err(unavailable(
                format!(
                    "device {index} has compute capability {}.{}, 6.1 is needed",
                    capability.0, capability.1
                ),
                "choose another `device` or `backend`",
            ));
        }
        Self::within(&context, describe(index)?)
    }

    /// Creates a device with its own stream in a context.
    fn within(context: &Arc<CudaContext>, info: DeviceInfo) -> Result<Self, BackendError> {
        let stream = context.new_stream().map_err(failed("creating a stream"))?;
        let copies = context.new_stream().map_err(failed("creating a stream"))?;
        let (kernels, events, pinned) = (HashMap::new(), Vec::new(), Vec::new());
        let (copied, copy_count) = (Vec::new(), 0);
        Ok(Self {
            info,
            stream,
            copies,
            copied,
            copy_count,
            kernels,
            events,
            pinned,
            waiter: Waiter::default(),
        })
    }

    /// Makes the context current on the calling thread, because another thread may have created the
    /// renderer.
    fn bind(&self) -> Result<(), BackendError> {
        self.stream.context().bind_to_thread().map_err(failed("entering the context"))
    }

    /// Records an event in the stream, and returns its index among those of a submission.
    fn record(&mut self, events: &mut Vec<CudaEvent>) -> Result<usize, BackendError> {
        let stream = self.stream.clone();
        self.record_in(&stream, events)
    }

    /// Records an event in a stream of this device.
    fn record_in(&mut self, stream: &CudaStream, events: &mut Vec<CudaEvent>) -> Result<usize, BackendError> {
        let event = match self.events.pop() {
            Some(event) => event,
            None => {
                let event = self.stream.context().new_event(Some(CUevent_flags::CU_EVENT_BLOCKING_SYNC));
                event.map_err(failed("creating an event"))?
            }
        };
        event.record(stream).map_err(failed("starting the timer"))?;
        events.push(event);
        Ok(events.len() - 1)
    }

    /// Queues commands in the stream.
    ///
    /// # Safety
    ///
    /// As [`Device::start`].
    unsafe fn queue(&mut self, mut commands: Vec<Command<'_>>) -> Result<Queued, BackendError> {
        self.bind()?;
        // SAFETY: the caller's promise.
        let queued = unsafe { self.queue_each(&mut commands) };
        if queued.is_err() {
            // Commands before the one that failed may run, and nobody waits for them.
            self.synchronize()?;
        }
        queued
    }

    /// Queues commands until one fails.
    ///
    /// # Safety
    ///
    /// As [`Device::start`].
    unsafe fn queue_each(&mut self, commands: &mut [Command<'_>]) -> Result<Queued, BackendError> {
        let Queued { mut events, mut launches, .. } = Queued::default();
        // The event after a launch is also that before the next, if nothing comes between them.
        let mut recorded = None;
        for command in commands {
            let before = recorded.take();
            match command {
                Command::Fill { buffer, first, bytes, ones } => {
                    self.fill(buffer, *first, *bytes, if *ones { u8::MAX } else { 0 })?;
                }
                Command::Copy { from, to, bytes } => self.copy(from, to, *bytes)?,
                Command::Dispatch(launch) => {
                    let kernel = self.kernel(launch.entry_point, launch.math)?;
                    let first = match before {
                        Some(event) => event,
                        None => self.record(&mut events)?,
                    };
                    // SAFETY: the caller's promise.
                    unsafe { self.launch(&kernel, launch) }?;
                    let last = self.record(&mut events)?;
                    launches.push((first, last));
                    recorded = Some(last);
                }
                Command::Read { from, to } => self.read(&self.stream, from, to)?,
            }
        }
        if recorded.is_none() {
            // What others wait for.
            self.record(&mut events)?;
        }
        Ok(Queued { events, launches, copy: None, stream: Some(self.stream.clone()) })
    }

    /// Starts a copy to the host after queued commands, in the stream of copies.
    fn queue_copy(
        &mut self,
        queued: &mut Queued,
        from: &Buffer,
        mut to: RowTarget<'_>,
    ) -> Result<(), BackendError> {
        if self.copied.len() >= MAX_COPIES {
            // Nobody waited for them.
            self.copies.synchronize().map_err(failed("running commands"))?;
            self.copied.clear();
        }
        let last = queued.events.last().ok_or_else(|| misuse(NAME, "nothing was queued"))?;
        self.copies.wait(last).map_err(failed("running commands"))?;
        // The memory is freed in the order of the other stream, which knows nothing of the copy.
        self.copy_count += 1;
        queued.copy = Some(self.copy_count);
        self.copied.push((self.copy_count, from.clone()));
        self.read(&self.copies, from, &mut to)?;
        let copies = self.copies.clone();
        self.record_in(&copies, &mut queued.events)?;
        if !to.starts_in(|address| self.pinned.iter().any(|pinned| pinned.has_address(address))) {
            // Only pinned memory is held until the copy has ended.
            self.copies.synchronize().map_err(failed("running commands"))?;
        }
        Ok(())
    }

    /// Waits for all that runs.
    fn synchronize(&self) -> Result<(), BackendError> {
        let ended = self.stream.synchronize().and(self.copies.synchronize());
        ended.map_err(failed("running commands"))
    }

    /// Waits for commands. Returns the times of their launches, and keeps their events for others.
    fn end(&mut self, queued: Queued) -> Result<Vec<Duration>, BackendError> {
        let Queued { events, launches, copy, .. } = queued;
        if let Some(last) = events.last() {
            self.waiter.wait(last)?;
        }
        if let Some(copy) = copy {
            self.copied.retain(|(number, _)| *number != copy);
        }
        let time = |(first, last): (usize, usize)| {
            let milliseconds =
                events[first].elapsed_ms(&events[last]).map_err(failed("reading the timer"))?;
            Ok(Duration::from_secs_f64(f64::from(milliseconds.max(0.0)) * 1e-3))
        };
        let times = launches.into_iter().map(time).collect();
        self.events.extend(events);
        times
    }
}

impl Drop for Cuda {
    /// Waits for what was started: it uses kernels and memory that are freed next.
    fn drop(&mut self) {
        let _ = self.bind();
        let _ = self.synchronize();
    }
}

/// Commands in the stream: their events, the last of which comes after all of them, and the indices
/// of those before and after each launch.
#[derive(Default)]
struct Queued {
    events: Vec<CudaEvent>,
    launches: Vec<(usize, usize)>,
    /// Number of the copy beside other commands.
    copy: Option<u64>,
    /// Stream of the device that queued them.
    stream: Option<Arc<CudaStream>>,
}

impl Device for Cuda {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn best_method(&self, kernel: Features, primitives: usize) -> (Traversal, Schedule) {
        (Traversal::Stack, Schedule::best_on_cuda(kernel, primitives))
    }

    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        self.bind()?;
        Ok(Buffer::new(self.allocate_bytes(bytes, what)?, bytes))
    }

    fn write(&mut self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError> {
        self.bind()?;
        self.write_bytes(to, first, bytes)
    }

    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        self.bind()?;
        self.kernel(entry_point, math).map(|_| ())
    }

    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        // SAFETY: the caller's promise.
        let queued = unsafe { self.queue(commands) }?;
        self.end(queued)
    }

    unsafe fn start(&mut self, commands: Vec<Command<'_>>) -> Result<Started, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.queue(commands) }.map(Started::running)
    }

    unsafe fn start_with_copy<'a>(
        &mut self,
        commands: Vec<Command<'a>>,
        from: &'a Buffer,
        to: RowTarget<'a>,
    ) -> Result<Started, BackendError> {
        // SAFETY: the caller's promise.
        let mut queued = unsafe { self.queue(commands) }?;
        let copied = self.queue_copy(&mut queued, from, to);
        if copied.is_err() {
            self.synchronize()?;
        }
        copied.map(|()| Started::running(queued))
    }

    fn wait(&mut self, started: Started) -> Result<Vec<Duration>, BackendError> {
        let bound = self.bind();
        let others = || misuse(NAME, "another device started these commands");
        let queued: Queued = started.on_device().map_err(|_| others())?;
        if !queued.stream.as_ref().is_some_and(|stream| Arc::ptr_eq(stream, &self.stream)) {
            return Err(others());
        }
        // Also after an error, because the caller then uses the memory again.
        let ended = self.end(queued);
        bound.and(ended)
    }

    fn second_stream(&self) -> Result<Option<Box<dyn Device>>, BackendError> {
        self.bind()?;
        // What both streams read must be complete before the second one begins.
        self.synchronize()?;
        let mut twin = Self::within(self.stream.context(), self.info.clone())?;
        twin.kernels.clone_from(&self.kernels);
        Ok(Some(Box::new(twin)))
    }

    fn pin(&mut self, memory: &Arc<HostMemory>) {
        // After an error, the owner of pinned memory may be gone.
        self.pinned.retain(|pinned| !pinned.is_left());
        if memory.bytes() > 0 && !self.pinned.iter().any(|pinned| pinned.is_of(memory)) {
            self.pinned.extend(Pinned::new([&self.stream, &self.copies], memory));
        }
    }

    fn is_pinned(&self, bytes: &[u8]) -> bool {
        self.pinned.iter().any(|pinned| pinned.has(bytes))
    }

    fn unpin(&mut self, memory: &Arc<HostMemory>) {
        self.pinned.retain(|pinned| !pinned.is_of(memory));
    }
}
