//! Image parts as messages, in the smallest format that the output needs.
//!
//! Each rank encodes its rendered sums as image parts; the root, or the parent in the tree of
//! ranks, decodes and adds them.

use super::ClusterError;
use super::means::{ChunkSum, DoubleSum, MeanSum, counts_of};
use bytemuck::{Pod, Zeroable, bytes_of, cast_slice, pod_collect_to_vec};
use rayon::prelude::*;
use std::ops::Range;
use trisect::film::{FilmCounts, PixelTotals, RowSet};
use trisect::metrics::srgb;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// Data sent for each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum WireFormat {
    /// sRGB, 8 bits per channel, for .png files. 3 bytes.
    Bytes = 1,
    /// Mean radiance in `f32`, for other image files. 12 bytes.
    Color = 2,
    /// Radiance sum and sample count of one chunk, for averages with at most one chunk per rank. 16
    /// bytes.
    Chunk = 3,
    /// Exact radiance sum and sample count. 56 bytes; sent as `Double` if `f64` holds all sums of
    /// the image part, and as `Chunk` if it is a single chunk.
    Mean = 4,
    /// Radiance sum in `f64` and sample count. 28 bytes.
    Double = 7,
    /// All kernel sums of a chunk, for variances. 32 bytes.
    Sums = 5,
    /// All kernel sums and AOV sums of a chunk, for denoising and AOVs. 96 bytes.
    SumsAndAovs = 6,
}

impl WireFormat {
    const ALL: [Self; 7] =
        [Self::Bytes, Self::Color, Self::Chunk, Self::Mean, Self::Sums, Self::SumsAndAovs, Self::Double];

    /// Returns the bytes per pixel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Bytes => 3,
            Self::Color => 12,
            Self::Chunk => size_of::<ChunkSum>(),
            Self::Mean => size_of::<MeanSum>(),
            Self::Double => size_of::<DoubleSum>(),
            Self::Sums => size_of::<PixelSums>(),
            Self::SumsAndAovs => size_of::<PixelSums>() + size_of::<AovSums>(),
        }
    }
}

/// Header of an image part: 96 bytes before the pixels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Header {
    first: u32,
    shift: u32,
    gap: u32,
    start: u32,
    end: u32,
    first_sample: u32,
    end_sample: u32,
    wire_format: u32,
    width: u32,
    submissions: u32,
    samples: u64,
    rejected: u64,
    segments: u64,
    unwritten: u64,
    device_nanoseconds: u64,
    render_nanoseconds: u64,
    /// Phase of an average.
    phase: u32,
    pad: u32,
}

const _: () = assert!(size_of::<Header>() == 96);

/// Part of the image, encoded as a message: some samples of some rows.
#[derive(Clone, Debug, PartialEq)]
pub struct ImagePart {
    /// Rows of the image.
    pub rows: RowSet,
    /// Sample indices of each pixel; for a sum over several ranks 0 to the number of samples.
    pub samples: Range<u32>,
    /// Phase of an average with two: 0 for all chunks but the last, 1 for the last chunk.
    pub phase: u32,
    /// Data of each pixel.
    pub wire_format: WireFormat,
    /// Width of the image in pixels.
    pub width: u32,
    /// Counts over the part's samples.
    pub counts: FilmCounts,
    /// Render time by the device's timer, in seconds.
    pub device_seconds: f64,
    /// Render time measured by the host, in seconds; 0 in a part from another rank.
    pub render_seconds: f64,
    /// Number of submissions.
    pub submissions: u32,
    /// Header and pixels.
    bytes: Vec<u8>,
}

/// Rendered sums before they are encoded.
pub(super) enum Rendered<'a> {
    /// Kernel sums and AOV sums of one chunk.
    Chunk(&'a [PixelSums], &'a [AovSums]),
    /// Sums over several chunks, and their counts.
    Means(&'a [MeanSum], FilmCounts),
}

impl Rendered<'_> {
    fn mean(&self, pixel: usize, samples: u32) -> MeanSum {
        match self {
            Self::Chunk(sums, _) => MeanSum::of(&PixelTotals::of(&sums[pixel], samples)),
            Self::Means(means, _) => means[pixel],
        }
    }
}

/// Cost of an image part: device seconds, host seconds, submissions.
pub(super) type Cost = (f64, f64, u32);

/// Strip to which this rank and all ranks below it have added their sums.
pub(super) struct Strip {
    pub rows: RowSet,
    pub phase: u32,
    /// Samples per pixel.
    pub samples: u32,
    pub sums: Vec<MeanSum>,
    pub counts: (FilmCounts, u32),
}

