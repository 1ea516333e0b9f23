//! Pipeline of chunks: sizes of submissions, and host memory for chunks as a device returns them.

use super::submission_queue::SubmissionQueue;
use super::submissions::SubmissionSizer;
use crate::film::{HostRecords, RadianceTotals};
use bytemuck::{Pod, Zeroable};
use trisect_device::{Device, DeviceKind};
use trisect_shared::aovs::AovSums;
use trisect_shared::features::{Features, MEDIA, has_any};
use trisect_shared::film::PixelSums;

/// Sums and AOV sums of a chunk.
#[derive(Default)]
pub(super) struct ChunkSums {
    pub pixels: HostRecords<PixelSums>,
    /// Empty if the render has none.
    pub aovs: HostRecords<AovSums>,
}

/// Sizes of submissions, and memory for two chunks, kept from frame to frame: one chunk is rendered
/// while the other is added to the film.
pub(super) struct ChunkPipeline {
    /// Sizes submissions by the speed of earlier ones, also of earlier frames.
    pub sizer: SubmissionSizer,
    /// Submissions that run.
    pub queue: SubmissionQueue,
    /// Chunk that is rendered.
    pub current: ChunkSums,
    /// Memory for another chunk.
    pub spare: ChunkSums,
    /// Sums over chunks that added up on the device.
    pub radiance: HostRecords<RadianceTotals>,
}

impl ChunkSums {
    /// Resizes memory to `pixels` pixels, with or without AOV sums. Memory that is too small is
    /// unpinned first.
    pub fn resize(&mut self, device: &mut dyn Device, pixels: usize, with_aovs: bool) {
        resize(device, &mut self.pixels, pixels);
        resize(device, &mut self.aovs, if with_aovs { pixels } else { 0 });
    }
}

impl ChunkPipeline {
    /// Unpins the memory: the device goes to another scene.
    pub fn unpin(&self, device: &mut dyn Device) {
        for chunk in [&self.current, &self.spare] {
            device.unpin(chunk.pixels.memory());
            device.unpin(chunk.aovs.memory());
        }
        device.unpin(self.radiance.memory());
    }

    /// Creates a pipeline for a device of this kind and a scene with these features, without memory
    /// yet.
    pub fn new(kind: DeviceKind, scene: Features) -> Self {
        let (current, spare) = (ChunkSums::default(), ChunkSums::default());
        let (sizer, queue) = (SubmissionSizer::new(kind), SubmissionQueue::default());
        let mut pipeline = Self { sizer, queue, current, spare, radiance: HostRecords::default() };
        pipeline.adapt_to(kind, scene);
        pipeline
    }

    /// Adapts the pipeline to a scene with these features on a device of this kind.
    pub fn adapt_to(&mut self, kind: DeviceKind, scene: Features) {
        self.sizer.set_loop_factor(kind, if has_any(scene, MEDIA) { 4 } else { 1 });
    }

    /// Pins memory for two chunks of `pixels` pixels, if the device is a GPU.
    pub fn pin(&mut self, device: &mut dyn Device, pixels: usize, with_aovs: bool) {
        if device.info().kind != DeviceKind::Gpu {
            return;
        }
        for chunk in [&mut self.current, &mut self.spare] {
            resize(device, &mut chunk.pixels, pixels);
            device.pin(chunk.pixels.memory());
            if with_aovs {
                resize(device, &mut chunk.aovs, pixels);
                device.pin(chunk.aovs.memory());
            }
        }
    }
}

/// Resizes records; memory that is too small is unpinned first.
pub(super) fn resize<T: Pod + Zeroable>(
    device: &mut dyn Device,
    records: &mut HostRecords<T>,
    pixels: usize,
) {
    if records.memory().bytes() < pixels * size_of::<T>() {
        device.unpin(records.memory());
    }
    records.resize(pixels);
}
