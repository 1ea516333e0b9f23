//! A pass over both halves of an image within a budget of work: the samples of all tiles, and those
//! of the tiles with more noise.

use super::allocate;
use super::noise_map::NoiseMap;
use super::renderer::AdaptiveRenderer;
use crate::Error;
use trisect_shared::film::CHUNK_SAMPLES;
use web_time::Instant;

/// Number of launches for each half.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Launches {
    /// Chunks of all pixels.
    pub chunks: u32,
    /// Launches with a sample count for each tile, of at most a chunk.
    pub tile_launches: u32,
}

/// Limits of a pass.
pub(super) struct PassBudget<'a> {
    /// Returns the work that fits the time that the host cost of these launches leaves.
    pub work: &'a dyn Fn(Launches) -> f64,
    /// Maximum of [`Launches::tile_launches`].
    pub max_tile_launches: u32,
}

/// Cost of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PassCost {
    pub launches: Launches,
    /// Work by the noise map, in segments.
    pub work: f64,
    pub seconds: f64,
    /// Device time, in seconds.
    pub device: f64,
}

/// Returns the maximum number of samples from index `first` on, and the number of their chunks.
/// `fit` returns the number of samples that fit the time that the host cost of its argument, a
/// number of chunks, leaves.
fn max_samples_within(first: u32, fit: &dyn Fn(u32) -> u32) -> (u32, u32) {
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

impl AdaptiveRenderer<'_> {
    /// Takes as many samples as the budget allows: by noise, or evenly.
    pub fn run_pass(
        &mut self,
        noise_map: &NoiseMap,
        adaptive: bool,
        room: &PassBudget,
    ) -> Result<PassCost, Error> {
        let (start, before) = (Instant::now(), self.totals.device);
        let tiles = self.halves.tiles().clone();
        let mut launches = Launches::default();
        let work;
        if adaptive {
            let shares = noise_map.shares(&tiles);
            let within = |launches, most: f64| {
                let work = 0.5 * (room.work)(launches);
                let taken = [0, 1].map(|half| self.halves.taken(half));
                allocate::Allocation::of_both((noise_map, &tiles), shares, taken, most)
                    .map(|allocation| allocation.counts(work))
            };
            launches.tile_launches = 1;
            let counts = within(launches, f64::MAX);
            let before = (room.work)(launches);
            let work_of = |half: usize, counts: &Vec<f64>, least: f64| {
                allocate::work(noise_map, &tiles, half, &|tile| counts[tile].max(least))
            };
            let beside = |launches| (room.work)(Launches::default()) - (room.work)(launches);
            let each;
            (each, launches) = self.for_all(room.max_tile_launches, &counts, &|each, launches| {
                work_of(0, &counts[0], each) + work_of(1, &counts[1], each) + beside(launches)
            });
            let most = f64::from(each) + f64::from(launches.tile_launches) * f64::from(CHUNK_SAMPLES);
            let greatest = counts.iter().flatten().copied().fold(0.0, f64::max);
            let is_same = greatest <= most && (room.work)(launches) == before;
            let mut counts = if is_same { counts } else { within(launches, most) };
            // With less time, the samples that all tiles take are fewer, too.
            let greatest = counts.iter().flatten().copied().fold(0.0, f64::max);
            let each = each.min(greatest as u32);
            work = work_of(0, &counts[0], f64::from(each)) + work_of(1, &counts[1], f64::from(each));
            launches = Launches::default();
            if each > 0 {
                launches.chunks = self.render_uniform(each)?;
                counts.iter_mut().flatten().for_each(|count| *count = (*count - f64::from(each)).max(0.0));
            }
            launches.tile_launches = self.render_per_tile([&counts[0], &counts[1]])?;
        } else {
            let one: f64 = (0..2).map(|half| allocate::work(noise_map, &tiles, half, &|_| 1.0)).sum();
            let fit = |launches| ((room.work)(launches) / one.max(1.0)).min(f64::from(u32::MAX / 4));
            let (samples, chunks) =
                max_samples_within(self.next, &|chunks| fit(Launches { chunks, tile_launches: 0 }) as u32);
            launches.chunks = chunks;
            let whole = f64::from(samples);
            if samples > 0 {
                self.render_uniform(samples)?;
            }
            // A fraction of a sample is a whole sample for some tiles; beside many samples it is
            // not worth a launch.
            let rest = (fit(Launches { tile_launches: 1, ..launches }) - whole).min(f64::from(CHUNK_SAMPLES));
            let is_worth = rest > 0.01 * whole;
            work = one * if is_worth { whole + rest } else { whole };
            if is_worth {
                let rest = vec![rest; tiles.len()];
                launches.tile_launches = self.render_per_tile([&rest, &rest])?;
            }
        }
        let device = (self.totals.device - before).as_secs_f64();
        Ok(PassCost { launches, work, seconds: start.elapsed().as_secs_f64(), device })
    }

    /// Returns the number of samples that all tiles take first, and the launches of the pass: tiles
    /// that need more take the rest in tile launches. A tile launch takes at most a chunk. Launches
    /// for all tiles may take several chunks, each of which is read while the next is rendered, but
    /// they give some tiles more than they need. `cost` returns the cost of such a number and its
    /// launches.
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
            (each, Launches { chunks, tile_launches: rest.min(f64::from(u32::MAX)) as u32 })
        };
        let all = candidates.into_iter().map(with_launches);
        let cheapest = all.min_by(|a, b| cost(a.0, a.1).total_cmp(&cost(b.0, b.1)));
        let (each, launches) = cheapest.unwrap_or((0.0, Launches { chunks: 0, tile_launches: 1 }));
        (each as u32, Launches { tile_launches: launches.tile_launches.min(most), ..launches })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// If another chunk would cost more than it brings, the samples end with the chunk before.
    #[test]
    fn as_many_as_fit() {
        let within = |first, room: u32, chunk: u32| {
            max_samples_within(first, &|chunks| room.saturating_sub(chunks * chunk))
        };
        assert_eq!(within(0, 100, 10), (90, 1));
        assert_eq!(within(0, CHUNK_SAMPLES + 15, 10), (CHUNK_SAMPLES, 1));
        assert_eq!(within(0, CHUNK_SAMPLES + 50, 10), (CHUNK_SAMPLES + 30, 2));
        assert_eq!(within(CHUNK_SAMPLES - 5, 100, 60), (5, 1));
        assert_eq!(within(CHUNK_SAMPLES - 5, 30, 12), (6, 2));
        assert_eq!(within(7, 10, 10), (0, 0));
    }
}
