//! Denoising: of a film, and of frames that stay on the device.

use super::overlap::make_room;
use super::schedule::Submissions;
use super::{Renderer, Settings};
use crate::Error;
use crate::denoise::{self, Denoise, Frames, History, Kernel, Seen, Shown, keep, passes, reach};
use crate::film::{Film, HostMemory, Rows, Target};
use crate::image::Image;
use crate::output::exposure::MAX_STOPS;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;
use trisect_kernels::Variant;
use trisect_shared::denoise::{Lit, STOPS, View};
use trisect_shared::display::DisplayParams;
use trisect_shared::film::PixelSums;
use trisect_shared::guides::Guides;

/// A frame that stayed on the device, and what it took there.
#[derive(Clone, Debug)]
pub struct Live {
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
    kept: bool,
    /// Pixels across and down the whole image.
    size: (u32, u32),
    /// Those of it that were made.
    rows: Range<u32>,
}

/// Samples a pixel that frames are summed to while the camera rests: with as many, the rounding of the sums (1e-5 of them) stays well below the noise that is left.
pub const MOST_KEPT: u32 = 1 << 16;

/// Live frames that follow each other, of the same settings.
pub(super) struct Series {
    settings: Settings,
    variant: Variant,
    /// Of the image.
    rows: Range<u32>,
    /// The last one's.
    image: Option<Seen>,
    /// Where the past is from that is read.
    before: Option<View>,
    /// Which of both pasts that is.
    past: usize,
    /// Whether the last frame wrote the other.
    wrote: bool,
    /// Samples a pixel since the camera came to rest; 0 without a history.
    kept: u32,
    /// The first sample of the next frame.
    sample: u32,
}

impl Series {
    fn new(variant: Variant, settings: Settings, rows: Range<u32>) -> Self {
        Self { settings, variant, rows, image: None, before: None, past: 0, wrote: false, kept: 0, sample: 0 }
    }

    /// Whether the camera moves.
    fn moves(&self, image: &Seen) -> bool {
        self.image.is_some_and(|last| last != *image)
    }

