//! List of backends and their devices.

use crate::error;
use crate::lifecycle::Running;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use trisect::device;

/// List the backends: each a dict with backend, devices (a list of dicts with index, name, kind and
/// details) and error, the reason why there are none.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let _running = Running::begin()?;
    let found = error::guarded(py, || Ok(device::list()))?;
    let all = PyList::empty(py);
    for (backend, devices) in found {
        let entry = PyDict::new(py);
        entry.set_item("backend", backend)?;
        let list = PyList::empty(py);
        match devices {
            Ok(devices) => {
                for device in devices {
                    let of = PyDict::new(py);
                    of.set_item("index", device.index)?;
                    of.set_item("name", device.name)?;
                    of.set_item("kind", format!("{:?}", device.kind).to_lowercase())?;
                    of.set_item("details", device.details)?;
                    list.append(of)?;
                }
                entry.set_item("error", py.None())?;
            }
            Err(error) => entry.set_item("error", error.to_string())?,
        }
        entry.set_item("devices", list)?;
        all.append(entry)?;
    }
    Ok(all)
}
