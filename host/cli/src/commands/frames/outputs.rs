//! Files that a render of frames writes.

use super::super::render;
use super::names::FrameNames;
use crate::cli::RenderArgs;
use std::ops::Range;
use std::path::Path;
use trisect::output::{self, Outputs};
use trisect_lab::Error;

/// Files of each frame.
pub struct FrameFiles {
    frames: Range<u32>,
    images: FrameNames,
    /// Statistics; `None` without, or on standard output.
    stats: Option<FrameNames>,
    /// Option that names the statistics.
    stats_option: &'static str,
}

impl FrameFiles {
    /// Returns the files of `frames`, and checks that all of them can be written.
    pub fn check(arguments: &RenderArgs, frames: &Range<u32>) -> Result<Self, Error> {
        let images = FrameNames::new(&arguments.output)?;
        let stats = arguments.log.stats.as_deref().filter(|path| !super::super::data::is_stdout(path));
        let stats = stats.map(FrameNames::new).transpose()?;
        let stats_option = arguments.log.stats_option;
        let files = Self { frames: frames.clone(), images, stats, stats_option };
        // Names that differ in these differ in all.
        for frame in [frames.start, frames.end - 1] {
            render::check(&files.of(arguments, frame))?;
        }
        for frame in frames.clone() {
            output::probe(&files.images.path(frame))?;
            if let Some(stats) = &files.stats {
                output::probe(&stats.path(frame))?;
            }
        }
        Ok(files)
    }

    /// Returns the arguments of a frame, with its own files.
    pub fn of(&self, arguments: &RenderArgs, frame: u32) -> RenderArgs {
        let mut arguments = arguments.clone();
        arguments.output = self.images.path(frame);
        if let Some(stats) = &self.stats {
            arguments.log.stats = Some(stats.path(frame));
        }
        arguments
    }

    /// Returns the files of all frames, to check that none is an input.
    pub fn outputs(&self) -> Outputs {
        let writes = |names: &FrameNames| {
            let (names, frames) = (names.clone(), self.frames.clone());
            move |name: &Path| names.frame(name).is_some_and(|frame| frames.contains(&frame))
        };
        let outputs = Outputs::default().folder("-o", Some(self.images.folder()), writes(&self.images));
        let Some(stats) = &self.stats else { return outputs };
        outputs.folder(self.stats_option, Some(stats.folder()), writes(stats))
    }
}
