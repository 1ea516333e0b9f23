//! One exposure for all frames, or their brightness would change from each to the next.
//!
//! An automatic exposure is that of frame 0, whichever frames a command renders: commands that
//! share the frames, or continue with them after an interrupt, write the same images.

use super::super::eprint;
use super::stage::Stage;
use super::{Job, Rendered};
use crate::cli::{Frames, RenderArgs};
use crate::progress::Bar;
use trisect::output::Format;
use trisect::output::exposure::Exposure;
use trisect_lab::Error;

/// Returns the first frame that a command renders, to a file or for its exposure.
pub fn first_frame(arguments: &RenderArgs) -> u32 {
    match &arguments.motion.frames {
        Some(Frames(frames)) if !is_automatic(arguments) => frames.start,
        _ => 0,
    }
}

/// Returns whether the images have an exposure that depends on one of them.
pub fn is_automatic(arguments: &RenderArgs) -> bool {
    matches!(arguments.exposure(), Exposure::Automatic(_))
        && Format::of(&arguments.output).is_ok_and(Format::is_display)
}

impl Job<'_> {
    /// Returns the exposure of all frames in stops, where it is known before frame `first`: that of
    /// the command line, or that of frame 0, which is rendered for it unless it is `first`. Returns
    /// `None` if the render was interrupted.
    pub(super) fn exposure_before(&self, stage: &mut Stage, first: u32) -> Result<Option<f32>, Error> {
        if first == 0 || !is_automatic(self.arguments) {
            return Ok(self.arguments.file.exposure);
        }
        let quiet = self.arguments.log.quiet;
        if !quiet {
            eprint("rendering frame 0 for the exposure of all frames; --exposure STOPS needs no frame");
        }
        let rendered = self.render(stage, self.start, Bar::named(quiet, "frame 0"))?;
        let stops = rendered.is_complete().then(|| self.exposure_of(&rendered));
        stage.session.renderer.recycle(rendered.film);
        Ok(stops)
    }

    /// Returns the exposure of all frames in stops from frame 0, and prints it.
    pub(super) fn exposure_of(&self, frame_0: &Rendered) -> f32 {
        let exposed = self.arguments.exposure().of(&frame_0.film.image(), &self.arguments.output);
        if let Some(automatic) = exposed.automatic.filter(|_| !self.arguments.log.quiet) {
            eprint(&format!("{automatic}, for all frames: that of frame 0"));
        }
        exposed.stops
    }
}
