//! A backend that counts what is written to its memory.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use trisect::device::cpu::Cpu;
use trisect::device::{BackendError, Buffer, Command, Device, DeviceInfo, MathMode};
use trisect::render::{Schedule, Traversal};
use trisect_kernels::EntryPoint;
use trisect_shared::features::Features;

/// Bytes that were written, by the purpose of the memory as errors name it.
#[derive(Clone, Default)]
pub struct WrittenBytes(Arc<Mutex<BTreeMap<&'static str, u64>>>);

impl WrittenBytes {
    /// Returns the bytes that were written since the last call.
    ///
    /// # Panics
    ///
    /// If another thread panicked while it counted.
    pub fn take(&self) -> BTreeMap<&'static str, u64> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
}

/// The CPU backend with memory of its own, as a GPU has: it reads no memory of the host in place.
pub struct CountingBackend {
    inner: Cpu,
    traversal: Traversal,
    /// Purpose of the memory at each address.
    purposes: HashMap<usize, &'static str>,
    written: WrittenBytes,
}

impl CountingBackend {
    /// Opens the backend, whose scenes are traced by `traversal`.
    ///
    /// # Panics
    ///
    /// If the CPU backend does not open.
    pub fn new(traversal: Traversal) -> Self {
        let (inner, purposes) = (Cpu::open(None).unwrap(), HashMap::new());
        Self { inner, traversal, purposes, written: WrittenBytes::default() }
    }

    /// Returns the counts.
    pub fn written(&self) -> WrittenBytes {
        self.written.clone()
    }
}

impl Device for CountingBackend {
    fn info(&self) -> &DeviceInfo {
        self.inner.info()
    }

    fn best_method(&self, _: Features, _: usize) -> (Traversal, Schedule) {
        (self.traversal, Schedule::Regenerate)
    }

    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        let buffer = self.inner.allocate(bytes, what)?;
        self.purposes.insert(buffer.address(), what);
        Ok(buffer)
    }

    fn write(&mut self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError> {
        if !bytes.is_empty() {
            let what = self.purposes.get(&to.address()).copied().unwrap_or("memory of unknown purpose");
            *self.written.0.lock().unwrap().entry(what).or_default() += bytes.len() as u64;
        }
        self.inner.write(to, first, bytes)
    }

    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        self.inner.compile(entry_point, math)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.inner.run(commands) }
    }
}
