//! Files of a render: its image, denoised and exposed, with its layers, and its statistics.

use super::super::fallback_path::or_fallback_path;
use super::super::{Session, background, data, eprint};
use super::light_groups;
use crate::cli::{MetadataArg, RenderArgs};
use crate::progress::Bar;
use std::borrow::Cow;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trisect::cryptomatte::{self, Cryptomatte};
use trisect::denoise::Denoiser;
use trisect::film::Film;
use trisect::image::{Image, ImageError};
use trisect::layers::{Aov, FilmPlace, layers};
use trisect::metadata;
use trisect::output;
use trisect::output::exposure::Exposed;
use trisect::output::{Channel, Encoding, Format, Metadata, Picture, ToneMap, Window, exceeds_half};
use trisect::stats::RenderStats;
use trisect::surfaces;
use trisect_lab::Error;

/// Message about an .exr whose colours do not fit 16-bit floats.
pub const BEYOND_HALF: &str = "colours have 32 bits: some exceed 65504, the maximum of 16-bit floats";

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
                let plain = RenderArgs { aov: Vec::new(), ..arguments.clone() };
                match or_fallback_path(&arguments.output, |path| {
                    let no_more = (Metadata::default(), &Cryptomatte::default());
                    write(path, &plain, session, &drawn, exposed.as_ref(), no_more)
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
    session: &mut Session,
    drawn: RenderOutput,
    mut stats: RenderStats,
    denoised: Option<Image>,
) -> Result<(ExitCode, bool), Error> {
    let start = Instant::now();
    if let Some(display) = &session.display {
        match (&denoised, &drawn) {
            (Some(image), _) => display.show(image),
            (None, RenderOutput::Film(film)) => display.show(&film.image()),
            #[cfg(feature = "mpi")]
            (None, _) => {}
        }
    }
    let exposed = exposed(arguments, &drawn, denoised);
    let stats = &mut stats;
    stats.exposure = exposed.as_ref().map_or(0.0, |(_, exposed)| exposed.stops);
    stats.tonemap = arguments.file.tone_map().name();
    let (mattes, mattes_failed) = mattes(arguments, session);
    let (of_surfaces, surfaces_failed) = surfaces(arguments, session);
    let denoiser = stats.denoise;
    let (of_lights, lights_failed) =
        light_groups::layers(arguments, session, denoiser.as_ref(), stats.exposure);
    let channels = [mattes.channels, of_surfaces, of_lights].concat();
    let mattes = Cryptomatte { channels, ..mattes };
    let failed = mattes_failed || surfaces_failed || lights_failed;
    let session = &*session;
    let written = or_fallback_path(&arguments.output, |path| {
        let metadata = metadata(arguments, session, stats);
        write(path, arguments, session, &drawn, exposed.as_ref(), (metadata, &mattes))
    });

    let mut told = None;
    stats.phases.write_seconds = start.elapsed().as_secs_f64();
    stats.scene.clone_from(&session.name);
    stats.choice.clone_from(&session.choice);
    if let Some(path) = &arguments.log.stats {
        let text = serde_json::to_string_pretty(&stats)
            .map_err(|error| ImageError::Codec { path: path.clone(), message: error.to_string() })?;
        told = Some(match data::is_stdout(path) {
            true => data::write(path, &text).map(|()| path.clone()),
            false => or_fallback_path(path, |path| data::write(path, &text)),
        });
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
        let is_exr = matches!(Format::of(&path), Ok(Format::Exr)) && !arguments.file.float;
        if is_exr && exposed.as_ref().is_some_and(|(image, _)| exceeds_half(&image.pixels)) {
            eprint(BEYOND_HALF);
        }
        if let Some(automatic) = exposed.as_ref().and_then(|(_, exposed)| exposed.automatic) {
            eprint(&automatic.to_string());
        }
        if !output::is_stdout(&path) {
            eprint(&format!("wrote {}", path.display()));
        }
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
    let is_whole = stats.unwritten_pixels == 0 && !moved && !failed;
    let code = if is_whole { ExitCode::SUCCESS } else { ExitCode::FAILURE };
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
    let (drawn, alpha) = match drawn {
        RenderOutput::Film(film) => {
            (Cow::Owned(film.image()), background::alpha_behind(arguments.background, film))
        }
        #[cfg(feature = "mpi")]
        RenderOutput::Image(image) => (Cow::Borrowed(*image), None),
        #[cfg(feature = "mpi")]
        RenderOutput::Bytes(..) => return None,
    };
    let exposed = arguments.exposure().of(&drawn, &arguments.output);
    let mut image = denoised.map_or(drawn, Cow::Owned);
    if exposed.stops != 0.0 {
        exposed.apply(image.to_mut());
    }
    if arguments.file.tone_map() != ToneMap::None {
        arguments.file.tone_map().apply(image.to_mut(), alpha.as_deref());
    }
    Some((image, exposed))
}

/// Writes the image before its background, with the layers that the command asks for.
fn write(
    path: &Path,
    arguments: &RenderArgs,
    session: &Session,
    drawn: &RenderOutput,
    exposed: Option<&(Cow<Image>, Exposed)>,
    (mut metadata, mattes): (Metadata, &Cryptomatte),
) -> Result<(), Error> {
    metadata.attributes.clone_from(&mattes.attributes);
    let window = session.settings.crop.map(Window::from);
    let encoding = Encoding { metadata, window, ..arguments.file.encoding() };
    match (drawn, exposed) {
        #[cfg(feature = "mpi")]
        (RenderOutput::Bytes(width, height, bytes), _) => {
            Ok(output::write_bytes((*width, *height), bytes, path, &encoding.metadata)?)
        }
        #[cfg(feature = "mpi")]
        (RenderOutput::Image(image), None) => Ok(Picture::from(*image).write(path, &encoding)?),
        (RenderOutput::Film(film), None) => Ok(Picture::from(&film.image()).write(path, &encoding)?),
        (RenderOutput::Film(film), Some((image, exposed))) => {
            let place = FilmPlace {
                camera: &session.renderer.camera(&session.settings),
                space: session.space,
                object: |primitive| session.renderer.object(primitive),
            };
            let mut layers = layers(film, &place, &arguments.aov, exposed.stops)
                .map_err(|message| ImageError::Codec { path: path.to_owned(), message })?;
            layers.extend(mattes.channels.iter().cloned());
            Ok(background::write(arguments.background, image, film, layers, (path, &encoding))?)
        }
        #[cfg(feature = "mpi")]
        (_, Some((image, _))) => Ok(Picture::from(image.as_ref()).write(path, &encoding)?),
    }
}

/// Renders the mattes that the command asks for. An error is printed, so that the image is written
/// in any case; returns whether there was one.
fn mattes(arguments: &RenderArgs, session: &mut Session) -> (Cryptomatte, bool) {
    if !arguments.aov.contains(&Aov::Cryptomatte) {
        return (Cryptomatte::default(), false);
    }
    let mut bar = Bar::named(arguments.log.quiet, "mattes");
    match cryptomatte::render(&mut session.renderer, &session.settings, &session.names, &mut bar) {
        Ok(mattes) => (mattes, false),
        Err(error) => {
            eprint(&format!("error: mattes: {error}"));
            (Cryptomatte::default(), true)
        }
    }
}

/// Renders the layers of surfaces that the command asks for. An error is printed, so that the image
/// is written in any case; returns whether there was one.
fn surfaces(arguments: &RenderArgs, session: &mut Session) -> (Vec<Channel>, bool) {
    let Session { renderer, settings, surfaces: Some(scenes), .. } = session else {
        return (Vec::new(), false);
    };
    let mut bar = Bar::named(arguments.log.quiet, "surfaces");
    match surfaces::render(renderer, settings, scenes, &arguments.aov, &mut bar) {
        Ok(channels) => (channels, false),
        Err(error) => {
            eprint(&format!("error: layers of surfaces: {error}"));
            (Vec::new(), true)
        }
    }
}

/// Returns the metadata that the command asks for.
fn metadata(arguments: &RenderArgs, session: &Session, stats: &RenderStats) -> Metadata {
    let (choice, Some(digest)) = (arguments.file.metadata(), session.digest) else {
        return Metadata::default();
    };
    if choice == MetadataArg::None {
        return Metadata::default();
    }
    let settings = &session.settings;
    let fingerprint = session.renderer.fingerprint(&digest, settings);
    let samples = stats.samples as f64 / settings.pixels().max(1) as f64;
    let mut metadata = metadata::of_image(&session.name, samples, &fingerprint);
    metadata::add_display(&mut metadata, stats.exposure, arguments.file.tone_map());
    if choice == MetadataArg::All {
        metadata::add_run(&mut metadata, stats);
    }
    metadata.camera = Some(session.camera_metadata());
    metadata
}
