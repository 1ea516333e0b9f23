//! Takes samples for both halves of an image: for all pixels as many, or for each tile its own.

use super::{Halves, Noise, allocate, halves};
use crate::Error;
use crate::film::{PixelTotals, Rows};
use crate::render::{Observer, Own, Parts, Renderer, Sampler, Settings};
use crate::sampling::survey::Survey;
use std::ops::{ControlFlow, Range};
use std::time::{Duration, Instant};
use trisect_shared::film::CHUNK_SAMPLES;

/// Of the second half's random numbers: the first's with these bits turned.
const OTHER_SEED: u32 = 0x9e37_79b9;

/// What samples took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Took {
    pub device: Duration,
    pub submissions: u64,
    pub kernel: &'static str,
}

/// An image in the making.
pub(super) struct Taker<'a> {
    pub renderer: &'a mut Renderer,
    pub settings: Settings,
    pub halves: Halves,
    pub took: Took,
    /// Index of the next sample of either half.
    next: u32,
    /// Passes that tiles took by themselves.
    own_passes: u32,
    observer: &'a mut dyn Observer,
    /// How far the image is, of 1.
    pub progress: f64,
}

/// Steps that an observer sees.
const STEPS: u64 = 1000;

/// An observer that is asked only whether to stop.
struct Ask<'a>(&'a mut dyn Observer, u64);

impl Observer for Ask<'_> {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        self.0.progress(self.1, STEPS)
    }
}

/// Settings of a half. The number of samples is only known at the end.
pub(super) fn of_half(settings: &Settings, half: usize) -> Settings {
    let seed = settings.seed ^ if half == 0 { 0 } else { OTHER_SEED };
    Settings { seed, samples: u32::MAX, ..settings.clone() }
}

impl<'a> Taker<'a> {
    pub fn new(renderer: &'a mut Renderer, settings: &Settings, observer: &'a mut dyn Observer) -> Self {
        let mut halves = Halves::new(settings.width, settings.height);
        if settings.guides {
            halves.make_guides();
        }
        Self::with(renderer, settings, halves, observer)
    }

    /// With memory that was made before.
    pub fn with(
        renderer: &'a mut Renderer,
        settings: &Settings,
        halves: Halves,
        observer: &'a mut dyn Observer,
    ) -> Self {
        let settings = settings.clone();
        let took = Took { kernel: "", ..Took::default() };
        Self { renderer, settings, halves, took, next: 0, own_passes: 0, observer, progress: 0.0 }
    }

    /// Whether only the difference of the halves tells the noise.
    pub fn apart(&self) -> bool {
        self.settings.sampler == Sampler::Sobol
    }

    pub fn survey(&self) -> Survey {
        Survey::new(&self.halves, self.apart())
    }

    pub fn noise(&self) -> Noise {
        self.survey().noise
    }

    /// Samples of a pixel in both halves, if all had the same.
    pub fn mean_samples(&self) -> f64 {
        self.halves.samples() as f64 / self.settings.pixels() as f64
    }

    fn asked(&mut self) -> u64 {
        (self.progress.clamp(0.0, 0.999) * STEPS as f64) as u64
    }

    fn check(&mut self) -> Result<(), Error> {
        let at = self.asked();
        match self.observer.progress(at, STEPS).is_break() {
            true => Err(Error::Cancelled),
            false => Ok(()),
        }
    }

    pub fn finish(&mut self) {
        let _ = self.observer.progress(STEPS, STEPS);
    }

    /// Goes on without guides.
    pub fn drop_guides(&mut self) {
        self.settings.guides = false;
        self.halves.drop_guides();
    }

