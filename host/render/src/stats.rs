//! Statistics of a render, for people and as versioned JSON (`--stats`).

mod ranks;
mod sampling;

pub use ranks::{BLOCK_SHIFT, Balance, ClusterPlan, ClusterReport, DistributionMode, RankReport};

pub use sampling::{FilterTrial, GoalProgress, Noise, Sampling, Strategy, Trial};

use crate::denoise::Denoiser;
use crate::film::{FilmCounts, Summation};
use crate::settings::Settings;
use serde::Serialize;
use std::time::Duration;
use trisect_device::DeviceInfo;
use trisect_device::{Schedule, Traversal};
use trisect_kernels::{EntryPoint, feature_names};

/// Version of the JSON that `--stats` writes. It is raised when a field changes its meaning or is
/// removed.
pub const FORMAT: u32 = 1;

/// Wall-clock seconds of each phase of a render.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Phases {
    /// Reading and validating the scene file.
    pub load_seconds: f64,
    /// Building the BVH.
    pub bvh_seconds: f64,
    /// Copying the scene to the device.
    pub upload_seconds: f64,
    /// Compiling the kernel and allocating the film; near zero from the second frame on.
    pub prepare_seconds: f64,
    /// Pruning the BVH for the camera's tiles and copying the tile entries; near zero if the image
    /// is rendered again.
    pub view_seconds: f64,
    /// All submissions, with the gaps between them, and all merges.
    pub render_seconds: f64,
    /// Part of `render_seconds` in which the device waited: for the film to be read back, and for
    /// merges of chunks that did not overlap rendering.
    pub merge_seconds: f64,
    /// Part of `merge_seconds`: copying the film from the device.
    pub read_seconds: f64,
    /// Encoding and writing the image.
    pub write_seconds: f64,
}

/// Statistics of one render.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RenderStats {
    /// Version of the JSON, [`FORMAT`].
    pub format: u32,
    /// Version of the program.
    pub version: &'static str,
    /// Name of the scene.
    pub scene: String,
    /// Device that rendered the image.
    pub device: DeviceInfo,
    /// Reason for the backend, if the program chose it; otherwise empty.
    pub choice: String,
    /// Name of the kernel.
    pub kernel: &'static str,
    /// Names of the kernel's features, with commas between them.
    pub features: String,
    /// Traversal of the kernel.
    pub traversal: Traversal,
    /// Schedule of the kernel.
    pub schedule: Schedule,
    /// Edge in pixels of the tiles whose camera rays enter the BVH below its root; `None` without
    /// tiles.
    pub tile: Option<u32>,
    /// Reason why there are no tiles, although there should be.
    pub tiles_refused: Option<String>,
    /// Place where the chunks of the film added up.
    pub sums: Summation,
    /// Reason why they did not add up on the device, although they should.
    pub sums_refused: Option<String>,
    /// Requested settings.
    pub settings: Settings,
    /// Wall-clock seconds of each phase.
    pub phases: Phases,
    /// Sum of the submissions' times, by the device's timer.
    pub device_seconds: f64,
    /// Result of the sampling goal, if the number of samples was not given.
    pub sampling: Option<Sampling>,
    /// Settings of the denoiser, if the image was denoised.
    pub denoise: Option<Denoiser>,
    /// Sum of the denoiser passes' times, by the device's timer; by wall clock for a library.
    pub denoise_seconds: f64,
    /// Library that denoised the image, with its version and its device; `None` without one.
    pub denoise_library: Option<String>,
    /// Times of each rank, if there are several. `device_seconds` is then the sum over them.
    pub cluster: Option<ClusterReport>,
    /// Exposure in stops by which the image file is brighter than the rendered radiance.
    pub exposure: f32,
    /// Name of the tone map of the image file.
    pub tonemap: &'static str,
    /// Number of kernel launches.
    pub submissions: u64,
    /// Samples in the image.
    pub samples: u64,
    /// Number of NaN or infinite samples, which were left out.
    pub rejected_samples: u64,
    /// Number of pixels that miss samples because no kernel wrote them.
    pub unwritten_pixels: u64,
    /// Number of path segments (rays) traced.
    pub segments: u64,
    /// Samples that this run rendered, with rejected ones; a film that continues a checkpoint has
    /// more.
    pub rendered_samples: u64,
    /// Path segments that this run traced.
    pub rendered_segments: u64,
    /// Millions of rendered samples per second of device time.
    pub msamples_per_second: f64,
    /// Millions of traced segments per second of device time.
    pub msegments_per_second: f64,
}

