//! Series of frames over all ranks, for `view --headless` and `bench cluster`: a frame is sent
//! while the next one is rendered.
//!
//! Ranks on the root's host share the memory of its frames. Their devices copy rows directly to
//! their place in a frame, and an empty message announces them to the root. Rows of other hosts are
//! sent as messages.
#![allow(unsafe_code, reason = "several ranks fill one frame; each block says why it is sound")]

use super::ClusterError;
use super::heartbeat::{Heartbeat, POLL_INTERVAL};
use super::network::{Message, Network, Tag};
use super::render_thread::RenderThread;
use crate::Error;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{Ordering, fence};
use std::time::{Duration, Instant};
use trisect::film::{FrameMemory, RowSet, RowTarget};
use trisect::render::Renderer;

/// Maximum number of frames that a rank may be ahead of the root's complete frames: being sent,
/// being rendered or waiting.
const MAX_FRAMES_AHEAD: u32 = 4;

/// Cost of one frame on one rank, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameCost {
    /// Time until the pixels were in place, measured by the host; for frames rendered at the same
    /// time, each one's share.
    pub render: f64,
    /// Part of `render` by the device's timer.
    pub device: f64,
}

/// Series of frames of an image whose rows are divided among ranks.
#[derive(Clone, Debug)]
pub struct FrameSeries {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Rows of each rank.
    pub rows: Vec<RowSet>,
    /// Number of frames.
    pub frames: u32,
    /// True if a waiting rank spins instead of sleeping. Where a GPU renders, that costs nothing
    /// and saves the time of waking up.
    pub spins: bool,
}

/// Costs and times of a series of frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeriesReport {
    /// Cost of each frame, by rank, then frame; empty for a rank without rows.
    pub costs: Vec<Vec<FrameCost>>,
    /// Time when each frame was complete on the root, in seconds since the start.
    pub whole: Vec<f64>,
    /// Mean number of bytes that the root received per frame.
    pub bytes: u64,
}

impl SeriesReport {
    /// Returns the mean time between complete frames in seconds, from frame `from` on. Transfers
    /// that overlap count once.
    pub fn period(&self, from: usize) -> f64 {
        match self.whole.get(from..) {
            Some([first, .., last]) => (last - first) / (self.whole.len() - from - 1) as f64,
            _ => self.whole.last().copied().unwrap_or(0.0),
        }
    }

    /// Returns the mean render time per frame of the slowest rank in seconds, from frame `from` on.
    pub fn render(&self, from: usize) -> f64 {
        self.slowest(from, |cost| cost.render)
    }

    /// Returns the mean device time per frame of the slowest rank in seconds, from frame `from` on.
    pub fn device(&self, from: usize) -> f64 {
        self.slowest(from, |cost| cost.device)
    }

    fn slowest(&self, from: usize, value: fn(&FrameCost) -> f64) -> f64 {
        let mean = |costs: &Vec<FrameCost>| {
            let counted = costs.get(from..).filter(|counted| !counted.is_empty()).unwrap_or(costs);
            counted.iter().map(value).sum::<f64>() / counted.len().max(1) as f64
        };
        self.costs.iter().map(mean).fold(0.0, f64::max)
    }
}

