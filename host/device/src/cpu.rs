//! CPU device: runs the kernels natively, on a pool of threads.

#[cfg(target_family = "wasm")]
mod helped;
mod helper;
mod instructions;
mod memory;

pub use helper::Helper;
pub use instructions::InstructionSet;

use memory::Memory;

use crate::command::{check_range, check_rows, handle, handles, misuse};
use crate::{
    BackendError, Buffer, Command, Device, DeviceInfo, DeviceKind, Dispatch, HostMemory, LentRecords,
};
use crate::{MathMode, RowTarget, Schedule, Traversal};
use rayon::prelude::*;
use std::time::Duration;
use trisect_kernels::EntryPoint;
use trisect_kernels::native::{Arguments, Array, Kernel, is_by_rows, native};
use trisect_shared::features::Features;
use trisect_system::threads::Pool;
use web_time::Instant;

/// Name of the backend.
pub(crate) const NAME: &str = "cpu";

/// Number of threads of a launch, next to each other in a row, that make a task of the pool.
const TASK: u32 = 64;

/// Number of pixels of a row in a task of a filter by rows, which also reads those around them.
const ROW_TASK: u32 = 512;

/// Number of bytes that a task of the pool fills.
const FILL: usize = 1 << 20;

/// CPU of this machine, with a thread pool.
pub struct Cpu {
    info: DeviceInfo,
    instructions: InstructionSet,
    pool: Pool,
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
            let message = format!("this processor has no {}", instructions.name());
            return Err(BackendError::Device { backend: NAME, action: "opening the device", message });
        }
        let pool = trisect_system::threads::pool(threads, "trisect-cpu")?;
        #[cfg(target_family = "wasm")]
        let threads = 1 + helped::count() as usize;
        #[cfg(not(target_family = "wasm"))]
        let threads = pool.threads();
        let info = describe_with(threads, instructions);
        Ok(Self { info, instructions, pool })
    }

    /// Returns the kernel of an entry point for the device's instruction set; for the baseline if
    /// it has no other, or if it is a render kernel that traces the binary BVH.
    fn kernel(&self, entry_point: EntryPoint) -> Result<Kernel, BackendError> {
        let native = native(entry_point).ok_or_else(|| misuse(NAME, "there is no such kernel"))?;
        let kernel = match self.instructions {
            InstructionSet::Baseline => None,
            InstructionSet::Avx2 => native.avx2,
            InstructionSet::Avx512 => native.avx512,
        };
        if entry_point.extra > 0 {
            return kernel.ok_or_else(|| misuse(NAME, "no kernel for this processor traces the wide BVH"));
        }
        Ok(kernel.filter(|_| is_by_rows(entry_point.name)).unwrap_or(native.baseline))
    }

    /// Runs a launch. Returns its time.
    ///
    /// # Safety
    ///
    /// As [`Device::run`].
    #[allow(unsafe_code, reason = "kernels answer for nothing that their caller hands them")]
    unsafe fn dispatch(&self, launch: &Dispatch<'_>) -> Result<Duration, BackendError> {
        let start = Instant::now();
        launch.check(NAME)?;
        if launch.math == MathMode::Fast {
            return Err(BackendError::NoFastMath { backend: NAME });
        }
        let kernel = self.kernel(launch.entry_point)?;
        let of = launch.entry_point;
        let memories = handles::<Memory>(launch, NAME)?;
        let arrays: Vec<Array> = launch
            .arrays
            .iter()
            .zip(&memories)
            .map(|(buffer, memory)| Array { first: memory.first(), bytes: buffer.bytes() as usize })
            .collect();
        let arguments = Arguments { params: launch.params, arrays: &arrays, features: of.features };
        let (across, down) = launch.threads;
        memories.iter().skip(of.reads).take(of.writes).for_each(|memory| memory.change());
        #[cfg(target_family = "wasm")]
        // SAFETY: the caller's promise.
        if unsafe { helped::dispatch(of, kernel, &arguments, &memories, down) } {
            return Ok(start.elapsed());
        }
        let task = if is_by_rows(of.name) { ROW_TASK } else { TASK };
        let of_row = across.div_ceil(task);
        (0..u64::from(of_row) * u64::from(down)).into_par_iter().for_each(|index| {
            let (y, first) = ((index / u64::from(of_row)) as u32, (index % u64::from(of_row)) as u32 * task);
            // SAFETY: the caller's promise; each thread of the launch is part of one task.
            unsafe { kernel(&arguments, first..across.min(first.saturating_add(task)), y) };
        });
        Ok(start.elapsed())
    }
}

/// Describes this machine's processor, with the best of its instruction sets.
pub fn describe(threads: usize) -> DeviceInfo {
    describe_with(threads, InstructionSet::best())
}

