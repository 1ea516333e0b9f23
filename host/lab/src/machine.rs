//! Reports on the machine and the program, as their JSON holds them: `trisect info` and `trisect
//! doctor`.

use serde::Serialize;
use trisect::denoise::oidn;
use trisect::device::{self, DeviceInfo};

/// Backends and devices, and features of the program.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Info {
    /// Version of the program.
    pub version: String,
    /// Backends, with their devices.
    pub backends: Vec<BackendInfo>,
    /// True if built with the feature `mpi`.
    pub mpi: bool,
    /// True if built with the feature `window`.
    pub window: bool,
    /// Version, device and file of Open Image Denoise; `None` if it cannot be used.
    pub oidn: Option<String>,
}

/// Devices of a backend.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BackendInfo {
    /// `cuda`, `wgpu` or `cpu`.
    pub backend: String,
    /// Devices; empty if there are none.
    pub devices: Vec<DeviceInfo>,
    /// Reason why there are none, with a remedy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<String>,
}

impl Info {
    /// Lists the backends and devices of a program with these features.
    pub fn new(mpi: bool, window: bool) -> Self {
        let backends = device::list().into_iter().map(|(backend, devices)| {
            let (devices, missing) = match devices {
                Ok(devices) => (devices, None),
                Err(error) => (Vec::new(), Some(error.to_string())),
            };
            BackendInfo { backend: backend.to_owned(), devices, missing }
        });
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            backends: backends.collect(),
            mpi,
            window,
            oidn: oidn::describe().ok(),
        }
    }
}

/// State of a part of the machine or the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum State {
    /// Tested, and works.
    Works,
    /// Not present; needed only by those who want it.
    Missing,
    /// Present, and does not work.
    Broken,
}

/// Result of the test of one part.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Finding {
    /// Name of the part.
    pub part: String,
    /// State of the part.
    pub state: State,
    /// Description of what was found.
    pub says: String,
    /// Remedy, unless the part works.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mend: Option<String>,
}

impl Finding {
    /// Creates the result for a part.
    pub fn new(part: &str, state: State, says: impl Into<String>, mend: Option<&str>) -> Self {
        Self { part: part.to_owned(), state, says: says.into(), mend: mend.map(str::to_owned) }
    }
}
