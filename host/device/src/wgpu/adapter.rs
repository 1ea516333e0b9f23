//! Adapters of wgpu, and the device opened on one, whose errors are kept instead of panicking.

use super::futures::block_on;
use crate::{BackendError, DeviceInfo, DeviceKind};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use wgpu::{
    Adapter, Backend, Backends, DeviceDescriptor, DeviceType, Features, Instance, InstanceDescriptor, Queue,
};

/// Open device and its queue.
pub(super) struct Gpu {
    pub device: wgpu::Device,
    pub queue: Queue,
    /// First error since the last [`Gpu::check`]; wgpu's own handler would panic.
    error: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Returns an error if wgpu reported one since the last call.
    pub fn check(&self, action: &'static str) -> Result<(), BackendError> {
        match self.error.lock().unwrap_or_else(PoisonError::into_inner).take() {
            None => Ok(()),
            Some(message) => Err(BackendError::Device { backend: "wgpu", action, message }),
        }
    }
}

/// The only instance: some drivers refuse further ones after about thirty in one process, even
/// when the former are gone.
static INSTANCE: LazyLock<Instance> = LazyLock::new(|| {
    let mut descriptor = InstanceDescriptor::new_without_display_handle();
    descriptor.backends = Backends::VULKAN | Backends::METAL | Backends::DX12 | Backends::BROWSER_WEBGPU;
    Instance::new(descriptor)
});

#[cfg(not(target_family = "wasm"))]
fn adapters() -> Vec<Adapter> {
    block_on(INSTANCE.enumerate_adapters(Backends::all()))
}

/// Returns the adapter that the browser chooses, which is the only one that it shows.
#[cfg(target_family = "wasm")]
fn adapters() -> Vec<Adapter> {
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..Default::default()
    };
    block_on(INSTANCE.request_adapter(&options)).into_iter().collect()
}

/// Returns the features that a device of this adapter is opened with.
///
/// Pass-through hands a shader to the driver in the language of its API, and the kernels are
/// SPIR-V. Metal and Direct3D 12 offer the same feature for other languages. A browser's timestamps
/// are coarser than its clock.
fn features(backend: Backend, offered: Features) -> Features {
    match backend {
        Backend::Vulkan => offered & (Features::PASSTHROUGH_SHADERS | Features::TIMESTAMP_QUERY),
        Backend::BrowserWebGpu => Features::empty(),
        _ => offered & Features::TIMESTAMP_QUERY,
    }
}

fn describe(index: usize, adapter: &Adapter) -> DeviceInfo {
    let info = adapter.get_info();
    let kind = if info.device_type == DeviceType::Cpu { DeviceKind::SoftwareGpu } else { DeviceKind::Gpu };
    let details: Vec<String> = [format!("{:?}", info.backend), info.driver, info.driver_info]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect();
    DeviceInfo {
        backend: "wgpu",
        index,
        name: info.name,
        kind,
        details: details.join(", "),
        timer: "timestamp queries",
    }
}

#[cfg(target_family = "wasm")]
fn none() -> BackendError {
    BackendError::Unavailable {
        backend: "wgpu",
        reason: "the browser offers no WebGPU adapter".to_owned(),
        remedy: "use a browser with WebGPU, or render on the CPU".to_owned(),
    }
}

#[cfg(not(target_family = "wasm"))]
fn none() -> BackendError {
    BackendError::Unavailable {
        backend: "wgpu",
        reason: "no Vulkan, Metal or Direct3D 12 adapter was found".to_owned(),
        remedy:
            "install a graphics driver with Vulkan (and its loader, Debian: libvulkan1), or Mesa's software \
                 adapter (Debian: mesa-vulkan-drivers), or choose another `backend`"
                .to_owned(),
    }
}

/// Returns all adapters, or why there are none.
pub fn devices() -> Result<Vec<DeviceInfo>, BackendError> {
    let devices: Vec<DeviceInfo> = adapters().iter().enumerate().map(|(i, a)| describe(i, a)).collect();
    if devices.is_empty() { Err(none()) } else { Ok(devices) }
}

/// Opens the adapter with this index, or the best hardware one.
pub(super) fn open(index: Option<usize>) -> Result<(DeviceInfo, Gpu), BackendError> {
    let adapters = adapters();
    if adapters.is_empty() {
        return Err(none());
    }
    let index = match index {
        Some(index) => index,
        None => best(&adapters)?,
    };
    let Some(adapter) = adapters.get(index) else {
        return Err(BackendError::NoSuchDevice { backend: "wgpu", index, devices: adapters.len() });
    };
    let (device, queue) = block_on(adapter.request_device(&DeviceDescriptor {
        label: Some("trisect"),
        required_features: features(adapter.get_info().backend, adapter.features()),
        required_limits: adapter.limits(), // the defaults are far below what hardware allows
        ..Default::default()
    }))
    .map_err(|error| BackendError::Device {
        backend: "wgpu",
        action: "opening the device",
        message: error.to_string(),
    })?;
    let error = Arc::new(Mutex::new(None));
    let keep = {
        let error = error.clone();
        move |message: String| {
            error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(message);
        }
    };
    let lost = keep.clone();
    device.on_uncaptured_error(Arc::new(move |error| keep(error.to_string())));
    device.set_device_lost_callback(move |reason, message| {
        if reason != wgpu::DeviceLostReason::Destroyed {
            lost(format!("the device was lost: {message}"));
        }
    });
    Ok((describe(index, adapter), Gpu { device, queue, error }))
}

/// Returns the index of the best adapter: discrete before integrated before others, and never a
/// software adapter.
fn best(adapters: &[Adapter]) -> Result<usize, BackendError> {
    let rank = |kind| match kind {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    };
    let kinds = adapters.iter().map(|adapter| adapter.get_info().device_type).enumerate();
    match kinds.min_by_key(|&(_, kind)| rank(kind)) {
        Some((index, kind)) if kind != DeviceType::Cpu => Ok(index),
        _ => Err(BackendError::Unavailable {
            backend: "wgpu",
            reason: "there are software adapters only, which are slower than `backend` cpu".to_owned(),
            remedy: format!(
                "to use {} nevertheless, pass `backend` wgpu `device` 0",
                adapters[0].get_info().name
            ),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::features;
    use wgpu::{Backend, Features};

    #[test]
    fn only_vulkan_takes_spirv_as_it_is() {
        let all = Features::all();
        assert!(features(Backend::Vulkan, all).contains(Features::PASSTHROUGH_SHADERS));
        for other in [Backend::Metal, Backend::Dx12] {
            assert_eq!(features(other, all), Features::TIMESTAMP_QUERY, "{other:?}");
        }
        assert!(features(Backend::Vulkan, Features::empty()).is_empty());
        assert!(features(Backend::BrowserWebGpu, all).is_empty());
    }
}