/// Function that renders a rank's rows of the frame with the given number into a target.
pub trait Render<State>:
    FnMut(&mut State, u32, &mut RowTarget<'_>) -> Result<FrameCost, Error> + Send + 'static
{
}

impl<State, F: FnMut(&mut State, u32, &mut RowTarget<'_>) -> Result<FrameCost, Error> + Send + 'static>
    Render<State> for F
{
}

/// Callback for each complete frame: its number and pixels.
pub type Show<'a> = dyn FnMut(u32, &[u32]) -> Result<(), Error> + 'a;

/// Render threads of a rank; if there are two, they take turns by frame.
struct RenderThreads<State, Task, Product> {
    first: RenderThread<State, Task, Product>,
    second: Option<RenderThread<State, Task, Product>>,
}

impl<State, Task, Product> RenderThreads<State, Task, Product> {
    fn of(&mut self, frame: usize) -> &mut RenderThread<State, Task, Product> {
        match &mut self.second {
            Some(twin) if frame % 2 == 1 => twin,
            _ => &mut self.first,
        }
    }
}

/// State of the root.
struct Root<'a, 'b> {
    show: &'a mut Show<'b>,
    frames: Arc<FrameMemory>,
    /// Number of ranks whose rows are missing, for each frame that is not complete.
    missing: VecDeque<usize>,
    /// Next frame of each rank.
    next: Vec<u32>,
    whole: Vec<f64>,
    bytes: u64,
    costs: Vec<Option<Vec<FrameCost>>>,
}

impl Root<'_, '_> {
    /// Takes a rank's rows of its next frame; empty `pixels` mean that the rows are already in
    /// place. Shows the frames that this completes, and returns their number.
    fn take(&mut self, series: &FrameSeries, rank: u32, pixels: &[u8], start: Instant) -> Result<u32, Error> {
        let wrong = || ClusterError::Protocol { rank, message: "rows of an unexpected frame".to_owned() };
        let rows = series.rows.get(rank as usize).ok_or_else(wrong)?;
        let next = self.next.get_mut(rank as usize).ok_or_else(wrong)?;
        let first = self.whole.len() as u32;
        let index = next.checked_sub(first).ok_or_else(wrong)? as usize;
        *next += 1;
        if index >= MAX_FRAMES_AHEAD as usize {
            return Err(wrong().into());
        }
        while self.missing.len() <= index {
            self.missing.push_back(series.rows.iter().filter(|rows| !rows.is_empty()).count());
        }
        let missing = self.missing.get_mut(index).filter(|missing| **missing > 0).ok_or_else(wrong)?;
        let row = series.width as usize * 4;
        if !pixels.is_empty() {
            if pixels.len() != rows.len() as usize * row {
                return Err(wrong().into());
            }
            let words: Vec<u32> = bytemuck::pod_collect_to_vec(pixels);
            // SAFETY: these rows belong to the rank that sent them, and the frame is not complete:
            // no one else uses them.
            let target = unsafe { self.frames.target(first + index as u32, rows) };
            target.ok_or_else(wrong)?.copy_from(bytemuck::cast_slice(&words));
        }
        *missing -= 1;
        let mut whole = 0;
        while self.missing.pop_front_if(|missing| *missing == 0).is_some() {
            self.whole.push(start.elapsed().as_secs_f64());
            fence(Ordering::SeqCst);
            // SAFETY: all ranks have reported that their rows are in place. They write the next
            // frame to this memory only after the root has reported this frame as complete.
            (self.show)(first + whole, unsafe { self.frames.read(first + whole) })?;
            whole += 1;
        }
        Ok(whole)
    }
}

/// Checks that each row of a rank is in the image and belongs to no other rank: two would write to
/// the same memory.
fn check_rows(series: &FrameSeries) -> Result<(), Error> {
    let mut taken = vec![false; series.height as usize];
    for (rank, rows) in (0..).zip(&series.rows) {
        for row in rows.iter() {
            match taken.get_mut(row as usize) {
                Some(taken) if !*taken => *taken = true,
                _ => {
                    let message = format!(
                        "row {row} of {}, which is outside the image or another rank's",
                        series.height
                    );
                    return Err(ClusterError::Protocol { rank, message }.into());
                }
            }
        }
    }
    Ok(())
}

/// Renders frames over all ranks; each rank calls this. `render` runs on its own thread; with a
/// state for a [second stream](Renderer::second_stream), two threads take turns, so that the device
/// has a frame to render while another one ends. `show` gets each complete frame on the root, in
/// order. `ended` returns whether the process was asked to end. Returns the report on the root,
/// `None` on the others.
///
/// # Errors
///
/// An error of this rank or another, a rank that was silent for too long, or a request to end. The
/// caller must then end the job.
pub fn series<N: Network, State: AsMut<Renderer> + Send + 'static>(
    link: &mut Heartbeat<N>,
    (mut state, twin): (State, Option<State>),
    series: &FrameSeries,
    render: impl Render<State> + Clone,
    show: &mut Show<'_>,
    ended: &dyn Fn() -> bool,
) -> Result<(State, Option<SeriesReport>), Error> {
    let rank = link.rank();
    let FrameSeries { width, height, .. } = *series;
    check_rows(series)?;
    let several = series.rows.len() > 1;
    let shared = if several { link.network().share(width, height, MAX_FRAMES_AHEAD)? } else { None };
    // Frames of the root, if this rank can access them.
    let frames = match shared {
        None if rank > 0 => None,
        shared => Some(Arc::new(shared.unwrap_or_else(|| FrameMemory::new(width, height, MAX_FRAMES_AHEAD)))),
    };
    // Both states have the same device, so pinning once is enough.
    frames.iter().for_each(|frames| state.as_mut().pin(frames.memory()));
    let own = series.rows.get(rank as usize).cloned().unwrap_or_else(|| RowSet::from(0..0));
    let together = if twin.is_some() { 2 } else { 1 };
    let workshop = |state| {
        let (reached, own, mut render) = (frames.clone(), own.clone(), render.clone());
        RenderThread::new(
            state,
            move |state, (index, mut pixels): (u32, Vec<u32>), out: &mut (dyn FnMut(_) + Send)| {
                // SAFETY: these rows are this rank's. The root has shown the earlier frame of this
                // memory, and reads the new rows only after a message that they are in place.
                let place = reached.as_ref().and_then(|frames| unsafe { frames.target(index, &own) });
                let cost = match place {
                    Some(mut place) => render(state, index, &mut place)?,
                    None => render(state, index, &mut RowTarget::packed(&mut pixels, width, &own))?,
                };
                fence(Ordering::SeqCst);
                out((pixels, FrameCost { render: cost.render / together as f64, ..cost }));
                Ok(())
            },
        )
    };
    let mut workshops = RenderThreads { first: workshop(state)?, second: twin.map(workshop).transpose()? };
    let ranks = series.rows.len();
    let busy: Vec<bool> = series.rows.iter().map(|rows| !rows.is_empty()).collect();
    let works = busy.get(rank as usize).copied().unwrap_or(false);
    let mut root = frames.clone().filter(|_| rank == 0).map(|frames| Root {
        show,
        frames,
        missing: VecDeque::new(),
        next: vec![0; ranks],
        whole: Vec::new(),
        bytes: 0,
        costs: vec![None; ranks],
    });
    let start = Instant::now();
    let wanted = if works { series.frames } else { 0 };
    let (mut ordered, mut whole) = (0, 0);
    let mut costs = Vec::new();
    let mut spare: Vec<Vec<u32>> = Vec::new();
    let mut reported = false;
    let nap = if series.spins { Duration::ZERO } else { POLL_INTERVAL };
    let report = 'frames: loop {
        while ordered < wanted && ordered < whole + MAX_FRAMES_AHEAD {
            let workshop = workshops.of(ordered as usize);
            if workshop.open() > 1 {
                break;
            }
            workshop.submit((ordered, spare.pop().or_else(|| link.network().reclaim()).unwrap_or_default()));
            ordered += 1;
        }
        let mut came = 0;
        // In the order of frames.
        if let Some(product) = workshops.of(costs.len()).next_product(nap) {
            let (pixels, cost) = match product {
                Ok(product) => product,
                Err(error) if rank == 0 => return Err(error),
                Err(error) => {
                    let told: RankOutcome = Err((error.exit_code(), error.to_string()));
                    link.send(0, Tag::Report, serde_json::to_vec(&told).unwrap_or_default())?;
                    link.flush()?;
                    link.expect(Tag::Done)?;
                    return Err(error);
                }
            };
            costs.push(cost);
            match &mut root {
                Some(root) => came += root.take(series, 0, &[], start)?,
                None if frames.is_some() => {
                    link.send(0, Tag::ImagePart, Vec::new())?;
                    spare.push(pixels);
                }
                None => link.send_words(0, Tag::ImagePart, pixels)?,
            }
        }
        while let Some(Message { from, tag, bytes }) = link.receive()? {
            match (tag, &mut root) {
                (Tag::ImagePart, Some(root)) => {
                    root.bytes += bytes.len() as u64;
                    came += root.take(series, from, &bytes, start)?;
                }
                (Tag::Report, Some(root)) => match serde_json::from_slice(&bytes) {
                    Ok(Ok(costs)) => {
                        if let Some(place) = root.costs.get_mut(from as usize) {
                            *place = Some(costs);
                        }
                    }
                    Ok(Err((code, message))) => {
                        let host = link.host_of(from);
                        return Err(ClusterError::Rank { rank: from, host, message, code }.into());
                    }
                    Err(error) => {
                        return Err(ClusterError::Protocol { rank: from, message: error.to_string() }.into());
                    }
                },
                // Number of frames that are complete on the root.
                (Tag::WorkRequest, None) => {
                    whole = <[u8; 4]>::try_from(bytes.as_slice()).map_or(whole, u32::from_ne_bytes);
                }
                (Tag::Done, None) if reported => break 'frames None,
                (other, _) => {
                    let message = format!("{other:?} during a series of frames");
                    return Err(ClusterError::Protocol { rank: from, message }.into());
                }
            }
        }
        if ended() {
            let total = u64::from(series.width) * u64::from(series.height);
            return Err(ClusterError::Ended { done: 0, total }.into());
        }
        if let Some(root) = &mut root {
            if came > 0 {
                whole += came;
                for to in (1..ranks as u32).filter(|&to| busy[to as usize]) {
                    link.send(to, Tag::WorkRequest, whole.to_ne_bytes().to_vec())?;
                }
            }
            if whole == series.frames {
                root.costs[0] =
                    Some(std::mem::take(&mut costs)).filter(|_| !reported).or(root.costs[0].take());
                reported = true;
                if root.costs.iter().all(Option::is_some) {
                    (1..ranks as u32).try_for_each(|to| link.send(to, Tag::Done, Vec::new()))?;
                    link.flush()?;
                    let costs = root.costs.iter_mut().filter_map(Option::take).collect();
                    let bytes = root.bytes / u64::from(series.frames.max(1));
                    break Some(SeriesReport { costs, whole: std::mem::take(&mut root.whole), bytes });
                }
            }
        } else if !reported && costs.len() as u32 == wanted && link.network().unsent() == 0 {
            reported = true;
            let told: RankOutcome = Ok(std::mem::take(&mut costs));
            link.send(0, Tag::Report, serde_json::to_vec(&told).unwrap_or_default())?;
        }
        if series.spins {
            std::thread::yield_now();
        }
    };
    // Nothing may use the shared memory when it is freed.
    drop(workshops.second.map(RenderThread::end));
    let mut state = workshops.first.end();
    frames.iter().for_each(|frames| state.as_mut().unpin(frames.memory()));
    drop((root, frames));
    link.network().unshare()?;
    Ok((state, report))
}

type RankOutcome = Result<Vec<FrameCost>, (u8, String)>;
