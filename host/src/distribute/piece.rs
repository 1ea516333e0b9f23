//! What travels: a piece of the image, in the smallest type that the output needs.

use super::DistributeError;
use crate::film::{ExactSum, FilmCounts, PixelTotals, Rows};
use crate::metrics::srgb;
use bytemuck::{Pod, Zeroable, bytes_of, cast_slice, pod_collect_to_vec};
use rayon::prelude::*;
use std::ops::Range;
use trisect_shared::film::PixelSums;
use trisect_shared::guides::Guides;

/// What travels of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Travels {
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
    Guided = 6,
}

impl Travels {
    const ALL: [Self; 7] =
        [Self::Bytes, Self::Color, Self::Chunk, Self::Mean, Self::Sums, Self::Guided, Self::Double];

    /// Bytes of a pixel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Bytes => 3,
            Self::Color => 12,
            Self::Chunk => size_of::<ChunkSum>(),
            Self::Mean => size_of::<MeanSum>(),
            Self::Double => size_of::<DoubleSum>(),
            Self::Sums => size_of::<PixelSums>(),
            Self::Guided => size_of::<PixelSums>() + size_of::<Guides>(),
        }
    }
}

/// The radiance of a chunk's samples.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct ChunkSum {
    radiance: [f32; 3],
    samples: u32,
}

/// The radiance of some samples that f64 holds: words, since its 28 bytes are no multiple of 8.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct DoubleSum {
    radiance: [[u32; 2]; 3],
    samples: u32,
}

impl DoubleSum {
    fn of(sum: &MeanSum) -> Self {
        let radiance = sum.radiance.map(|pair| bytemuck::cast(pair[0].to_bits()));
        Self { radiance, samples: sum.samples as u32 }
    }

    fn mean(&self) -> MeanSum {
        let radiance = self.radiance.map(|words| [f64::from_bits(bytemuck::cast(words)), 0.0]);
        MeanSum { radiance, samples: u64::from(self.samples) }
    }
}

/// The radiance of any number of samples, as an exact sum.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MeanSum {
    radiance: [[f64; 2]; 3],
    samples: u64,
}

impl MeanSum {
    /// Nothing.
    pub const ZERO: Self = Self { radiance: [[0.0; 2]; 3], samples: 0 };

    fn of(totals: &PixelTotals) -> Self {
        let parts = |sum: ExactSum| <[f64; 2]>::from(sum.parts());
        Self { radiance: totals.radiance.map(parts), samples: totals.samples }
    }

    /// Whether [`DoubleSum`] holds it.
    fn is_double(&self) -> bool {
        self.radiance.iter().all(|pair| pair[1] == 0.0) && self.samples <= u64::from(u32::MAX)
    }

    fn of_chunk(chunk: &ChunkSum) -> Self {
        Self { radiance: chunk.radiance.map(|sum| [f64::from(sum), 0.0]), samples: u64::from(chunk.samples) }
    }

    /// Adds what another rank has of the same pixel: exact, so that the order does not matter.
    pub fn add(&mut self, other: &Self) {
        for (sum, other) in self.radiance.iter_mut().zip(&other.radiance) {
            let mut exact = ExactSum::of_parts(sum[0], sum[1]);
            exact.merge(ExactSum::of_parts(other[0], other[1]));
            *sum = exact.parts().into();
        }
        self.samples += other.samples;
    }

    /// Mean radiance; NaN without samples.
    pub fn mean(&self) -> [f32; 3] {
        self.radiance.map(|sum| (ExactSum::of_parts(sum[0], sum[1]).value() / self.samples as f64) as f32)
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
    travels: u32,
    width: u32,
    submissions: u32,
    samples: u64,
    rejected: u64,
    segments: u64,
    unwritten: u64,
    device_nanoseconds: u64,
    render_nanoseconds: u64,
    pad: u64,
}

const _: () = assert!(size_of::<Header>() == 96);

/// A piece of the image: some samples of some rows, as bytes for the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Which rows.
    pub rows: Rows,
    /// Which samples.
    pub samples: Range<u32>,
    /// As what.
    pub travels: Travels,
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
    Chunk(&'a [PixelSums], &'a [Guides]),
    /// Several, merged.
    Totals(&'a [PixelTotals]),
}

impl Rendered<'_> {
    fn totals(&self, pixel: usize, samples: u32) -> PixelTotals {
        match self {
            Self::Chunk(sums, _) => PixelTotals::of(&sums[pixel], samples),
            Self::Totals(totals) => totals[pixel],
        }
    }
}

/// Times of a piece: device, host, launches.
pub(super) type Cost = (f64, f64, u32);

