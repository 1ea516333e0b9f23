//! One line per torture test and backend, from which `tests/accuracy.py` makes the tables of
//! `docs/notebook/torture-tests.md`:
//!
//! ```text
//! TORTURE 02 | cpu | AMD EPYC 9354 | passed | worst 1.9 of 4 sigma over 8 depths
//! ```
//!
//! The five fields are separated by " | "; no field holds a '|'. All lines: `cargo test --release
//! -p trisect-tests --test torture -- --nocapture 2>&1 | grep -o 'TORTURE.*'`.

use crate::BackendUnderTest;
use std::sync::OnceLock;
use trisect::device::{DeviceInfo, DeviceKind, cpu, cuda, wgpu};

/// Outcome of a test on a backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The test holds as stated.
    Passed,
    /// The test holds within a bound that was measured and whose reason the test states.
    Bounded,
    /// There is nothing to test; the figure states the reason.
    NotApplicable,
}

/// Returns the device that tests of a backend run on. Devices are listed once, because a driver may
/// fail if they are listed often.
fn device(subject: BackendUnderTest) -> Option<&'static DeviceInfo> {
    static DEVICES: [OnceLock<Option<DeviceInfo>>; 3] = [const { OnceLock::new() }; 3];
    let (slot, find): (usize, fn() -> Option<DeviceInfo>) = match subject {
        BackendUnderTest::Cpu => (0, || Some(cpu::describe(1))),
        BackendUnderTest::Wgpu | BackendUnderTest::WgpuNaga | BackendUnderTest::WgpuWgsl => (1, || {
            let devices = wgpu::devices().ok()?;
            let named = std::env::var("TRISECT_WGPU_DEVICE").ok().and_then(|index| index.parse().ok());
            let hardware = || devices.iter().position(|device| device.kind == DeviceKind::Gpu);
            let index = named.or_else(hardware).unwrap_or(0);
            devices.into_iter().nth(index)
        }),
        BackendUnderTest::Cuda => (2, || cuda::devices().ok()?.into_iter().next()),
    };
    DEVICES[slot].get_or_init(find).as_ref()
}

impl BackendUnderTest {
    /// Returns its name in reports, which distinguishes the routes of wgpu.
    pub fn label(self) -> &'static str {
        match self {
            Self::WgpuNaga => "wgpu-naga",
            Self::WgpuWgsl => "wgpu-wgsl",
            other => other.name(),
        }
    }

    /// Returns the index, in its backend, of the device that its tests run on; 0 if there is no
    /// device.
    pub fn index(self) -> usize {
        device(self).map_or(0, |device| device.index)
    }

    /// Returns whether its device is a graphics driver that computes on the CPU. Tests give such a
    /// slow device fewer samples.
    pub fn is_software(self) -> bool {
        device(self).is_some_and(|device| device.kind == DeviceKind::SoftwareGpu)
    }
}

/// Formats the line of a test and a backend.
pub fn line(number: u32, subject: BackendUnderTest, device: &str, outcome: Outcome, figure: &str) -> String {
    let outcome = match outcome {
        Outcome::Passed => "passed",
        Outcome::Bounded => "bounded",
        Outcome::NotApplicable => "not applicable",
    };
    format!("TORTURE {number:02} | {} | {device} | {outcome} | {}", subject.label(), figure.replace('|', "/"))
}

/// Prints the line of torture test `number` on standard error; `figure` is what was measured, in
/// words.
pub fn report(number: u32, subject: BackendUnderTest, outcome: Outcome, figure: impl AsRef<str>) {
    let device = device(subject).map_or("none here", |device| device.name.trim());
    eprintln!("{}", line(number, subject, device, outcome, figure.as_ref()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_five_fields() {
        let line = line(2, BackendUnderTest::WgpuNaga, "device", Outcome::Bounded, "a | b");
        assert_eq!(line, "TORTURE 02 | wgpu-naga | device | bounded | a / b");
    }
}
