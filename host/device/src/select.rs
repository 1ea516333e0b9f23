//! Selection of a backend and a device.

use super::{BackendError, Device, DeviceInfo, cpu, cuda, wgpu};

/// Backend that the user asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Choice {
    /// CUDA, else a hardware wgpu adapter, else the CPU. On Linux wgpu is not opened on a machine
    /// without the device file of a GPU.
    Auto,
    /// Threads of this machine's CPU.
    Cpu,
    /// GPU through Vulkan, Metal or Direct3D 12.
    Wgpu,
    /// NVIDIA GPU through CUDA.
    Cuda,
}

impl Choice {
    /// Returns the choice of the backend with this [name](DeviceInfo::backend), if there is one.
    pub fn of_backend(name: &str) -> Option<Self> {
        match name {
            cpu::NAME => Some(Self::Cpu),
            wgpu::NAME => Some(Self::Wgpu),
            cuda::NAME => Some(Self::Cuda),
            _ => None,
        }
    }
}

/// Device that was opened, with the reason for its choice.
pub struct Selection {
    /// Device, ready for a scene.
    pub device: Box<dyn Device>,
    /// Reason, for people; empty if the user named the backend.
    pub why: String,
}

impl Selection {
    /// Opens the best device: by CUDA, else a hardware adapter of wgpu, else the CPU.
    ///
    /// # Errors
    ///
    /// [`BackendError`] if not even the CPU's threads can be started.
    pub fn auto() -> Result<Self, BackendError> {
        open(Choice::Auto, None, None)
    }

    /// Opens the first device of a backend.
    ///
    /// # Errors
    ///
    /// [`BackendError::Unavailable`] if there is none.
    pub fn of(backend: Choice) -> Result<Self, BackendError> {
        open(backend, None, None)
    }
}

impl From<Selection> for Box<dyn Device> {
    fn from(selection: Selection) -> Self {
        selection.device
    }
}

/// Opens the backend that the user asks for. `device` is an index among that backend's devices, and
/// ignored with [`Choice::Auto`]; `threads` is the number of threads of the CPU backend, as in
/// [`Cpu::open`](cpu::Cpu::open).
pub fn open(
    choice: Choice,
    device: Option<usize>,
    threads: Option<usize>,
) -> Result<Selection, BackendError> {
    let named = |device: Box<dyn Device>| Selection { device, why: String::new() };
    match choice {
        Choice::Cpu => match device {
            None | Some(0) => Ok(named(Box::new(cpu::Cpu::open(threads)?))),
            Some(index) => Err(BackendError::NoSuchDevice { backend: "cpu", index, devices: 1 }),
        },
        Choice::Wgpu => Ok(named(Box::new(wgpu::Wgpu::open(device, wgpu::Route::BEST)?))),
        Choice::Cuda => Ok(named(cuda::open(device)?)),
        Choice::Auto => auto(threads),
    }
}

fn auto(threads: Option<usize>) -> Result<Selection, BackendError> {
    let cuda = match cuda::open(None) {
        Ok(device) => {
            return Ok(Selection { device, why: "auto: cuda comes first".to_owned() });
        }
        Err(error) => first_line(&error),
    };
    let opened = may_have_gpu().then(|| wgpu::Wgpu::open(None, wgpu::Route::BEST));
    let wgpu = match opened {
        Some(Ok(device)) => {
            return Ok(Selection { device: Box::new(device), why: format!("auto: {cuda}") });
        }
        Some(Err(error)) => first_line(&error),
        None => "wgpu is not opened: the system has no device file of a GPU".to_owned(),
    };
    let device = cpu::Cpu::open(threads)?;
    Ok(Selection { device: Box::new(device), why: format!("auto: {cuda}; {wgpu}") })
}

/// Beginnings of the names of GPUs' files in `/dev`: of Mesa's drivers, NVIDIA (also Tegra),
/// Windows' subsystem for Linux, Arm, Qualcomm, Imagination and Vivante.
const DEVICE_FILES: [&str; 9] = ["dri", "nvidia", "nvhost", "nvmap", "dxg", "mali", "kgsl", "pvr", "galcore"];

/// Returns whether this machine may have a GPU. Without one, looking for it loads all Vulkan
/// drivers, which takes longer than a small image.
fn may_have_gpu() -> bool {
    if !cfg!(target_os = "linux") {
        return true;
    }
    let Ok(files) = std::fs::read_dir("/dev") else { return true };
    files.flatten().any(|file| {
        let name = file.file_name();
        DEVICE_FILES.iter().any(|start| name.to_string_lossy().starts_with(start))
    })
}

fn first_line(error: &BackendError) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

/// Returns every backend with its devices, or why it has none.
pub fn list() -> Vec<(&'static str, Result<Vec<DeviceInfo>, BackendError>)> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    vec![("cuda", cuda::devices()), ("wgpu", wgpu::devices()), ("cpu", Ok(vec![cpu::describe(threads)]))]
}
