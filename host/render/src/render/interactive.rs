//! Live frames: frames of a viewer, which may be denoised and stay on the device.

use super::film_state::FilmState;
use super::live_session::{LiveSession, Restart};
use super::submission_queue::SubmissionQueue;
use super::{Renderer, Settings};
use crate::Error;
use crate::denoise::{
    self, DenoiseSettings, FrameSums, FrameView, Kernel, TemporalSettings, history_passes, passes, reach,
    store_pass,
};
use crate::film::{HostMemory, RowSet, RowTarget};
use crate::passes::DisplayPass;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;
use std::time::Duration;
use trisect_device::Started;
use trisect_image::Image;
use trisect_image::output::exposure::MAX_STOPS;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::display::DisplayParams;
use trisect_shared::film::PixelSums;

/// Live frame, which stayed on the device, with its times there.
#[derive(Clone, Debug)]
pub struct LiveFrame {
    /// Name of the kernel that traced it.
    pub kernel: &'static str,
    /// Samples per pixel since the camera came to rest, this frame's included.
    pub samples: u32,
    /// Event since which these samples are accumulated.
    pub since: Restart,
    /// Time of tracing.
    pub trace: Duration,
    /// Time of each pass over it.
    pub passes: Vec<(Kernel, Duration)>,
    /// Image of the denoiser that holds it, 0 or 1.
    image: usize,
    /// True if its samples are summed with those of earlier frames.
    accumulated: bool,
    /// Pixels across and down the whole image.
    size: (u32, u32),
    /// Rows of the image that were rendered.
    rows: Range<u32>,
}

impl LiveFrame {
    /// Returns the pass that converts it for a display.
    pub(super) fn display(&self, screen: &DisplayOptions) -> DisplayPass {
        let split = (f64::from(self.size.0) * screen.split.clamp(0.0, 1.0)).round() as u32;
        let params = display_params(self.size, split, screen.stops, self.rows.start);
        DisplayPass { params, image: Some(self.image), accumulated: self.accumulated }
    }
}

/// Live frame that the device may still render.
pub(super) struct StartedLive {
    /// The frame, without times.
    pub live: LiveFrame,
    trace: SubmissionQueue,
    filter: Started,
}

impl Renderer {
    /// Renders a frame of at most one chunk of samples per pixel, and denoises it on the device.
    /// Nothing is read back, so frames follow each other as fast as the device renders them.
    /// Without a filter the frame comes out as it is, except for the rounding of a division.
    ///
    /// With [`TemporalSettings`] each frame takes new samples, which continue where the last
    /// frame's ended as long as the settings stay the same; from
    /// [`MAX_ACCUMULATED_SAMPLES`](super::MAX_ACCUMULATED_SAMPLES)
    /// samples per pixel on, the image of a camera at rest stays as it is. Without them, each frame
    /// takes the same samples.
    ///
    /// # Errors
    ///
    /// The errors of [`denoise`](Self::denoise);
    /// [`SettingsError::TooManyLive`](super::SettingsError::TooManyLive) for more samples.
    pub fn live(
        &mut self,
        settings: &Settings,
        denoise: Option<&DenoiseSettings>,
        history: Option<&TemporalSettings>,
    ) -> Result<LiveFrame, Error> {
        self.live_rows(settings, denoise, history, &(0..settings.height))
    }

    /// Renders some rows of the frame that [`live`](Self::live) renders, to the same bits. To that
    /// end, as many rows around them as the filter reaches are traced and filtered too. The history
    /// covers only these rows.
    ///
    /// # Errors
    ///
    /// The errors of [`live`](Self::live);
    /// [`SettingsError::NoSuchPart`](super::SettingsError::NoSuchPart) for rows that the image does
    /// not have.
    pub fn live_rows(
        &mut self,
        settings: &Settings,
        denoise: Option<&DenoiseSettings>,
        history: Option<&TemporalSettings>,
        rows: &Range<u32>,
    ) -> Result<LiveFrame, Error> {
        let started = self.start_live(settings, denoise, history, rows)?;
        self.finish_live(started)
    }

    /// Starts the frame that [`live_rows`](Self::live_rows) renders.
    pub(super) fn start_live(
        &mut self,
        settings: &Settings,
        denoise: Option<&DenoiseSettings>,
        history: Option<&TemporalSettings>,
        rows: &Range<u32>,
    ) -> Result<StartedLive, Error> {
        denoise.map_or(Ok(()), DenoiseSettings::check)?;
        history.map_or(Ok(()), TemporalSettings::check)?;
        settings.check_live()?;
        settings.check_rows(&rows.clone().into(), &(0..settings.samples))?;
        let settings = Settings { guides: true, ..settings.clone() };
        let camera = self.camera(&settings);
        let image = FrameView::by(&camera, self.scene.middle(), settings.width, settings.height);
        // The state is taken, so that after an error the next frame starts anew.
        let halo = reach(denoise, history.is_some_and(|history| history.frames > 0));
        let around = rows.start.saturating_sub(halo)..rows.end.saturating_add(halo).min(settings.height);
        let same = |series: &LiveSession| {
            series.settings == settings && series.rows == *rows && series.has_rows(&around)
        };
        let mut series = match self.film_state.take_live() {
            Some(series) if same(&series) => series,
            before => {
                settings.check()?;
                let (kernel, before) = (self.make_film(&settings)?, before.as_deref());
                Box::new(LiveSession::new(kernel, settings.clone(), (rows.clone(), around), before))
            }
        };
        let around = series.around.clone();
        let moves = series.moves(&image);
        self.tile_entries.update(&mut self.uploaded, &self.scene, &settings, series.kernel, moves)?;
        let (frames, unwritten) = series.next(&image, history);
        if let Some(before) = unwritten {
            self.uploaded.denoise(&history_passes(&before, 1 - frames.past, &around))?;
        }
        if frames.sums == FrameSums::Added && series.accumulated == 2 * settings.samples {
            self.uploaded.denoise(&[store_pass(&image, around.clone())])?;
        }
        self.begin_submissions()?;
        if frames.sums != FrameSums::Kept {
            let (first, rows) = (series.first_sample(), RowSet::from(around.clone()));
            let samples = first..first + settings.samples;
            self.start_chunk(&settings, &rows, samples, &mut |_| ControlFlow::Continue(()))?;
        }
        let passes = passes(denoise, &image, &frames, &around);
        let filter = self.uploaded.start_denoise(&passes)?;
        let live = LiveFrame {
            kernel: series.kernel.name,
            samples: series.accumulated.max(settings.samples),
            since: series.since,
            trace: Duration::ZERO,
            passes: passes.iter().map(|pass| (pass.kernel, Duration::ZERO)).collect(),
            image: passes.last().map_or(0, |pass| pass.to),
            accumulated: frames.sums != FrameSums::Own,
            size: (image.width, image.height),
            rows: rows.clone(),
        };
        self.film_state = FilmState::Live(series);
        Ok(StartedLive { live, trace: self.take_submissions(), filter })
    }

