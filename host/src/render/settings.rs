//! What to render.

use super::kernel_selection::{Schedule, Traversal};
use crate::film::{Film, RowSet, SampleBlock};
use crate::memory;
use serde::{Deserialize, Serialize};
use std::ops::{Range, RangeInclusive};
use thiserror::Error;
use trisect_shared::features::{AOVS, Features, ROULETTE, SCHLICK, SOBOL};
use trisect_shared::film::CHUNK_SAMPLES;

/// The greatest depth of a path.
pub const MAX_DEPTH: u32 = 65_535;

/// Edges of tiles, in pixels: smaller ones would need more memory than they save time.
const TILES: RangeInclusive<u32> = 4..=1024;

/// How dielectrics reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fresnel {
    /// Fresnel's equations.
    Exact,
    /// Schlick's approximation, as in "Ray Tracing in One Weekend".
    Schlick,
}

/// Which build of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MathMode {
    /// No contraction, and on CUDA correctly rounded operations: there the CPU's bits, and on Vulkan wherever the driver's division
    /// and square root are correctly rounded, too.
    Precise,
    /// Fused multiply-add, and on CUDA approximate division and square root; not on the CPU.
    Fast,
}

/// One render.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// Segments a path, at most.
    pub depth: u32,
    /// Of the random numbers.
    pub seed: u32,
    /// End paths at random, by their throughput: the same mean, fewer segments, more variance.
    pub roulette: bool,
    /// From which segment on; 1 is the first.
    pub roulette_depth: u32,
    /// How dielectrics reflect.
    pub fresnel: Fresnel,
    /// Which build of the kernels.
    pub math: MathMode,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// Connect each vertex to a light, and weigh by multiple importance sampling. Off, paths find lights by chance: the same mean,
    /// but for lights without extent, which they never find.
    pub light_sampling: bool,
    /// The most that a channel of a sample's radiance is, for less noise and a darker mean. `None`: any.
    pub clamp: Option<f32>,
    /// How the closest hit is found; `None`: by what is fastest on the backend.
    pub traversal: Option<Traversal>,
    /// What a lane works on; `None`: what is fastest on the backend.
    pub schedule: Option<Schedule>,
    /// Edge in pixels of the tiles for whose camera rays the binary tree is pruned: a power of two from 4 to 1024, or 0 for none;
    /// `None`: by the number of samples, and none where there are lights.
    pub tile: Option<u32>,
    /// Whether the film gets normals, albedos and positions of what its pixels see.
    pub guides: bool,
    /// The kernel, by name; `None`: the cheapest that the scene can do with.
    pub variant: Option<&'static str>,
}

/// Where random numbers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampler {
    /// A hash: each number independent of each other.
    Independent,
    /// The Owen-scrambled Sobol sequence.
    Sobol,
}

