//! `trisect doctor`: tests what works on this machine, and suggests remedies for what does not.

use crate::cli::DoctorArgs;
use std::fmt::Write;
use std::io;
use std::path::Path;
use std::process::{Command, ExitCode};
use trisect::denoise::oidn::{self, OidnError};
use trisect::device::{self, BackendError, Choice, DeviceInfo};
use trisect::film::{Film, FilmCounts};
use trisect::memory;
use trisect::metrics::{ImageView, compare};
use trisect::render::{Renderer, Sampler, Settings};
use trisect::scene::Scene;
use trisect_lab::Error;
use trisect_lab::machine::{Finding, State};
use trisect_lab::tradeoff::user_cache;

fn works(part: &str, says: impl Into<String>) -> Finding {
    Finding::new(part, State::Works, says, None)
}

fn missing(part: &str, says: impl Into<String>, mend: &str) -> Finding {
    Finding::new(part, State::Missing, says, Some(mend))
}

/// Returns the finding for a backend or a device that failed with `error`.
fn failed(part: &str, error: &Error) -> Finding {
    match error {
        Error::Render(trisect::Error::Backend(BackendError::Unavailable { reason, remedy, .. })) => {
            missing(part, reason, remedy)
        }
        other => {
            let mend = "update the graphics driver; until then choose another --backend or --device";
            Finding::new(part, State::Broken, other.to_string(), Some(mend))
        }
    }
}

