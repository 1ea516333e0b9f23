//! Kernels on CUDA: compiled when first used, with a maximum of registers per lane, and launched.

use super::driver::failed;
use super::{Cuda, GRID_LIMIT, MAX_QUEUE, NAME};
use crate::command::handles;
use crate::{BackendError, Dispatch, MathMode};
use cudarc::driver::sys::CUdevice_attribute_enum;
use cudarc::driver::{CudaFunction, CudaSlice, DevicePtr, result};
use cudarc::nvrtc::Ptx;
use std::ffi::c_void;
use trisect_kernels::{EntryPoint, ptx, ptx_name, specialise};

/// Returns a module of one entry point with a maximum of registers per lane. More lanes then fit
/// the device, and values that do not fit the registers spill to memory.
fn limit_registers(ptx: &str, registers: u32) -> String {
    // The first brace after `.entry` begins the body, before which directives of the kernel stand.
    let body = ptx.find(".entry").and_then(|entry| Some(entry + ptx[entry..].find('{')?));
    let (head, body) = ptx.split_at(body.unwrap_or(ptx.len()));
    format!("{head}.maxnreg {registers}\n{body}")
}

impl Cuda {
    /// Returns the kernel of an entry point, specialised for its features. It is compiled once, as
    /// a module of its own, because the driver compiles a whole module before it starts any kernel
    /// of it.
    pub(super) fn kernel(&mut self, of: EntryPoint, math: MathMode) -> Result<CudaFunction, BackendError> {
        if let Some(kernel) = self.kernels.get(&(of, math)) {
            return Ok(kernel.clone());
        }
        let name = ptx_name(of);
        let module = ptx(name, math == MathMode::Fast).ok_or_else(|| BackendError::Device {
            backend: NAME,
            action: "finding the kernel",
            message: format!("the built-in PTX has no entry point {name}"),
        })?;
        let mut source = specialise::ptx(&module, of.features);
        if let Some(limit) = of.registers {
            source = limit_registers(&source, limit);
        }
        let module = self
            .stream
            .context()
            .load_module(Ptx::from_src(source))
            .map_err(failed("compiling the kernels"))?;
        let kernel = module.load_function(name).map_err(failed("finding the kernel"))?;
        self.kernels.insert((of, math), kernel.clone());
        Ok(kernel)
    }

    /// Launches a kernel, and returns before it ends.
    ///
    /// # Safety
    ///
    /// As [`Device::run`](crate::Device::run).
    pub(super) unsafe fn launch(
        &self,
        kernel: &CudaFunction,
        launch: &Dispatch<'_>,
    ) -> Result<(), BackendError> {
        launch.check(NAME)?;
        launch.check_extra(NAME)?;
        let (across, down) = launch.groups();
        if down > GRID_LIMIT {
            return Err(launch.too_long(NAME, GRID_LIMIT));
        }
        let group = launch.entry_point.workgroup();
        let mut grid = (across, down, 1);
        if launch.entry_point.queue {
            let lanes = u64::from(across) * u64::from(down) * u64::from(group.0 * group.1);
            if lanes > MAX_QUEUE {
                let (width, rows) = launch.threads;
                let limit = MAX_QUEUE / u64::from(width);
                return Err(BackendError::TooLong { backend: NAME, width, rows, limit });
            }
            grid = (self.resident_blocks(kernel, launch.entry_point)?.min(across * down), 1, 1);
        }
        let arrays = handles::<CudaSlice<u8>>(launch, NAME)?;
        let mut addresses: Vec<u64> =
            arrays.into_iter().map(|array| array.device_ptr(&self.stream).0).collect();
        // By value: the parameters, and for scenes the lengths of arrays. Then the arrays.
        let values = [launch.params, launch.lengths].into_iter().filter(|value| !value.is_empty());
        let mut arguments: Vec<*mut c_void> = values.map(|value| value.as_ptr().cast_mut().cast()).collect();
        arguments.extend(addresses.iter_mut().map(|address| (&raw mut *address).cast::<c_void>()));
        let stream = self.stream.cu_stream();
        let block = (group.0, group.1, 1);
        // SAFETY: the arguments are those of the entry point (see trisect_kernels), which `check`
        // counted, and the caller's promise.
        unsafe { result::launch_kernel(kernel.cu_function(), grid, block, 0, stream, &mut arguments) }
            .map_err(failed("launching"))
    }

    /// Returns the number of blocks of a kernel that the device holds at the same time, at least 1.
    fn resident_blocks(&self, kernel: &CudaFunction, of: EntryPoint) -> Result<u32, BackendError> {
        let group = of.workgroup();
        let threads = group.0 * group.1;
        let blocks = kernel
            .occupancy_max_active_blocks_per_multiprocessor(threads, 0, None)
            .map_err(failed("asking for the occupancy"))?;
        let processors = self
            .stream
            .context()
            .attribute(CUdevice_attribute_enum::CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT)
            .map_err(failed("asking for an attribute"))?;
        Ok((blocks * processors.unsigned_abs()).max(1))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    /// The limit stands between the arguments and the body, as the grammar of PTX wants it, and
    /// changes nothing else.
    #[test]
    fn registers_are_limited() {
        let module = ptx("render", false).unwrap();
        let limited = limit_registers(&module, 96);
        assert_eq!(limited.matches(".maxnreg 96\n{").count(), 1);
        assert_eq!(limited.replace(".maxnreg 96\n", ""), module);
        assert!(limited.find(".entry render(").unwrap() < limited.find(".maxnreg").unwrap());
    }
}
