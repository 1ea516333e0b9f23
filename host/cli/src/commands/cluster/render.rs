//! `trisect render --distribute`: renders an image over ranks.

use super::super::background;
use super::super::checkpointing::{RenderStart, RenderSupervisor};
use super::super::fallback_path::or_fallback_path;
use super::super::render::{self as single, RenderOutput};
use super::super::resume::describe_contents;
use super::super::{eprint, warn};
use super::{ClusterSession, Session};
use crate::cli::{DistributeArg, RenderArgs};
use crate::progress::Bar;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use trisect::Error::Cancelled;
use trisect::checkpoint::{Checkpoint, Header, Place, arithmetic};
use trisect::device::DeviceInfo;
use trisect::image::Image;
use trisect::output::{self, Format, Metadata, Picture};
use trisect::render::Settings;
use trisect_cluster::{
    AssembledImage, ClusterError, ClusterPlan, DistributionMode, Failure, ResumableFilm, WireFormat, Work,
    choose, plan, render_into_film,
};
use trisect_lab::Error;

/// Checkpoint from which a render continues.
#[derive(Clone)]
pub struct ResumeState {
    /// File of the checkpoint; the root writes it.
    pub place: Place,
    /// Header of the checkpoint.
    pub header: Header,
    /// True if its film has AOV sums.
    pub aovs: bool,
    /// The checkpoint, on the root only.
    pub checkpoint: Option<Checkpoint>,
}

/// Renders an image over all ranks.
pub fn run(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    render_film(ClusterSession::start(&arguments.cluster.ranks, arguments.job.threads)?, arguments, None)
}

/// Renders an image over all ranks, or continues from the checkpoint `before`.
pub fn render_film(
    mut crew: ClusterSession,
    arguments: &RenderArgs,
    before: Option<ResumeState>,
) -> Result<ExitCode, Error> {
    let start = Instant::now();
    let cluster = &arguments.cluster;
    let ranks = crew.link.ranks();
    let mut session = match begin(&mut crew, arguments, before.as_ref()) {
        Ok(session) => session,
        Err(code) => return Ok(code),
    };
    let denoise = arguments.denoise.denoise()?;
    let quiet = arguments.log.quiet || !crew.link.is_root();
    let mut work = work(arguments, &session.settings, ranks)?;
    // With a checkpoint or a time limit, the root keeps the film.
    let (mut kept, mut held) = (None, None);
    if arguments.checkpointing.given().is_some() && crew.link.is_root() {
        let before = before.and_then(|before| Some((before.place, before.checkpoint?)));
        if let Some((_, checkpoint)) = before.as_ref().filter(|_| !quiet) {
            eprint(&describe_contents(checkpoint));
        }
        match RenderStart::new(arguments, &session, before) {
            Ok(RenderStart { film, samples, saver }) => {
                let watch = RenderSupervisor::new(arguments, saver, start, crew.flag());
                let held = held.insert((watch, samples));
                kept = Some(ResumableFilm { film, samples: held.1.clone(), observer: &held.0 });
            }
            Err(error) => return Ok(crew.give_up(&error)),
        }
    }
    // `render_into_film` takes the renderer and returns it; `session` gets it back below.
    let mut renderer = session.renderer;
    if cluster.distribute == Some(DistributeArg::Auto) && arguments.checkpointing.given().is_none() {
        let chosen;
        (renderer, chosen) = match choose(&mut crew.link, renderer, &work) {
            Ok(chosen) => chosen,
            Err(error) => return Ok(crew.give_up(&error.into())),
        };
        (work.plan.mode, work.choice) = chosen;
        work.wire_format = wire_format(arguments, &session.settings, &work.plan, ranks);
        if !quiet {
            eprint(&format!("  {}", work.choice));
        }
    }
    let ended = crew.ended();
    let done = render_into_film(&mut crew.link, renderer, &work, kept, &mut Bar::new(quiet), &ended);
    let (finished, renderer) = match done {
        Ok(done) => done,
        Err(Failure { error, partial }) => {
            let is_asked = (cluster.write_partial || held.is_some())
                && !matches!(error, trisect_cluster::Error::Render(Cancelled));
            if let Some(partial) = partial.filter(|_| is_asked) {
                let watch = held.map(|held| held.0);
                keep_meanwhile(&mut crew, arguments, watch, partial, quiet);
            }
            return Ok(crew.give_up(&error.into()));
        }
    };
    let Some(finished) = finished else { return Ok(ExitCode::SUCCESS) };
    let mut stats = finished.stats(&renderer, &session.settings)?;
    stats.phases.load_seconds = session.load_seconds;
    session.renderer = renderer;
    let drawn = match &finished.picture {
        AssembledImage::Bytes { width, height, bytes } => RenderOutput::Bytes(*width, *height, bytes),
        AssembledImage::Color(image) => RenderOutput::Image(image),
        AssembledImage::Film(film) => match &held {
            Some((watch, samples)) => {
                return single::finish_film(arguments, session, (film, samples), watch, stats, denoise);
            }
            None => RenderOutput::Film(film),
        },
    };
    Ok(single::finish(arguments, &mut session, drawn, stats, denoise)?.0)
}

/// Reads the scene, opens the devices and compares them with the other ranks'. The root prints what
/// will be rendered.
fn begin(
    crew: &mut ClusterSession,
    arguments: &RenderArgs,
    before: Option<&ResumeState>,
) -> Result<Session, ExitCode> {
    let adjust = adjustment(arguments, before, crew.link.ranks());
    let checked = arguments.clone();
    let is_new = before.is_none();
    let check = move || {
        single::check(&checked)?;
        let ignored = checked.goal.without_effect().into_iter().chain(checked.cluster.without_effect());
        warn(&ignored.collect::<Vec<_>>(), "the options", checked.job.deny_warnings)?;
        // The root denoises the image.
        single::checked_denoiser(&checked)?;
        if is_new {
            single::check_new(&checked)?;
        }
        Ok(single::outputs(&checked))
    };
    let session = crew.assemble(&single::job(arguments), &arguments.cluster.ranks, check, adjust)?;
    if crew.link.is_root() && !arguments.log.quiet {
        single::announce(&session, &single::goal_text(&session, None));
    }
    Ok(session)
}

