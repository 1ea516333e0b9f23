//! `trisect view`: frames of a scene in a window, or without one.

pub mod headless;
#[cfg(feature = "window")]
mod window;

use super::{Session, eprint};
use crate::cli::{DenoiseArg, JobArgs, ViewArgs};
use std::process::ExitCode;
use trisect::input;
use trisect::output::exposure::{Automatic, Exposure, LightLevel};
use trisect::render::Settings;
use trisect::view::ViewOptions;
use trisect_lab::Error;

/// Returns the view options from the command line and the scene's settings.
pub fn look(arguments: &ViewArgs, settings: &Settings) -> Result<ViewOptions, Error> {
    let denoise = arguments.denoise.live_filter(DenoiseArg::Svgf)?;
    let history = arguments.history();
    history.check()?;
    // The default is one sample per pixel and frame, not the scene's number.
    let samples = arguments.job.spp.unwrap_or(1);
    let settings = Settings { samples, guides: true, ..settings.clone() };
    settings.check()?;
    settings.check_live()?;
    Ok(ViewOptions {
        scale: arguments.scale,
        history,
        max_samples: arguments.enough,
        screen: arguments.screen(),
        ..ViewOptions::new(settings, denoise)
    })
}

/// Longer side in pixels of the image from which an automatic exposure is determined.
const METER_PIXELS: u32 = 128;
/// Samples per pixel of the image from which an automatic exposure is determined.
const METER_SAMPLES: u32 = 16;

/// Returns the exposure in stops for a model without a scene file, from a small image of it, and
/// prints it.
pub fn metered(session: &mut Session, look: &ViewOptions, level: LightLevel) -> Result<f32, Error> {
    let Settings { width, height, .. } = look.settings;
    let share = f64::from(METER_PIXELS) / f64::from(width.max(height).max(METER_PIXELS));
    let side = |pixels: u32| ((f64::from(pixels) * share) as u32).max(1);
    let settings = Settings {
        width: side(width),
        height: side(height),
        samples: METER_SAMPLES,
        ..look.settings.clone()
    };
    let automatic = Automatic::of(&session.renderer.render(&settings)?.film.image(), level);
    eprint(&automatic.to_string());
    Ok(automatic.stops)
}

/// Shows a scene in a window, or renders its frames without one.
pub fn run(arguments: &ViewArgs) -> Result<ExitCode, Error> {
    super::refuse_ranks(&arguments.cluster)?;
    arguments.history().check()?;
    arguments.denoise.live_filter(DenoiseArg::Svgf)?;
    let outputs = headless::check(arguments)?;
    // A window reads its files again when they change, and names what is picked.
    input::record();
    let job = JobArgs { needs_names: !arguments.headless, ..arguments.job.clone() };
    let mut session = Session::open(&job, &outputs)?;
    let mut look = look(arguments, &session.settings)?;
    session.settings = look.settings.clone();
    session.notes.iter().for_each(|note| eprint(note));
    if let Exposure::Automatic(level) = arguments.job.exposure(arguments.exposure) {
        look.screen.stops = metered(&mut session, &look, level)?;
    }
    if arguments.headless {
        return headless::run(arguments, session, &look);
    }
    #[cfg(feature = "window")]
    return window::run(arguments, session, look);
    #[cfg(not(feature = "window"))]
    Err(trisect::device::BackendError::Unavailable {
        backend: "window",
        reason: "this program was built without the feature `window`".to_owned(),
        remedy: "build it with --features window, or use trisect view --headless".to_owned(),
    }
    .into())
}
