//! Error of a backend.

use thiserror::Error;
use trisect_system::memory;
use trisect_system::threads::ThreadError;

/// Error of a backend that cannot be used, or that failed.
#[derive(Debug, Error)]
pub enum BackendError {
    /// The backend is not available on this machine.
    #[error("backend {backend} is not available: {reason}\n  {remedy}")]
    Unavailable {
        /// Name of the backend.
        backend: &'static str,
        /// Reason.
        reason: String,
        /// Remedy.
        remedy: String,
    },
    /// `--device` names a device that does not exist.
    #[error("`device` {index}: {backend} has {}; `device::list` has them", count(*.devices))]
    NoSuchDevice {
        /// Name of the backend.
        backend: &'static str,
        /// Requested index.
        index: usize,
        /// Number of devices.
        devices: usize,
    },
    /// The device cannot hold the scene or the film.
    #[error(
        "{what} needs {} on the device, {backend} allows {}; choose a smaller `resolution` or another `backend`",
        memory::display(*needed), memory::display(*limit)
    )]
    TooLarge {
        /// Name of the backend.
        backend: &'static str,
        /// Buffer that is too large.
        what: &'static str,
        /// Bytes that it needs.
        needed: u64,
        /// Maximum number of bytes.
        limit: u64,
    },
    /// A side of the image has more pixels than one launch allows.
    #[error(
        "an image of {width}x{rows} has a side of more than {limit} pixels, which {backend} does not allow; choose a smaller `resolution` or another `backend`"
    )]
    TooLong {
        /// Name of the backend.
        backend: &'static str,
        /// Width of the image in pixels.
        width: u32,
        /// Number of rows of the launch.
        rows: u32,
        /// Maximum number of pixels along a side.
        limit: u64,
    },
    /// The route to the driver does not support the schedule.
    #[error(
        "`schedule` persistent and interleaved need SPIR-V pass-through, which {backend} has on Vulkan only; leave `schedule` out"
    )]
    NoQueue {
        /// Name of the backend.
        backend: &'static str,
    },
    /// The backend does not have this math build.
    #[error("`math` fast exists for cuda and wgpu; {backend} has one build: leave `math` out")]
    NoFastMath {
        /// Name of the backend.
        backend: &'static str,
    },
    /// Threads of the CPU could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadError),
    /// A call of this program was wrong or out of order: a fault of the program, not of the device.
    #[error("fault of this program: {message}")]
    Misuse {
        /// Description of the fault.
        message: String,
    },
    /// An action on the device failed: the driver reported an error.
    #[error("{backend}: {action}: {message}")]
    Device {
        /// Name of the backend.
        backend: &'static str,
        /// Action that failed.
        action: &'static str,
        /// Message of the driver or of this program.
        message: String,
    },
}

impl BackendError {
    /// Returns whether another backend may succeed: for all errors except settings that the backend
    /// lacks, a `--device` that does not exist and faults of this program.
    pub fn is_of_device(&self) -> bool {
        !self.is_unsupported() && !matches!(self, Self::NoSuchDevice { .. } | Self::Misuse { .. })
    }

    /// Returns whether the backend lacks a method that the settings name.
    pub fn is_unsupported(&self) -> bool {
        matches!(self, Self::NoQueue { .. } | Self::NoFastMath { .. })
    }

    /// Returns whether the backend or device does not exist here, so that another machine or
    /// another `--device` would help, but not another try.
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
