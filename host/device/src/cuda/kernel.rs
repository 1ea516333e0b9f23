//! Kernels on CUDA: compiled when first used, with a maximum of registers per lane.

use super::driver::failed;
use super::{Cuda, extract};
use crate::BackendError;
use crate::MathMode;
use cudarc::driver::CudaFunction;
use cudarc::driver::sys::CUdevice_attribute_enum;
use cudarc::nvrtc::Ptx;
use trisect_kernels::{PTX_FAST, PTX_PRECISE, WORKGROUP, is_level, variant_by_name};
use trisect_shared::features::{Features, HEAVY, has_any};

/// Returns the maximum number of registers per lane of a render kernel. More lanes at a time gain
/// more than spilling costs (docs/notebook/kernels-and-schedules.md).
fn registers(features: Features) -> u32 {
    if has_any(features, HEAVY) { 96 } else { 64 }
}

/// Maximum number of registers per lane of a level of the denoiser's filters
/// (docs/notebook/denoising.md).
const LEVEL_REGISTERS: u32 = 96;

impl Cuda {
    /// Returns the kernel of an entry point. It is compiled once, as a module of its own, because
    /// the driver compiles a whole module before it starts any kernel of it.
    pub(super) fn kernel(
        &mut self,
        name: &'static str,
        math: MathMode,
    ) -> Result<CudaFunction, BackendError> {
        if let Some(kernel) = self.kernels.get(&(name, math)) {
            return Ok(kernel.clone());
        }
        let source = if math == MathMode::Fast { PTX_FAST } else { PTX_PRECISE };
        let source = extract::entry(source, name).ok_or_else(|| BackendError::Device {
            backend: "cuda",
            action: "finding the kernel",
            message: format!("the built-in PTX has no entry point {name}"),
        })?;
        let limit = variant_by_name(name).map(|variant| registers(variant.features));
        let source = match limit.or_else(|| is_level(name).then_some(LEVEL_REGISTERS)) {
            Some(limit) => extract::limit_registers(&source, limit),
            None => source,
        };
        let module = self
            .stream
            .context()
            .load_module(Ptx::from_src(source))
            .map_err(failed("compiling the kernels"))?;
        let kernel = module.load_function(name).map_err(failed("finding the kernel"))?;
        self.kernels.insert((name, math), kernel.clone());
        Ok(kernel)
    }

    /// Returns the number of blocks of a kernel that the device holds at the same time, at least 1.
    pub(super) fn resident_blocks(&self, kernel: &CudaFunction) -> Result<u32, BackendError> {
        let threads = WORKGROUP.0 * WORKGROUP.1;
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
