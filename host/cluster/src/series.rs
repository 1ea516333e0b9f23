//! Series of frames over all ranks, for `view --headless` and `bench cluster`: a frame is sent
//! while the next one is rendered.
//!
//! Ranks on the root's host share the memory of its frames. Their devices copy rows directly to
//! their place in a frame, and an empty message announces them to the root. Rows of other hosts are
//! sent as messages.
#![allow(unsafe_code, reason = "several ranks fill one frame; each block says why it is sound")]

use super::ClusterError;
use super::frame_series::check_rows;
pub use super::frame_series::{FrameCost, FrameSeries, SeriesReport};
use super::heartbeat::{Heartbeat, POLL_INTERVAL};
use super::network::{Message, Network, Tag};
use super::render_thread::RenderThread;
use crate::Error;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{Ordering, fence};
use std::time::{Duration, Instant};
use trisect::film::{FrameMemory, RowSet, RowTarget};
use trisect::render::Renderer;
use trisect::spin::SpinGuard;

/// Maximum number of frames that a rank may be ahead of the root's complete frames: being sent,
/// being rendered or waiting.
const MAX_FRAMES_AHEAD: u32 = 4;

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

/// Task of a render thread: the frame's number, and memory for rows that are sent as messages.
type FrameTask = (u32, Vec<u32>);

/// Result of a task: the memory, and the frame's cost.
type RenderedFrame = (Vec<u32>, FrameCost);

/// A rank's part of a series.
struct RankSeries<'a, 'b, N: Network, State> {
    link: &'a mut Heartbeat<N>,
    series: &'a FrameSeries,
    threads: RenderThreads<State, FrameTask, RenderedFrame>,
    /// Frames of the root, if this rank can access them.
    frames: Option<Arc<FrameMemory>>,
    /// State of the root, on the root.
    root: Option<Root<'a, 'b>>,
    start: Instant,
    /// Number of frames that this rank renders.
    wanted: u32,
    /// Number of frames that its threads got.
    ordered: u32,
    /// Number of frames that are complete on the root.
    whole: u32,
    /// Costs of the frames that it rendered, until they are reported.
    costs: Vec<FrameCost>,
    rendered: usize,
    spare: Vec<Vec<u32>>,
    reported: bool,
    guard: SpinGuard,
}

impl<N: Network, State: Send + 'static> RankSeries<'_, '_, N, State> {
    /// Hands frames to the render threads, as far ahead as they may be.
    fn order(&mut self) {
        while self.ordered < self.wanted && self.ordered < self.whole + MAX_FRAMES_AHEAD {
            let thread = self.threads.of(self.ordered as usize);
            if thread.open() > 1 {
                break;
            }
            let memory = self.spare.pop().or_else(|| self.link.network().reclaim());
            thread.submit((self.ordered, memory.unwrap_or_default()));
            self.ordered += 1;
        }
    }

    /// Waits for this rank's next frame, for at most a nap, and takes or sends its rows. Returns
    /// the number of frames that this completes on the root.
    fn take_own(&mut self) -> Result<u32, Error> {
        let nap = if self.spins() { Duration::ZERO } else { POLL_INTERVAL };
        let rank = self.link.rank();
        // In the order of frames.
        let Some(product) = self.threads.of(self.rendered).next_product(nap) else { return Ok(0) };
        let (pixels, cost) = match product {
            Ok(product) => product,
            Err(error) if rank == 0 => return Err(error),
            Err(error) => {
                let told: RankOutcome = Err((error.exit_code(), error.to_string()));
                self.link.send(0, Tag::Report, serde_json::to_vec(&told).unwrap_or_default())?;
                self.link.flush()?;
                self.link.expect(Tag::Done)?;
                return Err(error);
            }
        };
        self.costs.push(cost);
        self.rendered += 1;
        match &mut self.root {
            Some(root) => return root.take(self.series, 0, &[], self.start),
            None if self.frames.is_some() => {
                self.link.send(0, Tag::ImagePart, Vec::new())?;
                self.spare.push(pixels);
            }
            None => self.link.send_words(0, Tag::ImagePart, pixels)?,
        }
        Ok(0)
    }

    /// Takes all messages that have come. Returns the number of frames that this completes on the
    /// root, or `None` if the root ends the series.
    fn receive(&mut self) -> Result<Option<u32>, Error> {
        let mut completed = 0;
        while let Some(Message { from, tag, bytes }) = self.link.receive()? {
            match (tag, &mut self.root) {
                (Tag::ImagePart, Some(root)) => {
                    root.bytes += bytes.len() as u64;
                    completed += root.take(self.series, from, &bytes, self.start)?;
                }
                (Tag::Report, Some(root)) => match serde_json::from_slice(&bytes) {
                    Ok(Ok(costs)) => {
                        if let Some(place) = root.costs.get_mut(from as usize) {
                            *place = Some(costs);
                        }
                    }
                    Ok(Err((code, message))) => {
                        let host = self.link.host_of(from);
                        return Err(ClusterError::Rank { rank: from, host, message, code }.into());
                    }
                    Err(error) => {
                        return Err(ClusterError::Protocol { rank: from, message: error.to_string() }.into());
                    }
                },
                // Number of frames that are complete on the root.
                (Tag::WorkRequest, None) => {
                    let whole = <[u8; 4]>::try_from(bytes.as_slice());
                    self.whole = whole.map_or(self.whole, u32::from_ne_bytes);
                }
                (Tag::Done, None) if self.reported => return Ok(None),
                (other, _) => {
                    let message = format!("{other:?} during a series of frames");
                    return Err(ClusterError::Protocol { rank: from, message }.into());
                }
            }
        }
        Ok(Some(completed))
    }

    /// Tells the other ranks how many frames are complete, and reports this rank's costs after its
    /// last frame. Returns the report of the series when all ranks have reported theirs.
    fn advance(&mut self, completed: u32) -> Result<Option<SeriesReport>, Error> {
        let Some(root) = &mut self.root else {
            let all = self.rendered as u32 == self.wanted && self.link.network().unsent() == 0;
            if all && !self.reported {
                self.reported = true;
                let told: RankOutcome = Ok(std::mem::take(&mut self.costs));
                self.link.send(0, Tag::Report, serde_json::to_vec(&told).unwrap_or_default())?;
            }
            return Ok(None);
        };
        let ranks = self.series.rows.len() as u32;
        if completed > 0 {
            self.whole += completed;
            for (to, _) in (0..ranks).zip(&self.series.rows).filter(|(to, rows)| *to > 0 && !rows.is_empty())
            {
                self.link.send(to, Tag::WorkRequest, self.whole.to_ne_bytes().to_vec())?;
            }
        }
        if self.whole < self.series.frames {
            return Ok(None);
        }
        if !self.reported {
            self.reported = true;
            root.costs[0] = Some(std::mem::take(&mut self.costs));
        }
        if !root.costs.iter().all(Option::is_some) {
            return Ok(None);
        }
        (1..ranks).try_for_each(|to| self.link.send(to, Tag::Done, Vec::new()))?;
        self.link.flush()?;
        let costs = root.costs.iter_mut().filter_map(Option::take).collect();
        let bytes = root.bytes / u64::from(self.series.frames.max(1));
        Ok(Some(SeriesReport { costs, whole: std::mem::take(&mut root.whole), bytes }))
    }

    /// Returns whether this rank spins while it waits.
    fn spins(&self) -> bool {
        self.series.spins && self.guard.may_spin()
    }

    /// Runs the series to its end. Returns the report on the root.
    fn run(&mut self, ended: &dyn Fn() -> bool) -> Result<Option<SeriesReport>, Error> {
        loop {
            self.order();
            let own = self.take_own()?;
            let Some(received) = self.receive()? else { return Ok(None) };
            if ended() {
                let total = u64::from(self.series.width) * u64::from(self.series.height);
                return Err(ClusterError::Ended { done: 0, total }.into());
            }
            if let Some(report) = self.advance(own + received)? {
                return Ok(Some(report));
            }
            if self.spins() {
                let before = Instant::now();
                std::thread::yield_now();
                self.guard.saw_gap(before.elapsed());
            }
        }
    }
}

