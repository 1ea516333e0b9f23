//! `trisect view`.

mod headless;
#[cfg(feature = "window")]
mod window;

use super::Session;
use crate::cli::{DenoiseArg, ViewArgs};
use std::process::ExitCode;
use trisect::Error;
use trisect::view::Look;

/// Shows a scene's frames.
pub fn run(arguments: &ViewArgs) -> Result<ExitCode, Error> {
    let denoise = arguments.denoise.denoise_or(DenoiseArg::Svgf)?;
    let history = arguments.history();
    history.check()?;
    headless::check(arguments)?;
    let mut session = Session::open(&arguments.job)?;
    // A frame is one sample a pixel, whatever the scene asks for.
    session.settings.samples = arguments.job.spp.unwrap_or(1);
    session.settings.guides = true;
    session.settings.check()?;
    session.settings.check_live()?;
    let look = Look {
        scale: arguments.scale,
        history,
        enough: arguments.enough,
        screen: arguments.screen(),
        ..Look::new(session.settings.clone(), denoise)
    };
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
