//! NVIDIA's driver and its devices. The driver's library is loaded at run time.

use crate::{BackendError, DeviceInfo, DeviceKind};
use cudarc::driver::{CudaContext, DriverError, result, sys};
use trisect_system::memory;

/// Minimum CUDA version that the driver must support, as 1000 · major + 10 · minor: the oldest with
/// all functions that this program calls.
const MIN_DRIVER: i32 = 12_000;

pub(super) fn failed(action: &'static str) -> impl Fn(DriverError) -> BackendError {
    move |error| {
        let text = error.error_string().map(|text| text.to_string_lossy().into_owned());
        BackendError::Device {
            backend: "cuda",
            action,
            message: text.unwrap_or_else(|_| format!("{error:?}")),
        }
    }
}

pub(super) fn unavailable(reason: String, remedy: &str) -> BackendError {
    BackendError::Unavailable { backend: "cuda", reason, remedy: remedy.to_owned() }
}

/// Loads the driver and returns the number of its devices. Must come before any other call of
/// cudarc, which panics if the library or one of its functions is missing.
pub(super) fn probe() -> Result<usize, BackendError> {
    let install = "install NVIDIA's driver, version 525 or newer, or choose another `backend`";
    // SAFETY: only tries to open the library.
    if !unsafe { sys::is_culib_present() } {
        return Err(unavailable("NVIDIA's driver library (libcuda) is not installed".to_owned(), install));
    }
    let mut version = 0;
    // SAFETY: writes one integer; every driver has this function.
    unsafe { sys::cuDriverGetVersion(&raw mut version) }
        .result()
        .map_err(failed("asking for the version"))?;
    if version < MIN_DRIVER {
        let reason =
            format!("the driver supports CUDA {}.{}, 12.0 is needed", version / 1000, version % 1000 / 10);
        return Err(unavailable(reason, install));
    }
    result::init().map_err(|error| {
        let text = error.error_string().map(|text| text.to_string_lossy().into_owned());
        unavailable(
            format!("the driver does not start: {}", text.unwrap_or_else(|_| format!("{error:?}"))),
            "`nvidia-smi` says more; without an NVIDIA GPU choose another `backend`",
        )
    })?;
    match CudaContext::device_count().map_err(failed("counting devices"))? {
        0 => Err(unavailable(
            "the driver sees no device".to_owned(),
            "check CUDA_VISIBLE_DEVICES and `nvidia-smi`",
        )),
        count => Ok(count as usize),
    }
}

/// Returns all CUDA devices, or why there are none.
pub fn devices() -> Result<Vec<DeviceInfo>, BackendError> {
    (0..probe()?).map(describe).collect()
}

pub(super) fn describe(index: usize) -> Result<DeviceInfo, BackendError> {
    let device = result::device::get(index as i32).map_err(failed("opening the device"))?;
    let name = result::device::get_name(device).map_err(failed("asking for the name"))?;
    // SAFETY: `device` comes from the driver.
    let bytes = unsafe { result::device::total_mem(device) }.map_err(failed("asking for the memory"))?;
    let attribute = |which| {
        // SAFETY: `device` comes from the driver.
        unsafe { result::device::get_attribute(device, which) }.map_err(failed("asking for an attribute"))
    };
    use sys::CUdevice_attribute_enum as Attribute;
    let major = attribute(Attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR)?;
    let minor = attribute(Attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR)?;
    let mut version = 0;
    // SAFETY: writes one integer; every driver has this function.
    unsafe { sys::cuDriverGetVersion(&raw mut version) }
        .result()
        .map_err(failed("asking for the version"))?;
    let details = format!(
        "compute capability {major}.{minor}, {}, driver for CUDA {}.{}",
        memory::display(bytes as u64),
        version / 1000,
        version % 1000 / 10
    );
    Ok(DeviceInfo { backend: "cuda", index, name, kind: DeviceKind::Gpu, details, timer: "CUDA events" })
}
