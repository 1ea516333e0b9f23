//! Reference images: renders of many samples whose own error is known, rendered once and kept in a
//! folder under a hash of scene, kernels and settings.

use super::TradeoffError;
use crate::Error;
use crate::accuracy::{Truth, mean_of};
use bytemuck::cast_slice;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use trisect::adaptive::{self, Adaptive, DualBuffers, Goal};
use trisect::bvh::BvhQuality;
use trisect::film::PixelTotals;
use trisect::image::Image;
use trisect::metrics::MetricsError;
use trisect::render::{Fingerprint, RenderObserver, Renderer, Sampler, Settings};
use trisect::scene::{ImageSettings, Scene};
use trisect_system::checksummed_file::{self, ChecksummedFileError, Contents};

/// Seed of references. No measurement uses it.
const SEED: u32 = 0x7e57_5eed;

/// First bytes of a reference file.
const MAGIC: &[u8; 8] = b"TRISREF2";

/// Reference of a scene: two images with different random numbers, and the variance of their mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Two images, each of half the samples.
    pub halves: [Image; 2],
    /// Variance of the mean of both images, by pixel and channel.
    pub variance: Vec<[f32; 3]>,
    /// Description of the reference.
    pub facts: ReferenceInfo,
}

/// Description of a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReferenceInfo {
    /// Hash of the scene, the kernels and the settings that decide the image.
    pub hash: String,
    /// Version of the program that rendered it.
    pub version: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Mean number of samples per pixel.
    pub samples: f64,
    /// Root of the relMSE of the reference itself, estimated.
    pub error: f64,
    /// Device that rendered it.
    pub device: String,
    /// Seconds that rendering took.
    pub seconds: f64,
}

/// Returns the settings for a reference: `settings` without anything that may add bias, and with
/// defaults for the options that change only noise or speed, except for independent samples: their
/// variance is that of the image.
pub fn settings_of(settings: &Settings) -> Settings {
    let image = ImageSettings { samples: 1, ..settings.image() };
    Settings { seed: SEED, sampler: Sampler::Independent, ..image.into() }
}

