//! A backend whose launches can fail or take long, or whose memory does not suffice.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use trisect::device::cpu::Cpu;
use trisect::device::{BackendError, Buffer, Command, Device, DeviceInfo, DeviceKind, MathMode};
use trisect_kernels::EntryPoint;

/// The CPU backend with all threads of this machine, and a function that is called after each
/// launch.
pub struct FaultInjectingBackend {
    inner: Cpu,
    info: DeviceInfo,
    after: Box<dyn FnMut() -> Result<(), BackendError> + Send>,
    /// Purpose that there is no memory for.
    lacks: Option<&'static str>,
    /// While true, memory is neither allocated nor written.
    full: Arc<AtomicBool>,
}

impl FaultInjectingBackend {
    /// Opens the backend. A launch fails if `after` returns an error.
    ///
    /// # Panics
    ///
    /// If the CPU backend does not open.
    pub fn new(after: impl FnMut() -> Result<(), BackendError> + Send + 'static) -> Self {
        let inner = Cpu::open(None).unwrap();
        Self { info: inner.info().clone(), inner, after: Box::new(after), lacks: None, full: Arc::default() }
    }

    /// Fails to allocate and to write memory while `full` is true.
    #[must_use]
    pub fn full_while(self, full: Arc<AtomicBool>) -> Self {
        Self { full, ..self }
    }

    fn check_memory(&self, action: &'static str) -> Result<(), BackendError> {
        let message = "out of memory".to_owned();
        let error = BackendError::Device { backend: "cpu", action, message };
        if self.full.load(Ordering::Relaxed) { Err(error) } else { Ok(()) }
    }

    /// Takes the memory for `what` away, as errors name it.
    #[must_use]
    pub fn without_memory_for(self, what: &'static str) -> Self {
        Self { lacks: Some(what), ..self }
    }

    /// Reports the device as a GPU, so that the host adds a chunk to the film while the next one is
    /// rendered.
    #[must_use]
    pub fn as_gpu(mut self) -> Self {
        self.info.kind = DeviceKind::Gpu;
        self
    }
}

impl Device for FaultInjectingBackend {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        if self.lacks == Some(what) {
            return Err(BackendError::TooLarge { backend: "cpu", what, needed: bytes, limit: bytes / 2 });
        }
        self.check_memory("allocating memory")?;
        self.inner.allocate(bytes, what)
    }

    fn write(&mut self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError> {
        self.check_memory("copying to the device")?;
        self.inner.write(to, first, bytes)
    }

    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        self.inner.compile(entry_point, math)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        let renders = |command: &Command<'_>| matches!(command, Command::Dispatch(launch) if launch.entry_point.name.starts_with("render"));
        let launches = commands.iter().filter(|command| renders(command)).count();
        // SAFETY: the caller's promise.
        let times = unsafe { self.inner.run(commands) }?;
        (0..launches).try_for_each(|_| (self.after)())?;
        Ok(times)
    }
}