/// Starts a thread that renders rows `own` of frames: to their places in `frames`, or packed. As
/// many threads of the rank render `together`.
fn render_thread<State: Send + 'static>(
    state: State,
    width: u32,
    (frames, own): (Option<Arc<FrameMemory>>, RowSet),
    mut render: impl Render<State>,
    together: u32,
) -> Result<RenderThread<State, FrameTask, RenderedFrame>, Error> {
    let thread = RenderThread::new(
        state,
        move |state, (index, mut pixels): FrameTask, out: &mut (dyn FnMut(_) + Send)| {
            // SAFETY: these rows are this rank's. The root has shown the earlier frame of this
            // memory, and reads the new rows only after a message that they are in place.
            let place = frames.as_ref().and_then(|frames| unsafe { frames.target(index, &own) });
            let cost = match place {
                Some(mut place) => render(state, index, &mut place)?,
                None => render(state, index, &mut RowTarget::packed(&mut pixels, width, &own))?,
            };
            fence(Ordering::SeqCst);
            out((pixels, FrameCost { render: cost.render / f64::from(together), ..cost }));
            Ok(())
        },
    )?;
    Ok(thread)
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
    let shared = match series.rows.len() > 1 {
        true => link.network().share(width, height, MAX_FRAMES_AHEAD)?,
        false => None,
    };
    let frames = match shared {
        None if rank > 0 => None,
        shared => Some(Arc::new(shared.unwrap_or_else(|| FrameMemory::new(width, height, MAX_FRAMES_AHEAD)))),
    };
    // Both states have the same device, so pinning once is enough.
    frames.iter().for_each(|frames| state.as_mut().pin(frames.memory()));
    let own = series.rows.get(rank as usize).cloned().unwrap_or_else(|| RowSet::from(0..0));
    let wanted = if own.is_empty() { 0 } else { series.frames };
    let together = if twin.is_some() { 2 } else { 1 };
    let thread = |state| render_thread(state, width, (frames.clone(), own.clone()), render.clone(), together);
    let threads = RenderThreads { first: thread(state)?, second: twin.map(thread).transpose()? };
    let ranks = series.rows.len();
    let root = frames.clone().filter(|_| rank == 0).map(|frames| Root {
        show,
        frames,
        missing: VecDeque::new(),
        next: vec![0; ranks],
        whole: Vec::new(),
        bytes: 0,
        costs: vec![None; ranks],
    });
    let mut part = RankSeries {
        link,
        series,
        threads,
        frames,
        root,
        start: Instant::now(),
        wanted,
        ordered: 0,
        whole: 0,
        costs: Vec::new(),
        rendered: 0,
        spare: Vec::new(),
        reported: false,
        guard: SpinGuard::default(),
    };
    let report = part.run(ended)?;
    let RankSeries { link, threads, frames, root, .. } = part;
    // Nothing may use the shared memory when it is freed.
    drop(threads.second.map(RenderThread::end));
    let mut state = threads.first.end();
    frames.iter().for_each(|frames| state.as_mut().unpin(frames.memory()));
    drop((root, frames));
    link.network().unshare()?;
    Ok((state, report))
}

type RankOutcome = Result<Vec<FrameCost>, (u8, String)>;
