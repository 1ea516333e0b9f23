//! `trisect render`.

use super::Session;
use crate::cli::RenderArgs;
use crate::progress::Bar;
use std::fs;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trisect::denoise::Denoise;
use trisect::distribute::DistributeError;
use trisect::film::Film;
use trisect::image::{Image, ImageError};
use trisect::output::layers;
use trisect::render::SettingsError;
use trisect::sampling::{self, Goal, Request, Sampled};
use trisect::stats::RenderStats;
use trisect::{Error, output};

/// Renders a scene to a file.
pub fn run(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    if arguments.cluster.distribute.is_some() {
        if arguments.request()?.is_some() {
            let what = "--budget, --target-error and --quality are for one process".to_owned();
            return Err(DistributeError::Unsupported { what, remedy: "name --spp".to_owned() }.into());
        }
        #[cfg(feature = "mpi")]
        return super::cluster::render::run(arguments);
        #[cfg(not(feature = "mpi"))]
        return Err(DistributeError::NotBuilt.into());
    }
    super::refuse_ranks(&arguments.cluster)?;
    check(arguments)?;
    let request = arguments.request()?;
    // A filter that a goal may choose is no wish of the user's.
    let denoise = arguments.denoise.denoise()?;
    if let Some(request) = &request {
        sampling::check(request.goal)?;
    }

    let mut session = Session::open(&arguments.job)?;
    session.settings.guides = needs_guides(arguments, denoise.as_ref());
    if !arguments.quiet {
        announce(&session, &aim(&session, request.as_ref()));
    }

    if let Some(request) = request {
        return reach(arguments, session, &request, denoise);
    }
    let mut frame = session.renderer.render(&session.settings, &mut Bar::new(arguments.quiet))?;
    frame.stats.phases.load_seconds = session.load_seconds;
    finish(arguments, session, Drawn::Film(&frame.film), frame.stats, denoise)
}

/// Renders until a goal is reached.
fn reach(
    arguments: &RenderArgs,
    mut session: Session,
    request: &Request,
    denoise: Option<Denoise>,
) -> Result<ExitCode, Error> {
    let bar = &mut Bar::of_goal(arguments.quiet);
    let Sampled { film, image, mut stats } =
        sampling::render(&mut session.renderer, &session.settings, request, bar)?;
    stats.phases.load_seconds = session.load_seconds;
    if matches!(request.goal, Goal::Error { .. }) {
        return finish(arguments, session, Drawn::Film(&film), stats, denoise);
    }
    conclude(arguments, session, Drawn::Film(&film), stats, Some(image))
}

/// Whether the render must write what tells edges.
pub fn needs_guides(arguments: &RenderArgs, denoise: Option<&Denoise>) -> bool {
    denoise.is_some() || arguments.aov.iter().any(|aov| aov.needs_guides())
}

/// Finds out what cannot be written before minutes of rendering are lost.
pub fn check(arguments: &RenderArgs) -> Result<(), Error> {
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
    Ok(())
}

/// How much is rendered.
pub fn aim(session: &Session, request: Option<&Request>) -> String {
    match request.map(|request| request.goal) {
        None => format!("{} spp", session.settings.samples),
        Some(Goal::Error { target, .. }) => format!("until the error is {} %", 100.0 * target),
        Some(Goal::Time(time)) => format!("for {} s", time.as_secs_f64()),
    }
}

/// Says what is rendered, and where.
pub fn announce(session: &Session, aim: &str) {
    let device = session.renderer.backend().device();
    eprintln!("{}: {}x{}, {aim}", session.name, session.settings.width, session.settings.height);
    eprintln!("{}: {} ({})", device.backend, device.name, device.details);
    if !session.choice.is_empty() {
        eprintln!("  {}", session.choice);
    }
}

/// What was rendered.
pub enum Drawn<'a> {
    /// All sums.
    Film(&'a Film),
    /// Mean radiance.
    #[cfg(feature = "mpi")]
    Image(&'a Image),
    /// Three bytes a pixel, for a .png.
    #[cfg(feature = "mpi")]
    Bytes(u32, u32, &'a [u8]),
}

/// Denoises, and writes the image and what it took.
pub fn finish(
    arguments: &RenderArgs,
    mut session: Session,
    drawn: Drawn,
    mut stats: RenderStats,
    denoise: Option<Denoise>,
) -> Result<ExitCode, Error> {
    let mut image = None;
    if let (Drawn::Film(film), Some(denoise)) = (&drawn, &denoise) {
        let denoised = session.renderer.denoise(film, &session.settings, denoise);
        let (denoised, passes) = match denoised {
            Ok(denoised) => denoised,
            Err(error) => {
                // Nothing that was rendered is lost.
                output::write(&film.image(), &arguments.output)?;
                eprintln!("warning: wrote {} without denoising", arguments.output.display());
                return Err(error);
            }
        };
        stats.denoise_seconds = passes.iter().map(Duration::as_secs_f64).sum();
        stats.denoise = Some(*denoise);
        image = Some(denoised);
    }
    conclude(arguments, session, drawn, stats, image)
}

/// Writes the image and what it took.
fn conclude(
    arguments: &RenderArgs,
    session: Session,
    drawn: Drawn,
    mut stats: RenderStats,
    denoised: Option<Image>,
) -> Result<ExitCode, Error> {
    let start = Instant::now();
    write(arguments, &session, &drawn, denoised)?;

    let stats = &mut stats;
    stats.phases.write_seconds = start.elapsed().as_secs_f64();
    stats.scene = session.name;
    stats.choice = session.choice;
    if let Some(path) = &arguments.stats {
        let text = serde_json::to_string_pretty(&stats)
            .map_err(|error| ImageError::Codec { path: path.clone(), message: error.to_string() })?;
        fs::write(path, text + "\n").map_err(|source| ImageError::Io { path: path.clone(), source })?;
    }
    if !arguments.quiet {
        eprintln!("{}", stats.summary());
        if let Some(cluster) = &stats.cluster {
            eprintln!("{}", cluster.summary());
        }
        if let Some(sampling) = &stats.sampling {
            eprintln!("{}", sampling.summary());
        }
        eprintln!("wrote {}", arguments.output.display());
    }
    for warning in stats.warnings() {
        eprintln!("warning: {warning}");
    }
    Ok(if stats.unwritten_pixels == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Writes the image that was denoised, or what was drawn, with its layers.
pub fn write(
    arguments: &RenderArgs,
    session: &Session,
    drawn: &Drawn,
    denoised: Option<Image>,
) -> Result<(), Error> {
    let path = &arguments.output;
    #[cfg_attr(
        not(feature = "mpi"),
        allow(clippy::infallible_destructuring_match, reason = "ranks bring the others")
    )]
    let film = match drawn {
        #[cfg(feature = "mpi")]
        Drawn::Bytes(width, height, bytes) => return Ok(output::write_bytes(*width, *height, bytes, path)?),
        #[cfg(feature = "mpi")]
        Drawn::Image(image) => return Ok(output::write(image, path)?),
        Drawn::Film(film) => film,
    };
    let image = denoised.unwrap_or_else(|| film.image());
    if arguments.aov.is_empty() {
        return Ok(output::write(&image, path)?);
    }
    let camera = session.renderer.camera(&session.settings);
    let object = |primitive| session.renderer.object(primitive);
    Ok(layers::write(&image, film, &camera, object, &arguments.aov, path)?)
}
