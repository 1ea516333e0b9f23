//! Series of frames of one scene, for a window and for files.

use crate::Error;
use crate::denoise::{DenoiseSettings, Kernel, TemporalSettings};
use crate::film::{HostFrame, RowSet, RowTarget};
use crate::render::{DisplayOptions, LiveFrame, MAX_ACCUMULATED_SAMPLES, Renderer, Settings};
use std::ops::Range;
use std::time::{Duration, Instant};
use trisect_scene::CameraPose;

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
    /// Memory of [`render_to_host_frame`](Self::render_to_host_frame).
    frame: Option<HostFrame>,
    last: Option<(ViewOptions, CameraPose, FrameTiming)>,
}

impl AsMut<Renderer> for Viewer {
    fn as_mut(&mut self) -> &mut Renderer {
        &mut self.renderer
    }
}

impl Viewer {
    /// Returns a viewer of the renderer's scene.
    pub fn new(renderer: Renderer) -> Self {
        Self { renderer, frame: None, last: None }
    }

    /// Returns the renderer with the scene on its backend.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Returns whether another frame would show nothing new: options and pose are those of the last
    /// frame, and the image is finished.
    pub fn is_converged(&self, look: &ViewOptions, pose: &CameraPose) -> bool {
        let same = |last: &&(ViewOptions, CameraPose, FrameTiming)| last.0 == *look && last.1 == *pose;
        self.last.as_ref().filter(same).is_some_and(|last| {
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

    /// Renders the next frame to memory of the viewer and returns its pixels as
    /// [`frame`](Self::frame) does. The memory is pinned where possible, so the copy is faster; it
    /// is overwritten by the next frame.
    ///
    /// # Errors
    ///
    /// Those of [`frame`](Self::frame).
    pub fn render_to_host_frame(
        &mut self,
        look: &ViewOptions,
        pose: &CameraPose,
    ) -> Result<(FrameTiming, &[u32]), Error> {
        let settings = look.scaled();
        settings.check()?;
        let (width, height) = (settings.width, settings.height);
        let mut frame = match self.frame.take() {
            Some(frame) if frame.size() == (width, height) => frame,
            other => {
                if let Some(other) = other {
                    self.renderer.unpin(other.memory());
                }
                let frame = HostFrame::new(width, height);
                self.renderer.pin(frame.memory());
                frame
            }
        };
        let shot = self.rows_to(look, pose, &(0..height), &mut frame.target());
        let frame = self.frame.insert(frame);
        Ok((shot?, frame.pixels()))
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
        let shot = FrameTiming { live, size: (settings.width, settings.height), display, present, whole };
        self.last = Some((look.clone(), *pose, shot.clone()));
        Ok(shot)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use crate::denoise::Filter;
    use crate::render::Restart;
    use trisect_device::cpu::Cpu;
    use trisect_image::metrics::srgb;
    use trisect_scene::Scene;

    #[test]
    fn a_series_ends_where_it_is_enough() {
        let scene = Scene::hello_world().unwrap();
        let renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let mut viewer = Viewer::new(renderer);
        let settings = Settings { width: 32, height: 18, samples: 2, ..Settings::of(&scene) };
        let mut look = ViewOptions {
            scale: 0.5,
            max_samples: 6,
            ..ViewOptions::new(settings, Some(DenoiseSettings::new(Filter::Svgf)))
        };
        let mut pose = scene.camera;
        let mut pixels = Vec::new();
        let mut counts = Vec::new();
        let mut since = Vec::new();
        while !viewer.is_converged(&look, &pose) {
            let shot = viewer.frame(&look, &pose, &mut pixels).unwrap();
            assert_eq!((shot.size, pixels.len()), ((16, 9), 16 * 9));
            counts.push(shot.live.samples);
            since.push(shot.live.since);
        }
        assert_eq!(counts, [2, 4, 6]);
        assert_eq!(since, [Restart::First; 3]);
        // Another pose starts a new series; another display option continues the same one.
        pose.look_from.x += 0.5;
        assert!(!viewer.is_converged(&look, &pose));
        let shot = viewer.frame(&look, &pose, &mut pixels).unwrap();
        assert_eq!((shot.live.samples, shot.live.since), (2, Restart::Camera));
        look.screen.split = 1.0;
        let shot = viewer.frame(&look, &pose, &mut pixels).unwrap();
        assert_eq!((shot.live.samples, shot.live.since), (4, Restart::Camera));
        assert!(shot.denoise() > 0.0 && shot.whole >= shot.present);
        // What starts anew says why.
        let mut after = |change: &dyn Fn(&mut ViewOptions)| {
            change(&mut look);
            let live = viewer.frame(&look, &pose, &mut pixels).unwrap().live;
            (live.samples, live.since)
        };
        assert_eq!(after(&|look| look.scale = 1.0), (2, Restart::Setting("the resolution")));
        assert_eq!(after(&|_| ()), (4, Restart::Setting("the resolution")));
        assert_eq!(after(&|look| look.settings.depth = 3), (2, Restart::Setting("the depth")));
        assert_eq!(after(&|look| look.settings.samples = 1), (1, Restart::Setting("the samples of a frame")));
        assert_eq!(after(&|look| look.denoise = None), (2, Restart::Setting("the samples of a frame")));
    }

    /// Checks that a series also ends if the samples of a frame do not divide the maximum number.
    #[test]
    fn a_series_ends_where_no_more_is_kept() {
        let scene = Scene::hello_world().unwrap();
        let renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let mut viewer = Viewer::new(renderer);
        let settings = Settings { width: 2, height: 1, samples: 255, ..Settings::of(&scene) };
        let look = ViewOptions::new(settings, None);
        let mut frames = 0;
        while !viewer.is_converged(&look, &scene.camera) {
            viewer.frame(&look, &scene.camera, &mut Vec::new()).unwrap();
            frames += 1;
            assert!(frames <= MAX_ACCUMULATED_SAMPLES / 255, "it never rests");
        }
        assert_eq!(frames, MAX_ACCUMULATED_SAMPLES / 255);
    }

    /// Checks that without a filter both sides of the split show the pixels of an image file.
    #[test]
    fn the_screen_shows_the_image() {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let settings = Settings { width: 32, height: 18, samples: 2, ..Settings::of(&scene) };
        let image = renderer.render(&settings).unwrap().film.image();
        let mut viewer = Viewer::new(renderer);
        for split in [0.0, 0.5, 1.0] {
            let mut look = ViewOptions::new(settings.clone(), None);
            look.screen.split = split;
            let mut pixels = Vec::new();
            viewer.frame(&look, &scene.camera, &mut pixels).unwrap();
            if split > 0.0 {
                viewer.frame(&look, &scene.camera, &mut pixels).unwrap();
                continue; // later frames have other samples
            }
            for (shown, pixel) in pixels.iter().zip(&image.pixels) {
                for (byte, value) in shown.to_le_bytes().into_iter().zip(pixel) {
                    assert!(byte.abs_diff(srgb::encode_u8(*value)) <= 1);
                }
            }
        }
    }
}
