//! Timestamps of launches.

use super::adapter::Gpu;
use crate::BackendError;
use std::time::Duration;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, ComputePassTimestampWrites, QuerySet,
    QuerySetDescriptor, QueryType,
};

/// Bytes of a timestamp.
const STAMP: u64 = 8;

/// Timestamps before and after each launch of a submission.
pub(super) struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    staging: Buffer,
    /// Number of launches that it can time.
    launches: u32,
    nanoseconds_per_tick: f64,
}

impl Timer {
    /// Creates a timer of this many launches.
    pub fn new(gpu: &Gpu, launches: u32) -> Result<Self, BackendError> {
        let stamps = 2 * launches;
        let buffer = |usage| {
            let size = u64::from(stamps) * STAMP;
            let descriptor =
                BufferDescriptor { label: Some("timer"), size, usage, mapped_at_creation: false };
            gpu.device.create_buffer(&descriptor)
        };
        let descriptor = QuerySetDescriptor { label: None, ty: QueryType::Timestamp, count: stamps };
        let timer = Self {
            queries: gpu.device.create_query_set(&descriptor),
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            staging: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            launches,
            nanoseconds_per_tick: f64::from(gpu.queue.get_timestamp_period()),
        };
        gpu.check("creating the timer")?;
        Ok(timer)
    }

    /// Returns the number of launches that it can time.
    pub fn launches(&self) -> u32 {
        self.launches
    }

    /// Returns where a compute pass writes the timestamps of a launch.
    pub fn writes(&self, launch: u32) -> ComputePassTimestampWrites<'_> {
        ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * launch),
            end_of_pass_write_index: Some(2 * launch + 1),
        }
    }

    /// Ends a submission of this many launches.
    pub fn resolve(&self, encoder: &mut CommandEncoder, launches: u32) {
        encoder.resolve_query_set(&self.queries, 0..2 * launches, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, u64::from(2 * launches) * STAMP);
    }

    /// Waits for the submission, and returns the time of each launch.
    pub fn read(&self, gpu: &Gpu, launches: u32) -> Result<Vec<Duration>, BackendError> {
        let mut ticks = vec![0u64; 2 * launches as usize];
        gpu.read(&self.staging, bytemuck::cast_slice_mut(&mut ticks), "reading the timer")?;
        let time = |pair: &[u64]| {
            let nanoseconds = pair[1].wrapping_sub(pair[0]) as f64 * self.nanoseconds_per_tick;
            Duration::from_nanos(nanoseconds as u64)
        };
        Ok(ticks.chunks_exact(2).map(time).collect())
    }
}
