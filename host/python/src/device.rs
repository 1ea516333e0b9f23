//! Devices: the choice among arguments, and the list of all.

use crate::error::{self, Facts};
use crate::lifecycle::Running;
use crate::words::word;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use trisect::device::{self, Choice, Selection};
use trisect::error::Error;
use trisect::settings::SettingsError;
use trisect::threads::{MAX_THREADS, start_shared};

/// Backends by name.
const BACKENDS: [(&str, Choice); 4] =
    [("auto", Choice::Auto), ("cpu", Choice::Cpu), ("wgpu", Choice::Wgpu), ("cuda", Choice::Cuda)];

/// Device that a call asks for.
#[derive(Clone, Copy, Debug)]
pub struct DeviceChoice {
    choice: Choice,
    device: Option<usize>,
    threads: Option<usize>,
}

impl DeviceChoice {
    /// Reads the arguments of a call.
    ///
    /// # Errors
    ///
    /// `SettingsError` for an unknown backend, or too many threads.
    pub fn read(
        backend: Option<&Bound<'_, PyAny>>,
        device: Option<usize>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        if threads.is_some_and(|threads| threads > MAX_THREADS) {
            let message =
                format!("threads must be from 1 to {MAX_THREADS}, or 0 for one for each logical core");
            return Err(error::raise("SettingsError", message, Facts { kind: "Value", ..Facts::default() }));
        }
        let choice = backend.map_or(Ok(Choice::Auto), |backend| word("backend", backend, &BACKENDS))?;
        Ok(Self { choice, device, threads })
    }

    /// Opens the device, and starts the threads that all devices share.
    ///
    /// # Errors
    ///
    /// Errors of the backend; [`SettingsError`] for an index without a backend.
    pub fn open(self) -> Result<Selection, Error> {
        let Self { choice, device, threads } = self;
        if choice == Choice::Auto && device.is_some() {
            return Err(SettingsError::DeviceWithoutBackend.into());
        }
        start_shared(threads)?;
        Ok(device::open(choice, device, threads)?)
    }
}

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
