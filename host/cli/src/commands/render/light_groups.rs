//! `trisect render --light-group`: layers with the light of groups of lights.

use super::super::signals::interrupts;
use super::super::{Session, eprint};
use crate::cli::RenderArgs;
use crate::progress::Bar;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use trisect::denoise::Denoiser;
use trisect::error::MotionError;
use trisect::image::ImageError;
use trisect::light_groups;
use trisect::output::{Channel, Format};
use trisect::render::RenderObserver;
use trisect::scene::{Rebase, SceneDocument};
use trisect_lab::Error;

/// Checks that the groups can be rendered with the other options, and written to the image file.
pub fn check(arguments: &RenderArgs) -> Result<(), Error> {
    if arguments.light_group.is_empty() {
        return Ok(());
    }
    if Format::of(&arguments.output)? != Format::Exr {
        return Err(ImageError::NoLightGroups { path: arguments.output.clone() }.into());
    }
    let (goal, keep) = (&arguments.goal, &arguments.checkpointing);
    let others = [
        ("--budget", goal.budget.is_some()),
        ("--target-error", goal.target_error.is_some()),
        ("--quality", goal.quality.is_some()),
        (arguments.motion.option().unwrap_or_default(), arguments.motion.moves()),
        ("--checkpoint", keep.checkpoint.is_some()),
        ("--time-limit", keep.time_limit.is_some()),
        ("--distribute", arguments.cluster.distribute.is_some()),
    ];
    match others.into_iter().find(|(_, given)| *given) {
        Some((with, _)) => {
            let remedy = "each layer has the --spp of the image";
            Err(MotionError::Beside { what: "--light-group", with, remedy }.into())
        }
        None => {
            document(arguments)?.light_group_names(&arguments.light_group)?;
            Ok(())
        }
    }
}

/// Reads the scene of a command.
fn document(arguments: &RenderArgs) -> Result<SceneDocument, Error> {
    let (job, options) = (&arguments.job, arguments.job.load.options());
    let mut document = match &job.scene {
        Some(path) => SceneDocument::load_with(path, &options)?,
        None => SceneDocument::hello_world_with(&options)?,
    };
    document.sharing = job.instances.into();
    document.choose_camera(&job.camera.choice())?;
    Ok(document)
}

/// Progress of the groups, which an interrupt ends.
struct Interruptible {
    bar: Bar,
    interrupted: Arc<AtomicBool>,
}

impl RenderObserver for Interruptible {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        match self.interrupted.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => self.bar.progress(done, total),
        }
    }
}

/// Renders the layers of the groups with an exposure in stops. An error is printed, so that the
/// image is written in any case; returns whether there was one.
pub fn layers(
    arguments: &RenderArgs,
    session: &mut Session,
    denoise: Option<&Denoiser>,
    stops: f32,
) -> (Vec<Channel>, bool) {
    if arguments.light_group.is_empty() {
        return (Vec::new(), false);
    }
    let mut render = || {
        let (document, quality) = (document(arguments)?, arguments.job.bvh_quality);
        let bar = Bar::named(arguments.log.quiet, "light groups");
        let mut bar = Interruptible { bar, interrupted: interrupts() };
        let Session { renderer, settings, .. } = &mut *session;
        let (groups, filter) =
            ((&document, arguments.light_group.as_slice(), quality), (denoise, stops.exp2()));
        let channels = light_groups::render(renderer, settings, groups, filter, &mut bar);
        // What follows is about the scene of the image.
        let scene = document.lower(Rebase::IDENTITY)?;
        renderer.update_scene(&scene, quality)?;
        Ok::<_, Error>(channels?)
    };
    match render() {
        Ok(channels) => (channels, false),
        Err(error) => {
            eprint(&format!("error: light groups: {error}"));
            (Vec::new(), true)
        }
    }
}