    /// What the next frame knows of those before it.
    fn next(&mut self, image: &Seen, history: Option<&History>) -> Frames {
        let last = self.image.replace(*image);
        let Some(history) = history else {
            (self.before, self.wrote, self.kept, self.sample) = (None, false, 0, 0);
            return Frames::none(image);
        };
        let samples = self.settings.samples;
        let kept = self.kept > 0 && last == Some(*image);
        if !kept {
            // What the last frame left is the past now.
            self.before = last.filter(|_| self.wrote).map(|last| last.view);
            self.past = 1 - self.past;
            self.kept = 0;
        }
        let spent = self.kept as f32;
        self.kept += samples;
        self.wrote = history.frames > 0;
        Frames {
            before: self.before.unwrap_or(image.view),
            history: if self.before.is_some() { (history.frames * samples) as f32 } else { 0.0 },
            spent,
            clamp: history.clamp.min(STOPS.1),
            reproject: self.wrote,
            past: self.past,
            kept,
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
        denoise: &Denoise,
    ) -> Result<(Image, Vec<Duration>), Error> {
        denoise::has_guides(film)?;
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
        fill: &dyn Fn(&mut [PixelSums], &mut [Guides]),
        settings: &Settings,
        denoise: &Denoise,
    ) -> Result<(Image, Vec<Duration>), Error> {
        denoise.check()?;
        let settings = Settings { guides: true, ..settings.clone() };
        // The memory was checked before the film was rendered, and much of what is held now was asked for then.
        self.make_film(&settings)?;
        let count = settings.pixels() as usize;
        make_room(self.backend.as_mut(), &mut self.chunk, count);
        make_room(self.backend.as_mut(), &mut self.guides, count);
        fill(&mut self.chunk, &mut self.guides);
        self.backend.write_film(&self.chunk, &self.guides)?;
        let (width, height) = (settings.width, settings.height);
        let image = Seen::by(&self.camera(&settings), width, height);
        let passes = passes(Some(denoise), &image, &Frames::none(&image), &(0..height));
        let times = self.backend.denoise(&passes)?;
        self.lit.resize(count, Lit::UNKNOWN);
        self.backend.read_denoised(passes.last().map_or(0, |pass| pass.to), &mut self.lit)?;
        Ok((denoise::image(width, height, &self.lit), times))
    }

    /// Renders a frame and denoises it where it is: nothing is read back, so that frames follow each other as fast as the device has them.
    /// At most one chunk of samples a pixel. Without a filter the frame comes out as it is, but for the rounding of a division.
    ///
    /// With a [`History`] each frame has samples of its own, which go on where the last frame's ended, as long as the settings stay the same;
    /// from [`MOST_KEPT`] samples a pixel on an image that rests stays as it is. Without one, each frame is the same.
    ///
    /// # Errors
    ///
    /// As [`denoise`](Self::denoise); [`SettingsError::TooManyLive`](super::SettingsError::TooManyLive) for more samples.
    pub fn live(
        &mut self,
        settings: &Settings,
        denoise: Option<&Denoise>,
        history: Option<&History>,
    ) -> Result<Live, Error> {
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
        denoise: Option<&Denoise>,
        history: Option<&History>,
        rows: &Range<u32>,
    ) -> Result<Live, Error> {
        denoise.map_or(Ok(()), Denoise::check)?;
        history.map_or(Ok(()), History::check)?;
        settings.check_live()?;
        settings.check_rows(&rows.clone().into(), &(0..settings.samples))?;
        let settings = Settings { guides: true, ..settings.clone() };
        let camera = self.camera(&settings);
        let image = Seen::by(&camera, settings.width, settings.height);
        // Taken: after an error the next frame begins anew.
        let same = |series: &Series| series.settings == settings && series.rows == *rows;
        let mut series = match self.live.take().filter(same) {
            Some(series) => series,
            None => {
                settings.check()?;
                Series::new(self.make_film(&settings)?, settings.clone(), rows.clone())
            }
        };
        let halo = reach(denoise, history.is_some_and(|history| history.frames > 0));
        let around = rows.start.saturating_sub(halo)..rows.end.saturating_add(halo).min(settings.height);
        let moves = series.moves(&image);
        self.sight.look(self.backend.as_mut(), &camera, &settings, series.variant, moves)?;
        let frames = series.next(&image, history);
        let mut trace = Duration::ZERO;
        let goes_on = !frames.kept || series.kept <= MOST_KEPT;
        if frames.kept && series.kept == 2 * settings.samples {
            self.backend.denoise(&[keep(&image, around.clone())])?;
        }
        if goes_on {
            let first = series.first_sample();
            let mut submissions = Submissions::new(settings.width, around.clone(), settings.samples);
            while let Some(submission) = submissions.next(&self.pace) {
                trace += self.submit(&settings, submission, first, settings.samples)?;
            }
        }
        let mut passes = passes(denoise, &image, &frames, &around);
        if !goes_on {
            series.kept -= settings.samples;
            passes.retain(|pass| pass.kernel != Kernel::Add);
        }
        let times = self.backend.denoise(&passes)?;
        let live = Live {
            kernel: series.variant.name,
            samples: series.kept.max(settings.samples),
            trace,
            passes: passes.iter().map(|pass| pass.kernel).zip(times).collect(),
            image: passes.last().map_or(0, |pass| pass.to),
            kept: frames.kept,
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
    pub fn read_live(&mut self, live: &Live) -> Result<Image, Error> {
        let (width, height) = live.size;
        let mut pixels = vec![Lit::UNKNOWN; width as usize * height as usize];
        self.backend.read_denoised(live.image, &mut pixels)?;
        Ok(denoise::image(width, height, &pixels))
    }

    /// The rows of the live frame that was rendered last for a screen, in `pixels`: red, green, blue and opacity from the lowest byte on, row by
    /// row from the top. Returns the device's time.
    ///
    /// # Errors
    ///
    /// As [`read_live`](Self::read_live).
    pub fn show(&mut self, live: &Live, screen: &Screen, pixels: &mut Vec<u32>) -> Result<Duration, Error> {
        let rows = Rows::from(live.rows.clone());
        self.show_to(live, screen, &mut Target::packed(pixels, live.size.0, &rows))
    }

    /// The same, to where the rows belong: those of the target, of which the frame must have rendered all.
    ///
    /// # Errors
    ///
    /// As there, and for a target of another width.
    pub fn show_to(&mut self, live: &Live, screen: &Screen, to: &mut Target<'_>) -> Result<Duration, Error> {
        let (width, height) = live.size;
        let rows = to.rows().blocks().next().map_or(0, |block| block.start)..to.rows().end();
        if rows.start < live.rows.start || rows.end > live.rows.end {
            let samples = 0..live.samples;
            return Err(super::SettingsError::NoSuchPart { rows, samples, height, of: live.samples }.into());
        }
        let split = (f64::from(width) * screen.split.clamp(0.0, 1.0)).round() as u32;
        let params = display_params((width, height), split, screen.stops, live.rows.start);
        let shown = Shown { params, image: Some(live.image), kept: live.kept };
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
pub struct Screen {
    /// Share of the width, from the left, that shows the samples' plain mean; the rest shows the denoised image.
    pub split: f64,
    /// Exposure: each of these stops doubles the light.
    pub stops: f32,
}

impl Default for Screen {
    fn default() -> Self {
        Self { split: 0.0, stops: 0.0 }
    }
}
