//! Series of frames of one scene, for a window and for files.

use super::layer::{FrameSums, Layer, LayerPicture};
use super::pick::Pick;
use crate::Error;
use crate::camera;
use crate::denoise::{DenoiseSettings, Kernel, TemporalSettings};
use crate::film::{HostFrame, RowSet, RowTarget};
use crate::render::{
    DisplayOptions, LiveFrame, MAX_ACCUMULATED_SAMPLES, Renderer, Settings, ShownFrame, StartedFrame,
};
use glam::Vec3;
use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;
use trisect_image::Image;
use trisect_scene::{CameraPose, PartName};
use trisect_shared::aovs::AovSums;
use web_time::Instant;

/// Options that can change from frame to frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewOptions {
    /// Settings of the render; `samples` are those of one frame.
    pub settings: Settings,
    /// Factor on width and height of the settings, from [`MIN_SCALE`] to 1.
    pub scale: f64,
    /// Filter, if any.
    pub denoise: Option<DenoiseSettings>,
    /// Use of earlier frames.
    pub history: TemporalSettings,
    /// Samples per pixel at which an image at rest is finished.
    pub max_samples: u32,
    /// Split between raw and denoised image, and exposure.
    pub screen: DisplayOptions,
}

/// Minimum of [`ViewOptions::scale`].
pub const MIN_SCALE: f64 = 0.05;

impl ViewOptions {
    /// Returns options with the settings' size, [`TemporalSettings::DEFAULT`], and as many samples
    /// at rest as can be accumulated.
    pub fn new(settings: Settings, denoise: Option<DenoiseSettings>) -> Self {
        let (history, screen) = (TemporalSettings::DEFAULT, DisplayOptions::default());
        Self { settings, scale: 1.0, denoise, history, max_samples: MAX_ACCUMULATED_SAMPLES, screen }
    }

    /// Returns the settings of a frame with width and height multiplied by the scale.
    pub fn scaled(&self) -> Settings {
        let scale = if self.scale.is_nan() { 1.0 } else { self.scale.clamp(MIN_SCALE, 1.0) };
        let side = |pixels: u32| ((f64::from(pixels) * scale).round() as u32).max(1);
        let Settings { width, height, .. } = self.settings;
        Settings { width: side(width), height: side(height), ..self.settings.clone() }
    }
}

/// Rendered frame with its times.
#[derive(Clone, Debug)]
pub struct FrameTiming {
    /// Rendered frame; the renderer keeps its image until the next one.
    pub live: LiveFrame,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Factor on width and height of the settings that it was rendered with.
    pub scale: f64,
    /// Time of the display conversion, by the device's timer.
    pub display: Duration,
    /// Wall-clock time of the display conversion and the copy to the host.
    pub present: Duration,
    /// Wall-clock time of the whole frame on the host.
    pub whole: Duration,
}

impl FrameTiming {
    /// Returns the seconds of path tracing, by the device's timer.
    pub fn trace(&self) -> f64 {
        self.live.trace.as_secs_f64()
    }

    /// Returns the seconds of all passes of the denoiser, by the device's timer.
    pub fn denoise(&self) -> f64 {
        self.live.passes.iter().map(|pass| pass.1.as_secs_f64()).sum()
    }

    /// Returns each pass of the denoiser with its seconds, by the device's timer.
    pub fn passes(&self) -> impl Iterator<Item = (Kernel, f64)> + '_ {
        self.live.passes.iter().map(|pass| (pass.0, pass.1.as_secs_f64()))
    }
}

/// Renders frames of a scene one after the other, which share samples and history.
pub struct Viewer {
    renderer: Renderer,
    /// Frames that run, in order.
    running: VecDeque<RunningFrame>,
    /// Memory of frames that were taken.
    unused: Vec<HostFrame>,
    /// Time since which the host waits for frames.
    waiting: Option<Instant>,
    last: Option<(ViewOptions, CameraPose, FrameTiming)>,
}

/// Frame that was started.
struct RunningFrame {
    started: StartedFrame,
    look: ViewOptions,
    pose: CameraPose,
    since: Instant,
    /// Time of the whole frame, if it ended before its start returned.
    whole: Option<Duration>,
}

impl AsMut<Renderer> for Viewer {
    fn as_mut(&mut self) -> &mut Renderer {
        &mut self.renderer
    }
}

impl Viewer {
    /// Returns a viewer of the renderer's scene.
    pub fn new(renderer: Renderer) -> Self {
        let (running, unused) = (VecDeque::new(), Vec::new());
        Self { renderer, running, unused, waiting: None, last: None }
    }

    /// Returns the renderer with the scene on its backend.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Returns the renderer itself, for another scene.
    pub fn into_renderer(self) -> Renderer {
        self.renderer
    }