/// Settings that cannot be rendered.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SettingsError {
    /// A number that must be at least 1 is 0.
    #[error("{name} is 0; it must be 1 or more")]
    Zero {
        /// Of the setting.
        name: &'static str,
    },
    /// Longer paths than a film counts: 256 samples of the greatest depth fit 32 bits.
    #[error("depth is {depth}; it must be at most {MAX_DEPTH}")]
    TooDeep {
        /// What was asked for.
        depth: u32,
    },
    /// A tile's edge that is none.
    #[error("a tile has an edge of {edge} pixels; choose 0, or a power of two from 4 to 1024")]
    NoSuchTile {
        /// What was asked for.
        edge: u32,
    },
    /// A clamp that leaves nothing, or is none.
    #[error("--clamp is {clamp}; it must be a number above 0")]
    NoClamp {
        /// What was asked for.
        clamp: String,
    },
    /// More pixels than indices.
    #[error("an image of {width}x{height} has more than 2^32 - 1 pixels; choose a smaller --resolution")]
    TooManyPixels {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// More than this machine can hold.
    #[error(
        "an image of {width}x{height} needs {} of memory, {} are free; choose a smaller --resolution",
        memory::display(*needed), memory::display(*available)
    )]
    TooLarge {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Bytes.
        needed: u64,
        /// Bytes.
        available: u64,
    },
    /// Rows or samples that the frame does not have, or none at all.
    #[error(
        "rows {} to {} and samples {} to {} are no part of an image of {height} rows and {of} samples; name some, all within it",
        rows.start, rows.end, samples.start, samples.end
    )]
    NoSuchPart {
        /// From the first to one past the last.
        rows: Range<u32>,
        /// The same.
        samples: Range<u32>,
        /// Rows of the image.
        height: u32,
        /// Samples a pixel of the image.
        of: u32,
    },
    /// A part that splits a chunk: its f32 sum would be rounded otherwise than in one piece.
    #[error(
        "samples {} to {} of {of} split a chunk; a part begins at a multiple of {CHUNK_SAMPLES} and ends at one or at the last sample",
        samples.start, samples.end
    )]
    SplitsChunk {
        /// From the first to one past the last.
        samples: Range<u32>,
        /// Samples a pixel of the image.
        of: u32,
    },
    /// More samples than stay on the device.
    #[error(
        "a frame that is denoised on the device has at most {CHUNK_SAMPLES} samples a pixel, not {samples}; lower --spp, or render it to a file"
    )]
    TooManyLive {
        /// What was asked for.
        samples: u32,
    },
    /// `--variant` names none.
    #[error("--variant {name}: there is none of this name; there are {known}")]
    NoSuchVariant {
        /// What was asked for.
        name: String,
        /// All.
        known: String,
    },
    /// `--variant` names one that would not render the scene right.
    #[error("--variant {name} lacks {missing}; {able} have what this render needs")]
    VariantLacks {
        /// The kernel.
        name: String,
        /// What it cannot do.
        missing: String,
        /// Those that can.
        able: String,
    },
    /// A combination that no kernel was built for.
    #[error(
        "no kernel was built for {needed} together; leave --traversal and --schedule out, or choose what one of these does: {able}"
    )]
    NoVariant {
        /// What it would have to do.
        needed: String,
        /// Those that cover the scene, by other methods.
        able: String,
    },
    /// A schedule that the route to the driver does not have.
    #[error(
        "--schedule persistent needs kernels that reach the driver as they are, which {backend} does on Vulkan only; leave --schedule out"
    )]
    NoQueue {
        /// The backend.
        backend: &'static str,
    },
    /// `--device` without a backend.
    #[error("--device needs --backend: its index is one of that backend's, as `trisect info` lists them")]
    DeviceWithoutBackend,
    /// A build of the kernels that the backend does not have.
    #[error("--math fast exists for cuda and wgpu; {backend} has one build: leave --math out")]
    NoFastMath {
        /// The backend.
        backend: &'static str,
    },
}

impl Settings {
    /// `width * height`.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Samples of all pixels.
    pub fn total_samples(&self) -> u64 {
        self.pixels() * u64::from(self.samples)
    }

    /// All of the frame.
    pub fn whole(&self) -> SampleBlock {
        SampleBlock { rows: 0..self.height, samples: 0..self.samples }
    }

    /// Refuses a part of something else, and one that splits a chunk.
    pub fn check_part(&self, part: &SampleBlock) -> Result<(), SettingsError> {
        let SampleBlock { rows, samples } = part.clone();
        if rows.is_empty() || rows.end > self.height || samples.is_empty() || samples.end > self.samples {
            return Err(SettingsError::NoSuchPart { rows, samples, height: self.height, of: self.samples });
        }
        let ends_whole = samples.end % CHUNK_SAMPLES == 0 || samples.end == self.samples;
        if samples.start % CHUNK_SAMPLES != 0 || !ends_whole {
            return Err(SettingsError::SplitsChunk { samples, of: self.samples });
        }
        Ok(())
    }

    /// Refuses rows of something else, and more samples than a chunk has.
    pub fn check_rows(&self, rows: &RowSet, samples: &Range<u32>) -> Result<(), SettingsError> {
        let fits = samples.end <= self.samples && samples.len() <= CHUNK_SAMPLES as usize;
        if rows.is_empty() || rows.end() > self.height || samples.is_empty() || !fits {
            let (rows, samples) = (0..rows.end(), samples.clone());
            return Err(SettingsError::NoSuchPart { rows, samples, height: self.height, of: self.samples });
        }
        Ok(())
    }

    /// Refuses what cannot be a frame that stays on the device.
    pub fn check_live(&self) -> Result<(), SettingsError> {
        match self.samples <= CHUNK_SAMPLES {
            true => Ok(()),
            false => Err(SettingsError::TooManyLive { samples: self.samples }),
        }
    }

    /// What a kernel must be able to do, besides what the scene needs.
    pub fn features(&self) -> Features {
        let roulette = if self.roulette { ROULETTE } else { 0 };
        let schlick = if self.fresnel == Fresnel::Schlick { SCHLICK } else { 0 };
        let sobol = if self.sampler == Sampler::Sobol { SOBOL } else { 0 };
        let guides = if self.guides { AOVS } else { 0 };
        roulette | schlick | sobol | guides
    }

