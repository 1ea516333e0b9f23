//! `trisect view`.

pub mod headless;
#[cfg(feature = "window")]
mod window;

use super::Session;
use crate::cli::{DenoiseArg, ViewArgs};
use std::process::ExitCode;
use trisect::Error;
use trisect::render::Settings;
use trisect::view::Look;

/// What is shown of a scene that asks for these settings.
pub fn look(arguments: &ViewArgs, settings: &Settings) -> Result<Look, Error> {
    let denoise = arguments.denoise.denoise_or(DenoiseArg::Svgf)?;
    let history = arguments.history();
    history.check()?;
    // A frame is one sample a pixel, whatever the scene asks for.
    let samples = arguments.job.spp.unwrap_or(1);
    let settings = Settings { samples, guides: true, ..settings.clone() };
    settings.check()?;
    settings.check_live()?;
    Ok(Look {
        scale: arguments.scale,
        history,
        enough: arguments.enough,
        screen: arguments.screen(),
        ..Look::new(settings, denoise)
    })
}

/// Shows a scene's frames.
pub fn run(arguments: &ViewArgs) -> Result<ExitCode, Error> {
    if arguments.cluster.distribute.is_some() {
        #[cfg(feature = "mpi")]
        return super::cluster::view::run(arguments);
        #[cfg(not(feature = "mpi"))]
        return Err(trisect::distribute::DistributeError::NotBuilt.into());
    }
    super::refuse_ranks(&arguments.cluster)?;
    arguments.history().check()?;
    let outputs = headless::check(arguments)?;
    let mut session = Session::open(&arguments.job, &outputs)?;
    let look = look(arguments, &session.settings)?;
    session.settings = look.settings.clone();
    if arguments.headless {
        return headless::run(arguments, session, &look);
    }
    #[cfg(feature = "window")]
    return window::run(arguments, session, look);
    #[cfg(not(feature = "window"))]
    Err(trisect::backend::BackendError::Unavailable {
        backend: "window",
        reason: "this program was built without the feature `window`".to_owned(),
        remedy: "build it with the feature, or use trisect view --headless".to_owned(),
    }
    .into())
}
