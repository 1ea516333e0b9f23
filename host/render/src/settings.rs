//! Settings of a render, and their errors.

mod crop;
mod error;
mod kernel_features;

pub use crop::Crop;
pub use error::SettingsError;
pub use kernel_features::KernelFeatures;

use crate::denoise::Denoiser;
use crate::film::{Film, RowSet, SampleBlock, Summation};
use serde::Serialize;
use std::ops::{Range, RangeInclusive};
use trisect_device::{MathMode, Schedule, Traversal};
use trisect_scene::{Fresnel, ImageSettings, Scene};
use trisect_shared::features::{AOVS, Features, ROULETTE, SCHLICK, SOBOL};
use trisect_shared::film::CHUNK_SAMPLES;
use trisect_system::memory;

/// Maximum number of segments of a path.
pub const MAX_DEPTH: u32 = 65_535;

/// Edges of tiles, in pixels; smaller tiles would cost more in memory than they save in time.
const TILES: RangeInclusive<u32> = 4..=1024;

/// Settings of a render.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Settings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Place of the image in a larger one, if it is a part; see [`Settings::cropped`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
    /// Samples per pixel.
    pub samples: u32,
    /// Maximum number of segments of a path; the camera ray is the first.
    pub depth: u32,
    /// Random seed.
    pub seed: u32,
    /// Russian roulette: paths end at random, by their throughput. The mean is the same, with fewer
    /// segments and more variance.
    pub roulette: bool,
    /// Segment from which on roulette may end a path; 1 is the first.
    pub roulette_depth: u32,
    /// Reflectance of dielectrics.
    pub fresnel: Fresnel,
    /// Math build of the kernels.
    pub math: MathMode,
    /// Source of random numbers.
    pub sampler: Sampler,
    /// Next-event estimation: each path vertex is connected to a light, with multiple importance
    /// sampling. Without it, paths find lights by chance: the mean is the same, except for point,
    /// spot and directional lights, which they never find.
    pub light_sampling: bool,
    /// Maximum radiance of a sample per channel: less noise, and a darker mean. `None` for no
    /// maximum.
    pub clamp: Option<f32>,
    /// Traversal; `None` for the fastest on the backend.
    pub traversal: Option<Traversal>,
    /// Schedule; `None` for the fastest on the backend.
    pub schedule: Option<Schedule>,
    /// Edge in pixels of the tiles for whose camera rays the binary BVH is pruned: a power of two
    /// from 4 to 1024, or 0 for none. `None` chooses by the number of samples, and no tiles for a
    /// kernel with quads, discs, triangles, lights, an environment map or textures.
    pub tile: Option<u32>,
    /// Place where chunks add up to the film; does not affect the image.
    pub sums: Summation,
    /// True if the film gets AOV totals: normal, albedo, position, emission and diffuseness of the
    /// first hits.
    pub guides: bool,
    /// True if camera rays that reach the sky add nothing, while all other rays see it. With
    /// [AOV totals](Self::guides), [`Film::alpha`] is the share of the others.
    pub hidden_sky: bool,
    /// Features of the kernel, to measure what they cost.
    pub features: KernelFeatures,
    /// Denoiser that [`Renderer::render`](crate::render::Renderer::render) runs over the film. The
    /// film stays as it is, and has AOVs then. Other functions have the denoiser as an argument.
    #[serde(skip)]
    pub denoise: Option<Denoiser>,
}

/// Source of random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Sampler {
    /// Hash: all numbers are independent of each other.
    Independent,
    /// The Owen-scrambled Sobol sequence, with the error of blue noise over the screen: less noise
    /// for the same number of samples. The variance within a pixel overestimates the noise.
    Sobol,
}

impl From<ImageSettings> for Settings {
    /// Returns settings with the program's defaults for everything that a scene cannot state.
    fn from(image: ImageSettings) -> Self {
        Self {
            width: image.width,
            height: image.height,
            crop: None,
            samples: image.samples,
            depth: image.depth,
            seed: 0,
            roulette: false,
            roulette_depth: 1,
            fresnel: image.fresnel,
            math: MathMode::Precise,
            sampler: Sampler::Sobol,
            light_sampling: true,
            traversal: None,
            schedule: None,
            tile: None,
            sums: Summation::Auto,
            clamp: None,
            guides: false,
            hidden_sky: false,
            features: KernelFeatures::Needed,
            denoise: None,
        }
    }
}

impl Settings {
    /// Returns settings for an image of `width` by `height` pixels: 64 samples per pixel, and the
    /// program's defaults for all others.
    pub fn new(width: u32, height: u32) -> Self {
        ImageSettings { width, height, samples: 64, depth: 50, fresnel: Fresnel::Exact }.into()
    }

    /// Returns the settings that a scene states, with the program's defaults for all others.
    pub fn of(scene: &Scene) -> Self {
        scene.image.into()
    }