    /// Waits for a frame, and returns it with its times.
    pub(super) fn finish_live(&mut self, started: StartedLive) -> Result<LiveFrame, Error> {
        let StartedLive { mut live, trace, filter } = started;
        // After an error the next frame starts anew.
        let state = std::mem::take(&mut self.film_state);
        let times = self.uploaded.wait(filter)?;
        live.passes.iter_mut().zip(times).for_each(|(pass, time)| pass.1 = time);
        live.trace = self.finish_taken(trace)?;
        self.film_state = state;
        Ok(live)
    }

    /// Returns the pixels of the last live frame. Rows that it did not render have unspecified
    /// values.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails, or no longer has this image.
    pub fn read_live(&mut self, live: &LiveFrame) -> Result<Image, Error> {
        let (width, height) = live.size;
        let mut pixels = vec![FilteredPixel::UNKNOWN; width as usize * height as usize];
        self.uploaded.read_denoised(live.image, live.size, &mut pixels)?;
        Ok(denoise::image(width, height, &pixels))
    }

    /// Returns sums and AOV sums of rows of the last live frame, row by row: over all frames that
    /// were accumulated. The next frame continues as if they had not been read.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails, or no longer has this frame.
    pub fn read_live_sums(
        &mut self,
        live: &LiveFrame,
        rows: &Range<u32>,
    ) -> Result<(Vec<PixelSums>, Vec<AovSums>), Error> {
        let rows = RowSet::from(rows.start.max(live.rows.start)..rows.end.min(live.rows.end));
        let count = live.size.0 as usize * rows.len() as usize;
        let (mut sums, mut aovs) = (vec![PixelSums::UNWRITTEN; count], vec![AovSums::UNWRITTEN; count]);
        self.uploaded.copy_sums(live.accumulated, &rows, (&mut sums, &mut aovs))?;
        Ok((sums, aovs))
    }

    /// Converts the rows of the last live frame for a display and copies them to `pixels`, row by
    /// row from the top: red, green, blue and opacity from the lowest byte on. Returns the device
    /// time.
    ///
    /// # Errors
    ///
    /// The errors of [`read_live`](Self::read_live).
    pub fn show(
        &mut self,
        live: &LiveFrame,
        screen: &DisplayOptions,
        pixels: &mut Vec<u32>,
    ) -> Result<Duration, Error> {
        let rows = RowSet::from(live.rows.clone());
        self.show_to(live, screen, &mut RowTarget::packed(pixels, live.size.0, &rows))
    }

    /// Converts rows of the last live frame for a display and copies them to their places in the
    /// target. The frame must have rendered all rows of the target. Returns the device time.
    ///
    /// # Errors
    ///
    /// The errors of [`show`](Self::show), and an error for a target of another width or with other
    /// rows.
    pub fn show_to(
        &mut self,
        live: &LiveFrame,
        screen: &DisplayOptions,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, Error> {
        let height = live.size.1;
        let rows = to.rows().blocks().next().map_or(0, |block| block.start)..to.rows().end();
        if rows.start < live.rows.start || rows.end > live.rows.end {
            let samples = 0..live.samples;
            return Err(super::SettingsError::NoSuchPart { rows, samples, height, of: live.samples }.into());
        }
        Ok(self.uploaded.display(&live.display(screen), to.reborrow())?)
    }

    /// Pins this memory, so that the device copies frames to it directly, if that is possible.
    pub fn pin(&mut self, memory: &Arc<HostMemory>) {
        self.uploaded.device_mut().pin(memory);
    }

    /// Undoes [`pin`](Self::pin).
    pub fn unpin(&mut self, memory: &Arc<HostMemory>) {
        self.uploaded.device_mut().unpin(memory);
    }
}

/// Returns the parameters of a display launch.
pub(super) fn display_params(size: (u32, u32), split: u32, stops: f32, first_row: u32) -> DisplayParams {
    let exposure = stops.clamp(-MAX_STOPS, MAX_STOPS).exp2();
    DisplayParams { width: size.0, height: size.1, split, exposure, first_row, pad0: 0, pad1: 0, pad2: 0 }
}

/// Options of a display for a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayOptions {
    /// Fraction of the width, from the left, that shows the plain mean of the samples; the rest
    /// shows the denoised image.
    pub split: f64,
    /// Exposure in stops, each of which doubles the light.
    pub stops: f32,
}

impl Default for DisplayOptions {
    fn default() -> Self {
        Self { split: 0.0, stops: 0.0 }
    }
}
