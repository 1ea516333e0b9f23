//! Probes as SPIR-V, passed through or translated by naga, also through WGSL.

use super::{Device, ProbeScene};
use crate::BackendUnderTest;
use bytemuck::Pod;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use trisect::device::BackendError;
use trisect::device::wgpu::Route;
use trisect_kernels::wgsl;
use trisect_probes::record::{Input, Output, ProbeParams};
use trisect_probes::{WORKGROUP, spirv};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingType, Buffer, BufferBindingType, BufferDescriptor, BufferUsages, ComputePipeline,
    ComputePipelineDescriptor, Features, Instance, InstanceDescriptor, MapMode, PipelineLayoutDescriptor,
    PollType, ShaderModule, ShaderModuleDescriptor, ShaderModuleDescriptorPassthrough, ShaderSource,
    ShaderStages,
};

/// The adapter that the other tests use, with a scene uploaded.
pub struct Wgpu {
    shared: Arc<Shared>,
    scene: [Buffer; 10],
}

/// Device and pipelines of a route, shared by all probes, because drivers create a few dozen
/// devices per process, not hundreds.
struct Shared {
    name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    route: Route,
    layout: BindGroupLayout,
    pipelines: Mutex<HashMap<&'static str, ComputePipeline>>,
}

fn failed(message: String) -> BackendError {
    BackendError::Device { backend: "wgpu", action: "probing", message }
}

/// Returns the device of a route, which is created once.
fn shared(route: Route) -> Result<Arc<Shared>, BackendError> {
    static OPEN: Mutex<[Option<Arc<Shared>>; 3]> = Mutex::new([None, None, None]);
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let slot = &mut open[route as usize];
    if let Some(shared) = slot {
        return Ok(shared.clone());
    }
    let made = Arc::new(Shared::open(route)?);
    *slot = Some(made.clone());
    Ok(made)
}

impl Shared {
    fn open(route: Route) -> Result<Self, BackendError> {
        let mut descriptor = InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
        let adapters =
            pollster::block_on(Instance::new(descriptor).enumerate_adapters(wgpu::Backends::all()));
        let index = BackendUnderTest::Wgpu.index();
        let adapter = adapters.get(index).ok_or(BackendError::NoSuchDevice {
            backend: "wgpu",
            index,
            devices: adapters.len(),
        })?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: adapter.features() & Features::PASSTHROUGH_SHADERS,
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|error| failed(error.to_string()))?;
        let entry = |binding, ty| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let storage = |read_only| BufferBindingType::Storage { read_only };
        let mut entries = vec![entry(0, BufferBindingType::Uniform)];
        entries.extend((1..=11).map(|binding| entry(binding, storage(true))));
        entries.push(entry(12, storage(false)));
        let layout =
            device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: None, entries: &entries });
        let name = adapter.get_info().name;
        Ok(Self { name, device, queue, route, layout, pipelines: Mutex::default() })
    }
}

impl Wgpu {
    pub fn open(route: Route, scene: &ProbeScene) -> Result<Self, BackendError> {
        let shared = shared(route)?;
        let records = scene.records();
        let device = &shared.device;
        let scene = [
            store(device, records.spheres),
            store(device, records.nodes),
            store(device, records.materials),
            store(device, records.planars),
            store(device, records.triangles),
            store(device, records.vertices),
            store(device, records.lights),
            store(device, records.textures),
            store(device, records.texels),
            store(device, records.environment),
        ];
        Ok(Self { shared, scene })
    }
}

fn store<T: Pod>(device: &wgpu::Device, records: &[T]) -> Buffer {
    // An empty array is bound as one record that no probe reads.
    let bytes: &[u8] = bytemuck::cast_slice(records);
    let contents: &[u8] = if bytes.is_empty() { &[0; 128] } else { bytes };
    device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage: BufferUsages::STORAGE })
}

fn module(shared: &Shared, probe: &'static str) -> Result<ShaderModule, BackendError> {
    let words = spirv(probe).ok_or_else(|| failed(format!("unknown probe {probe}")))?;
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(words);
    if shared.route == Route::PassThrough && shared.device.features().contains(Features::PASSTHROUGH_SHADERS)
    {
        let entry_point =
            wgpu::PassthroughShaderEntryPoint { name: probe.into(), workgroup_size: (WORKGROUP, 1, 1) };
        // SAFETY: spirv-val accepted the module when it was built; the layout matches its bindings.
        #[allow(unsafe_code, reason = "pass-through skips naga's validation")]
        return Ok(unsafe {
            shared.device.create_shader_module_passthrough(ShaderModuleDescriptorPassthrough {
                label: Some(probe),
                spirv: Some(words.into()),
                entry_points: vec![entry_point].into(),
                ..Default::default()
            })
        });
    }
    let source = match shared.route {
        Route::Wgsl => ShaderSource::Wgsl(wgsl(bytemuck::cast_slice(&words)).map_err(failed)?.into()),
        _ => ShaderSource::SpirV(words.into()),
    };
    Ok(shared.device.create_shader_module(ShaderModuleDescriptor { label: Some(probe), source }))
}

fn pipeline(
    device: &wgpu::Device,
    layout: &BindGroupLayout,
    module: &ShaderModule,
    probe: &str,
) -> ComputePipeline {
    let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(layout)],
        ..Default::default()
    });
    device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(probe),
        layout: Some(&layout),
        module,
        entry_point: Some(probe),
        compilation_options: Default::default(),
        cache: None,
    })
}

impl Device for Wgpu {
    fn name(&self) -> &str {
        &self.shared.name
    }

    fn run(
        &mut self,
        probe: &'static str,
        params: &ProbeParams,
        inputs: &[Input],
    ) -> Result<Vec<Output>, BackendError> {
        let Shared { device, queue, layout, pipelines, .. } = self.shared.as_ref();
        let mut pipelines = pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let pipeline = match pipelines.get(probe) {
            Some(pipeline) => pipeline.clone(),
            None => {
                let pipeline = pipeline(device, layout, &module(&self.shared, probe)?, probe);
                pipelines.insert(probe, pipeline.clone());
                pipeline
            }
        };
        drop(pipelines);
        let params = device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: bytemuck::bytes_of(params),
            usage: BufferUsages::UNIFORM,
        });
        let questions = store(device, inputs);
        let bytes = size_of_val(inputs) / size_of::<Input>() * size_of::<Output>();
        let buffer = |usage| {
            device.create_buffer(&BufferDescriptor {
                label: None,
                size: bytes as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let answers = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let staging = buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let buffers = [&params].into_iter().chain(&self.scene).chain([&questions, &answers]);
        let entries: Vec<_> = (0u32..)
            .zip(buffers)
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries });
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups((inputs.len() as u32).div_ceil(WORKGROUP), 1, 1);
        }
        encoder.copy_buffer_to_buffer(&answers, 0, &staging, 0, bytes as u64);
        queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        staging.slice(..).map_async(MapMode::Read, move |result| {
            let _ = sender.send(result);
        });
        device.poll(PollType::wait_indefinitely()).map_err(|e| failed(e.to_string()))?;
        receiver.recv().map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
        let view = staging.slice(..).get_mapped_range().map_err(|e| failed(e.to_string()))?;
        let mut outputs = vec![Output::default(); inputs.len()];
        bytemuck::cast_slice_mut::<_, u8>(&mut outputs).copy_from_slice(&view);
        Ok(outputs)
    }
}
