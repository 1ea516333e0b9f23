//! `trisect render`: renders a scene to an image file, with checkpoints, goals and layers.
//!
//! `resume` and the renders over ranks call its functions to check and write outputs.

mod light_groups;
mod write;

pub use write::{BEYOND_HALF, RenderOutput, finish, write_outputs};

use super::background;
use super::checkpointing::{ProgressObserver, RenderStart, RenderSupervisor, StopReason};
use super::data;
use super::display::Display;
use super::eprint;
use super::signals::interrupts;
use super::{Session, fit_to_cpu};
use crate::cli::{JobArgs, RenderArgs};
use crate::progress::Bar;
use std::io::{IsTerminal, stdout};
use std::ops::Range;
use std::process::ExitCode;
use std::time::Instant;
use trisect::adaptive::{self, Goal, Request, Sampled};
use trisect::checkpoint::{self, Checkpoint, CheckpointError, Place, arithmetic};
use trisect::denoise::Denoiser;
use trisect::device::BackendError;
use trisect::error::MotionError;
use trisect::film::{Film, SampleBlock};
use trisect::layers::{self, Aov};
use trisect::output;
use trisect::output::{Format, Outputs};
use trisect::render::Settings;
use trisect::stats::RenderStats;
use trisect_lab::Error;

/// Renders a scene to an image file.
pub fn run(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    let start = Instant::now();
    let (request, denoise) = goal(arguments)?;
    check(arguments)?;
    check_new(arguments)?;

    let display = Display::open(arguments)?;
    let job = JobArgs { may_roulette: request.is_some(), ..job(arguments) };
    let mut session = Session::open_to_render(&job, arguments, &outputs(arguments))?;
    session.display = display;
    adapt(&mut session.settings, arguments, denoise.as_ref());
    if !arguments.log.quiet {
        announce(&session, &goal_text(&session, request.as_ref()));
    }

    if let Some(request) = request {
        return render_to_goal(arguments, session, &request, denoise, start);
    }
    render_film(arguments, session, denoise, None, start)
}

/// Returns the job of a command, with what its outputs need.
pub fn job(arguments: &RenderArgs) -> JobArgs {
    let needs_names = arguments.aov.contains(&Aov::Cryptomatte);
    let needs_surfaces = arguments.aov.iter().any(|aov| aov.needs_surfaces());
    JobArgs { needs_names, needs_surfaces, crop: arguments.crop, ..arguments.job.clone() }
}

/// Returns the goal of a command for one process, and its filter, which a goal may replace. Prints
/// warnings about options without effect.
pub fn goal(arguments: &RenderArgs) -> Result<(Option<Request>, Option<Denoiser>), Error> {
    super::refuse_ranks(&arguments.cluster)?;
    let ignored = arguments.goal.without_effect().into_iter().chain(arguments.motion.without_effect());
    let ignored: Vec<_> = ignored.chain(arguments.file.without_effect(&arguments.output)).collect();
    super::warn(&ignored, "the options", arguments.job.deny_warnings)?;
    let request = arguments.request()?;
    let denoise = checked_denoiser(arguments)?;
    if let Some(request) = &request {
        adaptive::check(request.goal)?;
        if arguments.checkpointing.checkpoint.is_some() {
            return Err(CheckpointError::Unsupported { what: "--checkpoint" }.into());
        }
    }
    Ok((request, denoise))
}

/// Returns the denoiser of a command, before the render, if what it needs is there.
pub fn checked_denoiser(arguments: &RenderArgs) -> Result<Option<Denoiser>, Error> {
    let denoise = arguments.denoise.denoise()?;
    denoise.as_ref().map_or(Ok(()), Denoiser::check)?;
    Ok(denoise)
}