    /// Returns whether another frame would show nothing new: options and pose are those of the last
    /// frame, and the image is finished.
    pub fn is_converged(&self, look: &ViewOptions, pose: &CameraPose) -> bool {
        let same = |last: &&(ViewOptions, CameraPose, FrameTiming)| last.0 == *look && last.1 == *pose;
        self.running.is_empty()
            && self.last.as_ref().filter(same).is_some_and(|last| {
                let samples = last.2.live.samples;
                // Another frame would exceed the number of samples that are accumulated.
                samples >= look.max_samples
                    || samples.saturating_add(look.settings.samples) > MAX_ACCUMULATED_SAMPLES
            })
    }

    /// Renders the next frame and copies it to `pixels`: RGBA with 8 bits each, red in the lowest
    /// byte, row by row from the top.
    ///
    /// # Errors
    ///
    /// Those of [`Renderer::live`] and [`Renderer::set_camera`]. After an error the next frame
    /// starts a new series.
    pub fn frame(
        &mut self,
        look: &ViewOptions,
        pose: &CameraPose,
        pixels: &mut Vec<u32>,
    ) -> Result<FrameTiming, Error> {
        let settings = look.scaled();
        settings.check()?;
        let rows = 0..settings.height;
        let mut to = RowTarget::packed(pixels, settings.width, &RowSet::from(rows.clone()));
        self.rows_to(look, pose, &rows, &mut to)
    }

    /// Starts the next frame, to memory of the viewer, which is pinned where possible. A CUDA
    /// device returns before it ends, so that another one can be started meanwhile.
    ///
    /// # Errors
    ///
    /// Those of [`frame`](Self::frame).
    pub fn start(&mut self, look: &ViewOptions, pose: &CameraPose) -> Result<(), Error> {
        let since = Instant::now();
        self.waiting = Some(since);
        self.last = None;
        let settings = look.scaled();
        settings.check()?;
        self.renderer.set_camera(*pose)?;
        let memory = self.memory(settings.width, settings.height);
        let filters = (look.denoise.as_ref(), Some(&look.history));
        let started = self.renderer.start_frame(&settings, filters, &look.screen, memory)?;
        let whole = started.has_ended().then(|| since.elapsed());
        self.running.push_back(RunningFrame { started, look: look.clone(), pose: *pose, since, whole });
        Ok(())
    }

    /// Returns the number of frames that were started and not [taken](Self::take).
    pub fn running(&self) -> usize {
        self.running.len()
    }

    /// Returns whether the device rendered the oldest frame before [`start`](Self::start) returned.
    pub fn has_ended(&self) -> bool {
        self.running.front().is_some_and(|frame| frame.whole.is_some())
    }

    /// Waits for the oldest frame, and returns it as [`frame`](Self::frame) does; `None` if none
    /// was started. [`FrameTiming::whole`] of frames that run side by side is the time from the end
    /// of one to that of the next, without what the host does in between.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails.
    pub fn take(&mut self) -> Result<Option<(FrameTiming, &[u32])>, Error> {
        let Some(RunningFrame { started, look, pose, since, whole }) = self.running.pop_front() else {
            return Ok(None);
        };
        let ShownFrame { live, display, present, memory } = self.renderer.finish_frame(started)?;
        let end = Instant::now();
        let begin = self.waiting.replace(end).map_or(since, |before| before.max(since));
        let passes: Duration = live.passes.iter().map(|pass| pass.1).sum();
        let whole = whole.unwrap_or_else(|| (end - begin).max(live.trace + passes + display));
        let shot = FrameTiming { live, size: memory.size(), scale: look.scale, display, present, whole };
        self.last = Some((look, pose, shot.clone()));
        self.unused.push(memory);
        Ok(self.unused.last().map(|memory| (shot, memory.pixels())))
    }

    /// Copies the last frame to `pixels` once more, and returns its times; `None` if there was
    /// none.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails.
    pub fn show_again(&mut self, pixels: &mut Vec<u32>) -> Result<Option<FrameTiming>, Error> {
        let Some((look, _, shot)) = &self.last else { return Ok(None) };
        self.renderer.show(&shot.live, &look.screen, pixels)?;
        Ok(Some(shot.clone()))
    }

    /// Returns width and height of the last frame in pixels; `None` if there was none.
    pub fn size(&self) -> Option<(u32, u32)> {
        self.last.as_ref().map(|(_, _, shot)| shot.size)
    }

