//! The denoiser's passes over a pool of threads.
#![allow(unsafe_code, reason = "calls the shared crate, which reads without bounds checks")]

use super::failed;
use crate::backend::BackendError;
use crate::denoise::{Kernel, Pass};
use rayon::prelude::*;
use std::time::{Duration, Instant};
use trisect_shared::denoise::{Edge, Lit, estimate, finish, gather, level};
use trisect_shared::film::PixelSums;
use trisect_shared::guides::Guides;

/// The images between passes.
#[derive(Default)]
pub(super) struct Denoiser {
    images: [Vec<Lit>; 2],
    edges: Vec<Edge>,
}

impl Denoiser {
    /// Runs the passes one after the other, and says how long each took.
    pub(super) fn run(
        &mut self,
        passes: &[Pass],
        film: &[PixelSums],
        guides: &[Guides],
    ) -> Result<Vec<Duration>, BackendError> {
        self.images.iter_mut().for_each(|image| image.resize(film.len(), Lit::UNKNOWN));
        self.edges.resize(film.len(), Edge::NONE);
        passes.iter().map(|pass| self.pass(pass, film, guides)).collect()
    }

    fn pass(&mut self, pass: &Pass, film: &[PixelSums], guides: &[Guides]) -> Result<Duration, BackendError> {
        let start = Instant::now();
        let params = &pass.params;
        let width = params.width as usize;
        let [first, second] = &mut self.images;
        let (from, to) = if pass.to == 1 { (&*first, second) } else { (&*second, first) };
        if width * params.height as usize != film.len() || film.is_empty() {
            return Err(failed("a pass over another image"));
        }
        let edges = &mut self.edges;
        if pass.kernel == Kernel::Gather {
            let pixels = to.par_iter_mut().zip(edges).zip(film.par_iter().zip(guides));
            pixels.with_min_len(super::TASK).for_each(|((lit, edge), (sums, guides))| {
                (*lit, *edge) = gather(params, *sums, *guides);
            });
            return Ok(start.elapsed());
        }
        let edges = &*edges;
        to.par_chunks_mut(width).enumerate().for_each(|(row, pixels)| {
            let y = row as u32;
            for ((x, lit), pixel) in (0u32..).zip(pixels).zip(row * width..) {
                // SAFETY: the pixel is of the image, and all slices are as long as that, as was checked above.
                *lit = unsafe {
                    match pass.kernel {
                        Kernel::Gather => *lit,
                        Kernel::Estimate => estimate(params, from, edges, film[pixel].samples, x, y),
                        Kernel::Atrous => level::<false>(params, from, edges, x, y),
                        Kernel::Svgf => level::<true>(params, from, edges, x, y),
                        Kernel::Finish => finish(from[pixel], guides[pixel]),
                    }
                };
            }
        });
        Ok(start.elapsed())
    }

    pub(super) fn read(&self, image: usize, pixels: &mut [Lit]) -> Result<(), BackendError> {
        let from = self.images.get(image).filter(|image| image.len() == pixels.len());
        pixels.copy_from_slice(from.ok_or_else(|| failed("an image that no pass wrote"))?);
        Ok(())
    }
}
