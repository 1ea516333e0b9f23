//! One line for each torture test and backend, from which the table in `docs/accuracy.md` is made:
//!
//! ```text
//! TORTURE 02 | cpu | AMD EPYC 9354 | passed | worst 1.9 of 4 sigma over 8 depths
//! ```
//!
//! Five fields, " | " between them; no field holds a '|'. `cargo test --release -p trisect-tests --test torture -- --nocapture 2>&1 |
//! grep -o 'TORTURE.*'` shows them all.

use crate::Subject;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use trisect::backend::{Device, DeviceKind};

/// How a backend met a test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// As the test's number asks.
    Passed,
    /// Within a bound that was measured and whose reason the test states.
    Bounded,
    /// Nothing to test, with the reason.
    NotApplicable,
}

/// Names and kinds of the devices that were opened, by the backend's label.
static DEVICES: Mutex<BTreeMap<&str, (String, DeviceKind)>> = Mutex::new(BTreeMap::new());

fn devices() -> MutexGuard<'static, BTreeMap<&'static str, (String, DeviceKind)>> {
    DEVICES.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Subject {
    /// Its name in reports, where both routes of wgpu show.
    pub fn label(self) -> &'static str {
        match self {
            Self::WgpuNaga => "wgpu-naga",
            other => other.name(),
        }
    }

    /// Keeps what it opened, for reports.
    pub fn opened(self, device: &Device) {
        let name = device.name.replace('|', "/").trim().to_owned();
        devices().entry(self.label()).or_insert((name, device.kind));
    }

    /// Whether it is a graphics driver that computes on the CPU, which has time for few samples. `false` if nothing opens.
    pub fn is_software(self) -> bool {
        if !devices().contains_key(self.label())
            && let Ok(backend) = self.open()
        {
            self.opened(backend.device());
        }
        devices().get(self.label()).is_some_and(|(_, kind)| *kind == DeviceKind::SoftwareGpu)
    }
}

/// The line.
pub fn line(number: u32, subject: Subject, device: &str, outcome: Outcome, figure: &str) -> String {
    let outcome = match outcome {
        Outcome::Passed => "passed",
        Outcome::Bounded => "bounded",
        Outcome::NotApplicable => "not applicable",
    };
    format!("TORTURE {number:02} | {} | {device} | {outcome} | {}", subject.label(), figure.replace('|', "/"))
}

/// Prints the line of torture test `number` on standard error; `figure` says in words what was measured.
pub fn report(number: u32, subject: Subject, outcome: Outcome, figure: &str) {
    let devices = devices();
    let device = devices.get(subject.label()).map_or("not opened", |(name, _)| name.as_str());
    eprintln!("{}", line(number, subject, device, outcome, figure));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_five_fields() {
        let line = line(2, Subject::WgpuNaga, "device", Outcome::Bounded, "a | b");
        assert_eq!(line, "TORTURE 02 | wgpu-naga | device | bounded | a / b");
    }
}
