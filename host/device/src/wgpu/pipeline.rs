//! Compiles entry points of the SPIR-V kernels to wgpu compute pipelines, on first use, and binds
//! their buffers. Entry points with the same numbers of arrays share a bind group layout.

use super::Route;
use super::adapter::Gpu;
use super::scene_bindings::{buffers, params_bytes, reads, writes};
use super::storage_params::storage_params;
use crate::{BackendError, DeviceKind, Dispatch, MathMode};
use std::collections::HashMap;
use std::num::NonZero;
use trisect_kernels::{EntryPoint, specialise, spirv};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBinding, BufferBindingType,
    ComputePipeline, ComputePipelineDescriptor, Device, Features, PipelineLayout, PipelineLayoutDescriptor,
    ShaderModule, ShaderModuleDescriptor, ShaderModuleDescriptorPassthrough, ShaderSource, ShaderStages,
};

/// Bytes from the launch parameters of one launch to those of the next, in their common buffer: at
/// least any record's size, and a multiple of any device's alignment of uniforms.
pub(super) const PARAMS_STRIDE: u64 = 512;

const _: () = assert!(
    trisect_kernels::MAX_PARAMS + size_of::<trisect_shared::scene::FirstRows>() <= PARAMS_STRIDE as usize
);

/// Bind group layout, and the pipeline layout with only this group.
struct Layout {
    bindings: BindGroupLayout,
    pipeline: PipelineLayout,
}

/// Layouts by numbers of arrays, and the pipelines compiled so far, by entry point with its
/// features, and by math mode.
pub(super) struct Pipelines {
    route: Route,
    /// True if launch parameters are in a storage buffer; see [`storage_params`].
    in_storage: bool,
    layouts: HashMap<(usize, usize), Layout>,
    compiled: HashMap<(EntryPoint, MathMode), ComputePipeline>,
}

impl Layout {
    /// Creates a layout of a buffer of launch parameters, `read` read-only arrays and `written`
    /// writable ones, in the order of their bindings.
    fn new(device: &Device, params: BufferBindingType, read: usize, written: usize) -> Self {
        let entry = |binding, ty| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let arrays = |read_only, count| std::iter::repeat_n(BufferBindingType::Storage { read_only }, count);
        let kinds = [params].into_iter().chain(arrays(true, read)).chain(arrays(false, written));
        let entries: Vec<_> = (0u32..).zip(kinds).map(|(binding, kind)| entry(binding, kind)).collect();
        let bindings =
            device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: None, entries: &entries });
        let pipeline = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&bindings)],
            ..Default::default()
        });
        Self { bindings, pipeline }
    }
}

impl Pipelines {
    /// Returns no pipelines yet, for a device of this kind.
    pub fn new(route: Route, kind: DeviceKind) -> Self {
        let in_storage = kind == DeviceKind::SoftwareGpu;
        Self { route, in_storage, layouts: HashMap::new(), compiled: HashMap::new() }
    }

    /// Returns whether the driver gets SPIR-V, without translation by naga.
    pub fn pass_through(&self, gpu: &Gpu) -> bool {
        self.route == Route::PassThrough && gpu.device.features().contains(Features::PASSTHROUGH_SHADERS)
    }

    /// Compiles an entry point unless that was done before.
    pub fn compile(&mut self, gpu: &Gpu, of: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        if self.compiled.contains_key(&(of, math)) {
            return Ok(());
        }
        let layout = self.layouts.entry((reads(of), writes(of))).or_insert_with(|| {
            let params = match self.in_storage {
                true => BufferBindingType::Storage { read_only: true },
                false => BufferBindingType::Uniform,
            };
            Layout::new(&gpu.device, params, reads(of), writes(of))
        });
        let module = module(&gpu.device, (self.route, self.in_storage), of, math)?;
        let pipeline = gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
            label: Some(of.name),
            layout: Some(&layout.pipeline),
            module: &module,
            entry_point: Some(of.name),
            compilation_options: Default::default(),
            cache: None,
        });
        gpu.settle("compiling the kernels")?;
        self.compiled.insert((of, math), pipeline);
        Ok(())
    }

    /// Returns the pipeline of a launch, which [`Pipelines::compile`] made, and its bindings:
    /// launch parameters at a place of `params`, then the arrays.
    pub fn bind(
        &self,
        device: &Device,
        launch: &Dispatch<'_>,
        (params, place): (&Buffer, u64),
    ) -> Result<(&ComputePipeline, BindGroup), BackendError> {
        let of = launch.entry_point;
        let compiled = self.compiled.get(&(of, launch.math));
        let (Some(pipeline), Some(layout)) = (compiled, self.layouts.get(&(reads(of), writes(of)))) else {
            return Err(failed("rendering", format!("the kernel {} was not compiled", of.name)));
        };
        let size = NonZero::new(params_bytes(of) as u64);
        let params = BufferBinding { buffer: params, offset: place, size };
        let arrays = buffers(launch)?.into_iter().map(Buffer::as_entire_binding);
        let resources = [BindingResource::Buffer(params)].into_iter().chain(arrays);
        let entries: Vec<BindGroupEntry> =
            (0u32..).zip(resources).map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
        let descriptor = BindGroupDescriptor { label: None, layout: &layout.bindings, entries: &entries };
        Ok((pipeline, device.create_bind_group(&descriptor)))
    }
}