    /// Returns the picture of a layer of the last frame; `None` if there was none. `names` are
    /// those of the [objects](Renderer::object), from object 1 on. Frames accumulate as if nothing
    /// was read.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails.
    pub fn layer(&mut self, layer: Layer, names: &[PartName]) -> Result<Option<LayerPicture>, Error> {
        let Some((look, _, shot)) = &self.last else { return Ok(None) };
        let (width, settings) = (shot.size.0, look.scaled());
        let (sums, aovs) = self.renderer.read_live_sums(&shot.live, &(0..shot.size.1))?;
        let (renderer, camera) = (&self.renderer, self.renderer.camera(&settings));
        let tree = renderer.tree();
        let nodes = |pixel: usize| {
            let ray = camera::middle_ray(&camera, pixel as u32 % width, pixel as u32 / width);
            let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let aov = aovs.get(pixel).copied().unwrap_or(AovSums::ZERO);
            let distance = match aov.hits {
                0 => f64::INFINITY,
                hits => (aov.position.as_dvec3() / f64::from(hits)).distance(origin),
            };
            tree.nodes_before(origin, direction, distance)
        };
        let object = |aov: &AovSums| renderer.object((aov.hits > 0).then_some(aov.primitive));
        let objects: Vec<u32> =
            if layer.needs_objects() { aovs.iter().map(object).collect() } else { Vec::new() };
        let frame = FrameSums {
            sums: &sums,
            aovs: &aovs,
            objects: &objects,
            depth: &|position| camera::depth(&camera, position.as_dvec3()),
            nodes: &nodes,
            names,
        };
        Ok(Some(frame.picture(layer)))
    }

    /// Returns what a pixel of the last frame shows; `None` for the sky, for a pixel outside of the
    /// frame, and before the first frame. Frames accumulate as if nothing was read.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails.
    pub fn pick(&mut self, (x, y): (u32, u32)) -> Result<Option<Pick>, Error> {
        let Some((look, _, shot)) = &self.last else { return Ok(None) };
        if x >= shot.size.0 || y >= shot.size.1 {
            return Ok(None);
        }
        let camera = self.renderer.camera(&look.scaled());
        let (sums, aovs) = self.renderer.read_live_sums(&shot.live, &(y..y + 1))?;
        let (Some(sums), Some(aov)) = (sums.get(x as usize), aovs.get(x as usize)) else { return Ok(None) };
        let mean = |sum: Vec3, count: u32| sum.as_dvec3() / f64::from(count.max(1));
        let position = mean(aov.position, aov.hits);
        Ok((aov.hits > 0).then(|| Pick {
            object: self.renderer.object(Some(aov.primitive)),
            position,
            normal: mean(aov.normal, aov.hits),
            albedo: mean(aov.albedo, aov.samples()),
            depth: camera::depth(&camera, position),
            radiance: mean(sums.radiance, sums.samples),
        }))
    }

    /// Returns the image of the last frame, with its filter; `None` if there was none.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails.
    pub fn image(&mut self) -> Result<Option<Image>, Error> {
        let last = self.last.as_ref();
        last.map(|(_, _, shot)| self.renderer.read_live(&shot.live)).transpose()
    }

    /// Returns pinned memory for a frame, which may be one that was taken.
    fn memory(&mut self, width: u32, height: u32) -> HostFrame {
        let (mut fitting, others): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.unused).into_iter().partition(|frame| frame.size() == (width, height));
        others.iter().for_each(|frame| self.renderer.unpin(frame.memory()));
        let memory = fitting.pop();
        self.unused = fitting;
        memory.unwrap_or_else(|| {
            let frame = HostFrame::new(width, height);
            self.renderer.pin(frame.memory());
            frame
        })
    }

    /// Renders only `rows` of the next frame and copies them to `to`.
    ///
    /// # Errors
    ///
    /// Those of [`frame`](Self::frame), and one for rows that the image does not have.
    pub fn rows_to(
        &mut self,
        look: &ViewOptions,
        pose: &CameraPose,
        rows: &Range<u32>,
        to: &mut RowTarget<'_>,
    ) -> Result<FrameTiming, Error> {
        let start = Instant::now();
        self.last = None;
        self.renderer.set_camera(*pose)?;
        let settings = look.scaled();
        settings.check()?;
        let live = self.renderer.live_rows(&settings, look.denoise.as_ref(), Some(&look.history), rows)?;
        let presented = Instant::now();
        let display = self.renderer.show_to(&live, &look.screen, to)?;
        let (present, whole) = (presented.elapsed(), start.elapsed());
        let (size, scale) = ((settings.width, settings.height), look.scale);
        let shot = FrameTiming { live, size, scale, display, present, whole };
        self.last = Some((look.clone(), *pose, shot.clone()));
        Ok(shot)
    }
}

#[cfg(test)]
mod tests;