/// Renders the samples that the checkpoint `before` lacks, or all samples without one; writes
/// checkpoints meanwhile, and at the end the image, also of an incomplete film. The command started
/// at `start`.
pub fn render_film(
    arguments: &RenderArgs,
    mut session: Session,
    denoise: Option<Denoiser>,
    before: Option<(Place, Checkpoint)>,
    start: Instant,
) -> Result<ExitCode, Error> {
    let RenderStart { mut film, samples, saver } = RenderStart::new(arguments, &session, before)?;
    let watch =
        RenderSupervisor::new(arguments, saver, start, interrupts()).showing(session.display.as_ref());
    let bar = Bar::new(arguments.log.quiet);
    let mut told = ProgressObserver { bar, watch: &watch, announced: arguments.log.quiet };
    let mut spare = session.fallback_scene.take();
    let mut elsewhere = |error: &BackendError, film: &Film, settings: &mut Settings| {
        let loaded = spare.take()?;
        eprint(&format!("warning: {error}\n  the CPU continues (--fallback)"));
        fit_to_cpu(settings);
        let session = loaded.on_cpu(&arguments.job);
        if let Ok(session) = &session {
            watch.add_rounding(&arithmetic(session.renderer.device().info(), settings.math));
        }
        watch.rescue(film, arguments.log.quiet);
        Some(session.map(|session| session.renderer))
    };
    let Session { renderer, settings, .. } = &mut session;
    let rendered = renderer.render_missing_with_fallback(
        &mut film,
        settings,
        &samples,
        &watch,
        &mut told,
        &mut elsewhere,
    );
    let mut stats = match rendered {
        Ok(stats) => stats,
        Err(error) => {
            watch.rescue(&film, arguments.log.quiet);
            return Err(error.into());
        }
    };
    stats.phases.load_seconds = session.load_seconds;
    finish_film(arguments, session, (&film, &samples), &watch, stats, denoise)
}

/// Writes checkpoint and image of a film that should have `samples`, and prints the first missing
/// rows and samples.
pub fn finish_film(
    arguments: &RenderArgs,
    mut session: Session,
    (film, samples): (&Film, &Range<u32>),
    watch: &RenderSupervisor,
    stats: RenderStats,
    denoise: Option<Denoiser>,
) -> Result<ExitCode, Error> {
    let kept = watch.finish(film, arguments.log.quiet);
    let lacking = film.coverage.missing(samples);
    let ended = watch.stop_reason().filter(|_| !lacking.is_empty());
    if let Some(part) = lacking.first() {
        let SampleBlock { rows, samples } = part;
        let of = (rows.start, rows.end, samples.start);
        eprint(&format!(
            "ended before it was complete: rows {} to {} lack samples from {} on",
            of.0, of.1, of.2
        ));
        if ended == Some(StopReason::OutOfTime) && arguments.checkpointing.checkpoint.is_none() {
            eprint("for the best complete image in a time: --budget TIME in place of --time-limit");
        }
    }
    if let Some(ended) = ended.filter(|_| film.coverage.parts().is_empty()) {
        // An earlier image is not replaced.
        eprint(&format!("nothing was rendered: {} is unchanged", arguments.output.display()));
        return Ok(if kept? { ended.exit_code() } else { ExitCode::FAILURE });
    }
    let mut arguments = arguments.clone();
    if ended.is_some() && !arguments.light_group.is_empty() {
        eprint("the light groups are left out: they would take as long as the image");
        arguments.light_group.clear();
    }
    let arguments = &arguments;
    // A filter would spread rendered pixels over missing ones.
    let denoise = denoise.filter(|_| stats.unwritten_pixels == 0);
    let (code, in_place) = finish(arguments, &mut session, RenderOutput::Film(film), stats, denoise)?;
    let in_place = kept? && in_place;
    // A queue must not resume by exit code 7 if an output is at a fallback path.
    Ok(match ended {
        Some(StopReason::OutOfTime) if !in_place => ExitCode::FAILURE,
        Some(ended) => ended.exit_code(),
        None if !in_place => ExitCode::FAILURE,
        None => code,
    })
}

