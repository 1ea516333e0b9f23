//! `trisect render --frames`, `--camera-path` and `--shutter`: images of a scene or a camera that
//! moves.
//!
//! A [`Stage`] brings the scene to the moments of each image.

mod checks;
mod exposure;
mod names;
mod outputs;
mod stage;

use super::checkpointing::{ProgressObserver, RenderStart, RenderSupervisor, StopReason};
use super::display::Display;
use super::render::{self as single, RenderOutput, announce, goal_text};
use super::signals::interrupts;
use super::{eprint, fit_to_cpu, open};
use crate::cli::{Frames, JobArgs, MotionArgs, RenderArgs};
use crate::progress::Bar;
use outputs::FrameFiles;
use stage::{Stage, Track};
use std::ops::{ControlFlow, Range};
use std::process::ExitCode;
use std::time::Instant;
use trisect::adaptive::{self, Goal, Request, Sampled};
use trisect::denoise::Denoiser;
use trisect::device::{BackendError, Choice};
use trisect::film::Film;
use trisect::image::Image;
use trisect::render::{RenderObserver, Renderer, Settings, Shutter};
use trisect::scene::CameraPath;
use trisect::stats::RenderStats;
use trisect_lab::Error;

/// Parts that all images of a command have in common.
struct Job<'a> {
    arguments: &'a RenderArgs,
    request: Option<Request>,
    denoise: Option<Denoiser>,
    /// Time of frame 0 in seconds.
    start: f64,
    watch: RenderSupervisor,
}

/// An image that was rendered.
struct Rendered {
    film: Film,
    stats: RenderStats,
    /// Image of a render to a time, which is not that of the film.
    image: Option<Image>,
    /// Samples that the complete film has; `None` if the goal decides.
    samples: Option<Range<u32>>,
}

impl Rendered {
    /// Returns whether the film has all samples.
    fn is_complete(&self) -> bool {
        match &self.samples {
            Some(samples) => self.film.coverage.missing(samples).is_empty(),
            None => self.stats.sampling.as_ref().is_some_and(|sampling| !sampling.ended),
        }
    }
}

/// Renders the frames of `--frames` or of `--camera-path`, or one image with `--shutter`.
pub fn run(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    let path = arguments.motion.camera_path.as_deref().map(CameraPath::load).transpose()?;
    let mut filled = arguments.clone();
    if let (Some(path), None) = (&path, &arguments.motion.frames) {
        filled.motion.frames = Some(Frames(0..path.last().saturating_add(1)));
    }
    render(&filled, path)
}

/// Renders frames, or one image, with the camera of a path if there is one.
fn render(arguments: &RenderArgs, path: Option<CameraPath>) -> Result<ExitCode, Error> {
    let start = Instant::now();
    checks::refuse(arguments)?;
    let (request, denoise) = single::goal(arguments)?;
    let MotionArgs { frames, .. } = &arguments.motion;
    let files = match frames {
        Some(Frames(frames)) => Some(FrameFiles::check(arguments, frames)?),
        None => {
            single::check(arguments)?;
            None
        }
    };
    let outputs = files.as_ref().map_or_else(|| single::outputs(arguments), FrameFiles::outputs);
    let option = arguments.motion.option().unwrap_or_default();
    let job_arguments = JobArgs { may_roulette: request.is_some(), ..single::job(arguments) };
    let first = exposure::first_frame(arguments);
    let of_start = arguments.job.load.model.time.unwrap_or(0.0);
    let time = |frame: u32| of_start + f64::from(frame) / arguments.motion.fps();
    let display = Display::open(arguments)?;
    outputs.check_inputs("the camera path", &arguments.motion.camera_path)?;
    let track = path.map(|path| Track { path, start: of_start, fps: arguments.motion.fps() });
    let mut stage = Stage::open(job_arguments, arguments, outputs, (option, track), time(first))?;
    single::adapt(&mut stage.session.settings, arguments, denoise.as_ref());
    if !arguments.log.quiet {
        announce(&stage.session, &aim(arguments, &goal_text(&stage.session, request.as_ref())));
    }
    let watch = RenderSupervisor::new(arguments, None, start, interrupts()).showing(display.as_ref());
    stage.session.display = display;
    let job = Job { arguments, request, denoise, start: of_start, watch };
    match (frames, files) {
        (Some(Frames(frames)), Some(files)) => job.render_frames(stage, frames, &files),
        _ => job.render_one(stage),
    }
}

