//! Frames after a warm-up.

use crate::Error;
use crate::render::{RenderObserver, Renderer, Settings};
use crate::stats::RenderStats;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// What frames took.
#[derive(Clone, Debug)]
pub struct FrameStats {
    /// The very first, with what happens once: mostly one of the warm-up.
    pub first: RenderStats,
    /// How many did not count.
    pub warm_up: u32,
    /// Those that count.
    pub counted: Vec<RenderStats>,
}

/// What is rendered before anything counts: clocks settle, caches fill, and the scheduler learns its pace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WarmUp {
    /// So many frames at least; with 0 even the first counts.
    pub frames: u32,
    /// And frames until so long after the first: a GPU that idled while its driver compiled for seconds is slow for a while.
    pub time: Duration,
}

impl WarmUp {
    /// So many frames, however long they take.
    pub fn of(frames: u32) -> Self {
        Self { frames, time: Duration::ZERO }
    }
}

/// Renders frames to warm up, and then `frames` that count: what each of those took. At least one is rendered. `observer` watches all of
/// them.
///
/// # Errors
///
/// As [`Renderer::render`].
pub fn measure(
    renderer: &mut Renderer,
    settings: &Settings,
    warm_up: WarmUp,
    frames: u32,
    observer: &mut dyn RenderObserver,
) -> Result<FrameStats, Error> {
    let mut render = || renderer.render(settings, observer).map(|frame| frame.stats);
    let first = render()?;
    if warm_up.frames == 0 {
        let mut counted = vec![first.clone()];
        for _ in 1..frames {
            counted.push(render()?);
        }
        return Ok(FrameStats { first, warm_up: 0, counted });
    }
    let start = Instant::now();
    let mut done = 1;
    while done < warm_up.frames || start.elapsed() < warm_up.time {
        render()?;
        done += 1;
    }
    let counted = (0..frames).map(|_| render()).collect::<Result<_, _>>()?;
    Ok(FrameStats { first, warm_up: done, counted })
}

/// Notes when the first submission that it sees has ended.
#[derive(Debug, Default)]
pub struct FirstSubmission {
    /// Then; `None` before.
    pub ended: Option<Instant>,
}

impl RenderObserver for FirstSubmission {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        self.ended.get_or_insert_with(Instant::now);
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use crate::backend::cpu::Cpu;
    use crate::scene::Scene;

    #[test]
    fn the_warm_up_does_not_count() {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Box::new(Cpu::open(Some(1)).unwrap()), &scene).unwrap();
        let settings = Settings { width: 8, height: 4, samples: 2, ..scene.settings() };
        let mut first = FirstSubmission::default();
        let frames = measure(&mut renderer, &settings, WarmUp::of(2), 3, &mut first).unwrap();
        assert_eq!((frames.warm_up, frames.counted.len()), (2, 3));
        assert!(frames.counted.iter().all(|stats| stats.samples == 8 * 4 * 2));
        // Without a warm-up the first counts, too.
        let none = WarmUp { frames: 0, time: Duration::from_secs(9) };
        let cold = measure(&mut renderer, &settings, none, 2, &mut ()).unwrap();
        assert_eq!((cold.warm_up, cold.counted.len(), &cold.counted[0]), (0, 2, &cold.first));
        // 64 samples take less than 20 ms.
        let long = WarmUp { frames: 1, time: Duration::from_millis(20) };
        assert!(measure(&mut renderer, &settings, long, 1, &mut ()).unwrap().warm_up > 1);
        let ended = first.ended.unwrap();
        let again = first.progress(1, 1);
        assert_eq!((first.ended, again), (Some(ended), ControlFlow::Continue(())));
    }
}
