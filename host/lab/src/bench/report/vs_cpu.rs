//! Third experiment: the speed of the device over one thread of this machine's CPU, with equal
//! scenes and settings.

use super::{Bench, Conditions, csv, spheres};
use crate::Error;
use crate::bench::{Summary, WarmUp, measure};
use crate::plot::number;
use crate::plot::{Bars, Chart};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use trisect::device::Device;
use trisect::render::{MathMode, Settings};
use trisect::scene::{Rebase, Scene, SceneDocument};

/// Speed of the device against one thread of the CPU.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VsCpu {
    /// Program, device and settings.
    pub conditions: Conditions,
    /// Name of the CPU.
    pub cpu: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Points, by scene.
    pub points: Vec<VsCpuPoint>,
}

/// Times of a scene on both devices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VsCpuPoint {
    /// Name of the scene.
    pub scene: String,
    /// Name of the device's kernel.
    pub kernel: String,
    /// Device time of a frame, in seconds.
    pub device_seconds: Summary,
    /// Wall-clock seconds of one frame on one thread.
    pub thread_seconds: f64,
    /// `thread_seconds` over the median of `device_seconds`.
    pub ratio: f64,
}

impl VsCpu {
    pub(super) fn measure(
        bench: &mut Bench,
        one_thread: Box<dyn Device>,
        described: &[SceneDocument],
    ) -> Result<Self, Error> {
        let plan = bench.plan;
        let mut scenes = vec![("three spheres".to_owned(), Scene::hello_world()?)];
        for &count in &plan.vs_cpu {
            scenes.push((format!("{count} spheres"), spheres(count)?));
        }
        for scene in described {
            let file = scene.name.rsplit(['/', '\\']).next().unwrap_or_default();
            scenes.push((file.to_owned(), scene.clone().lower(Rebase::IDENTITY)?));
        }
        let (mut points, mut conditions) = (Vec::new(), None);
        let cpu = one_thread.info().name.clone();
        let mut thread = Bench { backend: Some(one_thread), plan, say: &mut |_| () };
        for (name, scene) in &scenes {
            let settings = plan.settings(Settings::of(scene), plan.samples);
            let (frames, device) = bench.with(scene, |_, renderer| {
                let frames = measure(renderer, &settings, WarmUp::of(plan.warm_up), plan.frames, &mut ())?;
                Ok((frames.counted, renderer.device().info().clone()))
            })?;
            // One frame that takes minutes needs no warm-up, and the CPU has no fast build of the
            // kernels.
            let precise = Settings { math: MathMode::Precise, ..settings.clone() };
            let slow =
                thread.with(scene, |_, renderer| measure(renderer, &precise, WarmUp::of(0), 1, &mut ()))?;
            let seconds: Vec<f64> = frames.iter().map(|stats| stats.device_seconds).collect();
            if let (Some(device_seconds), Some(last)) = (Summary::of(&seconds), frames.last()) {
                let thread_seconds = slow.first.device_seconds;
                let ratio = thread_seconds / device_seconds.median.max(1e-12);
                bench.say(&format!("{name}: {} times one thread", number(ratio)));
                let kernel = last.kernel.to_owned();
                points.push(VsCpuPoint {
                    scene: name.clone(),
                    kernel,
                    device_seconds,
                    thread_seconds,
                    ratio,
                });
                conditions = Some(Conditions::new(&device, &settings, plan));
            }
        }
        let Some(conditions) = conditions else {
            return Err(crate::bench::BenchError::NothingToMeasure.into());
        };
        Ok(Self { conditions, cpu, samples: plan.samples, points })
    }

    pub(super) fn summary(&self) -> String {
        let mut text = String::new();
        for point in &self.points {
            let _ = writeln!(text, "against one thread, {}: {}×", point.scene, number(point.ratio));
        }
        text
    }

    pub(super) fn chart(&self) -> Chart {
        let Conditions { width, height, math, .. } = &self.conditions;
        Chart::Bars(Bars {
            title: "Times as fast as one CPU thread of the same machine".to_owned(),
            notes: vec![
                self.conditions.device(),
                format!("one thread of: {}", self.cpu),
                format!("{width}×{height}, {} spp, each scene's own depth, {math} math", self.samples),
            ],
            label: "time of one thread over device time, ×".to_owned(),
            bars: self.points.iter().map(|point| (point.scene.clone(), point.ratio)).collect(),
        })
    }

    pub(super) fn csv(&self) -> String {
        let header = ["scene", "kernel", "device_median_s", "device_iqr_s", "one_thread_s", "ratio"];
        let row = |point: &VsCpuPoint| {
            [
                point.scene.clone(),
                point.kernel.clone(),
                point.device_seconds.median.to_string(),
                point.device_seconds.spread().to_string(),
                point.thread_seconds.to_string(),
                point.ratio.to_string(),
            ]
        };
        csv(header, self.points.iter().map(row))
    }
}