/// Tests everything that the program can do on this machine.
pub fn run(arguments: &DoctorArgs) -> Result<ExitCode, Error> {
    trisect::threads::start_shared(None)?;
    let mut findings = devices()?;
    findings.push(processes());
    findings.push(window());
    findings.push(denoiser());
    findings.push(works("memory", format!("{} are free", memory::display(memory::available()))));
    findings.push(folder("temporary files", Some(&std::env::temp_dir()), "set TMPDIR to one that can"));
    findings.push(folder(
        "cache",
        user_cache().as_deref(),
        "set XDG_CACHE_HOME to one that can, or say --cache",
    ));
    let json = || Ok(serde_json::to_string_pretty(&findings).unwrap_or_default() + "\n");
    super::data::print_result(arguments.json.json.as_deref(), json, || plain(&findings))?;
    let is_broken = findings.iter().any(|finding| finding.state == State::Broken);
    Ok(if is_broken { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn plain(findings: &[Finding]) -> String {
    let mut text = format!("trisect {}\n", env!("CARGO_PKG_VERSION"));
    for Finding { part, state, says, mend } in findings {
        let state = match state {
            State::Works => "works",
            State::Missing => "missing",
            State::Broken => "BROKEN",
        };
        let _ = writeln!(text, "{part:<16} {state:<8} {says}");
        if let Some(mend) = mend {
            let _ = writeln!(text, "{:<16} {:<8} {mend}", "", "mend:");
        }
    }
    text
}

/// Returns the settings of the image that devices render. Its samples are independent, because the
/// comparison takes their variance.
fn settings(scene: &Scene) -> Settings {
    Settings { sampler: Sampler::Independent, ..Settings::of(scene) }.size(64, 36).spp(16)
}

/// Renders an image on each device and compares it with that of the CPU.
fn devices() -> Result<Vec<Finding>, Error> {
    let scene = Scene::hello_world()?;
    let settings = settings(&scene);
    let render = |choice: Choice, index: Option<usize>| -> Result<Film, Error> {
        let selection = device::open(choice, index, None)?;
        Ok(Renderer::new(selection.device, &scene)?.render(&settings)?.film)
    };
    let cpu = render(Choice::Cpu, None)?;
    let mut findings = Vec::new();
    for (name, devices) in device::list() {
        let choice = Choice::of_backend(name).unwrap_or(Choice::Auto);
        match devices {
            Ok(devices) => {
                for device in devices {
                    let part = format!("{name} {}", device.index);
                    findings.push(match render(choice, Some(device.index)) {
                        Ok(film) => judge(&part, &device, &film, &cpu)?,
                        Err(error) => failed(&part, &error),
                    });
                }
            }
            Err(error) => findings.push(failed(name, &error.into())),
        }
    }
    Ok(findings)
}

/// Returns the finding for a device by comparing its image with that of the CPU.
fn judge(part: &str, device: &DeviceInfo, film: &Film, cpu: &Film) -> Result<Finding, Error> {
    let DeviceInfo { name, details, .. } = device;
    if film.pixels == cpu.pixels {
        let says = format!("{name} ({details}): the image is the processor's, bit for bit");
        return Ok(works(part, says));
    }
    let broken = |says| {
        let mend = "update the graphics driver; until then do not use this device";
        Finding::new(part, State::Broken, says, Some(mend))
    };
    // `compare` leaves out NaN and infinity, so they are counted first.
    let FilmCounts { unwritten, rejected, .. } = film.counts();
    if unwritten > 0 || rejected > cpu.counts().rejected {
        let says =
            format!("{name} ({details}): {unwritten} pixels lack samples, {rejected} samples are not finite");
        return Ok(broken(says));
    }
    let (image, reference) = (film.image(), cpu.image());
    let view = |pixels| ImageView::new(film.width as usize, film.height as usize, pixels);
    let difference = compare(&view(&image.pixels)?, &view(&reference.pixels)?)?.rel_mse;
    // Both use the same random numbers, and rounding changes the path of a few samples only: a
    // correct image differs by far less than one with other random numbers.
    let noise = rel_noise(cpu);
    let says =
        format!("{name} ({details}): relMSE to the processor's image {difference:.1e}, noise {noise:.1e}");
    Ok(match difference < noise {
        true => works(part, says),
        false => broken(says),
    })
}

/// Returns the relMSE that is expected from the film's noise.
fn rel_noise(film: &Film) -> f64 {
    let of = |(mean, variance): (f64, f64)| variance / (mean * mean + 0.01);
    let pixels = film
        .pixels
        .iter()
        .map(|pixel| pixel.mean().into_iter().zip(pixel.variance_of_mean()).map(of).sum::<f64>() / 3.0);
    pixels.sum::<f64>() / film.pixels.len().max(1) as f64
}

/// Returns the finding for MPI.
fn processes() -> Finding {
    if !cfg!(feature = "mpi") {
        let mend = "apt-get install libopenmpi-dev openmpi-bin libclang-dev, then cargo install --path host/cli --features mpi";
        return missing("mpi", "not built in: one process", mend);
    }
    match Command::new("mpirun").arg("--version").output() {
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stdout);
            let first = text.lines().next().unwrap_or("mpirun is there");
            works("mpi", format!("built in; {first}"))
        }
        Err(error) => missing("mpi", format!("built in, but mpirun: {error}"), "apt-get install openmpi-bin"),
    }
}

/// Returns the finding for Open Image Denoise.
fn denoiser() -> Finding {
    match oidn::describe() {
        Ok(library) => works("oidn", library),
        Err(error) => {
            let state = match error {
                OidnError::NotFound { .. } => State::Missing,
                _ => State::Broken,
            };
            let text = error.to_string();
            let (says, mend) =
                text.split_once("\n  ").unwrap_or((&text, "use another version of the library"));
            Finding::new("oidn", state, says, Some(mend))
        }
    }
}

/// Returns the finding for the viewer's window.
fn window() -> Finding {
    if !cfg!(feature = "window") {
        let mend = "cargo install --path host/cli --features window; or view --headless";
        return missing("window", "not built in", mend);
    }
    let named =
        ["WAYLAND_DISPLAY", "DISPLAY"].map(|name| std::env::var(name).is_ok_and(|value| !value.is_empty()));
    if cfg!(target_os = "linux") && named == [false; 2] {
        let mend = "log in at a screen or by ssh -X; or view --headless, which needs none";
        return missing("window", "no display: neither WAYLAND_DISPLAY nor DISPLAY is set", mend);
    }
    works("window", "a display is named (trisect view)")
}

/// Returns the finding for a folder, by writing a temporary file to it. If the folder does not
/// exist, the file is written to the nearest folder above it, in which it would be created.
fn folder(part: &str, path: Option<&Path>, mend: &str) -> Finding {
    let Some(path) = path else { return missing(part, "there is no home folder", mend) };
    let present = path.ancestors().find(|folder| folder.exists()).unwrap_or(path);
    let written = tempfile::NamedTempFile::new_in(present)
        .and_then(|mut file| io::Write::write_all(&mut file, b"trisect").and_then(|()| file.close()));
    match written {
        Ok(()) => works(part, path.display().to_string()),
        Err(error) => Finding::new(part, State::Broken, format!("{}: {error}", path.display()), Some(mend)),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use trisect::device::Device;
    use trisect::device::cpu::Cpu;

    #[test]
    fn another_image_is_broken() {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Cpu::open(None).unwrap(), &scene).unwrap();
        let mut film = |seed| renderer.render(&settings(&scene).seed(seed)).unwrap().film;
        let (cpu, mut near, other) = (film(0), film(0), film(1));
        let device = Cpu::open(None).unwrap().info().clone();
        let state = |film: &Film| judge("cpu 0", &device, film, &cpu).unwrap().state;
        assert_eq!(state(&cpu), State::Works);
        // A few samples took another path.
        near.pixels.exact_mut()[..3].copy_from_slice(&other.pixels.exact()[..3]);
        assert_eq!(state(&near), State::Works);
        // The negative control: other random numbers, which give the same image to the eye.
        assert_eq!(state(&other), State::Broken);
        near.pixels.exact_mut()[0] = Film::new(1, 1).pixels.exact()[0];
        assert_eq!(state(&near), State::Broken, "a pixel without samples");
    }
}
