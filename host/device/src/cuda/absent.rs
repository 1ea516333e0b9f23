//! CUDA where there is no driver to load: in a browser.

use crate::{BackendError, Device, DeviceInfo};

/// Name of the backend.
pub(crate) const NAME: &str = "cuda";

fn unavailable() -> BackendError {
    BackendError::Unavailable {
        backend: NAME,
        reason: "a browser has no CUDA".to_owned(),
        remedy: "choose `backend` wgpu or cpu".to_owned(),
    }
}

/// Returns why there are no devices.
pub fn devices() -> Result<Vec<DeviceInfo>, BackendError> {
    Err(unavailable())
}

/// Returns why no device can be opened.
pub(crate) fn open(_: Option<usize>) -> Result<Box<dyn Device>, BackendError> {
    Err(unavailable())
}