    /// Takes `samples` more of each pixel, for each half.
    pub fn uniform(&mut self, samples: u32) -> Result<(), Error> {
        let chunks: Vec<Range<u32>> = crate::render::chunks(self.next..self.next + samples).collect();
        let rows = Rows::from(0..self.settings.height);
        for half in 0..2 {
            self.check()?;
            let settings = of_half(&self.settings, half);
            let guides = settings.guides;
            if guides || chunks.len() == 1 {
                let at = self.asked();
                for range in &chunks {
                    let count = range.len() as u32;
                    let mut ask = Ask(self.observer, at);
                    let sums = self.renderer.render_sums(&settings, &rows, range.clone(), &mut ask)?;
                    self.halves.add(half, sums.pixels, count);
                    if guides {
                        self.halves.add_guides(half, sums.guides, count);
                    }
                    self.took.device += sums.device;
                    self.took.submissions += sums.submissions;
                    self.took.kernel = sums.kernel;
                }
                continue;
            }
            let parts = Parts { settings: &settings, rows: &rows, samples: &chunks };
            let state = (self.halves.take(half), Took::default());
            let take =
                |state: &mut (Vec<PixelTotals>, Took), range: &Range<u32>, sums: &crate::render::Sums<'_>| {
                    halves::add(&mut state.0, sums.pixels, range.len() as u32);
                    state.1.device += sums.device;
                    state.1.submissions += sums.submissions;
                    state.1.kernel = sums.kernel;
                    Ok(())
                };
            let (pixels, took) = self.renderer.each_sums(&parts, state, &take)?;
            self.halves.put(half, pixels);
            self.halves.count(half, samples);
            self.took.device += took.device;
            self.took.submissions += took.submissions;
            self.took.kernel = took.kernel;
        }
        self.next += samples;
        Ok(())
    }

    /// Takes these numbers of samples of each tile's pixels, rounded by chance.
    pub fn own(&mut self, counts: [&[f64]; 2]) -> Result<(), Error> {
        self.own_passes += 1;
        let seed = self.settings.seed;
        let mut left =
            [0, 1].map(|half| allocate::whole(counts[half], seed, 2 * self.own_passes + half as u32));
        let tiles = self.halves.tiles().clone();
        loop {
            let most = left.iter().flatten().copied().max().unwrap_or(0).min(CHUNK_SAMPLES);
            if most == 0 {
                return Ok(());
            }
            let end = self.next + most;
            for (half, left) in left.iter_mut().enumerate() {
                let now: Vec<u32> = left.iter().map(|&left| left.min(most)).collect();
                if now.iter().all(|&count| count == 0) {
                    continue;
                }
                self.check()?;
                let at = self.asked();
                let own = Own { tiles: &tiles, counts: &now, end };
                let settings = of_half(&self.settings, half);
                let sums = self.renderer.render_own(&settings, &own, &mut Ask(self.observer, at))?;
                self.took.device += sums.device;
                self.took.submissions += sums.submissions;
                self.halves.add_own(half, sums.pixels, &now);
                if settings.guides {
                    self.halves.add_own_guides(half, sums.guides, &now);
                }
                left.iter_mut().zip(&now).for_each(|(left, now)| *left -= now);
            }
            self.next = end;
        }
    }

    /// As [`own`](Self::own) for `more` work, shared by what a survey found, or evenly. Returns how long it took.
    pub fn spend(&mut self, survey: &Survey, adaptive: bool, more: f64) -> Result<Duration, Error> {
        let start = Instant::now();
        let tiles = self.halves.tiles().clone();
        let counts = [0, 1].map(|half| match adaptive {
            true => {
                let shape = allocate::shape(survey, half, &tiles);
                allocate::next(survey, &tiles, half, &shape, self.halves.taken(half), 0.5 * more)
            }
            false => {
                let one = allocate::work(survey, &tiles, half, &|_| 1.0);
                vec![0.5 * more / one.max(1.0); tiles.len()]
            }
        });
        if !adaptive {
            let even = counts[0].first().copied().unwrap_or(0.0).min(f64::from(u32::MAX / 4));
            let whole = even.floor();
            if whole >= 1.0 {
                self.uniform(whole as u32)?;
            }
            // A part of a sample is one for some tiles; beside many it is not worth a launch.
            let rest = even - whole;
            if rest > 0.01 * even {
                let rest = vec![rest; tiles.len()];
                self.own([&rest, &rest])?;
            }
            return Ok(start.elapsed());
        }
        self.own([&counts[0], &counts[1]])?;
        Ok(start.elapsed())
    }
}
