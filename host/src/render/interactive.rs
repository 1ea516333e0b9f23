//! Denoising: of a film, and of frames that stay on the device.

use super::chunk_pipeline::resize_records;
use super::submissions::Submissions;
use super::{Renderer, Settings};
use crate::Error;
use crate::denoise::{
    self, DenoiseSettings, DisplayLaunch, FrameView, Kernel, TemporalInputs, TemporalSettings, passes, reach,
    store_pass,
};
use crate::film::{Film, HostMemory, RowSet, RowTarget};
use crate::image::Image;
use crate::output::exposure::MAX_STOPS;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;
use trisect_kernels::Variant;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{FilteredPixel, PinholeView, STOP_FACTORS};
use trisect_shared::display::DisplayParams;
use trisect_shared::film::PixelSums;

/// A frame that stayed on the device, and what it took there.
#[derive(Clone, Debug)]
pub struct LiveFrame {
    /// That traced it.
    pub kernel: &'static str,
    /// Samples a pixel since the camera came to rest, this frame's among them.
    pub samples: u32,
    /// Tracing it.
    pub trace: Duration,
    /// Each pass over it.
    pub passes: Vec<(Kernel, Duration)>,
    /// Which of the denoiser's two images it is.
    image: usize,
    /// Whether its samples are summed with those before.
    accumulated: bool,
    /// Pixels across and down the whole image.
    size: (u32, u32),
    /// Those of it that were made.
    rows: Range<u32>,
}

/// Samples a pixel that frames are summed to while the camera rests: with as many, the rounding of the sums (1e-5 of them) stays well below the noise that is left.
pub const MAX_ACCUMULATED_SAMPLES: u32 = 1 << 16;

/// Live frames that follow each other, of the same settings.
pub(super) struct TemporalState {
    settings: Settings,
    variant: Variant,
    /// Of the image.
    rows: Range<u32>,
    /// The last one's.
    image: Option<FrameView>,
    /// Where the past is from that is read.
    previous_view: Option<PinholeView>,
    /// Which of both pasts that is.
    past: usize,
    /// Whether the last frame wrote the other.
    wrote: bool,
    /// Samples a pixel since the camera came to rest; 0 without a history.
    accumulated: u32,
    /// The first sample of the next frame.
    sample: u32,
}

impl TemporalState {
    fn new(variant: Variant, settings: Settings, rows: Range<u32>) -> Self {
        Self {
            settings,
            variant,
            rows,
            image: None,
            previous_view: None,
            past: 0,
            wrote: false,
            accumulated: 0,
            sample: 0,
        }
    }

    /// Whether the camera moves.
    fn moves(&self, image: &FrameView) -> bool {
        self.image.is_some_and(|last| last != *image)
    }

    /// What the next frame knows of those before it.
    fn next(&mut self, image: &FrameView, history: Option<&TemporalSettings>) -> TemporalInputs {
        let last = self.image.replace(*image);
        let Some(history) = history else {
            (self.previous_view, self.wrote, self.accumulated, self.sample) = (None, false, 0, 0);
            return TemporalInputs::none(image);
        };
        let samples = self.settings.samples;
        let kept = self.accumulated > 0 && last == Some(*image);
        if !kept {
            // What the last frame left is the past now.
            self.previous_view = last.filter(|_| self.wrote).map(|last| last.view);
            self.past = 1 - self.past;
            self.accumulated = 0;
        }
        let spent = self.accumulated as f32;
        self.accumulated += samples;
        self.wrote = history.frames > 0;
        TemporalInputs {
            previous_view: self.previous_view.unwrap_or(image.view),
            history: if self.previous_view.is_some() { (history.frames * samples) as f32 } else { 0.0 },
            spent,
            clamp: history.clamp.min(STOP_FACTORS.1),
            reproject: self.wrote,
            past: self.past,
            accumulated: kept,
        }
    }

    /// The first of this frame's samples.
    fn first_sample(&mut self) -> u32 {
        let count = self.settings.samples;
        let first = if self.sample.checked_add(count).is_some() { self.sample } else { 0 };
        self.sample = first + count;
        first
    }
}

