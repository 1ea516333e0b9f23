//! `trisect render`.

use super::Session;
use crate::cli::RenderArgs;
use crate::progress::Bar;
use std::fs;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trisect::image::ImageError;
use trisect::output::layers;
use trisect::render::SettingsError;
use trisect::{Error, output};

/// Renders a scene to a file.
pub fn run(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    // Before minutes of rendering are lost.
    output::check_writable(&arguments.output)?;
    if !arguments.aov.is_empty() {
        layers::check(&arguments.output)?;
    }
    if let Some(stats) = &arguments.stats {
        if *stats == arguments.output {
            return Err(SettingsError::SameFile { path: stats.display().to_string() }.into());
        }
        output::probe(stats)?;
    }

    let denoise = arguments.denoise.denoise()?;

    let mut session = Session::open(&arguments.job)?;
    session.settings.guides = denoise.is_some() || arguments.aov.iter().any(|aov| aov.needs_guides());
    if !arguments.quiet {
        let device = session.renderer.backend().device();
        eprintln!(
            "{}: {}x{}, {} spp",
            session.name, session.settings.width, session.settings.height, session.settings.samples
        );
        eprintln!("{}: {} ({})", device.backend, device.name, device.details);
        if !session.choice.is_empty() {
            eprintln!("  {}", session.choice);
        }
    }

    let mut frame = session.renderer.render(&session.settings, &mut Bar::new(arguments.quiet))?;
    let image = match &denoise {
        Some(denoise) => {
            let denoised = session.renderer.denoise(&frame.film, &session.settings, denoise);
            let (image, passes) = match denoised {
                Ok(denoised) => denoised,
                Err(error) => {
                    // Nothing that was rendered is lost.
                    output::write(&frame.film.image(), &arguments.output)?;
                    eprintln!("warning: wrote {} without denoising", arguments.output.display());
                    return Err(error);
                }
            };
            frame.stats.denoise_seconds = passes.iter().map(Duration::as_secs_f64).sum();
            frame.stats.denoise = Some(*denoise);
            image
        }
        None => frame.film.image(),
    };
    let start = Instant::now();
    if arguments.aov.is_empty() {
        output::write(&image, &arguments.output)?;
    } else {
        let renderer = &session.renderer;
        let camera = renderer.camera(&session.settings);
        let object = |primitive| renderer.object(primitive);
        layers::write(&image, &frame.film, &camera, object, &arguments.aov, &arguments.output)?;
    }

    let stats = &mut frame.stats;
    stats.phases.write_seconds = start.elapsed().as_secs_f64();
    stats.phases.load_seconds = session.load_seconds;
    stats.scene = session.name;
    stats.choice = session.choice;
    if let Some(path) = &arguments.stats {
        let text = serde_json::to_string_pretty(&stats)
            .map_err(|error| ImageError::Codec { path: path.clone(), message: error.to_string() })?;
        fs::write(path, text + "\n").map_err(|source| ImageError::Io { path: path.clone(), source })?;
    }
    if !arguments.quiet {
        eprintln!("{}", stats.summary());
        eprintln!("wrote {}", arguments.output.display());
    }
    for warning in stats.warnings() {
        eprintln!("warning: {warning}");
    }
    Ok(if stats.unwritten_pixels == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