/// Returns the module without its `NoContraction` decorations: the driver may then fuse a product
/// and a sum, and reassociate.
fn contractible(words: &[u32]) -> Vec<u32> {
    const HEADER: usize = 5;
    const NO_CONTRACTION: [u32; 2] = [3 << 16 | 71, 42]; // OpDecorate of three words, and the decoration
    let (header, mut rest) = words.split_at(HEADER.min(words.len()));
    let mut kept = header.to_vec();
    while let Some(&first) = rest.first() {
        let (instruction, after) = rest.split_at(((first >> 16).max(1) as usize).min(rest.len()));
        if first != NO_CONTRACTION[0] || instruction.get(2) != Some(&NO_CONTRACTION[1]) {
            kept.extend(instruction);
        }
        rest = after;
    }
    kept
}

fn failed(action: &'static str, message: String) -> BackendError {
    BackendError::Device { backend: "wgpu", action, message }
}

/// Creates the shader module of an entry point, specialised for its features.
fn module(
    device: &Device,
    (route, in_storage): (Route, bool),
    of: EntryPoint,
    math: MathMode,
) -> Result<ShaderModule, BackendError> {
    let module = spirv(of.name).ok_or_else(|| {
        failed("finding the kernel", format!("no built-in SPIR-V has the entry point {}", of.name))
    })?;
    let mut words: Vec<u32> = bytemuck::pod_collect_to_vec(module);
    specialise::spirv(&mut words, of.features);
    if math == MathMode::Fast {
        words = contractible(&words);
    }
    if in_storage {
        words = storage_params(&words);
    }
    if route == Route::PassThrough && device.features().contains(Features::PASSTHROUGH_SHADERS) {
        let threads = of.workgroup();
        let entry_points = vec![wgpu::PassthroughShaderEntryPoint {
            name: of.name.into(),
            workgroup_size: (threads.0, threads.1, 1),
        }];
        // SAFETY: spirv-val accepted the module when it was built, and a test compares the embedded
        // bytes with the manifest; `contractible` only removes decorations, and `storage_params`
        // moves a block that the layout has at the same place. Callers of
        // `Pipelines::compile` give the numbers of bindings that the module declares. The host
        // proves the indices that kernels use: see `trisect_shared::buffer`.
        #[allow(unsafe_code, reason = "pass-through skips naga's validation")]
        let module = unsafe {
            device.create_shader_module_passthrough(ShaderModuleDescriptorPassthrough {
                label: Some("trisect"),
                spirv: Some(words.into()),
                entry_points: entry_points.into(),
                ..Default::default()
            })
        };
        return Ok(module);
    }
    let source = match route {
        #[cfg(any(feature = "wgsl", target_family = "wasm"))]
        Route::Wgsl => {
            let text = trisect_kernels::wgsl(bytemuck::cast_slice(&words));
            ShaderSource::Wgsl(text.map_err(|message| failed("translating a kernel", message))?.into())
        }
        _ => ShaderSource::SpirV(words.into()),
    };
    Ok(device.create_shader_module(ShaderModuleDescriptor { label: Some("trisect"), source }))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn contractible_removes_only_no_contraction() {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(spirv("render").unwrap());
        let decorations =
            |words: &[u32]| words.windows(3).filter(|w| w[0] == 3 << 16 | 71 && w[2] == 42).count();
        let fast = contractible(&words);
        assert!(decorations(&words) > 1000 && decorations(&fast) == 0);
        assert_eq!(words.len() - fast.len(), 3 * decorations(&words));
        assert!(contractible(&[]).is_empty());
    }
}
