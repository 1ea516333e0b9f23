//! Probes as PTX.
#![allow(unsafe_code, reason = "launches kernels")]

use super::{Device, ProbeScene};
use bytemuck::Pod;
use cudarc::driver::{
    CudaContext, CudaModule, CudaSlice, CudaStream, DeviceRepr, DriverError, LaunchConfig, PushKernelArg,
};
use cudarc::nvrtc::Ptx;
use std::sync::Arc;
use trisect::device::{BackendError, cuda};
use trisect_kernels::specialise;
use trisect_probes::record::{Input, Output, ProbeParams};
use trisect_probes::{PTX_PRECISE, WORKGROUP};
use trisect_shared::scene::SceneLengths;

/// The first CUDA device.
pub struct Cuda {
    name: String,
    stream: Arc<CudaStream>,
    module: Arc<CudaModule>,
    lengths: Argument<SceneLengths>,
    arrays: [CudaSlice<u8>; 10],
}

#[repr(transparent)]
#[derive(Clone, Copy)]
struct Argument<T>(T);

// SAFETY: plain data with repr(C), of the type that the kernel declares.
unsafe impl<T: Copy> DeviceRepr for Argument<T> {}

fn failed(error: DriverError) -> BackendError {
    BackendError::Device { backend: "cuda", action: "probing", message: format!("{error:?}") }
}

impl Cuda {
    pub fn open(scene: &ProbeScene) -> Result<Self, BackendError> {
        // Devices are listed first, because cudarc panics where there is no driver.
        let name = cuda::devices()?.into_iter().next().map(|device| device.name).unwrap_or_default();
        let context = CudaContext::new(0).map_err(failed)?;
        let stream = context.default_stream();
        let module = context.load_module(Ptx::from_src(specialise::ptx(PTX_PRECISE, 0))).map_err(failed)?;
        let scene = scene.records();
        let lengths = Argument(SceneLengths::of(&scene));
        let arrays = [
            store(&stream, scene.spheres)?,
            store(&stream, scene.nodes)?,
            store(&stream, scene.materials)?,
            store(&stream, scene.planars)?,
            store(&stream, scene.triangles)?,
            store(&stream, scene.vertices)?,
            store(&stream, scene.lights)?,
            store(&stream, scene.textures)?,
            store(&stream, scene.texels)?,
            store(&stream, scene.environment)?,
        ];
        Ok(Self { name, stream, module, lengths, arrays })
    }
}

fn store<T: Pod>(stream: &Arc<CudaStream>, records: &[T]) -> Result<CudaSlice<u8>, BackendError> {
    let bytes: &[u8] = bytemuck::cast_slice(records);
    stream.clone_htod(if bytes.is_empty() { [0].as_slice() } else { bytes }).map_err(failed)
}

impl Device for Cuda {
    fn name(&self) -> &str {
        &self.name
    }

    fn run(
        &mut self,
        probe: &'static str,
        params: &ProbeParams,
        inputs: &[Input],
    ) -> Result<Vec<Output>, BackendError> {
        let kernel = self.module.load_function(probe).map_err(failed)?;
        let questions = store(&self.stream, inputs)?;
        let mut answers =
            self.stream.alloc_zeros::<u8>(inputs.len() * size_of::<Output>()).map_err(failed)?;
        let config = LaunchConfig {
            grid_dim: (params.count.div_ceil(WORKGROUP), 1, 1),
            block_dim: (WORKGROUP, 1, 1),
            shared_mem_bytes: 0,
        };
        let params = Argument(*params);
        let mut arguments = self.stream.launch_builder(&kernel);
        arguments.arg(&params).arg(&self.lengths);
        for array in &self.arrays {
            arguments.arg(array);
        }
        arguments.arg(&questions).arg(&mut answers);
        // SAFETY: the arguments are those of every entry point (see trisect_probes); both buffers
        // hold `count` records.
        unsafe { arguments.launch(config) }.map_err(failed)?;
        let mut outputs = vec![Output::default(); inputs.len()];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut outputs);
        self.stream.memcpy_dtoh(&answers, bytes).map_err(failed)?;
        self.stream.synchronize().map_err(failed)?;
        Ok(outputs)
    }
}