impl Renderer {
    /// Denoises a film of this scene on the backend, which `settings` render with guides. Returns the image and what each pass took.
    ///
    /// # Errors
    ///
    /// [`Error::Denoise`] for parameters that are none or a film without guides, and as [`render`](Self::render).
    pub fn denoise(
        &mut self,
        film: &Film,
        settings: &Settings,
        denoise: &DenoiseSettings,
    ) -> Result<(Image, Vec<Duration>), Error> {
        denoise::check_has_aovs(film)?;
        let settings = Settings { width: film.width, height: film.height, ..settings.clone() };
        self.denoise_sums(&|sums, guides| denoise::sums(film, sums, guides), &settings, denoise)
    }

    /// The same of sums and guides of an image of the settings' size, as kernels write them: `fill` writes one for each pixel.
    ///
    /// # Errors
    ///
    /// As [`denoise`](Self::denoise).
    pub(crate) fn denoise_sums(
        &mut self,
        fill: &dyn Fn(&mut [PixelSums], &mut [AovSums]),
        settings: &Settings,
        denoise: &DenoiseSettings,
    ) -> Result<(Image, Vec<Duration>), Error> {
        denoise.check()?;
        let settings = Settings { guides: true, ..settings.clone() };
        // The memory was checked before the film was rendered, and much of what is held now was asked for then.
        self.make_film(&settings)?;
        let count = settings.pixels() as usize;
        resize_records(self.backend.as_mut(), &mut self.chunk, count);
        resize_records(self.backend.as_mut(), &mut self.aovs, count);
        fill(&mut self.chunk, &mut self.aovs);
        self.backend.write_film(&self.chunk, &self.aovs)?;
        let (width, height) = (settings.width, settings.height);
        let image = FrameView::by(&self.camera(&settings), width, height);
        let passes = passes(Some(denoise), &image, &TemporalInputs::none(&image), &(0..height));
        let times = self.backend.denoise(&passes)?;
        self.filtered.resize(count, FilteredPixel::UNKNOWN);
        self.backend.read_denoised(passes.last().map_or(0, |pass| pass.to), &mut self.filtered)?;
        Ok((denoise::image(width, height, &self.filtered), times))
    }

    /// Renders a frame and denoises it where it is: nothing is read back, so that frames follow each other as fast as the device has them.
    /// At most one chunk of samples a pixel. Without a filter the frame comes out as it is, but for the rounding of a division.
    ///
    /// With a [`TemporalSettings`] each frame has samples of its own, which go on where the last frame's ended, as long as the settings stay the same;
    /// from [`MAX_ACCUMULATED_SAMPLES`] samples a pixel on an image that rests stays as it is. Without one, each frame is the same.
    ///
    /// # Errors
    ///
    /// As [`denoise`](Self::denoise); [`SettingsError::TooManyLive`](super::SettingsError::TooManyLive) for more samples.
    pub fn live(
        &mut self,
        settings: &Settings,
        denoise: Option<&DenoiseSettings>,
        history: Option<&TemporalSettings>,
    ) -> Result<LiveFrame, Error> {
        self.live_rows(settings, denoise, history, &(0..settings.height))
    }

    /// Some rows of the frame that [`live`](Self::live) renders: the same bits, for which as many rows around them are traced and filtered as the
    /// filter reaches. What the camera saw before is known in those only.
    ///
    /// # Errors
    ///
    /// As there; [`SettingsError::NoSuchPart`](super::SettingsError::NoSuchPart) for rows that the image does not have.
    pub fn live_rows(
        &mut self,
        settings: &Settings,
        denoise: Option<&DenoiseSettings>,
        history: Option<&TemporalSettings>,
        rows: &Range<u32>,
    ) -> Result<LiveFrame, Error> {
        denoise.map_or(Ok(()), DenoiseSettings::check)?;
        history.map_or(Ok(()), TemporalSettings::check)?;
        settings.check_live()?;
        settings.check_rows(&rows.clone().into(), &(0..settings.samples))?;
        let settings = Settings { guides: true, ..settings.clone() };
        let camera = self.camera(&settings);
        let image = FrameView::by(&camera, settings.width, settings.height);
        // Taken: after an error the next frame begins anew.
        let same = |series: &TemporalState| series.settings == settings && series.rows == *rows;
        let mut series = match self.live.take().filter(same) {
            Some(series) => series,
            None => {
                settings.check()?;
                TemporalState::new(self.make_film(&settings)?, settings.clone(), rows.clone())
            }
        };
        let halo = reach(denoise, history.is_some_and(|history| history.frames > 0));
        let around = rows.start.saturating_sub(halo)..rows.end.saturating_add(halo).min(settings.height);
        let moves = series.moves(&image);
        self.tile_entries.update(self.backend.as_mut(), &camera, &settings, series.variant, moves)?;
        let frames = series.next(&image, history);
        let mut trace = Duration::ZERO;
        let goes_on = !frames.accumulated || series.accumulated <= MAX_ACCUMULATED_SAMPLES;
        if frames.accumulated && series.accumulated == 2 * settings.samples {
            self.backend.denoise(&[store_pass(&image, around.clone())])?;
        }
        if goes_on {
            let first = series.first_sample();
            let mut submissions = Submissions::new(settings.width, around.clone(), settings.samples);
            while let Some(submission) = submissions.next(&self.submission_sizer) {
                trace += self.submit(&settings, submission, first, settings.samples)?;
            }
        }
        let mut passes = passes(denoise, &image, &frames, &around);
        if !goes_on {
            series.accumulated -= settings.samples;
            passes.retain(|pass| pass.kernel != Kernel::Add);
        }
        let times = self.backend.denoise(&passes)?;
        let live = LiveFrame {
            kernel: series.variant.name,
            samples: series.accumulated.max(settings.samples),
            trace,
            passes: passes.iter().map(|pass| pass.kernel).zip(times).collect(),
            image: passes.last().map_or(0, |pass| pass.to),
            accumulated: frames.accumulated,
            size: (image.width, image.height),
            rows: rows.clone(),
        };
        self.live = Some(series);
        Ok(live)
    }