fn describe_with(threads: usize, instructions: InstructionSet) -> DeviceInfo {
    let mut system = sysinfo::System::new();
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    let name = system.cpus().first().map(|cpu| cpu.brand().trim().to_owned()).filter(|name| !name.is_empty());
    DeviceInfo {
        backend: "cpu",
        index: 0,
        name: name.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        kind: DeviceKind::Cpu,
        details: format!("{threads} thread{}, {}", if threads == 1 { "" } else { "s" }, instructions.name()),
        timer: "wall clock",
    }
}

/// Returns the memory of a buffer that commands may write to.
fn writable(buffer: &Buffer) -> Result<&Memory, BackendError> {
    match handle::<Memory>(buffer, NAME)? {
        memory if memory.is_lent() => Err(misuse(NAME, "the buffer is the scene's own memory")),
        memory => {
            memory.change();
            Ok(memory)
        }
    }
}

/// Lends bytes of a buffer.
///
/// # Safety
///
/// The buffer has these bytes, and nothing else accesses them meanwhile.
#[allow(unsafe_code, reason = "buffers are addresses")]
#[allow(clippy::mut_from_ref, reason = "the caller's promise")]
unsafe fn bytes(memory: &HostMemory, first: u64, count: u64) -> &mut [u8] {
    // SAFETY: the caller's promise; the memory was zeros when it was allocated.
    unsafe { std::slice::from_raw_parts_mut(memory.first().add(first as usize), count as usize) }
}

impl Device for Cpu {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn best_method(&self, _kernel: Features, _primitives: usize) -> (Traversal, Schedule) {
        let traversal = match self.instructions {
            InstructionSet::Baseline => Traversal::Stack,
            InstructionSet::Avx2 | InstructionSet::Avx512 => Traversal::Wide,
        };
        (traversal, Schedule::Regenerate)
    }

    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        let too_large = |_| BackendError::TooLarge { backend: NAME, what, needed: bytes, limit: MAX_BYTES };
        let count = usize::try_from(bytes).map_err(too_large)?;
        Ok(Buffer::new(Memory::of(HostMemory::new(count)), bytes))
    }

    fn adopt(&mut self, records: &LentRecords) -> Option<Buffer> {
        let bytes = records.bytes().len() as u64;
        Some(Buffer::new(Memory::of(HostMemory::lent(records.clone())), bytes))
    }

    #[allow(unsafe_code, reason = "buffers are addresses")]
    fn write(&mut self, to: &Buffer, first: u64, from: &[u8]) -> Result<(), BackendError> {
        check_range(NAME, to, first, from.len() as u64)?;
        // SAFETY: the range was checked, and no launch runs outside of `run`.
        let to = unsafe { bytes(writable(to)?, first, from.len() as u64) };
        self.pool.install(|| {
            to.par_chunks_mut(FILL).zip(from.par_chunks(FILL)).for_each(|(to, from)| to.copy_from_slice(from))
        });
        Ok(())
    }

    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        match math {
            MathMode::Precise => self.kernel(entry_point).map(|_| ()),
            MathMode::Fast => Err(BackendError::NoFastMath { backend: NAME }),
        }
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        self.pool.install(|| {
            let mut times = Vec::new();
            for command in commands {
                match command {
                    Command::Fill { buffer, first, bytes: count, ones } => {
                        check_range(NAME, buffer, first, count)?;
                        // SAFETY: the range was checked, and commands run one after another.
                        let bytes = unsafe { bytes(writable(buffer)?, first, count) };
                        let value = if ones { u8::MAX } else { 0 };
                        bytes.par_chunks_mut(FILL).for_each(|part| part.fill(value));
                    }
                    Command::Copy { from, to, bytes: count } => {
                        check_range(NAME, from, 0, count)?;
                        check_range(NAME, to, 0, count)?;
                        let (from, to) = (handle::<Memory>(from, NAME)?, writable(to)?);
                        // SAFETY: the ranges were checked, and `copy` allows that they overlap.
                        unsafe { std::ptr::copy(from.first(), to.first(), count as usize) };
                    }
                    Command::Dispatch(launch) => {
                        // SAFETY: the caller's promise.
                        times.push(unsafe { self.dispatch(&launch) }?);
                    }
                    Command::Read { from, to } => read(from, to)?,
                }
            }
            Ok(times)
        })
    }
}

/// Maximum number of bytes of a buffer.
const MAX_BYTES: u64 = isize::MAX as u64;

/// Copies rows from a buffer.
#[allow(unsafe_code, reason = "buffers are addresses")]
fn read(from: &Buffer, mut to: RowTarget<'_>) -> Result<(), BackendError> {
    check_rows(NAME, from, &to)?;
    // SAFETY: no command that writes runs meanwhile.
    let bytes: &[u8] = unsafe { bytes(handle::<Memory>(from, NAME)?, 0, from.bytes()) };
    let row = to.row_bytes();
    to.each_row().into_par_iter().for_each(|(y, to)| {
        let first = y as usize * row;
        to.copy_from_slice(&bytes[first..first + row]);
    });
    Ok(())
}
