//! Files of a render: its image, denoised and exposed, with its layers, and its statistics.

use super::super::fallback_path::or_fallback_path;
use super::super::{Session, background, data, eprint};
use crate::cli::{Background, RenderArgs};
use std::borrow::Cow;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trisect::denoise::Denoiser;
use trisect::film::Film;
use trisect::image::{Image, ImageError};
use trisect::layers::{Aov, FilmPlace};
use trisect::output::exposure::Exposed;
use trisect::output::{self, ToneMap};
use trisect::stats::RenderStats;
use trisect_lab::Error;

/// Result of a render, in the form in which it was assembled.
pub enum RenderOutput<'a> {
    /// Film with all sums.
    Film(&'a Film),
    /// Image of mean radiance.
    #[cfg(feature = "mpi")]
    Image(&'a Image),
    /// Width, height and three sRGB bytes per pixel, for a .png.
    #[cfg(feature = "mpi")]
    Bytes(u32, u32, &'a [u8]),
}

/// Denoises a film, and writes image and statistics. Returns the exit code, and whether all outputs
/// are at their requested paths.
pub fn finish(
    arguments: &RenderArgs,
    session: &mut Session,
    drawn: RenderOutput,
    mut stats: RenderStats,
    denoise: Option<Denoiser>,
) -> Result<(ExitCode, bool), Error> {
    let mut image = None;
    if let (RenderOutput::Film(film), Some(denoise)) = (&drawn, &denoise) {
        let denoised = session.renderer.denoise(film, &session.settings, denoise);
        let (denoised, passes) = match denoised {
            Ok(denoised) => denoised,
            Err(error) => {
                // The image without the filter is written, so that no samples are lost.
                let exposed = exposed(arguments, &drawn, None);
                match or_fallback_path(&arguments.output, |path| {
                    write(path, (arguments.background, &[]), session, &drawn, exposed.as_ref())
                }) {
                    Ok(path) => eprint(&format!("warning: wrote {} without denoising", path.display())),
                    Err(error) => eprint(&format!("error: {error}")),
                }
                return Err(error.into());
            }
        };
        stats.denoise_seconds = passes.iter().map(Duration::as_secs_f64).sum();
        stats.denoise = Some(*denoise);
        stats.denoise_library = denoise.library();
        image = Some(denoised);
    }
    write_outputs(arguments, session, drawn, stats, image)
}

/// Writes image and statistics, and prints summary and warnings. Returns the exit code, and whether
/// all outputs are at their requested paths.
pub fn write_outputs(
    arguments: &RenderArgs,
    session: &Session,
    drawn: RenderOutput,
    mut stats: RenderStats,
    denoised: Option<Image>,
) -> Result<(ExitCode, bool), Error> {
    let start = Instant::now();
    let exposed = exposed(arguments, &drawn, denoised);
    let written = or_fallback_path(&arguments.output, |path| {
        write(path, (arguments.background, &arguments.aov), session, &drawn, exposed.as_ref())
    });

    let mut told = None;
    let stats = &mut stats;
    stats.phases.write_seconds = start.elapsed().as_secs_f64();
    stats.scene.clone_from(&session.name);
    stats.choice.clone_from(&session.choice);
    stats.exposure = exposed.as_ref().map_or(0.0, |(_, exposed)| exposed.stops);
    stats.tonemap = arguments.tonemap.name();
    if let Some(path) = &arguments.log.stats {
        let text = serde_json::to_string_pretty(&stats)
            .map_err(|error| ImageError::Codec { path: path.clone(), message: error.to_string() })?;
        told = Some(or_fallback_path(path, |path| data::write(path, &text)));
    }
    let path = match (written, &told) {
        (Ok(path), _) => path,
        // The statistics may be written although the image is not: their path is printed.
        (Err(error), told) => {
            match told {
                Some(Ok(path)) if !data::is_stdout(path) => eprint(&format!("wrote {}", path.display())),
                Some(Err(error)) => eprint(&format!("error: {error}")),
                _ => {}
            }
            return Err(error);
        }
    };
    let moved = path != arguments.output;
    if !arguments.log.quiet {
        eprint(&stats.summary());
        if arguments.log.verbose {
            eprint(&stats.details());
        }
        if let Some(cluster) = &stats.cluster {
            eprint(&cluster.summary());
        }
        if let Some(sampling) = &stats.sampling {
            eprint(&sampling.summary());
        }
        if let Some(automatic) = exposed.as_ref().and_then(|(_, exposed)| exposed.automatic) {
            eprint(&automatic.to_string());
        }
        eprint(&format!("wrote {}", path.display()));
    } else if moved {
        eprint(&format!("wrote {} instead", path.display()));
    }
    let told = told.transpose()?;
    let moved_stats = told.filter(|told| Some(told) != arguments.log.stats.as_ref());
    if let Some(path) = &moved_stats {
        eprint(&format!("wrote {} instead", path.display()));
    }
    let moved = moved || moved_stats.is_some();
    for warning in stats.warnings() {
        eprint(&format!("warning: {warning}"));
    }
    let code = if stats.unwritten_pixels == 0 && !moved { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    Ok((code, !moved))
}

/// Returns the image to write, denoised or as rendered, with exposure and tone map applied; `None`
/// for bytes, which are complete. An automatic exposure is determined from the image before
/// denoising.
fn exposed<'a>(
    arguments: &RenderArgs,
    drawn: &'a RenderOutput,
    denoised: Option<Image>,
) -> Option<(Cow<'a, Image>, Exposed)> {
    let mut alpha = None;
    let drawn = match drawn {
        RenderOutput::Film(film) => {
            alpha = background::alpha_behind(arguments.background, film);
            Cow::Owned(film.image())
        }
        #[cfg(feature = "mpi")]
        RenderOutput::Image(image) => Cow::Borrowed(*image),
        #[cfg(feature = "mpi")]
        RenderOutput::Bytes(..) => return None,
    };
    let exposed = arguments.exposure().of(&drawn, &arguments.output);
    let mut image = denoised.map_or(drawn, Cow::Owned);
    if exposed.stops != 0.0 {
        exposed.apply(image.to_mut());
    }
    if arguments.tonemap != ToneMap::None {
        arguments.tonemap.apply(image.to_mut(), alpha.as_deref());
    }
    Some((image, exposed))
}

/// Writes the image before its background, with the layers `aov` of its film.
fn write(
    path: &Path,
    (background, aov): (Background, &[Aov]),
    session: &Session,
    drawn: &RenderOutput,
    exposed: Option<&(Cow<Image>, Exposed)>,
) -> Result<(), Error> {
    match (drawn, exposed) {
        #[cfg(feature = "mpi")]
        (RenderOutput::Bytes(width, height, bytes), _) => {
            Ok(output::write_bytes(*width, *height, bytes, path)?)
        }
        #[cfg(feature = "mpi")]
        (RenderOutput::Image(image), None) => Ok(output::write(image, path)?),
        (RenderOutput::Film(film), None) => Ok(output::write(&film.image(), path)?),
        (RenderOutput::Film(film), Some((image, exposed))) => {
            let place = FilmPlace {
                camera: &session.renderer.camera(&session.settings),
                space: session.space,
                object: |primitive| session.renderer.object(primitive),
            };
            Ok(background::write_with_layers(background, image, film, &place, (aov, exposed.stops), path)?)
        }
        #[cfg(feature = "mpi")]
        (_, Some((image, _))) => Ok(output::write(image, path)?),
    }
}
