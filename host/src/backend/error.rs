//! Why a backend is not there, or failed.

use crate::memory;
use crate::render::SettingsError;
use crate::threads::ThreadError;
use thiserror::Error;

/// A backend that cannot be used, or that failed.
#[derive(Debug, Error)]
pub enum BackendError {
    /// It is not on this machine.
    #[error("backend {backend} is not available: {reason}\n  {remedy}")]
    Unavailable {
        /// Its name.
        backend: &'static str,
        /// Why.
        reason: String,
        /// What would help.
        remedy: String,
    },
    /// `--device` names none.
    #[error("--device {index}: {backend} has {}; `trisect info` lists devices", count(*.devices))]
    NoSuchDevice {
        /// The backend.
        backend: &'static str,
        /// What was asked for.
        index: usize,
        /// How many there are.
        devices: usize,
    },
    /// The device cannot hold the scene or the film.
    #[error(
        "{what} needs {} on the device, {backend} allows {}; choose a smaller --resolution or another --backend",
        memory::display(*needed), memory::display(*limit)
    )]
    TooLarge {
        /// The backend.
        backend: &'static str,
        /// Which buffer.
        what: &'static str,
        /// Bytes.
        needed: u64,
        /// Bytes.
        limit: u64,
    },
    /// More pixels along a side than one launch can have.
    #[error(
        "an image of {width}x{rows} has a side of more than {limit} pixels, which {backend} does not allow; choose a smaller --resolution or another --backend"
    )]
    TooLong {
        /// The backend.
        backend: &'static str,
        /// Pixels across.
        width: u32,
        /// Rows of the launch.
        rows: u32,
        /// Pixels.
        limit: u64,
    },
    /// The backend does not have what the settings ask for.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Threads of the CPU could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadError),
    /// The driver reported an error.
    #[error("{backend}: {action}: {message}")]
    Device {
        /// The backend.
        backend: &'static str,
        /// What was being done.
        action: &'static str,
        /// What the driver said.
        message: String,
    },
}

impl BackendError {
    /// Whether it is for want of a device that works or is large enough: another backend may do.
    pub fn is_of_device(&self) -> bool {
        !matches!(self, Self::Settings(_) | Self::NoSuchDevice { .. })
    }

    /// Whether another machine or another `--device` would help, rather than another try.
    pub fn is_unavailable(&self) -> bool {
        matches!(self, Self::Unavailable { .. } | Self::NoSuchDevice { .. })
    }
}

fn count(devices: usize) -> String {
    match devices {
        0 => "no device".to_owned(),
        1 => "1 device, index 0".to_owned(),
        n => format!("{n} devices, indices 0 to {}", n - 1),
    }
}