/// Returns the goal of the command as text.
fn aim(arguments: &RenderArgs, goal: &str) -> String {
    let MotionArgs { frames, shutter, .. } = &arguments.motion;
    let fps = arguments.motion.fps();
    let mut text = goal.to_owned();
    if let Some(Frames(frames)) = frames {
        text += &format!(", frames {} to {} at {fps} frames/s", frames.start, frames.end - 1);
    }
    if let Some(shutter) = shutter {
        text += &format!(", shutter open for {:.4} s", shutter / fps);
    }
    text
}

impl Job<'_> {
    /// Renders the image of the start, and writes it also if it is incomplete.
    fn render_one(&self, mut stage: Stage) -> Result<ExitCode, Error> {
        let arguments = self.arguments;
        let rendered = self.render(&mut stage, self.start, Bar::new(arguments.log.quiet))?;
        let Rendered { film, stats, samples, .. } = rendered;
        let samples = samples.unwrap_or(0..stage.session.settings.samples);
        single::finish_film(arguments, stage.session, (&film, &samples), &self.watch, stats, self.denoise)
    }

    /// Renders frames, and writes each one that is complete.
    fn render_frames(
        &self,
        mut stage: Stage,
        frames: &Range<u32>,
        files: &FrameFiles,
    ) -> Result<ExitCode, Error> {
        let quiet = self.arguments.log.quiet;
        let mut exposure = self.exposure_before(&mut stage, frames.start)?;
        let mut failed = false;
        for frame in frames.clone() {
            let start = Instant::now();
            let mut arguments = files.of(self.arguments, frame);
            let place = format!("frame {frame} ({} of {})", frame - frames.start + 1, frames.len());
            let time = self.start + f64::from(frame) / self.arguments.motion.fps();
            let rendered = self.render(&mut stage, time, Bar::named(quiet, &place))?;
            if let Some(ended) = self.watch.stop_reason().filter(|_| !rendered.is_complete()) {
                return Ok(self.stopped(frames, frame, exposure, ended));
            }
            if frame == 0 && exposure::is_automatic(&arguments) {
                exposure = Some(self.exposure_of(&rendered));
            }
            arguments.file.exposure = exposure;
            // The line below is shorter than the summary of an image.
            arguments.log.quiet = !self.arguments.log.verbose;
            let Rendered { film, stats, image, .. } = rendered;
            let session = &mut stage.session;
            let (_, in_place) = match &image {
                Some(image) => {
                    let film = RenderOutput::Film(&film);
                    single::write_outputs(&arguments, session, film, stats, Some(image.clone()))?
                }
                None => {
                    let film = RenderOutput::Film(&film);
                    single::finish(&arguments, session, film, stats, self.denoise)?
                }
            };
            failed |= !in_place;
            session.renderer.recycle(film);
            if !quiet && in_place {
                let seconds = start.elapsed().as_secs_f64();
                eprint(&format!(
                    "{place}, at {time:.3} s: wrote {} in {seconds:.2} s",
                    arguments.output.display()
                ));
            }
            if let Some(ended) = self.watch.stop_reason().filter(|_| frame + 1 < frames.end) {
                return Ok(self.stopped(frames, frame + 1, exposure, ended));
            }
        }
        if self.arguments.log.verbose {
            let (refitted, built) = stage.trees;
            eprint(&format!("BVH refitted {refitted} times, built {built} times"));
        }
        Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
    }

    /// Says which frames are complete, and how to continue with the same exposure, if it is known.
    /// Returns the exit code of a render that ended before frame `next`.
    fn stopped(&self, frames: &Range<u32>, next: u32, exposure: Option<f32>, ended: StopReason) -> ExitCode {
        let complete = match next - frames.start {
            0 => "no frame is complete".to_owned(),
            1 => format!("frame {} is complete", frames.start),
            _ => format!("frames {} to {} are complete", frames.start, next - 1),
        };
        // Without it frame 0 is rendered again.
        let exposure = exposure.filter(|_| self.arguments.file.exposure.is_none());
        let exposure = exposure.map_or_else(String::new, |stops| format!(" --exposure {stops}"));
        eprint(&format!(
            "ended before frame {next} was finished: {complete}; continue with --frames {next}..{}{exposure}",
            frames.end
        ));
        ended.exit_code()
    }

    /// Renders an image at a time, the moments of its shutter one after another.
    fn render(&self, stage: &mut Stage, time: f64, bar: Bar) -> Result<Rendered, Error> {
        let quiet = self.arguments.log.quiet;
        let watch = &self.watch;
        let mut told = ProgressObserver { bar, watch, announced: quiet };
        if let Some(request) = &self.request {
            stage.begin_frame(time)?;
            let session = &mut stage.session;
            let Sampled { film, image, mut stats } =
                adaptive::render(&mut session.renderer, &session.settings, request, &mut told)?;
            stats.phases.load_seconds = session.load_seconds;
            let image = matches!(request.goal, Goal::Time(_)).then_some(image);
            return Ok(Rendered { film, stats, image, samples: None });
        }
        let RenderStart { mut film, samples, .. } = RenderStart::new(self.arguments, &stage.session, None)?;
        let open = self.arguments.motion.shutter.unwrap_or(0.0) / self.arguments.motion.fps();
        let shutter = Shutter::new(open, self.arguments.motion.shutter_steps, samples.end)?;
        let total = stage.session.settings.pixels() * u64::from(samples.end);
        let mut sum: Option<RenderStats> = None;
        for moment in shutter.moments(samples.end) {
            let time = time + moment.after;
            if sum.is_none() {
                stage.begin_frame(time)?;
            } else if watch.stop_reason().is_some() {
                break;
            } else {
                stage.begin_moment(time)?;
            }
            let before = stage.session.settings.pixels() * u64::from(moment.samples.start);
            let mut told = PartObserver { whole: &mut told, before, total };
            let Stage { session, scene, .. } = stage;
            let mut elsewhere = |error: &BackendError, _: &Film, settings: &mut Settings| {
                if self.arguments.checkpointing.fallback.is_none() || session.fell_back {
                    return None;
                }
                session.fell_back = true;
                eprint(&format!("warning: {error}\n  the CPU continues (--fallback)"));
                fit_to_cpu(settings);
                let job = &self.arguments.job;
                let on_cpu = || {
                    let selection = open_cpu(job)?;
                    Renderer::with_quality(selection.device, scene, job.bvh_quality)
                };
                Some(on_cpu())
            };
            let mut stats = session.renderer.render_moment(
                &mut film,
                &mut session.settings,
                &moment.samples,
                watch,
                &mut told,
                &mut elsewhere,
            )?;
            stats.phases.load_seconds = session.load_seconds;
            if let Some(earlier) = &sum {
                stats.add_moments(earlier);
            }
            sum = Some(stats);
        }
        let stats = match sum {
            Some(stats) => stats,
            None => stage.session.renderer.statistics(&stage.session.settings)?,
        };
        Ok(Rendered { film, stats, image: None, samples: Some(samples) })
    }
}

/// Opens the CPU backend.
fn open_cpu(job: &JobArgs) -> Result<trisect::device::Selection, trisect::Error> {
    open(Choice::Cpu, None, job.threads)
}

/// Observer of a part of a render, which counts the samples of the whole.
struct PartObserver<'a> {
    whole: &'a mut dyn RenderObserver,
    /// Samples before the part.
    before: u64,
    total: u64,
}

impl RenderObserver for PartObserver<'_> {
    fn progress(&mut self, done: u64, _: u64) -> ControlFlow<()> {
        self.whole.progress(self.before + done, self.total)
    }

    fn should_continue(&self) -> bool {
        self.whole.should_continue()
    }
}