impl RenderStats {
    pub(crate) fn new(device: &DeviceInfo, settings: &Settings, kernel: EntryPoint, phases: Phases) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            scene: String::new(),
            device: device.clone(),
            choice: String::new(),
            kernel: kernel.name,
            features: feature_names(kernel.features),
            traversal: Traversal::of(kernel.features),
            schedule: Schedule::of(kernel.features),
            tile: None,
            tiles_refused: None,
            sums: Summation::Host,
            sums_refused: None,
            settings: settings.clone(),
            phases,
            device_seconds: 0.0,
            sampling: None,
            denoise: None,
            denoise_seconds: 0.0,
            denoise_library: None,
            cluster: None,
            exposure: 0.0,
            tonemap: "none",
            submissions: 0,
            samples: 0,
            rejected_samples: 0,
            unwritten_pixels: 0,
            segments: 0,
            rendered_samples: 0,
            rendered_segments: 0,
            msamples_per_second: 0.0,
            msegments_per_second: 0.0,
        }
    }

    /// Sets the results of a render: the counts of its film, and the times of rendering, merging
    /// and, as a part of merging, of reading.
    pub fn finish(&mut self, counts: FilmCounts, render: Duration, merge: Duration, read: Duration) {
        self.finish_from(FilmCounts::default(), counts, render, (merge, read));
    }

    /// Sets the results as `finish` does, for a film that had the samples `before`: these took no
    /// time, so they do not count for the rates.
    pub fn finish_from(
        &mut self,
        before: FilmCounts,
        counts: FilmCounts,
        render: Duration,
        (merge, read): (Duration, Duration),
    ) {
        let FilmCounts { samples, rejected, segments, unwritten } = counts;
        self.phases.render_seconds = render.as_secs_f64();
        self.phases.merge_seconds = merge.as_secs_f64();
        self.phases.read_seconds = read.as_secs_f64();
        self.samples = samples;
        self.rejected_samples = rejected;
        self.unwritten_pixels = unwritten;
        self.segments = segments;
        self.rendered_samples = (samples + rejected).saturating_sub(before.samples + before.rejected);
        self.rendered_segments = segments.saturating_sub(before.segments);
        let [samples, segments] = self.rates(self.device_seconds);
        (self.msamples_per_second, self.msegments_per_second) = (samples, segments);
    }

    /// Adds the times, and what was rendered, of earlier moments of the same image. The counts of
    /// the film stay.
    pub fn add_moments(&mut self, earlier: &Self) {
        let Phases {
            load_seconds,
            bvh_seconds,
            upload_seconds,
            prepare_seconds,
            view_seconds,
            render_seconds,
            merge_seconds,
            read_seconds,
            write_seconds,
        } = earlier.phases;
        let phases = &mut self.phases;
        phases.load_seconds += load_seconds;
        phases.bvh_seconds += bvh_seconds;
        phases.upload_seconds += upload_seconds;
        phases.prepare_seconds += prepare_seconds;
        phases.view_seconds += view_seconds;
        phases.render_seconds += render_seconds;
        phases.merge_seconds += merge_seconds;
        phases.read_seconds += read_seconds;
        phases.write_seconds += write_seconds;
        self.device_seconds += earlier.device_seconds;
        self.submissions += earlier.submissions;
        self.rendered_samples += earlier.rendered_samples;
        self.rendered_segments += earlier.rendered_segments;
        let [samples, segments] = self.rates(self.device_seconds);
        (self.msamples_per_second, self.msegments_per_second) = (samples, segments);
    }

    /// Returns the millions of rendered samples and of traced segments per second.
    fn rates(&self, seconds: f64) -> [f64; 2] {
        [self.rendered_samples, self.rendered_segments].map(|count| count as f64 / seconds.max(1e-9) * 1e-6)
    }

    /// Returns one line for people: what this run rendered. The rates of several ranks are by wall
    /// clock, because their device times overlap.
    pub fn summary(&self) -> String {
        let Self { rendered_samples: count, device, phases, .. } = self;
        let (place, timer, [samples, segments]) = match &self.cluster {
            Some(cluster) => {
                let place = format!("{} ranks", cluster.ranks.len());
                (place, "wall clock", self.rates(phases.render_seconds))
            }
            None => {
                let place = format!("{} ({})", device.backend, device.name);
                (place, device.timer, [self.msamples_per_second, self.msegments_per_second])
            }
        };
        let mut text = format!(
            "{count} samples, {:.2} segments each, in {:.3} s on {place}: {samples:.1} Msamples/s, \
             {segments:.1} Msegments/s by {timer}",
            self.rendered_segments as f64 / (*count).max(1) as f64,
            phases.render_seconds,
        );
        let in_film = self.samples + self.rejected_samples;
        if in_film != *count {
            text += &format!("; the film has {in_film} samples");
        }
        text
    }

    /// Returns more lines for people: kernel, method, and the time of each phase.
    pub fn details(&self) -> String {
        let Phases {
            load_seconds,
            bvh_seconds,
            upload_seconds,
            prepare_seconds,
            view_seconds,
            render_seconds,
            merge_seconds,
            read_seconds,
            write_seconds,
        } = self.phases;
        let tile = self.tile.map_or_else(|| "no tiles".to_owned(), |tile| format!("tiles of {tile}"));
        let (traversal, schedule) = (self.traversal, self.schedule);
        let method = format!("{traversal:?} traversal, {schedule:?} schedule").to_lowercase();
        let mut text = format!(
            "kernel {}: {method}, {tile}; {} submissions\nfeatures {}",
            self.kernel, self.submissions, self.features
        );
        let phases = [
            ("load the scene", load_seconds),
            ("build the BVH", bvh_seconds),
            ("upload", upload_seconds),
            ("compile, make the film", prepare_seconds),
            ("prune the BVH", view_seconds),
            ("render", render_seconds),
            ("  merge (of render)", merge_seconds),
            ("  read back (of merge)", read_seconds),
            ("  device (of render)", self.device_seconds),
            ("denoise", self.denoise_seconds),
            ("write", write_seconds),
        ];
        phases.iter().for_each(|(name, seconds)| text += &format!("\n  {name:<22} {seconds:>9.3} s"));
        text
    }

    /// Returns warnings for people, which a quiet render prints, too: faults of the image, and
    /// reasons why it took longer.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.rejected_samples > 0 {
            warnings.push(format!("{} samples were NaN or infinite and left out", self.rejected_samples));
        }
        if self.unwritten_pixels > 0 {
            warnings.push(format!("{} pixels miss samples and are NaN", self.unwritten_pixels));
        }
        if let Some(reason) = &self.tiles_refused {
            warnings.push(format!("rendered without tiles, which takes longer: {reason}"));
        }
        if let Some(reason) = &self.sums_refused {
            warnings.push(format!("the host adds the chunks up, which takes longer: {reason}"));
        }
        if let Some(reason) = self.sampling.as_ref().and_then(|sampling| sampling.denoiser_error.as_ref()) {
            warnings.push(format!("a denoiser could not be tried: {reason}"));
        }
        warnings.extend(self.sampling.as_ref().and_then(Sampling::warning));
        warnings
    }
}
