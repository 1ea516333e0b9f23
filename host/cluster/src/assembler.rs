//! Assembles the image on the root from the image parts that arrive.

use super::ClusterError;
use super::image_part::{ImagePart, WireFormat};
use super::means::MeanSum;
use crate::Error;
use rayon::prelude::*;
use std::ops::Range;
use trisect::film::{Film, FilmCounts, SampleBlock};
use trisect::image::Image;

/// Image on the root, complete or partial.
#[derive(Clone, Debug)]
pub enum AssembledImage {
    /// sRGB, 8 bits per channel, row by row; black where no part arrived.
    Bytes {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Three bytes per pixel.
        bytes: Vec<u8>,
    },
    /// Radiance; NaN where no part arrived.
    Color(Image),
    /// All sums.
    Film(Box<Film>),
}

/// Pixels in the form in which they arrive.
enum Store {
    Bytes(Vec<u8>),
    Color(Vec<[f32; 3]>),
    Means(Vec<MeanSum>),
    Film(Box<Film>),
}

/// Image of the root while parts arrive.
pub(super) struct Assembler {
    width: u32,
    height: u32,
    store: Store,
    /// Samples received, summed over all pixels, of those that were requested.
    pub done: u64,
    /// Samples requested, summed over all pixels.
    pub total: u64,
    /// Counts over all image parts.
    pub counts: FilmCounts,
}

impl Assembler {
    /// Creates an empty image for pixels in this wire format.
    pub fn new(width: u32, height: u32, samples: u32, travels: WireFormat) -> Self {
        let pixels = width as usize * height as usize;
        let store = match travels {
            WireFormat::Bytes => Store::Bytes(vec![0; pixels * 3]),
            WireFormat::Color => Store::Color(vec![[f32::NAN; 3]; pixels]),
            WireFormat::Chunk | WireFormat::Mean | WireFormat::Double => {
                Store::Means(vec![MeanSum::ZERO; pixels])
            }
            WireFormat::Sums => Store::Film(Box::new(Film::new(width, height))),
            WireFormat::SumsAndAovs => Store::Film(Box::new(Film::with_aovs(width, height))),
        };
        let total = pixels as u64 * u64::from(samples);
        Self { width, height, store, done: 0, total, counts: FilmCounts::default() }
    }

    /// Creates an assembler that completes a film; `samples` are the indices that it should have.
    pub fn for_film(film: Film, samples: &Range<u32>) -> Self {
        let missing = film.coverage.missing(samples);
        let (width, height) = (film.width, film.height);
        let total = missing.iter().map(SampleBlock::size).sum::<u64>() * u64::from(width);
        let store = Store::Film(Box::new(film));
        Self { width, height, store, done: 0, total, counts: FilmCounts::default() }
    }

    /// Returns the film, if the image has all sums.
    pub fn film(&self) -> Option<&Film> {
        match &self.store {
            Store::Film(film) => Some(film),
            _ => None,
        }
    }

    /// Returns whether all samples have arrived.
    pub fn is_complete(&self) -> bool {
        self.done >= self.total
    }

    /// Returns the numbers of complete pixels and of all pixels, counted as if samples arrived
    /// pixel by pixel.
    pub fn pixels(&self) -> (u64, u64) {
        let pixels = u64::from(self.width) * u64::from(self.height);
        (self.done / (self.total / pixels.max(1)).max(1), pixels)
    }

    fn bytes(&self, rows: &Range<u32>, of: usize) -> Range<usize> {
        let row = self.width as usize * of;
        rows.start as usize * row..rows.end as usize * row
    }

    /// Adds an image part that was checked against the image's size.
    ///
    /// # Errors
    ///
    /// For a part in another wire format; in a film, also for samples that it already has.
    pub fn take(&mut self, from: u32, piece: &ImagePart) -> Result<(), Error> {
        let other = || ClusterError::Protocol { rank: from, message: "pixels in another format".to_owned() };
        let (width, size) = (self.width as usize, piece.wire_format.bytes());
        let pixels = piece.pixels();
        let mut at = 0;
        let mut blocks: Vec<(Range<usize>, &[u8])> = Vec::new();
        for block in piece.rows.blocks() {
            let length = block.len() * width * size;
            blocks.push((self.bytes(&block, 1), pixels.get(at..at + length).unwrap_or_default()));
            at += length;
        }
        match (&mut self.store, piece.wire_format) {
            (Store::Bytes(store), WireFormat::Bytes) => {
                for (range, from) in blocks {
                    store[range.start * 3..range.end * 3].copy_from_slice(from);
                }
            }
            (Store::Color(store), WireFormat::Color) => {
                for (range, from) in blocks {
                    let to: &mut [u8] = bytemuck::cast_slice_mut(&mut store[range]);
                    to.copy_from_slice(from);
                }
            }
            (Store::Film(film), WireFormat::Sums | WireFormat::SumsAndAovs) => {
                let (sums, guides) = piece.sums();
                let mut at = 0;
                for rows in piece.rows.blocks() {
                    let pixels = at..at + rows.len() * width;
                    at = pixels.end;
                    let part = SampleBlock { rows, samples: piece.samples.clone() };
                    film.merge(&part, &sums[pixels.clone()])?;
                    if piece.wire_format == WireFormat::SumsAndAovs {
                        film.merge_aovs(&part, &guides[pixels])?;
                    }
                }
            }
            _ => return Err(other().into()),
        }
        self.done += (u64::from(piece.rows.len()) * width as u64) * piece.samples.len() as u64;
        Ok(())
    }

    /// Adds a rank's sums of contiguous rows to the sums of the image.
    ///
    /// # Errors
    ///
    /// For a part in another wire format, or of rows that are not contiguous.
    pub fn add(&mut self, from: u32, piece: &ImagePart) -> Result<(), ClusterError> {
        let other = || ClusterError::Protocol { rank: from, message: "pixels in another format".to_owned() };
        let rows = piece.rows.blocks().next().filter(|rows| rows.len() == piece.rows.len() as usize);
        let pixels = self.bytes(&rows.ok_or_else(other)?, 1);
        let Store::Means(store) = &mut self.store else { return Err(other()) };
        let summed = matches!(piece.wire_format, WireFormat::Chunk | WireFormat::Mean | WireFormat::Double);
        let to = store.get_mut(pixels).filter(|_| summed).ok_or_else(other)?;
        piece.add_to(to);
        self.done += to.len() as u64 * piece.samples.len() as u64;
        Ok(())
    }

    /// Returns the image so far.
    pub fn picture(self) -> AssembledImage {
        let (width, height) = (self.width, self.height);
        match self.store {
            Store::Bytes(bytes) => AssembledImage::Bytes { width, height, bytes },
            Store::Color(pixels) => AssembledImage::Color(Image { width, height, pixels }),
            Store::Means(means) => AssembledImage::Color(Image {
                width,
                height,
                pixels: means.par_iter().map(MeanSum::mean).collect(),
            }),
            Store::Film(film) => AssembledImage::Film(film),
        }
    }
}
