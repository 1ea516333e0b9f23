//! Passes of the denoiser and of the display, on the CPU's thread pool.
#![allow(unsafe_code, reason = "calls the shared crate, which reads without bounds checks")]

use super::failed;
use crate::BackendError;
use crate::RowTarget;
use crate::target::span;
use crate::{DisplayLaunch, Kernel, Pass};
use rayon::prelude::*;
use std::ops::Range;
use std::time::{Duration, Instant};
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{
    FilteredPixel, GBufferTexel, HistoryPixel, accumulate, atrous_level, demodulate, estimate_variance,
    remodulate, reproject,
};
use trisect_shared::display::display;
use trisect_shared::film::PixelSums;

/// Records between passes, one for each pixel.
#[derive(Default)]
pub(super) struct Denoiser {
    images: [Vec<FilteredPixel>; 2],
    gbuffer: Vec<GBufferTexel>,
    /// History that frames keep for later ones; a frame reads one and writes the other.
    histories: [Vec<HistoryPixel>; 2],
    /// Sums over the frames since the camera came to rest.
    accumulated: Vec<(PixelSums, AovSums)>,
}

/// Returns the pixel range of `rows` of an image, or `None` if the image does not have these rows.
fn range(rows: &Range<u32>, width: usize, pixels: usize) -> Option<Range<usize>> {
    let range = rows.start as usize * width..rows.end as usize * width;
    (width > 0 && range.start <= range.end && range.end <= pixels).then_some(range)
}

impl Denoiser {
    /// Runs the passes in order. Returns the time of each.
    pub(super) fn run(
        &mut self,
        passes: &[Pass],
        film: &[PixelSums],
        guides: &[AovSums],
    ) -> Result<Vec<Duration>, BackendError> {
        self.images.iter_mut().for_each(|image| image.resize(film.len(), FilteredPixel::UNKNOWN));
        self.gbuffer.resize(film.len(), GBufferTexel::NONE);
        if passes.iter().any(|pass| pass.kernel.is_temporal()) {
            self.histories.iter_mut().for_each(|past| past.resize(film.len(), HistoryPixel::NONE));
            self.accumulated.resize(film.len(), (PixelSums::ZERO, AovSums::ZERO));
        }
        passes.iter().map(|pass| self.pass(pass, film, guides)).collect()
    }

    fn pass(
        &mut self,
        pass: &Pass,
        film: &[PixelSums],
        guides: &[AovSums],
    ) -> Result<Duration, BackendError> {
        let start = Instant::now();
        let params = &pass.params;
        let width = params.width as usize;
        let [first, second] = &mut self.images;
        let (from, to) = if pass.to == 1 { (&*first, second) } else { (&*second, first) };
        if width * params.height as usize != film.len() || film.is_empty() {
            return Err(failed("the pass is for an image of another size"));
        }
        if (pass.accumulated || pass.kernel.is_temporal()) && self.accumulated.len() != film.len() {
            return Err(failed("the pass needs sums of earlier frames, which were not kept"));
        }
        let Some(pixels) = range(&pass.rows, width, film.len()) else {
            return Err(failed("the pass has rows outside the image"));
        };
        if pass.kernel == Kernel::Add {
            let new = film[pixels.clone()].par_iter().zip(&guides[pixels.clone()]);
            let pixels = self.accumulated[pixels].par_iter_mut().zip(new).with_min_len(super::TASK);
            pixels.for_each(|(kept, (sums, guides))| *kept = accumulate(params, *sums, *guides, *kept));
            return Ok(start.elapsed());
        }
        let kept = pass.accumulated.then_some(&self.accumulated);
        let of = |pixel: usize| kept.map_or_else(|| (film[pixel], guides[pixel]), |kept| kept[pixel]);
        if pass.kernel == Kernel::Demodulate {
            let first = pixels.start;
            let edges = &mut self.gbuffer[pixels.clone()];
            let pixels = to[pixels].par_iter_mut().zip(edges).enumerate().with_min_len(super::TASK);
            pixels.for_each(|(index, (lit, edge))| {
                let pixel = first + index;
                let (sums, guides) = of(pixel);
                (*lit, *edge) = demodulate(params, sums, guides);
            });
            return Ok(start.elapsed());
        }
        let edges = &self.gbuffer;
        if pass.kernel == Kernel::Reproject {
            let [first, second] = &mut self.histories;
            let (past, next) = if pass.past == 0 { (&*first, second) } else { (&*second, first) };
            let first = pixels.start;
            let next = &mut next[pixels.clone()];
            let pixels = to[pixels].par_iter_mut().zip(next).enumerate().with_min_len(super::TASK);
            pixels.for_each(|(index, (lit, next))| {
                let pixel = first + index;
                let (x, y) = ((pixel % width) as u32, (pixel / width) as u32);
                let (sums, guides) = of(pixel);
                // SAFETY: the pixel is in the image, and all slices have a record for each pixel,
                // as was checked above.
                (*lit, *next) = unsafe { reproject(params, from, edges, past, sums.samples, guides, x, y) };
            });
            return Ok(start.elapsed());
        }
        to[pixels].par_chunks_mut(width).zip(pass.rows.clone()).for_each(|(pixels, y)| {
            for ((x, lit), pixel) in (0u32..).zip(pixels).zip(y as usize * width..) {
                // SAFETY: the pixel is in the image, and all slices have a record for each pixel,
                // as was checked above.
                *lit = unsafe {
                    match pass.kernel {
                        Kernel::Add | Kernel::Demodulate | Kernel::Reproject => *lit,
                        Kernel::Estimate => estimate_variance(params, from, edges, of(pixel).0.samples, x, y),
                        Kernel::Atrous => atrous_level::<false>(params, from, edges, x, y),
                        Kernel::Svgf => atrous_level::<true>(params, from, edges, x, y),
                        Kernel::Remodulate => remodulate(from[pixel], of(pixel).1),
                    }
                };
            }
        });
        Ok(start.elapsed())
    }

    pub(super) fn read(&self, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError> {
        let from = self.images.get(image).filter(|image| image.len() == pixels.len());
        pixels.copy_from_slice(from.ok_or_else(|| failed("no pass wrote this image"))?);
        Ok(())
    }

    /// Converts rows of a frame for a display. Returns the time.
    pub(super) fn display(
        &self,
        frame: &DisplayLaunch,
        film: &[PixelSums],
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        let start = Instant::now();
        let from = match frame.image {
            None => None,
            Some(image) => {
                let image = self.images.get(image).filter(|image| image.len() == film.len());
                Some(image.ok_or_else(|| failed("no pass wrote this image"))?)
            }
        };
        let width = frame.params.width as usize;
        let fits = range(&span(frame.params.first_row, to.rows()), width, film.len()).is_some()
            && to.width() == width
            && (!frame.accumulated || self.accumulated.len() == film.len());
        if !fits {
            return Err(failed("the film is of an image of another size"));
        }
        to.each_row().into_par_iter().for_each(|(y, pixels)| {
            for ((x, pixel), index) in (0u32..).zip(pixels).zip(y as usize * width..) {
                let sums = if frame.accumulated { self.accumulated[index].0 } else { film[index] };
                let lit = from.map_or(FilteredPixel::UNKNOWN, |from| from[index]);
                *pixel = display(&frame.params, sums, lit, x);
            }
        });
        Ok(start.elapsed())
    }
}
