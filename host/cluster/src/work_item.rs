//! Work items of a rank: where they come from, and how the render thread turns them into image
//! parts.

use super::image_part::{ImagePart, Rendered, WireFormat};
use super::means::{MeanSum, add_chunk};
use crate::Error;
use rayon::prelude::*;
use std::ops::{ControlFlow, Range};
use std::time::{Duration, Instant};
use trisect::film::{FilmCounts, RowSet, SampleBlock};
use trisect::render::{ChunkJob, ChunkResult, PartSizer, Renderer, Settings, chunks};

/// Target render time of an image part of a rank's own rows: long enough to be worth a message,
/// short enough that little is lost with a rank.
const TARGET_PART_TIME: Duration = Duration::from_millis(400);

/// Some samples of some rows, to be rendered by this rank.
#[derive(Clone, Debug)]
pub(super) struct WorkItem {
    pub rows: RowSet,
    /// Sample indices of each pixel.
    pub samples: Range<u32>,
    /// Number of rows of an image part: the result is sent in strips of as many rows.
    pub strip: u32,
}

/// State of the render thread.
pub(super) struct WorkerState {
    pub renderer: Renderer,
    pub settings: Settings,
    pub wire_format: WireFormat,
    /// Number of phases of an average: 1 or 2.
    pub phases: u32,
}

/// Encodes rendered chunks as image parts.
struct ChunkEncoder<'a> {
    out: &'a mut (dyn FnMut(ImagePart) + Send),
    /// Ranges of chunks that are summed before they are sent.
    groups: Vec<Range<usize>>,
    /// Index of the next chunk.
    next: usize,
    /// Sums of the current group's earlier chunks for each pixel; `counts` are their counts for
    /// each strip.
    means: Vec<MeanSum>,
    counts: Vec<FilmCounts>,
    start: Instant,
    cost: (f64, f64, u32),
}

impl ChunkEncoder<'_> {
    /// Passes an image part on, with the time since the last one.
    fn send(&mut self, mut piece: ImagePart) {
        piece.render_seconds = self.start.elapsed().as_secs_f64();
        (self.out)(piece);
        (self.start, self.cost) = (Instant::now(), (0.0, 0.0, 0));
    }
}

/// Renders a work item and passes its image parts to `out`.
pub(super) fn render(
    bench: &mut WorkerState,
    order: WorkItem,
    out: &mut (dyn FnMut(ImagePart) + Send),
) -> Result<(), Error> {
    let WorkerState { renderer, settings, wire_format: travels, phases } = bench;
    let (width, WorkItem { rows, samples, strip }) = (settings.width, order);
    let parts: Vec<Range<u32>> = chunks(samples).collect();
    // Groups of chunks that are summed before they are sent. All kernel sums: each chunk alone. One
    // phase: all chunks. Two phases: all chunks but the last, so that less is left to send at the
    // end.
    let first_of =
        |index: usize| match (matches!(travels, WireFormat::Sums | WireFormat::SumsAndAovs), *phases) {
            (true, _) => index,
            (false, 1) => 0,
            (false, _) => {
                if index + 1 < parts.len() {
                    0
                } else {
                    index
                }
            }
        };
    let groups: Vec<Range<usize>> = (0..parts.len())
        .filter(|&index| index + 1 == parts.len() || first_of(index + 1) > index)
        .map(|index| first_of(index)..index + 1)
        .collect();
    let (start, cost) = (Instant::now(), (0.0, 0.0, 0));
    let mut desk = ChunkEncoder { out, groups, next: 0, means: Vec::new(), counts: Vec::new(), start, cost };
    let take = |desk: &mut ChunkEncoder<'_>, part: &Range<u32>, sums: &ChunkResult<'_>| {
        desk.cost.0 += sums.device.as_secs_f64();
        desk.cost.2 += sums.submissions as u32;
        let index = desk.next;
        desk.next += 1;
        let Some(group) = desk.groups.iter().position(|group| group.contains(&index)) else { return Ok(()) };
        let chunks = desk.groups[group].clone();
        let samples = parts[chunks.start].start..part.end;
        let phase = if *phases > 1 { group as u32 } else { 0 };
        let encode = |rows: &RowSet, rendered: Rendered<'_>, cost| {
            ImagePart::new(rows, (samples.clone(), phase), width, *travels, &rendered, cost)
        };
        if chunks.len() == 1 {
            for (rows, pixels) in strips(&rows, strip, width) {
                let guides = sums.aovs.get(pixels.clone()).unwrap_or_default();
                desk.send(encode(&rows, Rendered::Chunk(&sums.pixels[pixels], guides), desk.cost));
            }
            return Ok(());
        }
        if index == chunks.start {
            // In parallel, because the first touch of fresh memory takes most of the time.
            desk.means = rayon::iter::repeat_n(MeanSum::ZERO, sums.pixels.len()).with_min_len(4096).collect();
            desk.counts = strips(&rows, strip, width).map(|_| FilmCounts::default()).collect();
        }
        for ((rows, pixels), place) in strips(&rows, strip, width).zip(0..) {
            let means = &mut desk.means[pixels.clone()];
            add_chunk(means, &mut desk.counts[place], &sums.pixels[pixels.clone()], part.len() as u32);
            if index + 1 == chunks.end {
                let rendered = Rendered::Means(&desk.means[pixels], desk.counts[place]);
                desk.send(encode(&rows, rendered, desk.cost));
            }
        }
        Ok(())
    };
    let mut go_on = |_| ControlFlow::Continue(());
    // A GPU adds up the chunks of the first group, and the host reads their sum once.
    if let Some(group) = desk.groups.first().filter(|group| group.len() > 1).cloned() {
        let own = &parts[group.clone()];
        let (of_strips, ranges): (Vec<_>, Vec<_>) = strips(&rows, strip, width).unzip();
        if let Some(sum) = renderer.sum_chunks(settings, (&rows, &of_strips), own, &mut go_on)? {
            desk.cost = (sum.device.as_secs_f64(), 0.0, sum.submissions as u32);
            desk.next = group.end;
            let samples = parts[0].start..parts[group.end - 1].end;
            let means: &[MeanSum] = bytemuck::cast_slice(sum.pixels);
            for ((rows, pixels), counts) in of_strips.iter().zip(ranges).zip(sum.counts) {
                let rendered = Rendered::Means(&means[pixels], counts);
                desk.send(ImagePart::new(rows, (samples.clone(), 0), width, *travels, &rendered, desk.cost));
            }
        }
    }
    let left = &parts[desk.next..];
    let job =
        ChunkJob { settings, rows: &rows, samples: left, seeds: &[settings.seed], should_continue: &|| true };
    if !left.is_empty() {
        renderer.for_each_chunk(&job, &mut go_on, desk, &take)?;
    }
    Ok(())
}