impl Piece {
    /// Encodes what was rendered of rows of an image so wide.
    pub(super) fn new(
        rows: &Rows,
        samples: Range<u32>,
        width: u32,
        travels: Travels,
        rendered: &Rendered,
        cost: Cost,
    ) -> Self {
        let travels = match (travels, rendered) {
            (Travels::Chunk | Travels::Mean, Rendered::Totals(totals)) => {
                let double =
                    totals.par_iter().with_min_len(4096).all(|totals| MeanSum::of(totals).is_double());
                if double { Travels::Double } else { Travels::Mean }
            }
            _ => travels,
        };
        let pixels = rows.len() as usize * width as usize;
        let expected = samples.len() as u32;
        let at = |pixel: usize| rendered.totals(pixel, expected);
        let counts = (0..pixels)
            .into_par_iter()
            .with_min_len(4096)
            .map(|pixel| at(pixel).counts())
            .reduce(FilmCounts::default, |a, b| a + b);
        let ((first, shift, gap), own) = (rows.share(), rows.own());
        let header = Header {
            first,
            shift,
            gap,
            start: own.start,
            end: own.end,
            first_sample: samples.start,
            end_sample: samples.end,
            travels: travels as u32,
            width,
            submissions: cost.2,
            samples: counts.samples,
            rejected: counts.rejected,
            segments: counts.segments,
            unwritten: counts.unwritten,
            device_nanoseconds: (cost.0 * 1e9) as u64,
            render_nanoseconds: (cost.1 * 1e9) as u64,
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
            (Travels::Bytes, _) => each(&|pixel, place| {
                place.copy_from_slice(&at(pixel).mean().map(|value| srgb::encode_u8(value as f32)));
            }),
            (Travels::Color, _) => each(&|pixel, place| {
                place.copy_from_slice(bytes_of(&at(pixel).mean().map(|value| value as f32)));
            }),
            (Travels::Double, _) => {
                each(&|pixel, place| {
                    place.copy_from_slice(bytes_of(&DoubleSum::of(&MeanSum::of(&at(pixel)))));
                });
            }
            (Travels::Mean, _) => {
                each(&|pixel, place| place.copy_from_slice(bytes_of(&MeanSum::of(&at(pixel)))));
            }
            (Travels::Chunk, Rendered::Chunk(..)) => each(&|pixel, place| {
                let totals = at(pixel);
                let radiance = totals.radiance.map(|sum| sum.value() as f32); // one f32 each: exact
                place.copy_from_slice(bytes_of(&ChunkSum { radiance, samples: totals.samples as u32 }));
            }),
            (Travels::Sums | Travels::Guided, Rendered::Chunk(sums, guides)) => {
                let (of_sums, of_guides) = body.split_at_mut(size_of_val(*sums));
                of_sums.copy_from_slice(cast_slice(sums));
                if travels == Travels::Guided {
                    of_guides.copy_from_slice(cast_slice(guides));
                }
            }
            // Sums travel chunk by chunk.
            (Travels::Chunk | Travels::Sums | Travels::Guided, Rendered::Totals(_)) => {}
        }
        let (rows, (device_seconds, render_seconds, submissions)) = (rows.clone(), cost);
        Self { rows, samples, travels, width, counts, device_seconds, render_seconds, submissions, bytes }
    }

    /// Of sums that several ranks added up.
    pub(super) fn of_means(
        rows: &Rows,
        samples: Range<u32>,
        width: u32,
        means: &[MeanSum],
        counts: FilmCounts,
        submissions: u32,
    ) -> Self {
        let double = means.par_iter().with_min_len(4096).all(MeanSum::is_double);
        let travels = if double { Travels::Double } else { Travels::Mean };
        let (first, shift, gap) = rows.share();
        let header = Header {
            first,
            shift,
            gap,
            start: rows.own().start,
            end: rows.own().end,
            first_sample: samples.start,
            end_sample: samples.end,
            travels: travels as u32,
            width,
            submissions,
            samples: counts.samples,
            rejected: counts.rejected,
            segments: counts.segments,
            unwritten: counts.unwritten,
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
            travels,
            width,
            counts,
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
    /// [`DistributeError::Protocol`] for what is no piece of it.
    pub fn read(rank: u32, bytes: Vec<u8>, width: u32, height: u32) -> Result<Self, DistributeError> {
        let wrong = |message: &str| DistributeError::Protocol { rank, message: message.to_owned() };
        let head = bytes.get(..size_of::<Header>()).ok_or_else(|| wrong("a piece that is cut off"))?;
        let header: Header = bytemuck::pod_read_unaligned(head);
        let travels = Travels::ALL.into_iter().find(|kind| *kind as u32 == header.travels);
        let travels = travels.ok_or_else(|| wrong("pixels of an unknown kind"))?;
        let rows = Rows::of_share((header.first, header.shift, header.gap), header.start..header.end);
        let rows = rows.filter(|rows| rows.end() <= height && header.width == width);
        let rows = rows.ok_or_else(|| wrong("rows that the image does not have"))?;
        let pixels = rows.len() as usize * width as usize;
        if bytes.len() != size_of::<Header>() + pixels * travels.bytes() {
            return Err(wrong("a piece of another length than it says"));
        }
        Ok(Self {
            rows,
            samples: header.first_sample..header.end_sample,
            travels,
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
        match self.travels {
            Travels::Mean => read(self.pixels(), |mean: &MeanSum| *mean),
            Travels::Double => read(self.pixels(), DoubleSum::mean),
            Travels::Chunk => read(self.pixels(), MeanSum::of_chunk),
            _ => Vec::new(),
        }
    }

    /// A chunk's sums and guides, of what travels so; else none.
    pub(super) fn sums(&self) -> (Vec<PixelSums>, Vec<Guides>) {
        let pixels = self.rows.len() as usize * self.width as usize;
        let (sums, guides) = match self.travels {
            Travels::Sums | Travels::Guided => self.pixels().split_at(pixels * size_of::<PixelSums>()),
            _ => return (Vec::new(), Vec::new()),
        };
        (pod_collect_to_vec(sums), pod_collect_to_vec(guides))
    }
}
