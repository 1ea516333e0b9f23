//! Takes samples for both halves of an image: for all pixels as many, or for each tile its own.

use super::patience::{Patient, STEPS};
use super::survey::Survey;
use super::{Halves, Noise, SamplingError, allocate};
use crate::Error;
use crate::film::Rows;
use crate::render::{Observer, Own, Parts, Renderer, Sampler, Settings, Sums};
use std::cell::Cell;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
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

/// Launches for each half.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Launches {
    /// Chunks of all pixels.
    pub chunks: u32,
    /// Those in which tiles take their own numbers of samples, at most a chunk each.
    pub own: u32,
}

/// What a pass may take.
pub(super) struct Room<'a> {
    /// Work that there is time for beside so many launches.
    pub work: &'a dyn Fn(Launches) -> f64,
    /// [`Launches::own`], at most.
    pub own: u32,
}

/// What a pass took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spent {
    pub launches: Launches,
    /// By the survey.
    pub work: f64,
    pub seconds: f64,
    /// By the device's timer.
    pub device: f64,
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
    /// When it was first asked to end.
    ending: Option<Instant>,
    /// How far the image is, of 1.
    pub progress: f64,
}

/// The most samples from `first` on, and in how many chunks, where `fit` tells how many there is time for beside so many chunks.
fn most_within(first: u32, fit: &dyn Fn(u32) -> u32) -> (u32, u32) {
    let all = first..first.saturating_add(fit(0));
    let mut most = (0, 0);
    for (chunks, chunk) in (1..).zip(crate::render::chunks(all)) {
        let fits = fit(chunks);
        let samples = fits.min(chunk.end - first);
        if samples > most.0 {
            most = (samples, chunks);
        }
        if fits <= chunk.end - first {
            break;
        }
    }
    most
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
        Self {
            renderer,
            settings,
            halves,
            took,
            next: 0,
            own_passes: 0,
            observer,
            ending: None,
            progress: 0.0,
        }
    }

    /// Whether only the difference of the halves tells the noise.
    pub fn apart(&self) -> bool {
        self.settings.sampler == Sampler::Sobol
    }

    pub fn survey(&self) -> Survey {
        Survey::new(&self.halves, self.apart())
    }

    pub fn noise(&self) -> Noise {
        Noise::of(&self.halves, self.apart())
    }

    /// Samples of a pixel in both halves, if all had the same.
    pub fn mean_samples(&self) -> f64 {
        self.halves.samples() as f64 / self.settings.pixels() as f64
    }

    fn asked(&self) -> u64 {
        (self.progress.clamp(0.0, 0.999) * STEPS as f64) as u64
    }

    fn check(&mut self) -> Result<(), Error> {
        let at = self.asked();
        match self.observer.progress(at, STEPS).is_break() {
            true => Err(Error::Cancelled),
            false => Ok(()),
        }
    }

    /// Whether the image should get more samples.
    pub fn goes_on(&self) -> bool {
        self.observer.goes_on()
    }

    pub fn finish(&mut self) {
        let _ = self.observer.progress(STEPS, STEPS);
    }

    /// Goes on without guides.
    pub fn drop_guides(&mut self) {
        self.settings.guides = false;
        self.halves.drop_guides();
    }

    /// The index of the sample after so many more.
    fn after(&self, samples: u32) -> Result<u32, SamplingError> {
        self.next.checked_add(samples).ok_or(SamplingError::TooMany)
    }

    /// Takes `samples` more of each pixel, for each half, or whole chunks of them if it should not go on; returns how many chunks.
    pub fn uniform(&mut self, samples: u32) -> Result<u32, Error> {
        self.check()?;
        let end = self.after(samples)?;
        let chunks: Vec<Range<u32>> = crate::render::chunks(self.next..end).collect();
        let rows = Rows::from(0..self.settings.height);
        let settings = of_half(&self.settings, 0);
        let seeds = [settings.seed, of_half(&self.settings, 1).seed];
        let taken = AtomicUsize::new(0);
        let take = |(halves, took): &mut (&mut Halves, &mut Took), range: &Range<u32>, sums: &Sums<'_>| {
            let (half, count) = (usize::from(sums.seed != seeds[0]), range.len() as u32);
            halves.add(half, sums.pixels, count);
            if settings.guides {
                halves.add_guides(half, sums.guides, count);
            }
            took.device += sums.device;
            took.submissions += sums.submissions;
            took.kernel = sums.kernel;
            taken.fetch_add(1, Ordering::Release);
            Ok(())
        };
        // Both halves of a chunk, of one at least.
        let has_any = self.halves.samples() > 0;
        let at = self.asked();
        let mut patient = Patient::new(self.observer, at, &mut self.ending, || {
            has_any || taken.load(Ordering::Acquire) >= seeds.len()
        });
        let (ends, begun) = (Cell::new(false), Cell::new(0));
        let mut watch = |_| {
            let flow = patient.progress(0, 0);
            ends.set(!patient.goes_on());
            flow
        };
        let goes_on = || {
            let before: usize = begun.replace(begun.get() + 1);
            before < 2 || before % 2 == 1 || !ends.get()
        };
        let parts =
            Parts { settings: &settings, rows: &rows, samples: &chunks, seeds: &seeds, goes_on: &goes_on };
        let state = (&mut self.halves, &mut self.took);
        let done = self.renderer.each_sums(&parts, &mut watch, state, &take).map(|_| ());
        patient.or_given_up(done)?;
        let taken = taken.into_inner();
        // Of the last one there may be one half.
        let chunks = &chunks[..taken.div_ceil(2).min(chunks.len())];
        self.next = chunks.last().map_or(self.next, |last| last.end);
        Ok(chunks.len() as u32)
    }

    /// Takes these numbers of samples of each tile's pixels, rounded by chance; returns in how many launches of each half.
    pub fn own(&mut self, counts: [&[f64]; 2]) -> Result<u32, Error> {
        self.own_passes += 1;
        let seed = self.settings.seed;
        let mut left =
            [0, 1].map(|half| allocate::whole(counts[half], seed, 2 * self.own_passes + half as u32));
        let tiles = self.halves.tiles().clone();
        let mut launches = 0;
        loop {
            let most = left.iter().flatten().copied().max().unwrap_or(0).min(CHUNK_SAMPLES);
            let has_any = launches > 0 || self.halves.samples() > 0;
            if most == 0 || has_any && !self.goes_on() {
                return Ok(launches);
            }
            launches += 1;
            let end = self.after(most)?;
            for (half, left) in left.iter_mut().enumerate() {
                let now: Vec<u32> = left.iter().map(|&left| left.min(most)).collect();
                if now.iter().all(|&count| count == 0) {
                    continue;
                }
                self.check()?;
                let at = self.asked();
                let own = Own { tiles: &tiles, counts: &now, end };
                let settings = of_half(&self.settings, half);
                let mut patient = Patient::new(self.observer, at, &mut self.ending, || has_any);
                let sums = self.renderer.render_own(&settings, &own, &mut patient);
                let Some(sums) = patient.or_given_up(sums)? else {
                    // The other half may have taken its.
                    self.next = end;
                    return Ok(launches);
                };
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

    /// Takes as much as there is room for: where a survey found noise, or evenly.
    pub fn spend(&mut self, survey: &Survey, adaptive: bool, room: &Room) -> Result<Spent, Error> {
        let (start, before) = (Instant::now(), self.took.device);
        let tiles = self.halves.tiles().clone();
        let mut launches = Launches::default();
        let work;
        if adaptive {
            let shapes = [0, 1].map(|half| allocate::shape(survey, half, &tiles));
            let within = |launches, most: f64| {
                let work = 0.5 * (room.work)(launches);
                [0, 1].map(|half| {
                    let taken = self.halves.taken(half);
                    allocate::Filling::new((survey, &tiles), half, &shapes[half], taken, most).counts(work)
                })
            };
            launches.own = 1;
            let counts = within(launches, f64::MAX);
            let work_of = |half: usize, counts: &Vec<f64>, least: f64| {
                allocate::work(survey, &tiles, half, &|tile| counts[tile].max(least))
            };
            let beside = |launches| (room.work)(Launches::default()) - (room.work)(launches);
            let each;
            (each, launches) = self.for_all(room.own, &counts, &|each, launches| {
                work_of(0, &counts[0], each) + work_of(1, &counts[1], each) + beside(launches)
            });
            let most = f64::from(each) + f64::from(launches.own) * f64::from(CHUNK_SAMPLES);
            let mut counts = within(launches, most);
            // With less time, what all take is less, too.
            let greatest = counts.iter().flatten().copied().fold(0.0, f64::max);
            let each = each.min(greatest as u32);
            work = work_of(0, &counts[0], f64::from(each)) + work_of(1, &counts[1], f64::from(each));
            launches = Launches::default();
            if each > 0 {
                launches.chunks = self.uniform(each)?;
                counts.iter_mut().flatten().for_each(|count| *count = (*count - f64::from(each)).max(0.0));
            }
            launches.own = self.own([&counts[0], &counts[1]])?;
        } else {
            let one: f64 = (0..2).map(|half| allocate::work(survey, &tiles, half, &|_| 1.0)).sum();
            let fit = |launches| ((room.work)(launches) / one.max(1.0)).min(f64::from(u32::MAX / 4));
            let (samples, chunks) = most_within(self.next, &|chunks| fit(Launches { chunks, own: 0 }) as u32);
            launches.chunks = chunks;
            let whole = f64::from(samples);
            if samples > 0 {
                self.uniform(samples)?;
            }
            // A part of a sample is one for some tiles; beside many it is not worth a launch.
            let rest = (fit(Launches { own: 1, ..launches }) - whole).min(f64::from(CHUNK_SAMPLES));
            let is_worth = rest > 0.01 * whole;
            work = one * if is_worth { whole + rest } else { whole };
            if is_worth {
                let rest = vec![rest; tiles.len()];
                launches.own = self.own([&rest, &rest])?;
            }
        }
        let device = (self.took.device - before).as_secs_f64();
        Ok(Spent { launches, work, seconds: start.elapsed().as_secs_f64(), device })
    }

    /// How many samples all tiles take before those with more take the rest by themselves: launches for all bring more than a chunk at once and are read
    /// while the next is rendered, but some tiles get more than they should. `cost` is that of so many, with their launches.
    fn for_all(
        &self,
        most: u32,
        counts: &[Vec<f64>; 2],
        cost: &dyn Fn(f64, Launches) -> f64,
    ) -> (u32, Launches) {
        let greatest = counts.iter().flatten().copied().fold(0.0, f64::max).min(f64::from(u32::MAX / 4));
        let least = counts.iter().flatten().copied().fold(greatest, f64::min).floor();
        let mut candidates = vec![least, 0.0];
        let mut next = f64::from(CHUNK_SAMPLES);
        while next < greatest {
            candidates.push(next);
            next = (1.5 * next / f64::from(CHUNK_SAMPLES)).ceil() * f64::from(CHUNK_SAMPLES);
        }
        let with_launches = |each: f64| {
            let rest = ((greatest - each) / f64::from(CHUNK_SAMPLES)).ceil().max(1.0);
            let chunks =
                crate::render::chunks(self.next..self.next.saturating_add(each as u32)).count() as u32;
            (each, Launches { chunks, own: rest.min(f64::from(u32::MAX)) as u32 })
        };
        let all = candidates.into_iter().map(with_launches);
        let cheapest = all.min_by(|a, b| cost(a.0, a.1).total_cmp(&cost(b.0, b.1)));
        let (each, launches) = cheapest.unwrap_or((0.0, Launches { chunks: 0, own: 1 }));
        (each as u32, Launches { own: launches.own.min(most), ..launches })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where another chunk would cost more than it brings, the samples end with the chunk before.
    #[test]
    fn as_many_as_fit() {
        let within =
            |first, room: u32, chunk: u32| most_within(first, &|chunks| room.saturating_sub(chunks * chunk));
        assert_eq!(within(0, 100, 10), (90, 1));
        assert_eq!(within(0, CHUNK_SAMPLES + 15, 10), (CHUNK_SAMPLES, 1));
        assert_eq!(within(0, CHUNK_SAMPLES + 50, 10), (CHUNK_SAMPLES + 30, 2));
        assert_eq!(within(CHUNK_SAMPLES - 5, 100, 60), (5, 1));
        assert_eq!(within(CHUNK_SAMPLES - 5, 30, 12), (6, 2));
        assert_eq!(within(7, 10, 10), (0, 0));
    }
}
