//! Chunks one after the other: what one holds is summed on the host while the device renders the next.

use super::sums::{Sums, Took};
use super::{Renderer, Settings};
use crate::Error;
use crate::backend::{Backend, DeviceKind};
use crate::film::{HostRecords, Rows};
use std::ops::{ControlFlow, Range};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};
use trisect_kernels::Variant;
use trisect_shared::film::PixelSums;
use trisect_shared::guides::Guides;

/// What chunks took in all.
#[derive(Default)]
pub(crate) struct Chunks {
    pub device: Duration,
    /// Copying from the device.
    pub read: Duration,
    /// That, and what else the device waited for.
    pub waited: Duration,
    pub submissions: u64,
}

/// Samples of some rows, cut into chunks.
pub(crate) struct Parts<'a> {
    pub settings: &'a Settings,
    pub rows: &'a Rows,
    pub samples: &'a [Range<u32>],
}

/// What takes chunks, and memory for one.
type Taker<T> = (T, HostRecords<PixelSums>, Vec<Guides>);

/// Chunks from which on memory that the device copies to without a detour is worth what making it such takes: at 1920x1080 some 15 ms, for 6 ms a chunk.
const WORTH: usize = 4;

/// The same, or the thread that has it.
enum Held<'scope, T> {
    Here(Taker<T>),
    There(ScopedJoinHandle<'scope, Result<Taker<T>, Error>>),
}

impl<T> Held<'_, T> {
    fn wait(self) -> Result<Taker<T>, Error> {
        match self {
            Self::Here(taker) => Ok(taker),
            Self::There(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        }
    }
}

/// Gives a chunk so many pixels; the device lets go of memory that is too small.
pub(super) fn make_room(backend: &mut dyn Backend, chunk: &mut HostRecords<PixelSums>, pixels: usize) {
    if chunk.memory().bytes() < pixels * size_of::<PixelSums>() {
        backend.unpin(chunk.memory());
    }
    chunk.resize(pixels);
}

impl Renderer {
    /// Renders chunks for a film that someone else merges. `take` gets each, in order, with `state`; where the device is no processor of the host, on another
    /// thread while the next chunk is rendered.
    ///
    /// # Errors
    ///
    /// As [`render_sums`](Self::render_sums), and what `take` says.
    pub(crate) fn each_sums<T: Send>(
        &mut self,
        parts: &Parts<'_>,
        state: T,
        take: &(impl Fn(&mut T, &Range<u32>, &Sums<'_>) -> Result<(), Error> + Sync),
    ) -> Result<T, Error> {
        let variant = self.ready_for(parts.settings, parts.rows, parts.samples)?;
        Ok(self.each_chunk(parts, variant, &mut |_| ControlFlow::Continue(()), state, take)?.0)
    }

    /// The same with what was made ready for it. `watch` is told how many samples were taken so far.
    ///
    /// # Errors
    ///
    /// As [`chunk`](Self::chunk), and what `take` says.
    pub(super) fn each_chunk<T: Send>(
        &mut self,
        parts: &Parts<'_>,
        variant: Variant,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
        state: T,
        take: &(impl Fn(&mut T, &Range<u32>, &Sums<'_>) -> Result<(), Error> + Sync),
    ) -> Result<(T, Chunks), Error> {
        let Parts { settings, rows, samples } = *parts;
        let per_sample = u64::from(settings.width) * u64::from(rows.len());
        let kernel = variant.name;
        let mut before = 0;
        let mut render = |renderer: &mut Self, all: &mut Chunks, samples: &Range<u32>| {
            let mut watch = |done| watch(before + done);
            let took = renderer.chunk(settings, variant, rows, samples.clone(), &mut watch)?;
            before += per_sample * samples.len() as u64;
            all.device += took.device;
            all.read += took.read;
            all.waited += took.read;
            all.submissions += took.submissions;
            Ok::<Took, Error>(took)
        };
        let mut all = Chunks::default();
        if samples.len() < 2 || self.backend.device().kind != DeviceKind::Gpu {
            let mut state = state;
            for samples in samples {
                let Took { device, submissions, .. } = render(self, &mut all, samples)?;
                let start = Instant::now();
                let (pixels, guides) = (&self.chunk[..], &self.guides[..]);
                take(&mut state, samples, &Sums { pixels, guides, kernel, device, submissions })?;
                all.waited += start.elapsed();
            }
            return Ok((state, all));
        }
        let state = std::thread::scope(|scope| {
            if samples.len() >= WORTH {
                self.pin_chunks(settings.width as usize * rows.len() as usize);
            }
            let mut held = Held::Here((state, std::mem::take(&mut self.spare), Vec::new()));
            for samples in samples {
                let Took { device, submissions, .. } = render(self, &mut all, samples)?;
                let start = Instant::now();
                let (mut state, pixels, guides) = held.wait()?;
                let pixels = std::mem::replace(&mut self.chunk, pixels);
                let guides = std::mem::replace(&mut self.guides, guides);
                held = Held::There(scope.spawn(move || {
                    let sums = Sums { pixels: &pixels, guides: &guides, kernel, device, submissions };
                    take(&mut state, samples, &sums)?;
                    Ok((state, pixels, guides))
                }));
                all.waited += start.elapsed();
            }
            let start = Instant::now();
            let (state, pixels, guides) = held.wait()?;
            self.spare = std::mem::replace(&mut self.chunk, pixels);
            self.guides = guides;
            all.waited += start.elapsed();
            Ok::<T, Error>(state)
        })?;
        Ok((state, all))
    }

    /// Makes memory for two chunks of so many pixels to which the device copies without a detour.
    fn pin_chunks(&mut self, pixels: usize) {
        for chunk in [&mut self.chunk, &mut self.spare] {
            make_room(self.backend.as_mut(), chunk, pixels);
            self.backend.pin(chunk.memory());
        }
    }
}
