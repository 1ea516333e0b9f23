//! What a render took, for people and as versioned JSON.

use crate::adaptive::Sampling;
use crate::backend::Device;
use crate::cluster::ClusterReport;
use crate::denoise::DenoiseSettings;
use crate::film::FilmCounts;
use crate::render::{Schedule, Settings, Traversal};
use serde::Serialize;
use std::time::Duration;
use trisect_kernels::Variant;

/// Version of the JSON that `--stats` writes. A field that changes its meaning, or goes, raises it.
pub const FORMAT: u32 = 1;

/// Wall-clock seconds of each phase.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Phases {
    /// Reading and validating the scene file.
    pub load_seconds: f64,
    /// Building the BVH.
    pub bvh_seconds: f64,
    /// Copying the scene to the device.
    pub upload_seconds: f64,
    /// Compiling the kernel and allocating the film; near zero from the second frame on.
    pub prepare_seconds: f64,
    /// Pruning the tree for the camera, and copying that; near zero for the same image again.
    pub view_seconds: f64,
    /// All submissions, with their gaps, and all merges.
    pub render_seconds: f64,
    /// Of that, reading the film back and merging its chunks.
    pub merge_seconds: f64,
    /// Of that, copying the film from the device.
    pub read_seconds: f64,
    /// Encoding and writing the image.
    pub write_seconds: f64,
}

/// One render.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RenderStats {
    /// See [`FORMAT`].
    pub format: u32,
    /// Of the program.
    pub version: &'static str,
    /// Name of the scene.
    pub scene: String,
    /// Where it ran.
    pub device: Device,
    /// Why that backend, where the program chose.
    pub choice: String,
    /// The kernel's name.
    pub kernel: &'static str,
    /// What it does.
    pub traversal: Traversal,
    /// The same.
    pub schedule: Schedule,
    /// Pixels along the edge of the tiles whose camera rays begin below the BVH's root; none without tiles.
    pub tile: Option<u32>,
    /// Why there are none, where there should be.
    pub tiles_refused: Option<String>,
    /// What was asked for.
    pub settings: Settings,
    /// Wall clock.
    pub phases: Phases,
    /// Sum of the submissions' times by the device's timer.
    pub device_seconds: f64,
    /// What samples were taken by, where the number of them was not asked for.
    pub sampling: Option<Sampling>,
    /// How the image was denoised, if it was.
    pub denoise: Option<DenoiseSettings>,
    /// Sum of its passes' times by the device's timer.
    pub denoise_seconds: f64,
    /// What each rank's part took, where there are several; `device_seconds` is their sum then.
    pub cluster: Option<ClusterReport>,
    /// Stops by which the image file is brighter than the radiance that was rendered.
    pub exposure: f32,
    /// Launches.
    pub submissions: u64,
    /// Samples in the image.
    pub samples: u64,
    /// NaN or infinite samples, left out.
    pub rejected_samples: u64,
    /// Pixels that miss samples which no kernel wrote.
    pub unwritten_pixels: u64,
    /// Path segments (rays) traced.
    pub segments: u64,
    /// Millions of samples a second of device time.
    pub msamples_per_second: f64,
    /// Millions of segments a second of device time.
    pub msegments_per_second: f64,
}

impl RenderStats {
    pub(crate) fn new(device: &Device, settings: &Settings, variant: Variant, phases: Phases) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            scene: String::new(),
            device: device.clone(),
            choice: String::new(),
            kernel: variant.name,
            traversal: Traversal::of(variant.features),
            schedule: Schedule::of(variant.features),
            tile: None,
            tiles_refused: None,
            settings: settings.clone(),
            phases,
            device_seconds: 0.0,
            sampling: None,
            denoise: None,
            denoise_seconds: 0.0,
            cluster: None,
            exposure: 0.0,
            submissions: 0,
            samples: 0,
            rejected_samples: 0,
            unwritten_pixels: 0,
            segments: 0,
            msamples_per_second: 0.0,
            msegments_per_second: 0.0,
        }
    }

    pub(crate) fn finish(&mut self, counts: FilmCounts, render: Duration, merge: Duration, read: Duration) {
        let FilmCounts { samples, rejected, segments, unwritten } = counts;
        self.phases.render_seconds = render.as_secs_f64();
        self.phases.merge_seconds = merge.as_secs_f64();
        self.phases.read_seconds = read.as_secs_f64();
        self.samples = samples;
        self.rejected_samples = rejected;
        self.unwritten_pixels = unwritten;
        self.segments = segments;
        let seconds = self.device_seconds.max(1e-9);
        self.msamples_per_second = (samples + rejected) as f64 / seconds * 1e-6;
        self.msegments_per_second = segments as f64 / seconds * 1e-6;
    }

    /// The same where there were samples before, which took no time.
    pub(crate) fn finish_from(
        &mut self,
        before: FilmCounts,
        counts: FilmCounts,
        render: Duration,
        (merge, read): (Duration, Duration),
    ) {
        self.finish(counts, render, merge, read);
        let seconds = self.device_seconds.max(1e-9);
        let samples = (counts.samples + counts.rejected).saturating_sub(before.samples + before.rejected);
        self.msamples_per_second = samples as f64 / seconds * 1e-6;
        self.msegments_per_second = counts.segments.saturating_sub(before.segments) as f64 / seconds * 1e-6;
    }

    /// A line for people.
    pub fn summary(&self) -> String {
        format!(
            "{} samples, {:.2} segments each, in {:.3} s on {} ({}): {:.1} Msamples/s, {:.1} Msegments/s by {}",
            self.samples,
            self.segments as f64 / self.samples.max(1) as f64,
            self.phases.render_seconds,
            self.device.backend,
            self.device.name,
            self.msamples_per_second,
            self.msegments_per_second,
            self.device.timer,
        )
    }

    /// More lines for people: how it was rendered, and what each phase took.
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
        let mut text = format!("kernel {}: {method}, {tile}; {} submissions", self.kernel, self.submissions);
        let phases = [
            ("load the scene", load_seconds),
            ("build the BVH", bvh_seconds),
            ("upload", upload_seconds),
            ("compile, make the film", prepare_seconds),
            ("the camera's tree", view_seconds),
            ("render", render_seconds),
            ("  of that merge", merge_seconds),
            ("  of that read back", read_seconds),
            ("  of that the device", self.device_seconds),
            ("denoise", self.denoise_seconds),
            ("write", write_seconds),
        ];
        phases.iter().for_each(|(name, seconds)| text += &format!("\n  {name:<22} {seconds:>9.3} s"));
        text
    }

    /// What is wrong with the image, or made it take longer, for people: a quiet render says it, too.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.rejected_samples > 0 {
            warnings.push(format!("{} samples were NaN or infinite and left out", self.rejected_samples));
        }
        if self.unwritten_pixels > 0 {
            warnings.push(format!("{} pixels miss samples and are NaN", self.unwritten_pixels));
        }
        if let Some(reason) = &self.tiles_refused {
            warnings.push(format!("without tiles, which takes longer: {reason}"));
        }
        warnings.extend(self.sampling.as_ref().and_then(Sampling::warning));
        warnings
    }
}
