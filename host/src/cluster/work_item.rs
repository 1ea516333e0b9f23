//! What a rank renders next, and rendering it.

use super::image_part::{ImagePart, Rendered, WireFormat};
use super::means::{MeanSum, add_chunk};
use crate::Error;
use crate::film::{FilmCounts, RowSet, SampleBlock};
use crate::render::{ChunkJob, ChunkResult, PartSizer, Renderer, Settings, chunks};
use rayon::prelude::*;
use std::ops::{ControlFlow, Range};
use std::time::{Duration, Instant};

/// What a piece should take to render: then it is worth a message, and little is lost with it.
const TARGET_PART_TIME: Duration = Duration::from_millis(400);

/// Some samples of some rows.
#[derive(Clone, Debug)]
pub(super) struct WorkItem {
    pub rows: RowSet,
    /// Of each pixel.
    pub samples: Range<u32>,
    /// Rows of a piece that travels: what was rendered goes in so many.
    pub strip: u32,
}

/// What the rendering thread works with.
pub(super) struct WorkerState {
    pub renderer: Renderer,
    pub settings: Settings,
    pub wire_format: WireFormat,
    /// Of an average.
    pub phases: u32,
}

/// A piece, and the kernel that rendered it.
pub(super) type EncodedPart = (ImagePart, &'static str);

/// Where pieces are made of chunks.
struct ChunkEncoder<'a> {
    out: &'a mut (dyn FnMut(EncodedPart) + Send),
    /// Chunks that are summed before they travel.
    groups: Vec<Range<usize>>,
    /// The chunk that comes.
    next: usize,
    /// What those before it of its group add up to, and what each strip has.
    means: Vec<MeanSum>,
    counts: Vec<FilmCounts>,
    start: Instant,
    cost: (f64, f64, u32),
}

impl ChunkEncoder<'_> {
    /// Hands out a piece, with the time since the last.
    fn send(&mut self, (mut piece, kernel): EncodedPart) {
        piece.render_seconds = self.start.elapsed().as_secs_f64();
        (self.out)((piece, kernel));
        (self.start, self.cost) = (Instant::now(), (0.0, 0.0, 0));
    }
}

/// Renders an order, and hands out what travels of it.
pub(super) fn render(
    bench: &mut WorkerState,
    order: WorkItem,
    out: &mut (dyn FnMut(EncodedPart) + Send),
) -> Result<(), Error> {
    let WorkerState { renderer, settings, wire_format: travels, phases } = bench;
    let (width, WorkItem { rows, samples, strip }) = (settings.width, order);
    let parts: Vec<Range<u32>> = chunks(samples).collect();
    // What is summed before it travels: chunk by chunk, all, or all but the last, which then has less to wait for.
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
    let desk = ChunkEncoder { out, groups, next: 0, means: Vec::new(), counts: Vec::new(), start, cost };
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
            (ImagePart::new(rows, (samples.clone(), phase), width, *travels, &rendered, cost), sums.kernel)
        };
        if chunks.len() == 1 {
            for (rows, pixels) in strips(&rows, strip, width) {
                let guides = sums.aovs.get(pixels.clone()).unwrap_or_default();
                desk.send(encode(&rows, Rendered::Chunk(&sums.pixels[pixels], guides), desk.cost));
            }
            return Ok(());
        }
        if index == chunks.start {
            // By threads: the first touch of fresh memory is what takes the time.
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
    let parts = ChunkJob {
        settings,
        rows: &rows,
        samples: &parts,
        seeds: &[settings.seed],
        should_continue: &|| true,
    };
    renderer.for_each_chunk(&parts, &mut |_| ControlFlow::Continue(()), desk, &take)?;
    Ok(())
}

/// Rows in strips, and their pixels among those of all.
fn strips(rows: &RowSet, strip: u32, width: u32) -> impl Iterator<Item = (RowSet, Range<usize>)> + '_ {
    let strip = strip.max(1);
    (0..rows.len()).step_by(strip as usize).map(move |first| {
        let end = first.saturating_add(strip).min(rows.len());
        (rows.part(first..end), first as usize * width as usize..end as usize * width as usize)
    })
}

/// Where a rank's work comes from.
pub(super) enum Source {
    /// Its own rows, so many at a time.
    Static { rows: RowSet, next: u32, at_once: u32, whole: u32, samples: Range<u32>, strip: u32 },
    /// The root, as much as this rank's speed allows.
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

    /// Fits the next piece to the speed of the last.
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

/// Hands over what the root says.
pub(super) fn assign(source: &mut Source, part: Option<SampleBlock>) {
    if let (Source::Root { ready, .. }, Some(SampleBlock { rows, samples })) = (source, part) {
        *ready = Some(WorkItem { rows: rows.into(), samples, strip: u32::MAX });
    }
}
