//! Devices of wgpu that tests use one after another: a device keeps its compiled kernels, and a
//! software adapter takes seconds to compile one.

use crate::BackendUnderTest;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use trisect::device::{
    BackendError, Buffer, Command, Device, DeviceInfo, HostMemory, LentRecords, MathMode, RowTarget, Started,
};
use trisect::render::{Schedule, Traversal};
use trisect_kernels::EntryPoint;
use trisect_shared::features::Features;

/// Devices that no test uses, and the backends that opened them.
static UNUSED: Mutex<Vec<(BackendUnderTest, Box<dyn Device>)>> = Mutex::new(Vec::new());

/// A device that returns to the unused ones when it is dropped, unless its thread panics.
pub struct ReusedDevice {
    backend: BackendUnderTest,
    /// `None` after the drop.
    inner: Option<Box<dyn Device>>,
}

impl ReusedDevice {
    /// Returns an unused device of this backend that still works, or a new one.
    ///
    /// # Errors
    ///
    /// Those of `open`.
    pub fn take(
        backend: BackendUnderTest,
        open: impl FnOnce() -> Result<Box<dyn Device>, BackendError>,
    ) -> Result<Box<dyn Device>, BackendError> {
        let mut unused = UNUSED.lock().unwrap_or_else(PoisonError::into_inner);
        let found = unused.iter().position(|(of, _)| *of == backend).map(|index| unused.swap_remove(index).1);
        drop(unused);
        let working =
            found.and_then(|mut device| device.upload(&[0; 4], "a probe").is_ok().then_some(device));
        let inner = Some(working.map_or_else(open, Ok)?);
        Ok(Box::new(Self { backend, inner }))
    }

    fn inner(&self) -> &dyn Device {
        self.inner.as_deref().unwrap_or_else(|| panic!("the device was dropped"))
    }

    fn inner_mut(&mut self) -> &mut dyn Device {
        self.inner.as_deref_mut().unwrap_or_else(|| panic!("the device was dropped"))
    }
}

impl Drop for ReusedDevice {
    fn drop(&mut self) {
        let inner = self.inner.take().filter(|_| !std::thread::panicking());
        let mut unused = UNUSED.lock().unwrap_or_else(PoisonError::into_inner);
        unused.extend(inner.map(|inner| (self.backend, inner)));
    }
}

impl Device for ReusedDevice {
    fn info(&self) -> &DeviceInfo {
        self.inner().info()
    }

    fn best_method(&self, kernel: Features, primitives: usize) -> (Traversal, Schedule) {
        self.inner().best_method(kernel, primitives)
    }

    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        self.inner_mut().allocate(bytes, what)
    }

    fn upload(&mut self, bytes: &[u8], what: &'static str) -> Result<Buffer, BackendError> {
        self.inner_mut().upload(bytes, what)
    }

    fn joins_arrays(&self) -> bool {
        self.inner().joins_arrays()
    }

    fn allocate_joined(&mut self, bytes: &[u64], what: &'static str) -> Result<Vec<Buffer>, BackendError> {
        self.inner_mut().allocate_joined(bytes, what)
    }

    fn adopt(&mut self, records: &LentRecords) -> Option<Buffer> {
        self.inner_mut().adopt(records)
    }

    fn write(&mut self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError> {
        self.inner_mut().write(to, first, bytes)
    }

    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        self.inner_mut().compile(entry_point, math)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.inner_mut().run(commands) }
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn start(&mut self, commands: Vec<Command<'_>>) -> Result<Started, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.inner_mut().start(commands) }
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn start_with_copy<'a>(
        &mut self,
        commands: Vec<Command<'a>>,
        from: &'a Buffer,
        to: RowTarget<'a>,
    ) -> Result<Started, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.inner_mut().start_with_copy(commands, from, to) }
    }

    fn wait(&mut self, started: Started) -> Result<Vec<Duration>, BackendError> {
        self.inner_mut().wait(started)
    }

    fn second_stream(&self) -> Result<Option<Box<dyn Device>>, BackendError> {
        self.inner().second_stream()
    }

    fn pin(&mut self, memory: &Arc<HostMemory>) {
        self.inner_mut().pin(memory);
    }

    fn is_pinned(&self, bytes: &[u8]) -> bool {
        self.inner().is_pinned(bytes)
    }

    fn unpin(&mut self, memory: &Arc<HostMemory>) {
        self.inner_mut().unpin(memory);
    }
}