impl ImagePart {
    /// Encodes the `rendered` sums of `rows` of an image of `width` pixels, with the sample indices
    /// of each pixel and the phase of an average. Sums over chunks are sent in the smallest format
    /// that holds them exactly.
    pub(super) fn new(
        rows: &RowSet,
        (samples, phase): (Range<u32>, u32),
        width: u32,
        travels: WireFormat,
        rendered: &Rendered,
        cost: Cost,
    ) -> Self {
        let travels = match (travels, rendered) {
            (WireFormat::Chunk | WireFormat::Mean, Rendered::Means(means, _)) => {
                let double = means.par_iter().with_min_len(4096).all(MeanSum::is_double);
                if double { WireFormat::Double } else { WireFormat::Mean }
            }
            (WireFormat::Mean, Rendered::Chunk(..)) => WireFormat::Chunk,
            _ => travels,
        };
        let pixels = rows.len() as usize * width as usize;
        let expected = samples.len() as u32;
        let counts = match rendered {
            Rendered::Chunk(sums, _) => counts_of(sums, expected),
            Rendered::Means(_, counts) => *counts,
        };
        let ((first, shift, gap), own) = (rows.share(), rows.places());
        let header = Header {
            first,
            shift,
            gap,
            start: own.start,
            end: own.end,
            first_sample: samples.start,
            end_sample: samples.end,
            wire_format: travels as u32,
            width,
            submissions: cost.2,
            samples: counts.samples,
            rejected: counts.rejected,
            segments: counts.segments,
            unwritten: counts.unwritten,
            device_nanoseconds: (cost.0 * 1e9) as u64,
            render_nanoseconds: (cost.1 * 1e9) as u64,
            phase,
            pad: 0,
        };
        let mut bytes = vec![0u8; size_of::<Header>() + pixels * travels.bytes()];
        let (head, body) = bytes.split_at_mut(size_of::<Header>());
        head.copy_from_slice(bytes_of(&header));
        encode(body, travels, rendered, expected);
        let (rows, (device_seconds, render_seconds, submissions)) = (rows.clone(), cost);
        Self {
            rows,
            samples,
            phase,
            wire_format: travels,
            width,
            counts,
            device_seconds,
            render_seconds,
            submissions,
            bytes,
        }
    }

    /// Encodes a strip's sums that several ranks added up.
    pub(super) fn of_strip(strip: &Strip, width: u32) -> Self {
        let Strip { rows, phase, samples, sums: means, counts: (counts, submissions) } = strip;
        let (samples, submissions) = (0..*samples, *submissions);
        let double = means.par_iter().with_min_len(4096).all(MeanSum::is_double);
        let travels = if double { WireFormat::Double } else { WireFormat::Mean };
        let (first, shift, gap) = rows.share();
        let header = Header {
            first,
            shift,
            gap,
            start: rows.places().start,
            end: rows.places().end,
            first_sample: samples.start,
            end_sample: samples.end,
            wire_format: travels as u32,
            width,
            submissions,
            samples: counts.samples,
            rejected: counts.rejected,
            segments: counts.segments,
            unwritten: counts.unwritten,
            phase: *phase,
            ..Header::zeroed()
        };
        let mut bytes = vec![0u8; size_of::<Header>() + means.len() * travels.bytes()];
        let (head, body) = bytes.split_at_mut(size_of::<Header>());
        head.copy_from_slice(bytes_of(&header));
        let places = body.par_chunks_exact_mut(travels.bytes()).zip(means).with_min_len(4096);
        places.for_each(|(place, mean)| match double {
            true => place.copy_from_slice(bytes_of(&DoubleSum::of(mean))),
            false => place.copy_from_slice(bytes_of(mean)),
        });
        let rows = rows.clone();
        Self {
            rows,
            samples,
            phase: *phase,
            wire_format: travels,
            width,
            counts: *counts,
            device_seconds: 0.0,
            render_seconds: 0.0,
            submissions,
            bytes,
        }
    }

    /// Returns the encoded message.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Decodes an image part that `rank` sent, of an image of this size.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Protocol`] for bytes that are no part of the image.
    pub fn read(rank: u32, bytes: Vec<u8>, width: u32, height: u32) -> Result<Self, ClusterError> {
        let wrong = |message: &str| ClusterError::Protocol { rank, message: message.to_owned() };
        let head = bytes.get(..size_of::<Header>()).ok_or_else(|| wrong("a truncated image part"))?;
        let header: Header = bytemuck::pod_read_unaligned(head);
        let travels = WireFormat::ALL.into_iter().find(|kind| *kind as u32 == header.wire_format);
        let travels = travels.ok_or_else(|| wrong("pixels in an unknown format"))?;
        let rows = RowSet::of_share((header.first, header.shift, header.gap), header.start..header.end);
        let rows = rows.filter(|rows| rows.end() <= height && header.width == width);
        let rows = rows.ok_or_else(|| wrong("rows outside the image"))?;
        let pixels = rows.len() as usize * width as usize;
        if bytes.len() != size_of::<Header>() + pixels * travels.bytes() {
            return Err(wrong("an image part whose length differs from its header"));
        }
        Ok(Self {
            rows,
            samples: header.first_sample..header.end_sample,
            phase: header.phase,
            wire_format: travels,
            width,
            counts: FilmCounts {
                samples: header.samples,
                rejected: header.rejected,
                segments: header.segments,
                unwritten: header.unwritten,
            },
            device_seconds: header.device_nanoseconds as f64 * 1e-9,
            render_seconds: header.render_nanoseconds as f64 * 1e-9,
            submissions: header.submissions,
            bytes,
        })
    }

