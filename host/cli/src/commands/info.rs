//! `trisect info`: lists backends and devices.

use super::data;
use crate::cli::InfoArgs;
use std::fmt::Write;
use std::process::ExitCode;
use trisect::denoise::oidn;
use trisect::device::{self, DeviceKind};
use trisect_lab::Error;
use trisect_lab::machine::Info;

/// Lists backends and devices, with reason and remedy for a backend that is not available.
pub fn run(arguments: &InfoArgs) -> Result<ExitCode, Error> {
    data::print_result(arguments.json.json.as_deref(), || Ok(json()), text)?;
    Ok(ExitCode::SUCCESS)
}

fn json() -> String {
    let info = Info::new(cfg!(feature = "mpi"), cfg!(feature = "window"));
    // A value has its keys sorted.
    format!("{:#}\n", serde_json::to_value(info).unwrap_or_default())
}

fn text() -> String {
    let mut text = String::new();
    let _ = writeln!(text, "trisect {}", env!("CARGO_PKG_VERSION"));
    for (name, devices) in device::list() {
        match devices {
            Ok(devices) => {
                for device in devices {
                    let note = match device.kind {
                        DeviceKind::SoftwareGpu => ", software: used only when asked for",
                        _ => "",
                    };
                    let _ = writeln!(
                        text,
                        "{name:<5} --device {}: {} ({}{note})",
                        device.index, device.name, device.details
                    );
                }
            }
            Err(error) => text += &format!("{name:<5} {error}\n"),
        }
    }
    text += match cfg!(feature = "mpi") {
        true => "mpi   built in: mpirun -n N trisect render --distribute auto\n",
        false => "mpi   not built in; build with --features mpi (docs/how-to/cluster.md)\n",
    };
    let _ = match oidn::describe() {
        Ok(library) => writeln!(text, "oidn  {library}: trisect render --denoise oidn"),
        Err(error) => writeln!(text, "oidn  {error}"),
    };
    text
}