/// Returns what adapts the settings of each rank, and names the facts in which ranks must agree.
fn adjustment(
    arguments: &RenderArgs,
    before: Option<&ResumeState>,
    ranks: u32,
) -> impl FnOnce(&mut Settings, &DeviceInfo) -> Result<Vec<(String, String)>, Error> + Send + 'static {
    let own = arguments.clone();
    let resumed = before.map(|before| (before.header.spp, before.aovs));
    move |settings, device| {
        let denoise = own.denoise.denoise()?;
        single::adapt(settings, &own, denoise.as_ref());
        if let Some((spp, guides)) = resumed {
            (settings.samples, settings.guides) = (spp, guides);
        }
        let Work { plan, wire_format: travels, .. } = work(&own, settings, ranks)?;
        let distribute = format!("{plan:?}, {:?}", own.cluster.distribute);
        let mut facts = vec![
            ("--distribute with its parameters".to_owned(), distribute),
            ("what travels, by the output's format".to_owned(), format!("{travels:?}")),
        ];
        if own.checkpointing.given().is_some() {
            // The checkpoint records the root's arithmetic only, so all ranks must have the same.
            facts.push(("the device's arithmetic".to_owned(), arithmetic(device, settings.math)));
        }
        Ok(facts)
    }
}

/// Calls [`keep`] while the root's heartbeat continues, so that the other ranks stay alive.
fn keep_meanwhile(
    crew: &mut ClusterSession,
    arguments: &RenderArgs,
    watch: Option<RenderSupervisor>,
    partial: Box<AssembledImage>,
    quiet: bool,
) {
    let arguments = arguments.clone();
    let kept = crew.link.run_to_completion(move || keep(&arguments, watch, &partial, quiet));
    if let Err(error) = kept {
        eprint(&format!("error: {error}"));
    }
}

/// Returns the work of all ranks.
///
/// # Errors
///
/// [`ClusterError::Unsupported`] for `--fallback`, and for a film kept with `--distribute average`.
fn work(arguments: &RenderArgs, settings: &Settings, ranks: u32) -> Result<Work, Error> {
    let cluster = &arguments.cluster;
    if arguments.checkpointing.fallback.is_some() {
        let (what, remedy) = ("--fallback is for one process", "use --spare cpu");
        return Err(ClusterError::Unsupported { what: what.to_owned(), remedy: remedy.to_owned() }.into());
    }
    if let Some(what) = arguments.checkpointing.given() {
        if cluster.distribute == Some(DistributeArg::Average) {
            let what = format!(
                "{what} needs a film that grows by rows and chunks, which --distribute average does not have"
            );
            let remedy = "use --distribute rows".to_owned();
            return Err(ClusterError::Unsupported { what, remedy }.into());
        }
        return Ok(Work::for_film(settings.clone(), cluster.ranks.block_shift()));
    }
    let plan = cluster.plan();
    let travels = wire_format(arguments, settings, &plan, ranks);
    Ok(Work { settings: settings.clone(), plan, wire_format: travels, choice: String::new() })
}

/// Returns the wire format of a pixel: the smallest one with all data that the output needs.
fn wire_format(arguments: &RenderArgs, settings: &Settings, plan: &ClusterPlan, ranks: u32) -> WireFormat {
    let most = plan::samples_of(settings.samples, 0, plan::averaging(settings.samples, ranks));
    if settings.guides {
        WireFormat::SumsAndAovs
    } else if !arguments.aov.is_empty() {
        WireFormat::Sums
    } else if plan.mode == DistributionMode::Average {
        // Shares may differ in size; if the largest exceeds a chunk, exact sums are sent.
        if most.len() <= 256 { WireFormat::Chunk } else { WireFormat::Mean }
    } else if matches!(Format::of(&arguments.output), Ok(Format::Png))
        && arguments.exposure().is_none()
        && arguments.file.is_plain()
    {
        WireFormat::Bytes
    } else {
        WireFormat::Color
    }
}

/// Writes the checkpoint and the partial image, without layers and filters because time is short.
fn keep(arguments: &RenderArgs, watch: Option<RenderSupervisor>, partial: &AssembledImage, quiet: bool) {
    if let (Some(watch), AssembledImage::Film(film)) = (watch, partial) {
        watch.rescue(film, quiet);
        if film.coverage.parts().is_empty() {
            return;
        }
    }
    let exposed = |mut image: Image, alpha: Option<&[f32]>, path: &Path| {
        arguments.exposure().of(&image, path).apply(&mut image);
        arguments.file.tone_map().apply(&mut image, alpha);
        Ok(Picture::from(&image).write(path, &arguments.file.encoding())?)
    };
    let written = or_fallback_path(&arguments.output, |path| match partial {
        AssembledImage::Bytes { width, height, bytes } => {
            Ok(output::write_bytes((*width, *height), bytes, path, &Metadata::default())?)
        }
        AssembledImage::Color(image) => exposed(image.clone(), None, path),
        AssembledImage::Film(film) => {
            let alpha = background::alpha_behind(arguments.background, film);
            exposed(film.image(), alpha.as_deref(), path)
        }
    });
    match written {
        Ok(path) => eprint(&format!("wrote the partial image to {}", path.display())),
        Err(error) => eprint(&format!("error: {error}")),
    }
}
