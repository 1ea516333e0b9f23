//! What travels: a piece of the image, in the smallest type that the output needs.

use super::ClusterError;
use super::means::{ChunkSum, DoubleSum, MeanSum, counts_of};
use super::reduce::Strip;
use crate::film::{FilmCounts, PixelTotals, RowSet};
use crate::metrics::srgb;
use bytemuck::{Pod, Zeroable, bytes_of, cast_slice, pod_collect_to_vec};
use rayon::prelude::*;
use std::ops::Range;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// What travels of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum WireFormat {
    /// 8 bits a channel, sRGB: for a .png. 3 bytes.
    Bytes = 1,
    /// Mean radiance, f32: for other images. 12 bytes.
    Color = 2,
    /// The sum of a chunk, and its samples: of a share of samples that is no more than that. 16 bytes.
    Chunk = 3,
    /// An exact sum, and its samples. 56 bytes, or, where f64 holds all sums of the piece, 28.
    Mean = 4,
    /// That. 28 bytes.
    Double = 7,
    /// All that kernels sum of a chunk: for variances. 32 bytes.
    Sums = 5,
    /// The same and what tells edges: for denoising and layers. 96 bytes.
    SumsAndAovs = 6,
}

impl WireFormat {
    const ALL: [Self; 7] =
        [Self::Bytes, Self::Color, Self::Chunk, Self::Mean, Self::Sums, Self::SumsAndAovs, Self::Double];

    /// Bytes of a pixel.
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

/// What a piece is of. 96 bytes, before the pixels.
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
    /// Of an average.
    phase: u32,
    pad: u32,
}

const _: () = assert!(size_of::<Header>() == 96);

/// A piece of the image: some samples of some rows, as bytes for the way.
#[derive(Clone, Debug, PartialEq)]
pub struct ImagePart {
    /// Which rows.
    pub rows: RowSet,
    /// Which samples.
    pub samples: Range<u32>,
    /// Of an average: whether this is what was summed first or what came last.
    pub phase: u32,
    /// As what.
    pub wire_format: WireFormat,
    /// Pixels across.
    pub width: u32,
    /// In it.
    pub counts: FilmCounts,
    /// By the device's timer, in seconds.
    pub device_seconds: f64,
    /// As the host saw it.
    pub render_seconds: f64,
    /// Launches.
    pub submissions: u32,
    /// Header and pixels.
    bytes: Vec<u8>,
}

/// What was rendered, before it travels.
pub(super) enum Rendered<'a> {
    /// One chunk.
    Chunk(&'a [PixelSums], &'a [AovSums]),
    /// Several, added up, and what is in them.
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

/// Times of a piece: device, host, launches.
pub(super) type Cost = (f64, f64, u32);

impl ImagePart {
    /// Encodes what was rendered of rows of an image so wide: samples, and the phase of an average.
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
        let at = |pixel: usize| rendered.mean(pixel, expected);
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
                let radiance = mean.radiance.map(|sum| sum[0] as f32); // one f32 each: exact
                place.copy_from_slice(bytes_of(&ChunkSum { radiance, samples: mean.samples as u32 }));
            }),
            (WireFormat::Sums | WireFormat::SumsAndAovs, Rendered::Chunk(sums, guides)) => {
                let (of_sums, of_guides) = body.split_at_mut(size_of_val(*sums));
                of_sums.copy_from_slice(cast_slice(sums));
                if travels == WireFormat::SumsAndAovs {
                    of_guides.copy_from_slice(cast_slice(guides));
                }
            }
            // Sums travel chunk by chunk.
            (WireFormat::Chunk | WireFormat::Sums | WireFormat::SumsAndAovs, Rendered::Means(..)) => {}
        }
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

    /// Of sums that several ranks added up.
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

    /// For the way.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// What came from `rank`, of an image of this size.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Protocol`] for what is no piece of it.
    pub fn read(rank: u32, bytes: Vec<u8>, width: u32, height: u32) -> Result<Self, ClusterError> {
        let wrong = |message: &str| ClusterError::Protocol { rank, message: message.to_owned() };
        let head = bytes.get(..size_of::<Header>()).ok_or_else(|| wrong("a piece that is cut off"))?;
        let header: Header = bytemuck::pod_read_unaligned(head);
        let travels = WireFormat::ALL.into_iter().find(|kind| *kind as u32 == header.wire_format);
        let travels = travels.ok_or_else(|| wrong("pixels of an unknown kind"))?;
        let rows = RowSet::of_share((header.first, header.shift, header.gap), header.start..header.end);
        let rows = rows.filter(|rows| rows.end() <= height && header.width == width);
        let rows = rows.ok_or_else(|| wrong("rows that the image does not have"))?;
        let pixels = rows.len() as usize * width as usize;
        if bytes.len() != size_of::<Header>() + pixels * travels.bytes() {
            return Err(wrong("a piece of another length than it says"));
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

    /// Of all its rows, one below the other.
    pub fn pixels(&self) -> &[u8] {
        self.bytes.get(size_of::<Header>()..).unwrap_or_default()
    }

    /// The exact sums of what is a mean or a chunk's sum; else none.
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

    /// Adds them to sums of as many pixels, each row's in one piece.
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

    /// A chunk's sums and guides, of what travels so; else none.
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
