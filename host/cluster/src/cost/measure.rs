//! Measures the numbers of the cost model: the speed of the ranks, and the network between them.

use super::Machine;
use crate::heartbeat::Heartbeat;
use crate::network::{Network, Tag};
use crate::{ClusterError, Error};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};
use trisect::device::DeviceKind;
use trisect::film::RowSet;
use trisect::render::{Renderer, Settings};
use trisect::threads;

/// Returns the approximate number of pixels on which the rate is measured.
fn trial_samples(kind: DeviceKind) -> u64 {
    match kind {
        DeviceKind::Gpu => 1 << 24,
        DeviceKind::Cpu => 1 << 15,
        DeviceKind::SoftwareGpu => 1 << 13,
    }
}

/// Size in bytes of a message that measures the bandwidth.
const LARGE_MESSAGE_BYTES: usize = 4 << 20;

/// Number of empty messages that measure the latency.
const LATENCY_MESSAGES: u32 = 16;

/// Number of empty messages that are sent at once to measure the overhead.
const BURST_MESSAGES: u32 = 64;

/// Number of renders whose mean time counts: on a host under load the least says little.
const TRIALS: u32 = 5;

/// Returns this rank's samples per second on rows spread over the image, and the seconds of a whole
/// image that do not depend on the number of samples.
fn rate(renderer: &mut Renderer, settings: &Settings) -> Result<(f64, f64), Error> {
    let row = u64::from(settings.width);
    let rows =
        (trial_samples(renderer.device().info().kind) / row).clamp(1, u64::from(settings.height)) as u32;
    let rows = RowSet::interleaved(settings.height, 0, 0, settings.height.div_ceil(rows));
    let most = settings.samples.min(32);
    // The first render compiles kernels and allocates memory.
    renderer.render_chunk(settings, &rows, 0..1, &mut ())?;
    let mut time = |samples: u32| -> Result<f64, Error> {
        let start = Instant::now();
        for _ in 0..TRIALS {
            renderer.render_chunk(settings, &rows, 0..samples, &mut ())?;
        }
        Ok(start.elapsed().as_secs_f64() / f64::from(TRIALS))
    };
    let pixels = (u64::from(rows.len()) * row) as f64;
    let one = time(1)?;
    if most == 1 {
        return Ok((pixels / one.max(1e-9), 0.0));
    }
    let slope = (time(most)? - one).max(1e-9) / (pixels * f64::from(most - 1));
    // Cost of a pixel besides its samples, over the whole image.
    let fixed = (one - slope * pixels).max(0.0) * f64::from(settings.height) / f64::from(rows.len());
    Ok((1.0 / slope, fixed))
}

/// Number of round trips that measure a handoff.
const HANDOFFS: u32 = 32;

/// Returns the mean time in seconds until another thread has answered.
fn handoff() -> Result<f64, ClusterError> {
    let (ask, asked) = channel();
    let (answer, answered) = channel();
    let thread = threads::spawn("answering thread", move || {
        asked.into_iter().take_while(|()| answer.send(()).is_ok()).for_each(drop);
    })?;
    let start = Instant::now();
    let is_answered = || ask.send(()).is_ok() && answered.recv().is_ok();
    let count = (0..HANDOFFS).take_while(|_| is_answered()).count();
    let time = start.elapsed().as_secs_f64() / count.max(1) as f64;
    drop(ask);
    let _ = thread.join();
    Ok(time)
}

/// Returns the machine with the rate of the root, which renders alone, and the slowdown of all
/// ranks against it.
///
/// # Errors
///
/// Errors of [`Heartbeat::receive`] and [`Renderer::render_chunk`].
pub fn with_slowdown<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    settings: &Settings,
    together: Machine,
) -> Result<(Renderer, Machine), Error> {
    let (own, mut renderer) = (settings.clone(), renderer);
    let (renderer, alone) = link.run_while_polling(move || {
        let alone = rate(&mut renderer, &own);
        (renderer, alone)
    })?;
    let (rate, fixed) = alone?;
    Ok((renderer, Machine { rate, fixed, slowdown: (rate / together.rate).max(1.0), ..together }))
}

/// Sends a request to a rank, and returns the time until its answer, and the answer.
fn ask<N: Network>(
    link: &mut Heartbeat<N>,
    rank: u32,
    what: u8,
) -> Result<(Duration, Vec<u8>), ClusterError> {
    let start = Instant::now();
    link.send(rank, Tag::Ping, vec![what])?;
    let answer = link.expect(Tag::Ping)?;
    Ok((start.elapsed(), answer.bytes))
}

/// Measures the ranks and the network between them; all ranks call this. Returns the result on the
/// root, `None` on the others.
///
/// # Errors
///
/// Errors of [`Heartbeat::receive`] and [`Renderer::render_chunk`]; [`ClusterError::Protocol`] for
/// an invalid answer.
pub fn measure<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    settings: &Settings,
) -> Result<(Renderer, Option<Machine>), Error> {
    let own = settings.clone();
    let mut renderer = renderer;
    let (renderer, rate, handoff) = link.run_while_polling(move || {
        let handoff = handoff();
        let rate = rate(&mut renderer, &own);
        (renderer, rate, handoff)
    })?;
    let ((rate, fixed), handoff) = (rate?, handoff?);
    if !link.is_root() {
        loop {
            // Requests of the root: an echo (0), a large message (1), the rate (2, always last) or
            // many messages (3).
            match link.expect(Tag::Ping)?.bytes.first() {
                Some(3) => (0..BURST_MESSAGES).try_for_each(|_| link.send(0, Tag::Ping, Vec::new()))?,
                Some(1) => link.send(0, Tag::Ping, vec![0; LARGE_MESSAGE_BYTES])?,
                Some(2) => {
                    link.send(0, Tag::Ping, bytemuck::cast_slice(&[rate, fixed, handoff]).to_vec())?;
                    return Ok((renderer, None));
                }
                _ => link.send(0, Tag::Ping, Vec::new())?,
            }
        }
    }
    let mut machine = Machine { rate, fixed, handoff, ..Machine::UNKNOWN };
    for rank in 1..link.ranks() {
        ask(link, rank, 0)?;
        let mut least = Duration::MAX;
        for _ in 0..LATENCY_MESSAGES {
            least = least.min(ask(link, rank, 0)?.0);
        }
        ask(link, rank, 3)?;
        let burst = Instant::now();
        (1..BURST_MESSAGES).try_for_each(|_| link.expect(Tag::Ping).map(drop))?;
        let overhead = burst.elapsed().as_secs_f64() / f64::from(BURST_MESSAGES - 1);
        ask(link, rank, 1)?;
        let large = ask(link, rank, 1)?.0.min(ask(link, rank, 1)?.0);
        let (_, bytes) = ask(link, rank, 2)?;
        let theirs: Vec<f64> = bytemuck::pod_collect_to_vec(&bytes[..bytes.len() / 8 * 8]);
        let [theirs, fixed, handoff] = theirs[..] else {
            let message = "an invalid rate".to_owned();
            return Err(ClusterError::Protocol { rank, message }.into());
        };
        machine.rate = machine.rate.min(theirs);
        machine.fixed = machine.fixed.max(fixed);
        machine.handoff = machine.handoff.max(handoff);
        machine.latency = machine.latency.max(least.as_secs_f64() / 2.0);
        machine.overhead = machine.overhead.max(overhead);
        let rest = large.saturating_sub(least).as_secs_f64().max(1e-9);
        machine.bandwidth = machine.bandwidth.min(LARGE_MESSAGE_BYTES as f64 / rest);
    }
    Ok((renderer, Some(machine)))
}
