//! Frames one after the other over all ranks: a frame travels while the next one is rendered.

use super::link::{Link, NAP};
use super::network::{Message, Network, Tag};
use super::workshop::Workshop;
use super::{DistributeError, Shared};
use crate::Error;
use crate::film::Rows;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Frames that a rank may be ahead of what the root has: one that travels, one that is rendered, one that waits.
const AHEAD: u32 = 3;

/// What one frame took a rank, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameCost {
    /// As the host saw it, until its pixels were there.
    pub render: f64,
    /// Of that, by the device's timer.
    pub device: f64,
}

/// Frames of an image of so many pixels across.
#[derive(Clone, Debug)]
pub struct Series {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Which rows each rank has.
    pub rows: Vec<Rows>,
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

/// Makes a frame's rows: which frame, and where its pixels go, one row below the other.
pub trait Render<State>:
    FnMut(&mut State, u32, &mut Vec<u32>) -> Result<FrameCost, Error> + Send + 'static
{
}

impl<State, F: FnMut(&mut State, u32, &mut Vec<u32>) -> Result<FrameCost, Error> + Send + 'static>
    Render<State> for F
{
}

/// Gets each whole frame: its number and pixels.
pub type Show<'a> = dyn FnMut(u32, &[u32]) -> Result<(), Error> + 'a;

/// A frame that is not whole.
struct Frame {
    pixels: Vec<u32>,
    missing: usize,
}

/// Where whole frames are put together: memory that ranks share, or the root's own.
#[derive(Clone, Copy)]
struct Frames {
    shared: Option<Shared>,
    image: usize,
}

impl Frames {
    /// The first word of a frame in the shared memory.
    fn first(&self, index: u32) -> usize {
        (index % AHEAD) as usize * self.image
    }
}

/// The root's side.
struct Root<'a, 'b> {
    show: &'a mut Show<'b>,
    frames: Frames,
    pending: VecDeque<Frame>,
    /// Of each rank, the frame whose rows come next.
    next: Vec<u32>,
    spare: Vec<Vec<u32>>,
    whole: Vec<f64>,
    bytes: u64,
    costs: Vec<Option<Vec<FrameCost>>>,
}

impl Root<'_, '_> {
    /// Takes a rank's rows of its next frame. Returns frames that are whole now.
    fn take(&mut self, series: &Series, rank: u32, pixels: &[u8], start: Instant) -> Result<u32, Error> {
        let wrong = || DistributeError::Protocol { rank, message: "rows of another frame".to_owned() };
        let rows = series.rows.get(rank as usize).ok_or_else(wrong)?;
        let next = self.next.get_mut(rank as usize).ok_or_else(wrong)?;
        let first = self.whole.len() as u32;
        let index = next.checked_sub(first).ok_or_else(wrong)? as usize;
        *next += 1;
        let count = series.width as usize * series.height as usize;
        while self.pending.len() <= index {
            let mut pixels = self.spare.pop().unwrap_or_default();
            pixels.resize(if self.frames.shared.is_some() { 0 } else { count }, 0);
            let missing = series.rows.iter().filter(|rows| !rows.is_empty()).count();
            self.pending.push_back(Frame { pixels, missing });
        }
        let frame = self.pending.get_mut(index).ok_or_else(wrong)?;
        let row = series.width as usize * 4;
        // Who shares the root's memory has written there.
        let written = pixels.is_empty() && self.frames.shared.is_some();
        if !written && pixels.len() != rows.len() as usize * row || frame.missing == 0 {
            return Err(wrong().into());
        }
        match self.frames.shared {
            Some(shared) if !written => {
                let place = self.frames.first(first + index as u32);
                let words: Vec<u32> = bytemuck::pod_collect_to_vec(pixels);
                shared.write(place, series.width as usize, rows, &words);
            }
            Some(_) => {}
            None => {
                let to: &mut [u8] = bytemuck::cast_slice_mut(&mut frame.pixels);
                let mut at = 0;
                for block in rows.blocks() {
                    let length = block.len() * row;
                    let place = block.start as usize * row..block.end as usize * row;
                    to[place].copy_from_slice(&pixels[at..at + length]);
                    at += length;
                }
            }
        }
        frame.missing -= 1;
        let mut whole = 0;
        while let Some(frame) = self.pending.pop_front_if(|frame| frame.missing == 0) {
            self.whole.push(start.elapsed().as_secs_f64());
            match self.frames.shared {
                Some(shared) => {
                    (self.show)(first + whole, shared.read(self.frames.first(first + whole), count))?
                }
                None => (self.show)(first + whole, &frame.pixels)?,
            }
            self.spare.push(frame.pixels);
            whole += 1;
        }
        Ok(whole)
    }
}

/// Renders frames over all ranks, each of which calls this. `render` runs on a thread of its own; `show` gets each whole frame on the root, in
/// order. What came of it is returned on the root.
///
/// # Errors
///
/// An error of this rank or of another, or of a rank that was silent for too long: the job must be ended then.
pub fn series<N: Network, State: Send + 'static>(
    link: &mut Link<N>,
    state: State,
    series: &Series,
    mut render: impl Render<State>,
    show: &mut Show<'_>,
    ended: &dyn Fn() -> bool,
) -> Result<(State, Option<SeriesReport>), Error> {
    let rank = link.rank();
    let image = series.width as usize * series.height as usize;
    let several = series.rows.len() > 1;
    let shared = if several { link.network().share(image * AHEAD as usize)? } else { None };
    let frames = Frames { shared, image };
    let (width, own) = (series.width as usize, series.rows.get(rank as usize).cloned());
    let mut workshop = Workshop::new(state, move |state, (index, mut pixels): (u32, Vec<u32>), out| {
        let cost = render(state, index, &mut pixels)?;
        if let (Some(shared), Some(own)) = (frames.shared, &own) {
            shared.write(frames.first(index), width, own, &pixels);
        }
        out((pixels, cost));
        Ok(())
    });
    let ranks = series.rows.len();
    let busy: Vec<bool> = series.rows.iter().map(|rows| !rows.is_empty()).collect();
    let works = busy.get(rank as usize).copied().unwrap_or(false);
    let mut root = (rank == 0).then(|| Root {
        show,
        frames,
        pending: VecDeque::new(),
        next: vec![0; ranks],
        spare: Vec::new(),
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
    let nap = if series.spins { Duration::ZERO } else { NAP };
    loop {
        while ordered < wanted && ordered < whole + AHEAD && workshop.open() < 2 {
            workshop.order((ordered, spare.pop().or_else(|| link.network().reclaim()).unwrap_or_default()));
            ordered += 1;
        }
        let mut came = 0;
        if let Some(product) = workshop.product(nap) {
            let (pixels, cost) = match product {
                Ok(product) => product,
                Err(error) if rank == 0 => return Err(error),
                Err(error) => {
                    let told: Told = Err((error.exit_code(), error.to_string()));
                    link.send(0, Tag::Report, serde_json::to_vec(&told).unwrap_or_default())?;
                    link.flush()?;
                    link.expect(Tag::Done)?;
                    return Err(error);
                }
            };
            costs.push(cost);
            match &mut root {
                Some(root) => {
                    let own: &[u8] = if shared.is_some() { &[] } else { bytemuck::cast_slice(&pixels) };
                    came += root.take(series, 0, own, start)?;
                    spare.push(pixels);
                }
                None if shared.is_some() => {
                    link.send(0, Tag::Part, Vec::new())?;
                    spare.push(pixels);
                }
                None => link.send_words(0, Tag::Part, pixels)?,
            }
        }
        while let Some(Message { from, tag, bytes }) = link.turn()? {
            match (tag, &mut root) {
                (Tag::Part, Some(root)) => {
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
                        return Err(DistributeError::Rank { rank: from, host, message, code }.into());
                    }
                    Err(error) => {
                        return Err(
                            DistributeError::Protocol { rank: from, message: error.to_string() }.into()
                        );
                    }
                },
                // The root has so many frames.
                (Tag::Want, None) => {
                    whole = <[u8; 4]>::try_from(bytes.as_slice()).map_or(whole, u32::from_ne_bytes);
                }
                (Tag::Done, None) if reported => {
                    link.network().unshare()?;
                    return Ok((workshop.end(), None));
                }
                (other, _) => {
                    let message = format!("{other:?} in a series of frames");
                    return Err(DistributeError::Protocol { rank: from, message }.into());
                }
            }
        }
        if ended() {
            let total = u64::from(series.width) * u64::from(series.height);
            return Err(DistributeError::Ended { done: 0, total }.into());
        }
        if let Some(root) = &mut root {
            if came > 0 {
                whole += came;
                for to in (1..ranks as u32).filter(|&to| busy[to as usize]) {
                    link.send(to, Tag::Want, whole.to_ne_bytes().to_vec())?;
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
                    link.network().unshare()?;
                    let report = SeriesReport { costs, whole: std::mem::take(&mut root.whole), bytes };
                    return Ok((workshop.end(), Some(report)));
                }
            }
        } else if !reported && costs.len() as u32 == wanted && link.network().unsent() == 0 {
            reported = true;
            let told: Told = Ok(std::mem::take(&mut costs));
            link.send(0, Tag::Report, serde_json::to_vec(&told).unwrap_or_default())?;
        }
        if series.spins {
            std::thread::yield_now();
        }
    }
}

type Told = Result<Vec<FrameCost>, (u8, String)>;