/// Renders until the goal is reached, or until an interrupt or the time limit, and writes the
/// image.
fn render_to_goal(
    arguments: &RenderArgs,
    mut session: Session,
    request: &Request,
    denoise: Option<Denoiser>,
    start: Instant,
) -> Result<ExitCode, Error> {
    let watch = RenderSupervisor::new(arguments, None, start, interrupts());
    let mut told = ProgressObserver {
        bar: Bar::of_goal(arguments.log.quiet),
        watch: &watch,
        announced: arguments.log.quiet,
    };
    let Sampled { film, image, mut stats } =
        adaptive::render(&mut session.renderer, &session.settings, request, &mut told)?;
    stats.phases.load_seconds = session.load_seconds;
    let ended =
        watch.stop_reason().filter(|_| stats.sampling.as_ref().is_some_and(|sampling| sampling.ended));
    let (code, in_place) = match request.goal {
        Goal::Error { .. } => finish(arguments, &mut session, RenderOutput::Film(&film), stats, denoise)?,
        Goal::Time(_) => {
            write_outputs(arguments, &mut session, RenderOutput::Film(&film), stats, Some(image))?
        }
    };
    Ok(ended.filter(|_| in_place).map_or(code, StopReason::exit_code))
}

/// Adapts the settings to what the image needs: AOV sums for a filter, for a layer of the first hit
/// and for a background, behind which the sky is hidden.
pub fn adapt(settings: &mut Settings, arguments: &RenderArgs, denoise: Option<&Denoiser>) {
    settings.hidden_sky = arguments.background.hides_sky();
    settings.guides =
        denoise.is_some() || settings.hidden_sky || arguments.aov.iter().any(|aov| aov.needs_aov_sums());
}

/// Returns the files that a render writes.
pub fn outputs(arguments: &RenderArgs) -> Outputs {
    Outputs::default()
        .file("-o", Some(&arguments.output))
        .file(arguments.log.stats_option, arguments.log.stats.as_deref())
        .file("--checkpoint", arguments.checkpointing.checkpoint.as_deref())
}

/// Checks before the render that all outputs can be written.
pub fn check(arguments: &RenderArgs) -> Result<(), Error> {
    Format::of(&arguments.output)?;
    if output::is_stdout(&arguments.output) && stdout().is_terminal() {
        return Err(trisect::image::ImageError::ToTerminal.into());
    }
    if !arguments.aov.is_empty() {
        layers::check(&arguments.output, &arguments.aov)?;
    }
    let moves = arguments.motion.frames.is_some() || arguments.motion.camera_path.is_some();
    if arguments.aov.contains(&Aov::Motion) && !moves {
        return Err(MotionError::NoFrames.into());
    }
    light_groups::check(arguments)?;
    background::check(arguments.background, &arguments.output)?;
    arguments.file.check(&arguments.output)?;
    outputs(arguments).check()?;
    output::probe(&arguments.output)?;
    if let Some(stats) = &arguments.log.stats {
        data::probe(stats)?;
    }
    if let Some(path) = &arguments.checkpointing.checkpoint {
        checkpoint::probe(path)?;
    }
    Ok(())
}

/// Checks that the checkpoint of a new render does not exist yet.
pub fn check_new(arguments: &RenderArgs) -> Result<(), Error> {
    match arguments.checkpointing.checkpoint.as_ref().filter(|path| path.exists()) {
        Some(path) => Err(CheckpointError::Exists { path: path.clone() }.into()),
        None => Ok(()),
    }
}

/// Returns the goal as text: samples per pixel, error or time.
pub fn goal_text(session: &Session, request: Option<&Request>) -> String {
    match request.map(|request| request.goal) {
        None => format!("{} spp", session.settings.samples),
        Some(Goal::Error { target, .. }) => format!("until the error is {} %", 100.0 * target),
        Some(Goal::Time(time)) => format!("for {} s", time.as_secs_f64()),
    }
}

/// Prints scene, image size, goal and device.
pub fn announce(session: &Session, aim: &str) {
    let device = session.renderer.device().info();
    eprint(&format!("{}: {}x{}, {aim}", session.name, session.settings.width, session.settings.height));
    eprint(&format!("{}: {} ({})", device.backend, device.name, device.details));
    if !session.choice.is_empty() {
        eprint(&format!("  {}", session.choice));
    }
    for note in &session.notes {
        eprint(note);
    }
}