    /// Returns these settings for an image of `width` by `height` pixels.
    #[must_use]
    pub fn size(self, width: u32, height: u32) -> Self {
        Self { width, height, ..self }
    }

    /// Returns these settings with `samples` samples per pixel.
    #[must_use]
    pub fn spp(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// Returns these settings with another random seed.
    #[must_use]
    pub fn seed(self, seed: u32) -> Self {
        Self { seed, ..self }
    }

    /// Returns these settings with a denoiser, and with the AOVs that it needs.
    #[must_use]
    pub fn denoise(self, denoiser: impl Into<Denoiser>) -> Self {
        Self { denoise: Some(denoiser.into()), guides: true, ..self }
    }

    /// Returns the part of the settings that a scene can state.
    pub fn image(&self) -> ImageSettings {
        let Self { width, height, samples, depth, fresnel, .. } = *self;
        ImageSettings { width, height, samples, depth, fresnel }
    }

    /// Returns `width * height`.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Returns the number of samples of all pixels.
    pub fn total_samples(&self) -> u64 {
        self.pixels() * u64::from(self.samples)
    }

    /// Returns the block of all rows and samples of the frame.
    pub fn whole(&self) -> SampleBlock {
        SampleBlock { rows: 0..self.height, samples: 0..self.samples }
    }

    /// Checks that a part is one of this frame, and splits no chunk.
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

    /// Checks that samples are of this frame.
    pub fn check_samples(&self, samples: &Range<u32>) -> Result<(), SettingsError> {
        if samples.is_empty() || samples.end > self.samples {
            let (rows, samples) = (0..self.height, samples.clone());
            return Err(SettingsError::NoSuchPart { rows, samples, height: self.height, of: self.samples });
        }
        Ok(())
    }

    /// Checks that rows and samples are of this frame, and that the samples are at most a chunk.
    pub fn check_rows(&self, rows: &RowSet, samples: &Range<u32>) -> Result<(), SettingsError> {
        let fits = samples.end <= self.samples && samples.len() <= CHUNK_SAMPLES as usize;
        if rows.is_empty() || rows.end() > self.height || samples.is_empty() || !fits {
            let (rows, samples) = (0..rows.end(), samples.clone());
            return Err(SettingsError::NoSuchPart { rows, samples, height: self.height, of: self.samples });
        }
        Ok(())
    }

    /// Checks that a frame can be live: its samples are at most a chunk.
    pub fn check_live(&self) -> Result<(), SettingsError> {
        match self.samples <= CHUNK_SAMPLES {
            true => Ok(()),
            false => Err(SettingsError::TooManyLive { samples: self.samples }),
        }
    }

    /// Returns the features that a kernel needs besides those of the scene and its lights.
    pub fn needed_features(&self) -> Features {
        let roulette = if self.roulette { ROULETTE } else { 0 };
        let schlick = if self.fresnel == Fresnel::Schlick { SCHLICK } else { 0 };
        let sobol = if self.sampler == Sampler::Sobol { SOBOL } else { 0 };
        let guides = if self.guides { AOVS } else { 0 };
        roulette | schlick | sobol | guides
    }

    /// Checks the settings, and the memory that they need, before anything is allocated.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.check_with(0)
    }

    /// Checks the settings of a render that already holds `held` bytes of its memory.
    pub(crate) fn check_holding(&self, held: u64) -> Result<(), SettingsError> {
        let lacking = |needed: u64| memory::lacking(needed.saturating_sub(held));
        self.check_within(|needed| lacking(needed).map(|free| free.saturating_add(held)), 0)
    }

    /// Checks the settings of a render that holds `more` additional bytes per pixel.
    ///
    /// # Errors
    ///
    /// The errors of [`check`](Self::check).
    pub fn check_with(&self, more: u64) -> Result<(), SettingsError> {
        self.check_within(memory::lacking, more)
    }

    fn check_within(&self, lacking: impl Fn(u64) -> Option<u64>, more: u64) -> Result<(), SettingsError> {
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
        match lacking(needed) {
            Some(available) => Err(SettingsError::TooLarge { width, height, needed, available }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(width: u32, height: u32) -> Settings {
        Settings {
            width,
            height,
            crop: None,
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
            sums: Summation::Auto,
            guides: false,
            hidden_sky: false,
            features: KernelFeatures::Needed,
            denoise: None,
        }
    }

    #[test]
    fn sizes_are_checked_before_allocation() {
        assert_eq!(settings(1, 1).check(), Ok(()));
        assert_eq!(settings(0, 1).check(), Err(SettingsError::Zero { name: "width" }));
        assert_eq!(settings(1, 0).check(), Err(SettingsError::Zero { name: "height" }));
        assert!(matches!(settings(u32::MAX, 2).check(), Err(SettingsError::TooManyPixels { .. })));
        assert!(matches!(
            settings(10_000, 10_000).check_within(|needed| (needed > 1 << 30).then_some(1 << 30), 0),
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