/// Splits rows into strips; returns each with the range of its pixels among the pixels of all rows.
fn strips(rows: &RowSet, strip: u32, width: u32) -> impl Iterator<Item = (RowSet, Range<usize>)> + '_ {
    let strip = strip.max(1);
    (0..rows.len()).step_by(strip as usize).map(move |first| {
        let end = first.saturating_add(strip).min(rows.len());
        (rows.part(first..end), first as usize * width as usize..end as usize * width as usize)
    })
}

/// Source of a rank's work items.
pub(super) enum Source {
    /// The rank's own rows, `at_once` at a time, a multiple of `whole`; `next` is the first left.
    Static { rows: RowSet, next: u32, at_once: u32, whole: u32, samples: Range<u32>, strip: u32 },
    /// The root, which hands out as many samples as this rank's speed allows.
    Root { asked: bool, over: bool, ready: Option<WorkItem>, speed: PartSizer },
}

impl Source {
    pub fn is_over(&self) -> bool {
        match self {
            Self::Static { rows, next, samples, .. } => *next >= rows.len() || samples.start >= samples.end,
            Self::Root { over, ready, .. } => *over && ready.is_none(),
        }
    }

    pub fn take(&mut self) -> Option<WorkItem> {
        match self {
            Self::Static { rows, next, at_once, samples, strip, .. }
                if *next < rows.len() && samples.start < samples.end =>
            {
                let rows = rows.part(*next..next.saturating_add(*at_once));
                let order = WorkItem { rows, samples: samples.clone(), strip: *strip };
                *next += order.rows.len();
                Some(order)
            }
            Self::Static { .. } => None,
            Self::Root { ready, .. } => ready.take(),
        }
    }

    /// Fits the size of the next work item to the render time of the image part `piece`.
    pub fn learn(&mut self, piece: &ImagePart) {
        let (at_once, whole) = match self {
            Self::Static { at_once, whole, .. } => (at_once, whole),
            Self::Root { speed, .. } => {
                let samples =
                    u64::from(piece.rows.len()) * u64::from(piece.width) * piece.samples.len() as u64;
                return speed.learn(samples, Duration::from_secs_f64(piece.render_seconds));
            }
        };
        let rows =
            f64::from(piece.rows.len()) * TARGET_PART_TIME.as_secs_f64() / piece.render_seconds.max(1e-6);
        // Whole blocks, so that tiles stay whole, too.
        *at_once = (rows.min(f64::from(u32::MAX / 2)) as u32 / *whole * *whole).max(*whole);
    }
}

/// Stores the block that the root handed out as the next work item.
pub(super) fn assign(source: &mut Source, part: Option<SampleBlock>) {
    if let (Source::Root { ready, .. }, Some(SampleBlock { rows, samples })) = (source, part) {
        *ready = Some(WorkItem { rows: rows.into(), samples, strip: u32::MAX });
    }
}
