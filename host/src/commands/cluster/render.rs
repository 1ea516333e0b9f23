//! `trisect render --distribute`.

use super::super::Session;
use super::super::render::{self as single, Drawn};
use super::Crew;
use crate::cli::{DistributeArg, RenderArgs};
use crate::progress::Bar;
use std::process::ExitCode;
use trisect::distribute::{Failure, Mode, Picture, Plan, Travels, Work, choose, plan, still};
use trisect::output::{self, Format};
use trisect::render::Settings;
use trisect::{Error, Error::Cancelled};

/// Renders an image over all ranks.
pub fn run(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    let cluster = &arguments.cluster;
    let mut crew = Crew::start(&cluster.ranks)?;
    let ranks = crew.link.ranks();
    let (own, checked) = (arguments.clone(), arguments.clone());
    let adjust = move |settings: &mut Settings| {
        let denoise = own.denoise.denoise()?;
        settings.guides = single::needs_guides(&own, denoise.as_ref());
        let plan = own.cluster.plan();
        let travels = travels(&own, settings, &plan, ranks);
        let distribute = format!("{plan:?}, {:?}", own.cluster.distribute);
        Ok(vec![
            ("--distribute with its parameters".to_owned(), distribute),
            ("what travels, by the output's format".to_owned(), format!("{travels:?}")),
        ])
    };
    let check = move || single::check(&checked);
    let session = match crew.assemble(&arguments.job, &cluster.ranks, check, adjust) {
        Ok(session) => session,
        Err(code) => return Ok(code),
    };
    let denoise = arguments.denoise.denoise()?;
    let quiet = arguments.quiet || !crew.link.is_root();
    if !quiet {
        single::announce(&session, &single::aim(&session, None));
    }
    let Session { renderer, settings, name, digest, space, choice, load_seconds, open_seconds } = session;
    let plan = cluster.plan();
    let travel = travels(arguments, &settings, &plan, ranks);
    let mut work = Work { settings: settings.clone(), plan, travels: travel, choice: String::new() };
    let mut renderer = renderer;
    if cluster.distribute == Some(DistributeArg::Auto) {
        let chosen;
        (renderer, chosen) = match choose(&mut crew.link, renderer, &work) {
            Ok(chosen) => chosen,
            Err(error) => return Ok(crew.give_up(&error)),
        };
        (work.plan.mode, work.choice) = chosen;
        work.travels = travels(arguments, &settings, &work.plan, ranks);
        if !quiet {
            eprintln!("  {}", work.choice);
        }
    }
    let ended = crew.ended();
    let done = still(&mut crew.link, renderer, &work, &mut Bar::new(quiet), &ended);
    let (finished, renderer) = match done {
        Ok(done) => done,
        Err(Failure { error, partial }) => {
            let partial = partial.filter(|_| cluster.write_partial && !matches!(error, Cancelled));
            if let Some(partial) = partial {
                match write_partial(arguments, &partial) {
                    Ok(()) => eprintln!("wrote what there is to {}", arguments.output.display()),
                    Err(error) => eprintln!("error: {error}"),
                }
            }
            return Ok(crew.give_up(&error));
        }
    };
    let Some(finished) = finished else { return Ok(ExitCode::SUCCESS) };
    let mut stats = finished.stats(renderer.backend().device(), &settings);
    stats.phases.load_seconds = load_seconds;
    let session = Session { renderer, settings, name, digest, space, choice, load_seconds, open_seconds };
    let drawn = match &finished.picture {
        Picture::Bytes { width, height, bytes } => Drawn::Bytes(*width, *height, bytes),
        Picture::Color(image) => Drawn::Image(image),
        Picture::Film(film) => Drawn::Film(film),
    };
    Ok(single::finish(arguments, session, drawn, stats, denoise)?.0)
}

/// What travels of each pixel: the least that the output needs.
fn travels(arguments: &RenderArgs, settings: &Settings, plan: &Plan, ranks: u32) -> Travels {
    let most = plan::samples_of(settings.samples, 0, plan::averaging(settings.samples, ranks));
    if settings.guides {
        Travels::Guided
    } else if !arguments.aov.is_empty() {
        Travels::Sums
    } else if plan.mode == Mode::Average {
        // Where shares differ, who has more than a chunk sends exact sums.
        if most.len() <= 256 { Travels::Chunk } else { Travels::Mean }
    } else if matches!(Format::of(&arguments.output), Ok(Format::Png)) {
        Travels::Bytes
    } else {
        Travels::Color
    }
}

/// The image without layers and filters: time is short.
fn write_partial(arguments: &RenderArgs, partial: &Picture) -> Result<(), Error> {
    let path = &arguments.output;
    match partial {
        Picture::Bytes { width, height, bytes } => output::write_bytes(*width, *height, bytes, path)?,
        Picture::Color(image) => output::write(image, path)?,
        Picture::Film(film) => output::write(&film.image(), path)?,
    }
    Ok(())
}