    /// Refuses what cannot be rendered, before anything is allocated.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.check_within(memory::available(), 0)
    }

    /// The same of a render that has so many bytes of its memory already.
    pub(crate) fn check_holding(&self, held: u64) -> Result<(), SettingsError> {
        self.check_within(memory::available().saturating_add(held), 0)
    }

    /// The same of a render that holds so many more bytes a pixel.
    ///
    /// # Errors
    ///
    /// As [`check`](Self::check).
    pub fn check_with(&self, more: u64) -> Result<(), SettingsError> {
        self.check_within(memory::available(), more)
    }

    fn check_within(&self, available: u64, more: u64) -> Result<(), SettingsError> {
        let counts = [
            ("width", self.width),
            ("height", self.height),
            ("samples per pixel (spp)", self.samples),
            ("depth", self.depth),
            ("roulette depth", self.roulette_depth),
        ];
        if let Some(&(name, _)) = counts.iter().find(|(_, count)| *count == 0) {
            return Err(SettingsError::Zero { name });
        }
        if self.depth > MAX_DEPTH {
            return Err(SettingsError::TooDeep { depth: self.depth });
        }
        let is_tile = |edge: u32| edge == 0 || edge.is_power_of_two() && TILES.contains(&edge);
        if let Some(edge) = self.tile.filter(|&edge| !is_tile(edge)) {
            return Err(SettingsError::NoSuchTile { edge });
        }
        if let Some(clamp) = self.clamp.filter(|clamp| !(clamp.is_normal() && *clamp > 0.0)) {
            return Err(SettingsError::NoClamp { clamp: clamp.to_string() });
        }
        let (width, height) = (self.width, self.height);
        if self.pixels() > u64::from(u32::MAX) {
            return Err(SettingsError::TooManyPixels { width, height });
        }
        let guides = if self.guides { Film::BYTES_PER_PIXEL_OF_AOVS } else { 0 };
        let needed = self.pixels() * (Film::BYTES_PER_PIXEL + guides + more);
        if needed > available {
            return Err(SettingsError::TooLarge { width, height, needed, available });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(width: u32, height: u32) -> Settings {
        Settings {
            width,
            height,
            samples: 1,
            depth: 1,
            seed: 0,
            roulette: false,
            roulette_depth: 1,
            fresnel: Fresnel::Exact,
            math: MathMode::Precise,
            sampler: Sampler::Independent,
            light_sampling: true,
            clamp: None,
            traversal: None,
            schedule: None,
            tile: None,
            guides: false,
            variant: None,
        }
    }

    #[test]
    fn sizes_are_checked_before_allocation() {
        assert_eq!(settings(1, 1).check(), Ok(()));
        assert_eq!(settings(0, 1).check(), Err(SettingsError::Zero { name: "width" }));
        assert_eq!(settings(1, 0).check(), Err(SettingsError::Zero { name: "height" }));
        assert!(matches!(settings(u32::MAX, 2).check(), Err(SettingsError::TooManyPixels { .. })));
        assert!(matches!(
            settings(10_000, 10_000).check_within(1 << 30, 0),
            Err(SettingsError::TooLarge { .. })
        ));
        let deep = Settings { depth: MAX_DEPTH + 1, ..settings(1, 1) };
        assert!(matches!(deep.check(), Err(SettingsError::TooDeep { .. })));
        for edge in [2, 12, 2048] {
            let tile = Settings { tile: Some(edge), ..settings(1, 1) };
            assert_eq!(tile.check(), Err(SettingsError::NoSuchTile { edge }));
        }
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE / 2.0] {
            let clamp = Settings { clamp: Some(bad), ..settings(1, 1) };
            assert!(matches!(clamp.check(), Err(SettingsError::NoClamp { .. })));
        }
        let no_samples = Settings { samples: 0, ..settings(1, 1) };
        assert!(matches!(no_samples.check(), Err(SettingsError::Zero { .. })));
    }

    #[test]
    fn parts_are_of_whole_chunks() {
        let frame = Settings { samples: 600, ..settings(4, 4) };
        let check = |rows, samples| frame.check_part(&SampleBlock { rows, samples });
        assert_eq!(frame.check_part(&frame.whole()), Ok(()));
        for samples in [0..256, 256..512, 0..512, 256..600, 512..600] {
            assert_eq!(check(1..3, samples), Ok(()));
        }
        for samples in [0..255, 1..256, 256..511, 500..600] {
            assert!(matches!(check(1..3, samples), Err(SettingsError::SplitsChunk { of: 600, .. })));
        }
        for (rows, samples) in [(0..5, 0..256), (2..2, 0..256), (0..4, 512..601), (0..4, 256..256)] {
            assert!(matches!(check(rows, samples), Err(SettingsError::NoSuchPart { .. })));
        }
    }
}
