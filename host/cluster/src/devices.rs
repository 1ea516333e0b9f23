//! Choice of each rank's device: its own GPU, if the host has enough of them.

use super::ClusterError;
use crate::Error;
use trisect::device::{Choice, DeviceKind, cuda, wgpu};

/// Action of a rank if its host has no GPU left for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum NoGpuPolicy {
    /// End the job.
    Refuse,
    /// Use the CPU.
    Cpu,
    /// Share a GPU with another rank.
    Share,
}

/// Returns the backend and device of the rank with number `local` on its host: each rank gets its
/// own GPU; `spare` decides for ranks beyond the last GPU. With [`Choice::Auto`], a host without
/// GPUs gives the CPU. A device that the user named stays, and so does [`Choice::Cpu`].
///
/// # Errors
///
/// [`ClusterError::NoDevice`] if the host has fewer GPUs than ranks, unless `spare` allows it; the
/// backend's error if it is not available.
pub fn for_rank(
    choice: Choice,
    device: Option<usize>,
    local: u32,
    spare: NoGpuPolicy,
) -> Result<(Choice, Option<usize>), Error> {
    if device.is_some() || choice == Choice::Cpu {
        return Ok((choice, device));
    }
    let of_cuda = || cuda::devices().map(|devices| devices.into_iter().map(|device| device.index).collect());
    let of_wgpu = || {
        let hardware = |devices: Vec<trisect::device::DeviceInfo>| {
            let gpus = devices.into_iter().filter(|device| device.kind == DeviceKind::Gpu);
            gpus.map(|device| device.index).collect::<Vec<usize>>()
        };
        wgpu::devices().map(hardware)
    };
    let (backend, name, gpus): (_, _, Vec<usize>) = match choice {
        Choice::Cuda => (choice, "cuda", of_cuda()?),
        Choice::Wgpu => (choice, "wgpu", of_wgpu()?),
        Choice::Auto | Choice::Cpu => match (of_cuda(), of_wgpu()) {
            (Ok(gpus), _) => (Choice::Cuda, "cuda", gpus),
            (Err(_), Ok(gpus)) if !gpus.is_empty() => (Choice::Wgpu, "wgpu", gpus),
            _ => return Ok((Choice::Cpu, None)),
        },
    };
    pick(&gpus, local, spare).map_or_else(
        || Ok((Choice::Cpu, None)),
        |device| match device {
            Ok(device) => Ok((backend, Some(device))),
            Err(devices) => Err(ClusterError::NoDevice { local, backend: name, devices }.into()),
        },
    )
}

/// Returns the GPU of a rank from `gpus`; `None` for the CPU, and the number of GPUs as the error
/// if there are too few.
fn pick(gpus: &[usize], local: u32, spare: NoGpuPolicy) -> Option<Result<usize, usize>> {
    match (gpus.get(local as usize), spare) {
        (Some(own), _) => Some(Ok(*own)),
        (None, NoGpuPolicy::Cpu) => None,
        (None, NoGpuPolicy::Share) if !gpus.is_empty() => Some(Ok(gpus[local as usize % gpus.len()])),
        (None, _) => Some(Err(gpus.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rank_its_own() {
        assert_eq!(pick(&[3, 5], 1, NoGpuPolicy::Refuse), Some(Ok(5)));
        assert_eq!(pick(&[3, 5], 2, NoGpuPolicy::Refuse), Some(Err(2)));
        assert_eq!(pick(&[3, 5], 2, NoGpuPolicy::Cpu), None);
        assert_eq!(pick(&[3, 5], 3, NoGpuPolicy::Share), Some(Ok(5)));
        assert_eq!(pick(&[], 0, NoGpuPolicy::Share), Some(Err(0)));
    }
}