    /// Returns the encoded pixels of all rows, from top to bottom; AOV sums follow all other sums.
    pub fn pixels(&self) -> &[u8] {
        self.bytes.get(size_of::<Header>()..).unwrap_or_default()
    }

    /// Returns the exact sum of each pixel, for the formats `Chunk`, `Mean` and `Double`; empty for
    /// others.
    pub(super) fn means(&self) -> Vec<MeanSum> {
        fn read<T: Pod>(bytes: &[u8], mean: impl Fn(&T) -> MeanSum + Sync) -> Vec<MeanSum> {
            let records = bytes.par_chunks_exact(size_of::<T>()).with_min_len(4096);
            records.map(|record| mean(&bytemuck::pod_read_unaligned(record))).collect()
        }
        match self.wire_format {
            WireFormat::Mean => read(self.pixels(), |mean: &MeanSum| *mean),
            WireFormat::Double => read(self.pixels(), DoubleSum::mean),
            WireFormat::Chunk => read(self.pixels(), MeanSum::of_chunk),
            _ => Vec::new(),
        }
    }

    /// Adds the part's sums to `sums`, which has the same pixels in the same order; formats other
    /// than `Chunk`, `Mean` and `Double` add nothing.
    pub(super) fn add_to(&self, sums: &mut [MeanSum]) {
        fn add<T: Pod>(bytes: &[u8], sums: &mut [MeanSum], mean: impl Fn(&T) -> MeanSum + Sync) {
            let records = bytes.par_chunks_exact(size_of::<T>());
            let pairs = sums.par_iter_mut().zip(records).with_min_len(8192);
            pairs.for_each(|(sum, record)| sum.add(&mean(&bytemuck::pod_read_unaligned(record))));
        }
        match self.wire_format {
            WireFormat::Mean => add(self.pixels(), sums, |mean: &MeanSum| *mean),
            WireFormat::Double => add(self.pixels(), sums, DoubleSum::mean),
            WireFormat::Chunk => add(self.pixels(), sums, MeanSum::of_chunk),
            _ => {}
        }
    }

    /// Returns the kernel sums and AOV sums of a chunk, for the formats `Sums` and `SumsAndAovs`;
    /// empty for others.
    pub(super) fn sums(&self) -> (Vec<PixelSums>, Vec<AovSums>) {
        let pixels = self.rows.len() as usize * self.width as usize;
        let (sums, guides) = match self.wire_format {
            WireFormat::Sums | WireFormat::SumsAndAovs => {
                self.pixels().split_at(pixels * size_of::<PixelSums>())
            }
            _ => return (Vec::new(), Vec::new()),
        };
        (pod_collect_to_vec(sums), pod_collect_to_vec(guides))
    }
}
/// Writes sums to `body` as they travel. A pixel has `expected` samples.
fn encode(body: &mut [u8], travels: WireFormat, rendered: &Rendered, expected: u32) {
    let at = |pixel: usize| rendered.mean(pixel, expected);
    let mut each = |write: &(dyn Fn(usize, &mut [u8]) + Sync)| {
        let places = body.par_chunks_exact_mut(travels.bytes()).enumerate().with_min_len(4096);
        places.for_each(|(pixel, place)| write(pixel, place));
    };
    match (travels, rendered) {
        (WireFormat::Bytes, _) => each(&|pixel, place| {
            place.copy_from_slice(&at(pixel).mean().map(srgb::encode_u8));
        }),
        (WireFormat::Color, _) => each(&|pixel, place| {
            place.copy_from_slice(bytes_of(&at(pixel).mean()));
        }),
        (WireFormat::Double, _) => {
            each(&|pixel, place| {
                place.copy_from_slice(bytes_of(&DoubleSum::of(&at(pixel))));
            });
        }
        (WireFormat::Mean, _) => {
            each(&|pixel, place| place.copy_from_slice(bytes_of(&at(pixel))));
        }
        (WireFormat::Chunk, Rendered::Chunk(..)) => each(&|pixel, place| {
            let mean = at(pixel);
            let radiance = mean.radiance.map(|sum| sum[0] as f32); // exact: one f32 each
            place.copy_from_slice(bytes_of(&ChunkSum { radiance, samples: mean.samples as u32 }));
        }),
        (WireFormat::Sums | WireFormat::SumsAndAovs, Rendered::Chunk(sums, guides)) => {
            let (of_sums, of_guides) = body.split_at_mut(size_of_val(*sums));
            of_sums.copy_from_slice(cast_slice(sums));
            if travels == WireFormat::SumsAndAovs {
                of_guides.copy_from_slice(cast_slice(guides));
            }
        }
        // Kernel sums are sent chunk by chunk, never as means.
        (WireFormat::Chunk | WireFormat::Sums | WireFormat::SumsAndAovs, Rendered::Means(..)) => {}
    }
}