/// Returns a hash of everything that identifies an image with these settings and a BVH of this
/// quality.
pub fn hash(scene: &Scene, settings: &Settings, quality: Option<BvhQuality>) -> String {
    let fingerprint = Fingerprint::new(&scene.digest(), settings, quality);
    fingerprint.sha256().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

impl ReferenceInfo {
    /// Returns a summary of a reference's samples and own error, or "no reference".
    pub(super) fn summary(of: Option<&Self>) -> String {
        match of {
            Some(Self { samples, error, .. }) => {
                format!("reference of {samples:.0} samples a pixel, own error {:.3} %", 100.0 * error)
            }
            None => "no reference".to_owned(),
        }
    }
}

impl Reference {
    /// Renders a reference until the goal is reached. `quality` is that of the renderer's BVH.
    ///
    /// # Errors
    ///
    /// Errors of [`adaptive::render`].
    pub fn render(
        renderer: &mut Renderer,
        scene: &Scene,
        settings: &Settings,
        quality: Option<BvhQuality>,
        goal: Goal,
        observer: &mut dyn RenderObserver,
    ) -> Result<Self, Error> {
        let settings = settings_of(settings);
        let (halves, noise, seconds) =
            adaptive::render_dual_buffers(renderer, &settings, goal, Adaptive::Auto, observer)?;
        let device = renderer.device().info();
        let facts = ReferenceInfo {
            hash: hash(scene, &settings, quality),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            width: settings.width,
            height: settings.height,
            samples: halves.samples() as f64 / settings.pixels() as f64,
            error: noise.error,
            device: format!("{}: {}", device.backend, device.name),
            seconds,
        };
        Ok(Self::of(&halves, facts))
    }

    fn of(halves: &DualBuffers, facts: ReferenceInfo) -> Self {
        let image = |half: usize| {
            let pixels = halves.pixels(half).par_iter().map(|pixel| pixel.mean().map(|v| v as f32)).collect();
            Image { width: halves.width, height: halves.height, pixels }
        };
        let variances = |half: usize| halves.pixels(half).par_iter().map(PixelTotals::variance_of_mean);
        let both = variances(0).zip(variances(1));
        let variance = both.map(|(a, b)| std::array::from_fn(|c| (0.25 * (a[c] + b[c])) as f32)).collect();
        Self { halves: [image(0), image(1)], variance, facts }
    }

    /// Returns the mean of both halves.
    pub fn image(&self) -> Image {
        let [a, b] = &self.halves;
        mean_of(a, b)
    }

    /// Prepares the reference for comparisons; `image` is [its image](Self::image).
    ///
    /// # Errors
    ///
    /// [`MetricsError`] for an image without pixels.
    pub fn truth<'a>(&'a self, image: &'a Image) -> Result<Truth<'a>, MetricsError> {
        let [a, b] = &self.halves;
        Truth::of_halves([a, b], &self.variance, image, &[])
    }

    /// Returns the path of the file for a reference with this hash.
    pub fn path(folder: &Path, hash: &str) -> PathBuf {
        folder.join(format!("{hash}.reference"))
    }

    /// Reads the reference with this hash; `None` if the folder has none.
    ///
    /// # Errors
    ///
    /// [`TradeoffError`] for a file that is not a reference, is cut off or was changed.
    pub fn read(folder: &Path, hash: &str) -> Result<Option<Self>, TradeoffError> {
        let path = Self::path(folder, hash);
        let wrong =
            |message: &str| TradeoffError::Reference { path: path.clone(), message: message.to_owned() };
        let Contents { header, data } = match checksummed_file::read(&path, MAGIC) {
            Ok(contents) => contents,
            Err(ChecksummedFileError::Io(error)) if error.kind() == io::ErrorKind::NotFound => {
                return Ok(None);
            }
            Err(ChecksummedFileError::Io(source)) => return Err(TradeoffError::Cache { path, source }),
            Err(error) => return Err(wrong(&error.to_string())),
        };
        let facts: ReferenceInfo =
            serde_json::from_slice(&header).map_err(|error| wrong(&error.to_string()))?;
        let pixels = u64::from(facts.width) * u64::from(facts.height);
        if facts.hash != hash || data.len() as u64 != pixels.saturating_mul(36) {
            return Err(wrong("it belongs to another scene or size"));
        }
        let values: Vec<f32> =
            data.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let planes: Vec<Vec<[f32; 3]>> = values
            .chunks_exact(3 * pixels.max(1) as usize)
            .map(|plane| plane.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
            .collect();
        let [a, b, variance] =
            <[Vec<[f32; 3]>; 3]>::try_from(planes).map_err(|_| wrong("it has no pixels"))?;
        let image = |pixels| Image { width: facts.width, height: facts.height, pixels };
        Ok(Some(Self { halves: [image(a), image(b)], variance, facts: facts.clone() }))
    }

    /// Checks, before a reference is rendered, that files can be written to the folder. Creates the
    /// folder if necessary.
    ///
    /// # Errors
    ///
    /// [`TradeoffError::Cache`] with the path of the folder.
    pub fn check_folder(folder: &Path) -> Result<(), TradeoffError> {
        let probe = folder.join(format!(".{}.part", std::process::id()));
        fs::create_dir_all(folder)
            .and_then(|()| fs::write(&probe, b""))
            .and_then(|()| fs::remove_file(&probe))
            .map_err(|source| TradeoffError::Cache { path: folder.to_owned(), source })
    }

    /// Writes the reference into the folder and replaces an earlier one, atomically.
    ///
    /// # Errors
    ///
    /// [`TradeoffError`] with the path of the file.
    pub fn write(&self, folder: &Path) -> Result<(), TradeoffError> {
        let path = Self::path(folder, &self.facts.hash);
        let io = |source| TradeoffError::Cache { path: path.clone(), source };
        fs::create_dir_all(folder).map_err(io)?;
        let header = serde_json::to_vec(&self.facts)
            .map_err(|error| TradeoffError::Reference { path: path.clone(), message: error.to_string() })?;
        let bytes = |plane: &[[f32; 3]]| -> Vec<u8> {
            cast_slice::<_, f32>(plane).iter().flat_map(|value| value.to_le_bytes()).collect()
        };
        let planes =
            [&self.halves[0].pixels, &self.halves[1].pixels, &self.variance].map(|plane| bytes(plane));
        let parts: Vec<&[u8]> = planes.iter().map(Vec::as_slice).collect();
        checksummed_file::write(&path, MAGIC, &header, &parts).map_err(io)
    }
}