    /// The pixels of the live frame that was rendered last; of rows that it has not, what the device happens to have.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] when the device fails, or has another image by now.
    pub fn read_live(&mut self, live: &LiveFrame) -> Result<Image, Error> {
        let (width, height) = live.size;
        let mut pixels = vec![FilteredPixel::UNKNOWN; width as usize * height as usize];
        self.backend.read_denoised(live.image, &mut pixels)?;
        Ok(denoise::image(width, height, &pixels))
    }

    /// The rows of the live frame that was rendered last for a screen, in `pixels`: red, green, blue and opacity from the lowest byte on, row by
    /// row from the top. Returns the device's time.
    ///
    /// # Errors
    ///
    /// As [`read_live`](Self::read_live).
    pub fn show(
        &mut self,
        live: &LiveFrame,
        screen: &DisplayOptions,
        pixels: &mut Vec<u32>,
    ) -> Result<Duration, Error> {
        let rows = RowSet::from(live.rows.clone());
        self.show_to(live, screen, &mut RowTarget::packed(pixels, live.size.0, &rows))
    }

    /// The same, to where the rows belong: those of the target, of which the frame must have rendered all.
    ///
    /// # Errors
    ///
    /// As there, and for a target of another width.
    pub fn show_to(
        &mut self,
        live: &LiveFrame,
        screen: &DisplayOptions,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, Error> {
        let (width, height) = live.size;
        let rows = to.rows().blocks().next().map_or(0, |block| block.start)..to.rows().end();
        if rows.start < live.rows.start || rows.end > live.rows.end {
            let samples = 0..live.samples;
            return Err(super::SettingsError::NoSuchPart { rows, samples, height, of: live.samples }.into());
        }
        let split = (f64::from(width) * screen.split.clamp(0.0, 1.0)).round() as u32;
        let params = display_params((width, height), split, screen.stops, live.rows.start);
        let shown = DisplayLaunch { params, image: Some(live.image), accumulated: live.accumulated };
        Ok(self.backend.display(&shown, to)?)
    }

    /// Lets the device copy frames to this memory without a detour, where it can.
    pub fn pin(&mut self, memory: &Arc<HostMemory>) {
        self.backend.pin(memory);
    }

    /// Takes that back.
    pub fn unpin(&mut self, memory: &Arc<HostMemory>) {
        self.backend.unpin(memory);
    }
}

/// For a display's launch.
pub(super) fn display_params(size: (u32, u32), split: u32, stops: f32, first_row: u32) -> DisplayParams {
    let exposure = stops.clamp(-MAX_STOPS, MAX_STOPS).exp2();
    DisplayParams { width: size.0, height: size.1, split, exposure, first_row, pad0: 0, pad1: 0, pad2: 0 }
}

/// How a screen shows a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayOptions {
    /// Share of the width, from the left, that shows the samples' plain mean; the rest shows the denoised image.
    pub split: f64,
    /// Exposure: each of these stops doubles the light.
    pub stops: f32,
}

impl Default for DisplayOptions {
    fn default() -> Self {
        Self { split: 0.0, stops: 0.0 }
    }
}
