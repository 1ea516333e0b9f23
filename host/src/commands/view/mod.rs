//! `trisect view`.

pub mod headless;
#[cfg(feature = "window")]
mod window;

use super::{Session, eprint};
use crate::cli::{DenoiseArg, ViewArgs};
use std::process::ExitCode;
use trisect::Error;
use trisect::output::exposure::{Automatic, Exposure};
use trisect::render::Settings;
use trisect::view::ViewOptions;

/// What is shown of a scene that asks for these settings.
pub fn look(arguments: &ViewArgs, settings: &Settings) -> Result<ViewOptions, Error> {
    let denoise = arguments.denoise.denoise_or(DenoiseArg::Svgf)?;
    let history = arguments.history();
    history.check()?;
    // A frame is one sample a pixel, whatever the scene asks for.
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

/// Longer side of the image that an automatic exposure is measured in, in pixels.
const METER_PIXELS: u32 = 128;
/// Its samples a pixel.
const METER_SAMPLES: u32 = 16;

/// Returns the exposure that a model by itself is shown with, by a small image of it, and says so.
pub fn metered(session: &mut Session, look: &ViewOptions) -> Result<f32, Error> {
    let Settings { width, height, .. } = look.settings;
    let share = f64::from(METER_PIXELS) / f64::from(width.max(height).max(METER_PIXELS));
    let side = |pixels: u32| ((f64::from(pixels) * share) as u32).max(1);
    let settings = Settings {
        width: side(width),
        height: side(height),
        samples: METER_SAMPLES,
        ..look.settings.clone()
    };
    let automatic = Automatic::of(&session.renderer.render(&settings, &mut ())?.film.image());
    eprint(&automatic.to_string());
    Ok(automatic.stops)
}

/// Shows a scene's frames.
pub fn run(arguments: &ViewArgs) -> Result<ExitCode, Error> {
    if arguments.cluster.distribute.is_some() {
        #[cfg(feature = "mpi")]
        return super::cluster::view::run(arguments);
        #[cfg(not(feature = "mpi"))]
        return Err(trisect::cluster::ClusterError::NotBuilt.into());
    }
    super::refuse_ranks(&arguments.cluster)?;
    arguments.history().check()?;
    let outputs = headless::check(arguments)?;
    let mut session = Session::open(&arguments.job, &outputs)?;
    let mut look = look(arguments, &session.settings)?;
    session.settings = look.settings.clone();
    session.notes.iter().for_each(|note| eprint(note));
    if arguments.job.exposure(arguments.exposure) == Exposure::Automatic {
        look.screen.stops = metered(&mut session, &look)?;
    }
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
