//! Frames one after the other over all ranks: a frame travels while the next one is rendered.
//!
//! Ranks on the root's host have its frames in their memory, and their devices copy rows to where they belong; nothing but the word that they are there
//! travels. Rows of other hosts come as messages.
#![allow(unsafe_code, reason = "several fill one frame; each block names why it is sound")]

use super::ClusterError;
use super::heartbeat::{Heartbeat, POLL_INTERVAL};
use super::network::{Message, Network, Tag};
use super::render_thread::RenderThread;
use crate::Error;
use crate::film::{FrameMemory, RowSet, RowTarget};
use crate::render::Renderer;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{Ordering, fence};
use std::time::{Duration, Instant};

/// Frames that a rank may be ahead of what the root has: one that travels, one that is rendered, one that waits.
const MAX_FRAMES_AHEAD: u32 = 4;

/// What one frame took a rank, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameCost {
    /// As the host saw it, until its pixels were there; of frames that are rendered at the same time, each one's part.
    pub render: f64,
    /// Of that, by the device's timer.
    pub device: f64,
}

/// Frames of an image of so many pixels across.
#[derive(Clone, Debug)]
pub struct FrameSeries {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Which rows each rank has.
    pub rows: Vec<RowSet>,
    /// How many.
    pub frames: u32,
    /// Whether a rank that waits spins: where others render, that costs nothing and saves the time of waking up.
    pub spins: bool,
}

/// What a series took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeriesReport {
    /// Of each rank, each frame.
    pub costs: Vec<Vec<FrameCost>>,
    /// When each frame was whole on the root, in seconds since the start.
    pub whole: Vec<f64>,
    /// That came to the root with each frame.
    pub bytes: u64,
}

impl SeriesReport {
    /// From one frame to the next, from the frame of this number on: the mean, so that what travels at the same time counts once.
    pub fn period(&self, from: usize) -> f64 {
        match self.whole.get(from..) {
            Some([first, .., last]) => (last - first) / (self.whole.len() - from - 1) as f64,
            _ => self.whole.last().copied().unwrap_or(0.0),
        }
    }

    /// Mean of the slowest rank's rendering, from the frame of this number on.
    pub fn render(&self, from: usize) -> f64 {
        self.slowest(from, |cost| cost.render)
    }

    /// The same by the device's timer.
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

/// Makes a frame's rows: which frame, and where its pixels go.
pub trait Render<State>:
    FnMut(&mut State, u32, &mut RowTarget<'_>) -> Result<FrameCost, Error> + Send + 'static
{
}

impl<State, F: FnMut(&mut State, u32, &mut RowTarget<'_>) -> Result<FrameCost, Error> + Send + 'static>
    Render<State> for F
{
}

/// Gets each whole frame: its number and pixels.
pub type Show<'a> = dyn FnMut(u32, &[u32]) -> Result<(), Error> + 'a;

/// Who renders frames, by turns.
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

/// The root's side.
struct Root<'a, 'b> {
    show: &'a mut Show<'b>,
    frames: Arc<FrameMemory>,
    /// Of each frame that is not whole, how many ranks it misses.
    missing: VecDeque<usize>,
    /// Of each rank, the frame whose rows come next.
    next: Vec<u32>,
    whole: Vec<f64>,
    bytes: u64,
    costs: Vec<Option<Vec<FrameCost>>>,
}

impl Root<'_, '_> {
    /// Takes a rank's rows of its next frame, or the word that they are where they belong. Returns frames that are whole now.
    fn take(&mut self, series: &FrameSeries, rank: u32, pixels: &[u8], start: Instant) -> Result<u32, Error> {
        let wrong = || ClusterError::Protocol { rank, message: "rows of another frame".to_owned() };
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
            // SAFETY: these rows are of the rank that sent them, and the frame is not whole: no one else has them.
            let target = unsafe { self.frames.target(first + index as u32, rows) };
            target.ok_or_else(wrong)?.copy_from(&words);
        }
        *missing -= 1;
        let mut whole = 0;
        while self.missing.pop_front_if(|missing| *missing == 0).is_some() {
            self.whole.push(start.elapsed().as_secs_f64());
            fence(Ordering::SeqCst);
            // SAFETY: all have said that their rows are there, and write the next frame of this place when the root has said that it has this one.
            (self.show)(first + whole, unsafe { self.frames.read(first + whole) })?;
            whole += 1;
        }
        Ok(whole)
    }
}

/// Each row is one rank's: two would write to the same memory.
fn check_rows(series: &FrameSeries) -> Result<(), Error> {
    let mut taken = vec![false; series.height as usize];
    for (rank, rows) in (0..).zip(&series.rows) {
        for row in rows.iter() {
            match taken.get_mut(row as usize) {
                Some(taken) if !*taken => *taken = true,
                _ => {
                    let message = format!("row {row} of {} is another's, or no one's", series.height);
                    return Err(ClusterError::Protocol { rank, message }.into());
                }
            }
        }
    }
    Ok(())
}

/// Renders frames over all ranks, each of which calls this. `render` runs on a thread of its own, or with a [twin](Renderer::second_stream) on two that take turns:
/// the device has a frame to render while another ends. `show` gets each whole frame on the root, in order. What came of it is returned on the root.
///
/// # Errors
///
/// An error of this rank or of another, or of a rank that was silent for too long: the job must be ended then.
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
    // The root's frames, where this rank reaches them.
    let frames = match shared {
        None if rank > 0 => None,
        shared => Some(Arc::new(shared.unwrap_or_else(|| FrameMemory::new(width, height, MAX_FRAMES_AHEAD)))),
    };
    // Twins have one device.
    frames.iter().for_each(|frames| state.as_mut().pin(frames.memory()));
    let own = series.rows.get(rank as usize).cloned().unwrap_or_else(|| RowSet::from(0..0));
    let together = if twin.is_some() { 2 } else { 1 };
    let workshop = |state| {
        let (reached, own, mut render) = (frames.clone(), own.clone(), render.clone());
        RenderThread::new(
            state,
            move |state, (index, mut pixels): (u32, Vec<u32>), out: &mut (dyn FnMut(_) + Send)| {
                // SAFETY: these rows are this rank's, and the root has shown what was in this place before: it is told when they are there.
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
                // The root has so many frames.
                (Tag::WorkRequest, None) => {
                    whole = <[u8; 4]>::try_from(bytes.as_slice()).map_or(whole, u32::from_ne_bytes);
                }
                (Tag::Done, None) if reported => break 'frames None,
                (other, _) => {
                    let message = format!("{other:?} in a series of frames");
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
    // Nothing may hold the memory when it is given back.
    drop(workshops.second.map(RenderThread::end));
    let mut state = workshops.first.end();
    frames.iter().for_each(|frames| state.as_mut().unpin(frames.memory()));
    drop((root, frames));
    link.network().unshare()?;
    Ok((state, report))
}

type RankOutcome = Result<Vec<FrameCost>, (u8, String)>;
